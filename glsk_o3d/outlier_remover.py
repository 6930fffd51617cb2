"""OutlierRemover: points -> those that are no outliers, single points far from all others or clusters that float."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .numerics.frame import MIN_POINTS
from .numerics.groups import component_labels
from .numerics.neighbourhoods import local_outlier_ratio, mean_distances, nearest_neighbours, principal, row_medians
from .parameters import documented, parameter
from .pipeline import Filter, Watch
from .points import Points

# All fitted, on clouds with outliers of 1 to 10 %, sparse limbs and crowns.
OUTLIER_ROUNDS = 6  # since what is left of a cluster stands out once the rest is gone
DENSEST_HOPS = 4  # from neighbour to neighbour, within which the densest place is looked for
FLOATING_RATIO = 5.0  # times as far from its neighbours as points there are: not for a surface that is only uneven
FLOATING_SHARE = 0.1  # of all points that can float at most; more are a part of the object
LIMB_NEIGHBOURS = 64  # among points far from theirs, that a limb of an object is longer than thick with
# least second and third over first principal spread of points that fill space
FILLED_SECOND, FILLED_THIRD = 0.35, 0.1


@documented
@dataclass(frozen=True, kw_only=True)
class OutlierRemover(Filter[Points]):
    """Set outliers aside: later filters ignore them, but each belongs to the vertex of the nearest point.

    An outlier is far from its neighbours, relative to their spacing, or in a small isolated cluster. Do not call
    Open3D's ``remove_statistical_outlier`` first: it also removes points of sparse limbs.

    References
    ----------
    Breunig et al. 2000, LOF: identifying density-based local outliers.

    Examples
    --------
    >>> import numpy as np
    >>> from glsk_o3d import Sampler
    >>> from glsk_o3d.samples import torus
    >>> points = (Sampler() | OutlierRemover())(np.append(torus(500).points, [[0, 0, 1]], axis=0))
    >>> np.flatnonzero(points.outlier)
    array([500])
    """

    consumes: ClassVar[type] = Points
    produces: ClassVar[type] = Points

    outlier_factor: float = parameter(
        2.5,
        "Ratio of a point's distance to its neighbours over theirs above which it is an outlier. 0 keeps all.",
        low=0,
    )

    def _run(self, points: Points, watch: Watch | None) -> Points:
        if not self.outlier_factor:
            return points
        points.check_whole(self)
        cloud, neighbours = points.cloud, points.neighbours
        left, neighbours = inliers(cloud, points.weight, neighbours, self.outlier_factor, MIN_POINTS)
        if len(left) == len(points):
            return points
        gone = np.ones(len(points), bool)
        gone[left] = False
        return points.without(gone, neighbours)


def inliers(
    points: np.ndarray, weight: np.ndarray, neighbours: np.ndarray, factor: float, least: int
) -> tuple[np.ndarray, np.ndarray]:
    """The points left when those far from all others are set aside, round by round.

    An outlier is `factor` times farther from its neighbours than these are from theirs. Where there are many, its
    neighbours are outliers, too; then what floats in space goes, see `in_floating_cluster`. At least `least` points are
    left. Returned are their rows (m,), ascending, and their nearest neighbours among those left, (m, k).
    """
    left, distance = np.arange(len(points)), mean_distances(points, neighbours)
    for _ in range(OUTLIER_ROUNDS):
        # as near as the neighbours would be if all were there
        mean = distance / np.sqrt(weight[left].take(neighbours).mean(axis=1))
        found = local_outlier_ratio(mean, neighbours) > factor
        if mean.max() > FLOATING_RATIO * mean.min():  # else none can float
            found |= in_floating_cluster(points[left], weight[left], mean, neighbours)
        keep = np.flatnonzero(~found)
        if len(keep) == len(left) or len(keep) < least:
            break
        left, index = left[keep], np.cumsum(~found) - 1
        k = min(neighbours.shape[1], len(left))
        changed = np.flatnonzero(found[neighbours[keep]].any(axis=1))
        distance, neighbours, there = distance[keep], index[neighbours[keep, :k]], points[left]
        near, neighbours[changed] = nearest_neighbours(there, k, of=there[changed])
        distance[changed] = near[:, 1:].mean(axis=1)
    return left, neighbours


def in_floating_cluster(points: np.ndarray, weight: np.ndarray, mean: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Points that float in space, among others that do, (n,) bool array.

    They are far from their neighbours, a distance `mean` (n,), for what is some steps away, or anywhere if they are an
    island; and together they fill space, or are a handful alone. A sparse surface is flat, and a sparse limb long.
    """
    densest, each = row_medians(mean.take(neighbours)), np.ascontiguousarray(neighbours.T)
    for _ in range(DENSEST_HOPS):
        densest = densest.take(each).min(axis=0)
    island, sparse = np.zeros(len(points), bool), mean > FLOATING_RATIO * np.median(mean)
    if sparse.any():
        near = neighbours[:, 1:5]
        ends = np.column_stack([np.repeat(np.arange(len(points)), near.shape[1]), near.ravel()])
        part = component_labels(len(points), ends)
        island = np.bincount(part, weight)[part] < FLOATING_SHARE * weight.sum()
    far = np.flatnonzero((mean > FLOATING_RATIO * densest) | (island & sparse))
    found = np.zeros(len(points), bool)
    if len(far) > 3:
        among = nearest_neighbours(points[far], min(LIMB_NEIGHBOURS, len(far)))[1]
        third, second, first = principal(points[far], among)[0].T
        found[far] = (second > FILLED_SECOND * first) & (third > FILLED_THIRD * first)
    if island.any():
        found |= island & sparse & (np.bincount(part)[part] < LIMB_NEIGHBOURS)
    return found & (weight[found].sum() < FLOATING_SHARE * weight.sum())
