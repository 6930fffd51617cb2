"""What two operators, two skeletons and a solid say of the first skeleton."""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from ..analysis.agreement import SkeletonAgreement
from ..decisions import coordinates
from ..interop.packages import require
from ..numerics.neighbourhoods import spacing
from ..numerics.vectors import dot
from ..report import REFUSED
from .operators import OperatorAgreement
from .solid import Solid

# All measured on shapes with known axes; see docs/crosscheck.md.
COVERED = 2.0  # spacings from the mesh within which it covers a point
ALIGNED = 0.7  # cosine of the angle between the normals of mesh and cloud
UNCOVERED_SHARE, TILTED_SHARE = 0.01, 0.12  # of the points, beyond which the mesh is at fault
TURNED_ANGLE, EIGENVALUE_RATIO = 60.0, 1.5  # degrees in the median, and one way or the other: between clean operators
CERTAIN, LIKELY = 0.9, 0.75  # probabilities from which on a graph agrees, and agrees in part

# Fitted, by benchmarks/crosscheck.py, but the first, which is of the code and not of the graph.
WEIGHTS = {"operators": -5.0, "solid": -3.7, "limbs": -1.2, "doubt": -3.1, "constant": 4.3}

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"


@dataclass(frozen=True)
class MeshFacts:
    """How a mesh fits a cloud: shares of the points that it passes by, and where its normals are others."""

    uncovered: float
    tilted: float


def mesh_facts(solid: Solid, points: np.ndarray, normals: np.ndarray) -> MeshFacts:
    """How a mesh fits points (n, 3) with normals (n, 3) up to their sign."""
    igl, mesh = require("igl"), (solid.vertices, solid.faces)
    squared, face, _ = igl.point_mesh_squared_distance(points, *mesh)
    along = dot(igl.per_face_normals(*mesh, np.zeros(3))[face], normals)
    far = squared > (COVERED * spacing(points)) ** 2
    return MeshFacts(uncovered=float(far.mean()), tilted=float((np.abs(along) < ALIGNED).mean()))


def judge(
    rows: OperatorAgreement, skeletons: SkeletonAgreement, solid: Solid, mesh: MeshFacts, stop_reason: str
) -> tuple[str, float, tuple[str, ...]]:
    """The verdict on a cloud, the probability that its graph is right, and what speaks against it.

    `stop_reason` is that of the mesh's contraction. Where the mesh is at fault, what it says is not counted.
    """
    differences = {"operators": of_operators(rows), "solid": of_counts(skeletons, solid), "limbs": of_limbs(skeletons)}
    faults = of_mesh(solid, skeletons.components[0], mesh, stop_reason)
    told = [name for name, found in differences.items() if found]
    by_itself = WEIGHTS["constant"] + WEIGHTS["doubt"] * skeletons.doubt
    probability = float(expit(by_itself + (0 if faults else sum(WEIGHTS[name] for name in told))))
    reasons = [*faults, *(reason for found in differences.values() for reason in found)]
    if skeletons.closest_call and expit(by_itself) < CERTAIN:
        reasons.append(f"whether the branch at ({coordinates(skeletons.closest_call)}) is a limb is a close call")
    verdict = DISTRUST if probability < LIKELY else IN_PART if told or probability < CERTAIN else AGREES
    return UNTOLD if faults and told else verdict, probability, tuple(reasons)


def of_mesh(solid: Solid, components: int, mesh: MeshFacts, stop_reason: str) -> list[str]:
    """What is wrong with a mesh."""
    torn = solid.n_solids > components and (solid.made_by == "given" or not solid.is_watertight)
    return _wrong(
        (REFUSED in stop_reason, f"the mesh's own contraction failed: {stop_reason}"),
        (torn, f"the mesh is in {solid.n_solids} parts"),
        (mesh.uncovered > UNCOVERED_SHARE, f"the mesh passes by {mesh.uncovered:.0%} of the points"),
        (mesh.tilted > TILTED_SHARE, f"the mesh is tilted at {mesh.tilted:.0%} of the points: thin walls, or noise"),
    )


def of_operators(rows: OperatorAgreement) -> list[str]:
    """How two operators differ."""
    turned, ratio = rows.angle.get("median", 0.0), rows.eigenvalue_ratio
    equal = 1 / EIGENVALUE_RATIO < ratio < EIGENVALUE_RATIO
    return _wrong(
        (turned > TURNED_ANGLE, f"half of the mean curvature vectors are turned by more than {turned:.0f} degrees"),
        (not equal, f"the eigenvalues of the cloud's Laplacian are {ratio:.3g} times those of the mesh's"),
        (rows.folded > 0, f"{rows.folded} rings do not go once around their point"),
    )


def of_counts(skeletons: SkeletonAgreement, solid: Solid) -> list[str]:
    """What the solid has more or less of than the cloud's skeleton."""
    parts, loops, told = skeletons.components[0], skeletons.loops[0], "{}: {} in the skeleton, {} in the mesh".format
    return _wrong(
        (parts != solid.n_solids, told("components", parts, solid.n_solids)),
        (loops != solid.genus, told("loops", loops, solid.genus)),
    )


def of_limbs(skeletons: SkeletonAgreement) -> list[str]:
    """Ends that one skeleton has and the other lacks."""
    found = [f"the mesh's skeleton ends at ({coordinates(at)}), the cloud's does not" for at in skeletons.missing]
    return found + [f"the skeleton ends at ({coordinates(at)}), the mesh's does not" for at in skeletons.extra]


def _wrong(*told: tuple[bool, str]) -> list[str]:
    return [text for wrong, text in told if wrong]
