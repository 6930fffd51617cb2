"""Tell outliers from the points of a surface."""

import numpy as np

from ..numerics.components import component_labels
from ..numerics.neighbourhoods import isolation, nearest_neighbours, principal, row_medians

ROUNDS = 6  # since what is left of a group stands out once the rest is gone
HOPS = 4  # from neighbour to neighbour, within which the densest place is looked for
ADRIFT = 5.0  # times as far from its neighbours as points there are: not for a surface that is only uneven
FEW = 0.1  # share of all points that can float at most; more are a part of the object
WIDE = 64  # neighbours, among points far from theirs, that a limb of an object is longer than thick with
ROUND, FULL = 0.35, 0.1  # least second and third over first principal spread of points that fill space


def without_outliers(points, weight, distance, neighbours, factor, least):
    """The points left when those far from all others are set aside, round by round.

    An outlier is `factor` times farther from its neighbours than these are from theirs. Where there are many, its
    neighbours are outliers, too; then what floats in space goes, see `adrift`.

    Parameters
    ----------
    points : (n, 3) float array
    weight : (n,) float array
        Points that each stands for.
    distance : (n, k) float array
    neighbours : (n, k) int array
        As from `nearest_neighbours`.
    factor : float
    least : int
        Points to leave at least.

    Returns
    -------
    (m,) int array
        Rows, ascending.
    """
    left = np.arange(len(points))
    for _ in range(ROUNDS):
        # as near as the neighbours would be if all were there
        mean = distance[:, 1:].mean(axis=1) / np.sqrt(weight[left].take(neighbours).mean(axis=1))
        found = isolation(mean, neighbours) > factor
        if (mean > ADRIFT * np.quantile(mean, 0.05)).any():
            found |= adrift(points[left], weight[left], mean, neighbours)
        keep = np.flatnonzero(~found)
        if len(keep) == len(left) or len(keep) < least:
            break
        left, index = left[keep], np.cumsum(~found) - 1
        k = min(neighbours.shape[1], len(left))
        changed = np.flatnonzero(found[neighbours[keep, :k]].any(axis=1))
        distance, neighbours = distance[keep, :k], index[neighbours[keep, :k]]
        there = points[left]
        distance[changed], neighbours[changed] = nearest_neighbours(there, k, of=there[changed])
    return left


def adrift(points, weight, mean, neighbours):
    """Points that float in space, among others that do.

    They are far from their neighbours for what is some steps away, or anywhere if they are an island; and together
    they fill space, or are a handful alone. A sparse surface is flat, and a sparse limb long.

    Parameters
    ----------
    points : (n, 3) float array
    weight : (n,) float array
    mean : (n,) float array
        Distance to the neighbours.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) bool array
    """
    densest = row_medians(mean.take(neighbours))
    for _ in range(HOPS):
        densest = densest.take(neighbours).min(axis=1)
    island, alone = np.zeros(len(points), bool), mean > ADRIFT * np.median(mean)
    if alone.any():
        near = neighbours[:, 1:5]
        ends = np.column_stack([np.repeat(np.arange(len(points)), near.shape[1]), near.ravel()])
        part = component_labels(len(points), ends)
        island = np.bincount(part, weight)[part] < FEW * weight.sum()
    far = np.flatnonzero((mean > ADRIFT * densest) | (island & alone))
    found = np.zeros(len(points), bool)
    if len(far) > 3:
        among = nearest_neighbours(points[far], min(WIDE, len(far)))[1]
        third, second, first = principal(points[far], among)[0].T
        found[far] = (second > ROUND * first) & (third > FULL * first)
    if island.any():
        found |= island & alone & (np.bincount(part)[part] < WIDE)
    return found & (weight[found].sum() < FEW * weight.sum())
