"""How two Laplacians of one object agree, and two skeletons, neither of which is known to be right."""

from dataclasses import dataclass

import numpy as np

from ..data.decisions import Decision, Place
from ..data.skeleton import Skeleton
from .comparison import TIP_REACH, matched
from .curves import distances


@dataclass(frozen=True, eq=False)
class OperatorAgreement:
    """How a cloud's Laplacian agrees with that of a mesh.

    Attributes
    ----------
    points, compared, flat : int
        Points that are contracted; those near enough to the mesh to be compared; of these the ones where neither says
        that the surface is bent, so that there is no curvature to compare.
    angle, ratio : dict of str to float
        Quantiles over the others of the angle between the mean curvature vectors, in degrees, and of the length of ours
        over that of the mesh's; empty where all is flat.
    functions : float
        How differently smooth functions are mapped: norm of the difference over the norm, the median of six waves.
    eigenvalues : (k, 2) float64 array
        The smallest fifty of both, ours first, in the working frame.
    eigenvalue_ratio : float
        Median of ours over the mesh's, without those that are zero.
    folded : int
        Rings that do not go once around their point: none, unless something is wrong with them.
    """

    points: int
    compared: int
    flat: int
    angle: dict[str, float]
    ratio: dict[str, float]
    functions: float
    eigenvalues: np.ndarray
    eigenvalue_ratio: float
    folded: int


@dataclass(frozen=True)
class SkeletonAgreement:
    """How two skeletons of one object agree; pairs are the first's and the second's.

    Attributes
    ----------
    distance_in_radii, hausdorff95_in_radii : float
        To the nearest place on the other in local radii: mean of both directions, 95 % quantile of the worse one.
    components, loops, leaves : tuple of int
    missing, extra : tuple of (x, y, z)
        Where limbs of the second end that the first lacks, and the other way around.
    doubt, closest_call : float, (x, y, z) or None
        Minus the logarithm of the certainty of the closest calls about a limb in both, and the place of the closer one.
    """

    distance_in_radii: float
    hausdorff95_in_radii: float
    components: tuple[int, int]
    loops: tuple[int, int]
    leaves: tuple[int, int]
    missing: tuple[Place, ...]
    extra: tuple[Place, ...]
    doubt: float
    closest_call: Place | None


def compare_skeletons(ours: Skeleton, theirs: Skeleton, step: float) -> SkeletonAgreement:
    """How two skeletons agree, by places on both that are `step` apart."""
    in_radii = [np.divide(*distances(*pair, step)) for pair in ((ours, theirs), (theirs, ours))]
    ends, other_ends = (skeleton.vertices[skeleton.leaves] for skeleton in (ours, theirs))
    reach = TIP_REACH * np.maximum(ours.radii[ours.leaves][:, None], theirs.radii[theirs.leaves])
    rows, other_rows = np.reshape(matched(ends, other_ends, reach) if reach.size else (), (-1, 2)).astype(int).T
    closest = [
        min(calls, key=lambda call: abs(call.probability - 0.5)) for calls in map(_limbs, (ours, theirs)) if calls
    ]
    certainty = [call.certainty for call in closest]
    return SkeletonAgreement(
        distance_in_radii=float(np.mean([distance.mean() for distance in in_radii])),
        hausdorff95_in_radii=float(max(np.percentile(distance, 95) for distance in in_radii)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
        leaves=(len(ours.leaves), len(theirs.leaves)),
        missing=tuple(map(tuple, np.delete(other_ends, other_rows, 0).tolist())),
        extra=tuple(map(tuple, np.delete(ends, rows, 0).tolist())),
        doubt=float(np.log(np.divide(1, certainty)).sum()),
        closest_call=closest[int(np.argmin(certainty))].place if closest else None,
    )


def _limbs(skeleton: Skeleton) -> list[Decision]:
    return [decision for decision in skeleton.report.decisions if decision.about == "limb"]
