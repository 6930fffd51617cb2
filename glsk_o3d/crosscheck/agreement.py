"""How the rings of a cloud and a mesh agree, and how their skeletons do, in numbers and as a verdict."""

from dataclasses import dataclass

import numpy as np

from ..analysis.curves import distances
from ..numerics.cotangent import cotangent_laplacian
from ..report import REFUSED, Report
from ..skeleton import Skeleton
from ..state import Contraction
from .mesh import mesh_laplacian, umbrellas

ANGLE_QUANTILES = {"median": 50, "p75": 75, "p90": 90}

# All fitted.
FLAT_LAPLACIAN = 1e-3  # of the ring's size: smaller Laplacian coordinates have no direction
COMPARISON_STEP = 0.002  # of the diagonal: spacing of the places where skeletons are compared
COVERED_SHARE = 0.7  # of the closed rings that a mesh closes too; below it, it does not describe the cloud

# All measured: what separates clean, dense samples of known shapes from sparse and noisy ones; see docs/crosscheck.md.
TURNED_ANGLE = 30.0  # degrees
NEAR_RADII, FAR_RADII = 0.2, 0.5  # mean distance, in local radii
HAUSDORFF_RADII = 1.0  # local radii, in 95 % of the length

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"
MEANINGS = {
    AGREES: "as of clean, dense clouds; gaps that cloud and mesh share, as of scans from one or two sides, do not show",
    IN_PART: "of 17 test clouds 10 had a good skeleton all the same; look at --labelled",
    DISTRUST: "rare, and a call to look at --labelled: of 13 test clouds 10 had a good skeleton all the same",
    UNTOLD: "usual with noise or few points: no word against the skeleton; look at --labelled, or 'glsk evaluate'",
}
"""What to expect of each verdict; the numbers are measured, see docs/crosscheck.md."""


@dataclass(frozen=True)
class RowAgreement:
    """How the Laplacian coordinates of a cloud's rings agree with those of a mesh."""

    closed: int  # distinct points of the cloud whose ring closes
    compared: int  # closed rings at which the mesh has a closed umbrella as well
    covered: float  # the share of the closed ones that were compared
    angle: dict[str, float]  # quantiles of the angle between ours and the mesh's, in degrees; 0 is best


@dataclass(frozen=True)
class SkeletonAgreement:
    """How the skeletons of a cloud and of a mesh agree; pairs are the cloud's and the mesh's."""

    distance_in_radii: float  # mean to the nearest place on the other, of both directions, in local radii
    hausdorff95_in_radii: float  # 95 % quantile of the worse direction
    components: tuple[int, int]
    loops: tuple[int, int]


def compare_rows(state: Contraction, faces: np.ndarray) -> tuple[np.ndarray, RowAgreement]:
    """Compare the Laplacian coordinates of a cloud, fresh from the ring builder, with those of a mesh of its points.

    Gives the angle at every distinct point, (m,) float array, 0 where both are flat and NaN where none is compared,
    and a RowAgreement.
    """
    points, rings = state.cloud, state.rings
    matrix = cotangent_laplacian(points, rings)
    ours, theirs = matrix @ points, mesh_laplacian(points, faces) @ points
    compared = rings.closed & umbrellas(len(points), faces)
    size = -matrix.diagonal() * rings.mean_lengths(points)  # of Laplacian coordinates as long as the ring is wide
    a, b = np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1)
    flat = compared & (np.maximum(a, b) <= FLAT_LAPLACIAN * np.abs(size))
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", ours, theirs) / (a * b)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    angle[flat], angle[~compared] = 0, np.nan
    n, n_closed, told = int(compared.sum()), int(rings.closed.sum()), angle[compared & ~flat]
    told = told[np.isfinite(told)]
    rows = RowAgreement(
        closed=n_closed,
        compared=n,
        covered=n / max(n_closed, 1),
        angle={name: float(np.percentile(told, at)) for name, at in ANGLE_QUANTILES.items()} if len(told) else {},
    )
    return angle, rows


def compare_skeletons(ours: Skeleton, theirs: Skeleton, step: float) -> SkeletonAgreement:
    """How two skeletons agree, by places on both that are `step` apart."""
    both = [distances(*pair, step) for pair in ((ours, theirs), (theirs, ours))]
    in_radii = [distance / radius for distance, radius in both]
    return SkeletonAgreement(
        distance_in_radii=float(np.mean([each.mean() for each in in_radii])),
        hausdorff95_in_radii=float(max(np.percentile(each, 95) for each in in_radii)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
    )


def judge(
    rows: RowAgreement, skeletons: SkeletonAgreement, warned: tuple[str, ...], mesh_report: Report
) -> tuple[str, tuple[str, ...]]:
    """The verdict on a cloud, as docs/crosscheck.md has it, and a tuple of what speaks against a better one.

    `warned` is what the cloud's own run warns of, `mesh_report` the report of the mesh's.
    """
    faults, grave, slight = [], [], list[str]()  # of the mesh; against trust; against agreement
    if REFUSED in mesh_report.stop_reason:
        faults.append(f"the mesh's own contraction failed: {mesh_report.stop_reason}")
    if rows.covered < COVERED_SHARE:
        faults.append(f"the mesh closes around {rows.covered:.0%} of the points whose rings close")
    for name in ("components", "loops"):
        ours, theirs = getattr(skeletons, name)
        if ours != theirs:
            grave.append(f"{name}: {ours} in the skeleton of the cloud, {theirs} in that of the mesh")
    apart, hausdorff = skeletons.distance_in_radii, skeletons.hausdorff95_in_radii
    if apart > NEAR_RADII:
        (grave if apart > FAR_RADII else slight).append(f"the skeletons lie {apart:.2f} local radii apart on average")
    if hausdorff > HAUSDORFF_RADII:
        slight.append(f"5 % of a skeleton are more than {hausdorff:.1f} local radii from the other")
    if rows.angle and rows.angle["p75"] > TURNED_ANGLE:
        slight.append(f"a quarter of the Laplacian coordinates are turned by more than {rows.angle['p75']:.0f} degrees")
    slight += [f"the run itself warns: {message}" for message in warned]
    slight += [f"the mesh's run warns: {message}" for message in mesh_report.warnings if message not in warned]
    reasons = (*faults, *grave, *slight)
    if faults and (grave or not rows.compared):
        return UNTOLD, reasons
    return DISTRUST if grave else IN_PART if reasons else AGREES, reasons
