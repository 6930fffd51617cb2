"""Set outliers aside: single points far from all others, and clusters that float in space."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..numerics.groups import component_labels
from ..numerics.morton import morton_order
from ..numerics.neighbourhoods import local_outlier_ratio, nearest_neighbours, principal, row_medians
from .frame import MIN_POINTS, Frame, to_working_frame
from .surface import Surface

# All fitted, on clouds with outliers of 1 to 10 %, sparse limbs and crowns.
OUTLIER_ROUNDS = 6  # since what is left of a cluster stands out once the rest is gone
DENSEST_HOPS = 4  # from neighbour to neighbour, within which the densest place is looked for
FLOATING_RATIO = 5.0  # times as far from its neighbours as points there are: not for a surface that is only uneven
DENSE_QUANTILE = 0.05  # of the distances to neighbours: how near points are where they are dense
FLOATING_SHARE = 0.1  # of all points that can float at most; more are a part of the object
LIMB_NEIGHBOURS = 64  # among points far from theirs, that a limb of an object is longer than thick with
# least second and third over first principal spread of points that fill space
FILLED_SECOND, FILLED_THIRD = 0.35, 0.1


def set_aside_outliers(
    points: np.ndarray, counts: np.ndarray, by: str, k: Callable[[int], int], factor: float
) -> Surface:
    """The surface that a cloud shows without its outliers, in the frame of the points without these.

    The arguments are those of `to_working_frame` and, as `factor`, `inliers`; 0 keeps all. The representative of an
    outlier is the point nearest to it.
    """
    frame, cloud, representative, weight, distance, neighbours = to_working_frame(points, counts, by, k)
    outlier = np.zeros(len(points), bool)
    if factor:
        left, among_left = inliers(cloud, weight, distance, neighbours, factor, MIN_POINTS)
        kept = np.zeros(len(cloud), bool)
        kept[left] = True
        outlier = ~kept[representative]
    if outlier.any():
        inside = ~outlier
        if len(cloud) == len(points):  # the neighbours are known
            given, place = np.empty(len(cloud), int), np.empty(len(cloud), int)
            given[representative] = np.arange(len(points))
            order = morton_order(points[given[left]])
            left, among_left = left[order], among_left[order, : k(len(left))]
            place[left] = np.arange(len(left))
            frame = Frame.of(points[given[left]], by)
            cloud, weight, neighbours = frame.into(points[given[left]]), weight[left], np.argsort(order)[among_left]
            representative = place[representative]
        else:  # copies in a frame that far ones made wide may be none in their own
            frame, cloud, representative[inside], weight, _, neighbours = to_working_frame(
                points[inside], counts[inside], by, k
            )
        representative[outlier] = cKDTree(cloud).query(frame.into(points[outlier]))[1]
    return Surface.measured(frame, cloud, neighbours, weight, np.ones(len(cloud)), representative, outlier)


def inliers(
    points: np.ndarray, weight: np.ndarray, distance: np.ndarray, neighbours: np.ndarray, factor: float, least: int
) -> tuple[np.ndarray, np.ndarray]:
    """The points left when those far from all others are set aside, round by round.

    An outlier is `factor` times farther from its neighbours than these are from theirs. Where there are many, its
    neighbours are outliers, too; then what floats in space goes, see `in_floating_cluster`. At least `least` points are
    left. Returned are their rows (m,), ascending, and their nearest neighbours among those left, (m, k).
    """
    left = np.arange(len(points))
    for _ in range(OUTLIER_ROUNDS):
        # as near as the neighbours would be if all were there
        mean = distance[:, 1:].mean(axis=1) / np.sqrt(weight[left].take(neighbours).mean(axis=1))
        found = local_outlier_ratio(mean, neighbours) > factor
        if (mean > FLOATING_RATIO * np.quantile(mean, DENSE_QUANTILE)).any():
            found |= in_floating_cluster(points[left], weight[left], mean, neighbours)
        keep = np.flatnonzero(~found)
        if len(keep) == len(left) or len(keep) < least:
            break
        left, index = left[keep], np.cumsum(~found) - 1
        k = min(neighbours.shape[1], len(left))
        changed = np.flatnonzero(found[neighbours[keep, :k]].any(axis=1))
        distance, neighbours = distance[keep, :k], index[neighbours[keep, :k]]
        there = points[left]
        distance[changed], neighbours[changed] = nearest_neighbours(there, k, of=there[changed])
    return left, neighbours


def in_floating_cluster(points: np.ndarray, weight: np.ndarray, mean: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Points that float in space, among others that do, (n,) bool array.

    They are far from their neighbours, a distance `mean` (n,), for what is some steps away, or anywhere if they are an
    island; and together they fill space, or are a handful alone. A sparse surface is flat, and a sparse limb long.
    """
    densest = row_medians(mean.take(neighbours))
    for _ in range(DENSEST_HOPS):
        densest = densest.take(neighbours).min(axis=1)
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
