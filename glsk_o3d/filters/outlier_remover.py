"""OutlierRemover: points -> those that are no outliers, single points far from all others or clusters that float."""

from dataclasses import dataclass

import numpy as np

from ..data.points import Points
from ..geometry.frame import MIN_POINTS
from ..geometry.groups import component_labels
from ..geometry.neighbourhoods import local_outlier_ratio, mean_distances, nearest_neighbours, principal, row_medians
from ..geometry.numbers import fitted, speed
from ..geometry.vectors import TINY
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@dataclass(frozen=True)
class OutlierNumbers:
    """Numbers of the OutlierRemover, fitted on clouds with outliers of 1 to 10 %, sparse limbs and crowns."""

    rounds: int = speed(20, "rounds; clouds need less than ten, but ever sparser spirals one a point")
    hops: int = fitted(4, "hops between neighbours, within which the densest place is looked for")
    floating_ratio: float = fitted(
        5.0, "distance of points that float from their neighbours, over that of others there"
    )
    floating_share: float = fitted(0.1, "most share of points that float; more are a part of the object")
    limb_neighbours: int = fitted(64, "neighbours among points far from theirs, with which a limb is longer than thick")
    mixed_share: float = fitted(0.01, "least share of mixed pixels, if there are any; fewer are at ends of a scan")
    filled_second: float = fitted(0.35, "least second over first principal spread of points that fill space")
    filled_third: float = fitted(0.1, "least third over first principal spread of points that fill space")


OUTLIER = OutlierNumbers()

MIXED_OR_TWIGS = (
    "sparse points beside a surface may be mixed pixels of a depth camera or twigs, which cannot be told apart, and "
    "are kept: if they are of a camera, filter its flying pixels first"
)


@documented
@dataclass(frozen=True, kw_only=True)
class OutlierRemover(Filter[Points, Points]):
    """Set outliers aside: later filters ignore them, but each belongs to the vertex of the nearest point.

    An outlier is far from its neighbours, relative to their spacing, in a small isolated cluster, or a mixed pixel of a
    depth camera, between the edge of a surface and what is behind it. Do not call
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

    outlier_factor: float = parameter(
        2.5,
        "Ratio of a point's distance to its neighbours over theirs above which it is an outlier. 0 keeps all.",
        low=0,
    )

    def run(self, points: Points, context: RunContext) -> Points:
        if not self.outlier_factor:
            return points
        points.check_not_thinned(self)
        points.check_not_moved(self)
        cloud, weight, neighbours, factor = points.cloud, points.weight, points.neighbours, self.outlier_factor
        distance = mean_distances(cloud, neighbours)
        mixed, doubtful = mixed_pixels(points, distance, factor)
        remaining, neighbours = inliers(cloud, weight, neighbours, distance, mixed, factor, MIN_POINTS)
        if doubtful:
            points = points.with_report(points.report.with_reason("mixed pixels", MIXED_OR_TWIGS))
        if len(remaining) == len(points):
            return points
        gone = np.ones(len(points), bool)
        gone[remaining] = False
        remaining_points = points.without(gone, neighbours)
        return remaining_points.with_facts(n_mixed=int(mixed.sum()))


def inliers(
    points: np.ndarray,
    weight: np.ndarray,
    neighbours: np.ndarray,
    distance: np.ndarray,
    mixed: np.ndarray,
    factor: float,
    least: int,
) -> tuple[np.ndarray, np.ndarray]:
    """The points left when those far from all others are set aside, round by round.

    An outlier is `factor` times farther from its neighbours than these are from theirs, by the mean `distance` (n,).
    Where there are many, its neighbours are outliers, too; then what floats in space goes, see `in_floating_cluster`.
    At least `least` points are left. `mixed` pixels (n,) go in the first round. Returned are the rows (m,) of those
    left, ascending, and their nearest neighbours among these, (m, k).
    """
    remaining = np.arange(len(points))
    for _ in range(OUTLIER.rounds):  # what is left of a cluster stands out once the rest is gone
        # as near as the neighbours would be if all were there
        mean = distance / np.sqrt(weight[remaining].take(neighbours).mean(axis=1))
        outlier = (local_outlier_ratio(mean, neighbours) > factor) | mixed[remaining]
        if mean.max() > OUTLIER.floating_ratio * mean.min():  # else none can float
            outlier |= in_floating_cluster(points[remaining], weight[remaining], mean, neighbours)
        keep = np.flatnonzero(~outlier)
        if len(keep) == len(remaining) or len(keep) < least:
            break
        remaining, index = remaining[keep], np.cumsum(~outlier) - 1
        k = min(neighbours.shape[1], len(remaining))
        changed = np.flatnonzero(outlier[neighbours[keep]].any(axis=1))
        distance, neighbours, near_points = distance[keep], index[neighbours[keep, :k]], points[remaining]
        near, neighbours[changed] = nearest_neighbours(near_points, k, of=near_points[changed])
        distance[changed] = near[:, 1:].mean(axis=1)
    return remaining, neighbours


def mixed_pixels(points: Points, distance: np.ndarray, factor: float) -> tuple[np.ndarray, bool]:
    """Points that hang between the edge of a surface and what a camera saw behind it, (n,) bool array.

    A pixel on an edge has a depth between front and back. Such points are sparse beside a surface a few steps away,
    and in none of their own, since their neighbourhoods are thick: with the ratio r of their distances to the spacing
    of the surface, and neighbourhoods t times as thick as wide, ``r^2 t > factor``. There are some only where
    more than a few are so by far, with ``r sqrt(t) > factor``. Where little of a cloud is a surface, or too much is
    sparse, they may be twigs: then there are none, and the second result is True.
    """
    n, (third, second, first), neighbours = len(points), points.spread.T, points.neighbours
    mean = distance / np.sqrt(points.weight.take(neighbours).mean(axis=1))
    flat = (third < OUTLIER.filled_third * second) & (second > OUTLIER.filled_second * first)
    none, few = np.zeros(n, bool), max(OUTLIER.mixed_share * n, 2 * neighbours.shape[1])
    thick = mean * np.sqrt(np.sqrt(third / np.maximum(second, TINY)))
    densest = np.where(flat, mean, np.inf)
    if np.count_nonzero(thick > factor * densest.min()) <= few:  # as in most clouds
        return none, False
    columns = np.ascontiguousarray(neighbours.T)
    for _ in range(OUTLIER.hops + 1):
        densest = densest.take(columns).min(axis=0)
    if np.count_nonzero(thick > factor * densest) <= few:
        return none, False
    mixed = thick > np.sqrt(factor) * densest
    surface, sparse = np.count_nonzero(flat) / n, np.count_nonzero(mixed) / n
    clear = surface >= 2 * OUTLIER.floating_share and sparse < OUTLIER.floating_share
    return (mixed if clear else none), not clear


def in_floating_cluster(points: np.ndarray, weight: np.ndarray, mean: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Points that float in space, among others that do, (n,) bool array.

    They are far from their neighbours, a distance `mean` (n,), for what is some steps away, or anywhere if they are an
    island; and together they fill space, or are a handful alone. A sparse surface is flat, and a sparse limb long.
    """
    densest, columns = row_medians(mean.take(neighbours)), np.ascontiguousarray(neighbours.T)
    for _ in range(OUTLIER.hops):
        densest = densest.take(columns).min(axis=0)
    island, sparse = np.zeros(len(points), bool), mean > OUTLIER.floating_ratio * np.median(mean)
    if sparse.any():
        near = neighbours[:, 1:5]
        ends = np.column_stack([np.repeat(np.arange(len(points)), near.shape[1]), near.ravel()])
        part = component_labels(len(points), ends)
        island = np.bincount(part, weight)[part] < OUTLIER.floating_share * weight.sum()
    far = np.flatnonzero((mean > OUTLIER.floating_ratio * densest) | (island & sparse))
    floating = np.zeros(len(points), bool)
    if len(far) > 3:
        among = nearest_neighbours(points[far], min(OUTLIER.limb_neighbours, len(far)))[1]
        third, second, first = principal(points[far], among)[0].T
        floating[far] = (second > OUTLIER.filled_second * first) & (third > OUTLIER.filled_third * first)
    if island.any():
        floating |= island & sparse & (np.bincount(part)[part] < OUTLIER.limb_neighbours)
    return floating & (weight[floating].sum() < OUTLIER.floating_share * weight.sum())
