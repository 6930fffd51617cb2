"""What two operators, two skeletons and a solid say of the first skeleton."""

from dataclasses import dataclass

import numpy as np

from ...analysis.agreement import OperatorAgreement, SkeletonAgreement
from ...data.decisions import coordinates, logistic
from ...data.report import REFUSED
from ...geometry.neighbourhoods import spacing
from ...geometry.vectors import dot
from ...interop.packages import require
from .solid import Solid

# All measured on shapes with known axes; see docs/crosscheck.md.
COVERED = 2.0  # spacings from the mesh within which it covers a point
ALIGNED = 0.7  # cosine of the angle between the normals of mesh and cloud
UNCOVERED_SHARE, TILTED_SHARE = 0.01, 0.12  # of the points, beyond which the mesh is at fault
ELSEWHERE_SHARE = 0.2  # of the points, which a mesh of the same object does not pass by
TURNED, MOST_TURNED = 40.0, 140.0  # degrees: the median, and the 90 % quantile, of the angles between sound operators
RATIO, MAPPED = 1.5, 0.8  # one way or the other, of lengths and eigenvalues; and how differently functions are mapped
CERTAIN, LIKELY = 0.9, 0.75  # probabilities from which on a graph agrees, and agrees in part

# Fitted, by benchmarks/crosscheck.py, but the first, which is of the code and not of the graph.
WEIGHTS = {"operators": -5.0, "solid": -4.2, "limbs": -1.2, "doubt": -3.4, "constant": 4.4}

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"


@dataclass(frozen=True)
class MeshFacts:
    """How a mesh fits a cloud."""

    uncovered: float  # share of the points that it passes by
    tilted: float  # and where its normals are others
    faults: tuple[str, ...]


def mesh_facts(solid: Solid, points: np.ndarray, normals: np.ndarray, components: int, stop_reason: str) -> MeshFacts:
    """How a mesh fits points (n, 3) with normals (n, 3) up to their sign, whose skeleton has so many components."""
    igl, mesh = require("igl"), (solid.vertices, solid.faces)
    squared, face, _ = igl.point_mesh_squared_distance(points, *mesh)
    cosine = dot(igl.per_face_normals(*mesh, np.zeros(3))[face], normals)
    shares = float((squared > (COVERED * spacing(points)) ** 2).mean()), float((np.abs(cosine) < ALIGNED).mean())
    return MeshFacts(*shares, of_mesh(solid, components, *shares, stop_reason))


def judge(
    rows: OperatorAgreement, skeletons: SkeletonAgreement, solid: Solid, mesh: MeshFacts
) -> tuple[str, float, tuple[str, ...]]:
    """The verdict on a cloud, the probability that its graph is right, and what speaks against it.

    Where the mesh is at fault, what it says is not counted.
    """
    counts, limbs, operators = of_counts(skeletons, solid), of_limbs(skeletons), of_operators(rows)
    doubt, trusted = {"doubt": skeletons.doubt}, float(not mesh.faults)
    facts = dict(operators=bool(operators), solid=bool(counts), limbs=float(np.log1p(len(limbs))))
    probability = logistic(WEIGHTS, {name: trusted * fact for name, fact in facts.items()} | doubt)
    folded = _reasons((rows.folded > 0, f"rings that do not go once around their point: {rows.folded}"))
    reasons = [*folded, *mesh.faults, *operators, *counts, *limbs]
    if skeletons.closest_call and logistic(WEIGHTS, dict.fromkeys(facts, 0.0) | doubt) < CERTAIN:
        reasons.append(f"whether the branch at ({coordinates(skeletons.closest_call)}) is a limb is a close call")
    differs = bool(operators or counts or limbs)
    same = len({*skeletons.components}) == 1 == len({*skeletons.loops})
    verdict = DISTRUST if probability < LIKELY else IN_PART if differs or probability < CERTAIN else AGREES
    if mesh.faults and (differs or not same or mesh.uncovered > ELSEWHERE_SHARE):
        verdict = UNTOLD
    return DISTRUST if folded else verdict, probability, tuple(reasons)


def of_mesh(solid: Solid, components: int, uncovered: float, tilted: float, stop_reason: str) -> tuple[str, ...]:
    """What is wrong with a mesh; `stop_reason` is that of its contraction."""
    torn = solid.n_solids > components and (solid.made_by == "given" or not solid.is_watertight)
    return _reasons(
        (REFUSED in stop_reason, f"the mesh's own contraction failed: {stop_reason}"),
        (torn, f"the mesh is in {solid.n_solids} parts"),
        (uncovered > UNCOVERED_SHARE, f"the mesh is not where {uncovered:.0%} of the points are"),
        (uncovered > ELSEWHERE_SHARE, "the mesh is of something else: has it the same units and place?"),
        (tilted > TILTED_SHARE, f"the mesh is tilted at {tilted:.0%} of the points: thin walls, or noise"),
    )


def of_operators(rows: OperatorAgreement) -> tuple[str, ...]:
    """How two operators differ."""
    angles, length, eigenvalues = rows.angle, rows.ratio.get("median", 1.0), rows.eigenvalue_ratio
    half, tenth = angles.get("median", 0.0), angles.get("p90", 0.0)
    return _reasons(
        (half > TURNED, f"half of the mean curvature vectors are turned by more than {half:.0f} degrees"),
        (tenth > MOST_TURNED, f"a tenth of the mean curvature vectors are turned by more than {tenth:.0f} degrees"),
        (not 1 / RATIO < length < RATIO, f"the mean curvature vectors are {length:.3g} times as long as the mesh's"),
        (not 1 / RATIO < eigenvalues < RATIO, f"the eigenvalues are {eigenvalues:.3g} times those of the mesh"),
        (not rows.functions < MAPPED, f"smooth functions are mapped differently, by {rows.functions:.0%}"),
    )


def of_counts(skeletons: SkeletonAgreement, solid: Solid) -> tuple[str, ...]:
    """What the solid has more or less of than the cloud's skeleton; one that is open may have a handle cut open."""
    counts = ("components", skeletons.components, solid.n_solids), ("loops", skeletons.loops, solid.genus)
    return tuple(
        f"{name}: {ours} in the skeleton, {right} in the mesh"
        for name, (ours, theirs), right in counts
        if ours != right and (solid.is_watertight or ours != theirs)
    )


def of_limbs(skeletons: SkeletonAgreement) -> list[str]:
    """Ends that one skeleton has and the other lacks."""
    missing = [f"the mesh's skeleton ends at ({coordinates(at)}), the cloud's does not" for at in skeletons.missing]
    return missing + [f"the skeleton ends at ({coordinates(at)}), the mesh's does not" for at in skeletons.extra]


def _reasons(*facts: tuple[bool, str]) -> tuple[str, ...]:
    return tuple(text for holds, text in facts if holds)
