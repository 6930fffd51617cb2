"""Thin a cloud."""

import numpy as np

from .neighbourhoods import nearest_neighbours

SPARSE = 0.25  # share of the points left, below which the neighbours are looked up anew


def thin(points, neighbours, n):
    """Merge mutual nearest neighbours, round by round, in the last one the nearest, until n points are left.

    Gaps stay smaller than in a random sample, and dense parts stay dense: scanners and meshes have them where there is
    detail. No point moves. It does not depend on the
    order of the points, nor on how they are turned, but where distances are equal: on grids a point's nearest neighbour
    is any of several, and more than n points may be left because no two choose each other.

    Parameters
    ----------
    points : (m, 3) float array
        All different.
    neighbours : (m, k) int array
        Their nearest neighbours, the point itself first.
    n : int
        At least 1.

    Returns
    -------
    (m,) int array
        The point that each was merged into; itself for those that are left.
    """
    left = np.ones(len(points), bool)
    into = np.arange(len(points))
    while SPARSE * len(points) < left.sum() > n:
        keeper, swallowed = _mutual(points, neighbours, left)
        if len(keeper) == 0:
            break
        most = left.sum() - n
        if len(keeper) > most:
            nearest = np.argsort(((points[keeper] - points[swallowed]) ** 2).sum(axis=1), kind="stable")[:most]
            keeper, swallowed = keeper[nearest], swallowed[nearest]
        into[swallowed] = keeper
        left[swallowed] = False
    while (into != into[into]).any():
        into = into[into]
    rows = np.flatnonzero(left)
    if n < len(rows) < len(points):
        around = nearest_neighbours(points[rows], min(neighbours.shape[1], len(rows)))[1]
        into = rows[thin(points[rows], around, n)][(np.cumsum(left) - 1)[into]]
    return into


def _mutual(points, neighbours, left):
    """Pairs of points left that are each other's nearest; of each pair the one with more room around it is kept."""
    rows = np.flatnonzero(left)
    candidates = neighbours[rows, 1:]
    there = left[candidates]
    first = np.argmax(there, axis=1)
    found = there[np.arange(len(rows)), first]
    nearest = np.full(len(points), -1)
    nearest[rows[found]] = candidates[found, first[found]]
    one = rows[found]
    one = one[(nearest[nearest[one]] == one) & (one < nearest[one])]
    other = nearest[one]
    room = [((points[neighbours[p, -1]] - points[p]) ** 2).sum(axis=1) for p in (one, other)]
    swap = room[1] > room[0]
    return np.where(swap, other, one), np.where(swap, one, other)
