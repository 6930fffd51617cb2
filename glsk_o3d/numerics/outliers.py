"""Tell outliers from the points of a surface."""

import numpy as np

from .components import component_labels
from .groups import group_median
from .neighbourhoods import isolation, nearest_neighbours, principal, row_medians

ROUNDS = 6  # since what is left of a group stands out once the rest is gone
HOPS = 4  # from neighbour to neighbour, within which the densest place is looked for
ADRIFT = 5.0  # times as far from its neighbours as points there are: not for a surface that is only uneven
VOLUME = 0.1  # least over largest principal spread of a neighbourhood that is no surface


def without_outliers(points, weight, distance, neighbours, factor, least):
    """The points left when those far from all others are set aside, round by round.

    An outlier is `factor` times farther from its neighbours than these are from theirs. Where there are many, its
    neighbours are outliers, too, so one is also what is far from its neighbours for what is some steps away, and fills
    space there.

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
    left, k = np.arange(len(points)), neighbours.shape[1]
    for _ in range(ROUNDS):
        # as near as the neighbours would be if all were there
        mean = distance[:, 1:].mean(axis=1) / np.sqrt(weight[left][neighbours].mean(axis=1))
        found = isolation(mean, neighbours) > factor
        if (mean > ADRIFT * np.quantile(mean, 0.05)).any():
            found |= adrift(points[left], mean, neighbours)
            if not found.any():
                found = islands(points[left], mean, neighbours)
        keep = np.flatnonzero(~found)
        if len(keep) == len(left) or len(keep) < max(least, k):
            break
        left, index = left[keep], np.cumsum(~found) - 1
        changed = np.flatnonzero(found[neighbours[keep]].any(axis=1))
        distance, neighbours = distance[keep], index[neighbours[keep]]
        there = points[left]
        distance[changed], neighbours[changed] = nearest_neighbours(there, k, of=there[changed])
    return left


def adrift(points, mean, neighbours):
    """Points that float in space, among others that do.

    Parameters
    ----------
    points : (n, 3) float array
    mean : (n,) float array
        Distance to the neighbours.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) bool array
    """
    densest = row_medians(mean[neighbours])
    for _ in range(HOPS):
        densest = densest[neighbours].min(axis=1)
    far = np.flatnonzero(mean > ADRIFT * densest)
    found = mean > ADRIFT**2 * densest  # a handful, whose neighbourhoods reach back to the surface
    found[far[fullness(points, neighbours[far]) > VOLUME]] = True
    return found


def islands(points, mean, neighbours):
    """Points of parts apart that float in space, and are no surface: so many that they have only each other.

    Parameters
    ----------
    points : (n, 3) float array
    mean : (n,) float array
        Distance to the neighbours.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) bool array
    """
    n, k = neighbours.shape
    part = component_labels(n, np.column_stack([np.repeat(np.arange(n), k), neighbours.ravel()]))
    parts, size = part.max() + 1, np.bincount(part)
    typical = group_median(mean, part, parts)
    sparse = (typical > ADRIFT * typical[np.argmax(size)])[part]
    rows = np.flatnonzero(sparse)
    full = group_median(fullness(points, neighbours[rows]), part[rows], parts)
    return sparse & (full > VOLUME)[part]


def fullness(points, neighbours):
    """Least over largest principal spread of neighbourhoods: how far they fill space, (n,) float array."""
    spread = principal(points, neighbours)[0]
    return spread[:, 0] / np.maximum(spread[:, 2], np.finfo(float).tiny)
