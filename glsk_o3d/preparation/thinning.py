"""Thin a cloud."""

import numpy as np

from ..numerics.groups import group_sum
from ..numerics.neighbourhoods import fullness, nearest_left

MOST = 4  # points that one may stand for after a pass, where there are more than enough
WORTH = 0.01  # share of the points that another round must merge
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
    into = _ends(into)
    rows = np.flatnonzero(left)
    if n < len(rows) < len(points):
        around = nearest_left(points, neighbours, left, min(neighbours.shape[1], len(rows)))
        into = rows[thin(points[rows], around, n)][(np.cumsum(left) - 1)[into]]
    return into


def thin_smooth(points, neighbours, spread, around):
    r"""Merge mutual nearest neighbours, at most four into one, where the surface has more points than it takes.

    A disc of k points of a tube with N points around it rises above its plane by :math:`\sigma_1 / \sigma_3 =
    \pi k / (4 N^2)`, the least over the largest principal spread. Merged m into one, the tube has
    :math:`N / \sqrt m` points around it. (Of few points it is less, two thirds of that for 16: a plane fits them
    better.) Points are merged as long as `around` are left; edges, thin parts and noise,
    where the ratio is large, stay as they are.

    Parameters
    ----------
    points : (n, 3) float array
        All different.
    neighbours : (n, k) int array
        Their nearest neighbours, the point itself first.
    spread : (n, 3) float array
        As from `principal`.
    around : float
        Positive.

    Returns
    -------
    (n,) int array
        The point that each was merged into; itself for those that are left.
    """
    needed = np.pi * neighbours.shape[1] / (4 * max(around, 1) ** 2)
    most = np.minimum(needed / np.maximum(fullness(spread, neighbours), needed / MOST), MOST)
    return merge_nearest(points, neighbours, most)


def average_noisy(points, neighbours, noise, weight, n):
    """Put the mean of at most four points in their place where there is noise, but keep about n of them or more.

    A neighbourhood that is narrower than the noise is a ball, wherever the surface is. The mean of m points has less
    noise, and its neighbourhood is wider.

    Parameters
    ----------
    points : (m, 3) float array
        All different.
    neighbours : (m, k) int array
        Their nearest neighbours, the point itself first.
    noise : (m,) float array
        Points where it is 0 stay.
    weight : (m,) float array
        Of every point in the mean.
    n : int

    Returns
    -------
    into : (m,) int array
        The mean that each point is in.
    mean : (c, 3) float array
    total : (c,) float array
        Their weight.
    """
    into = merge_nearest(points, neighbours, np.where(noise > 0, min(MOST, np.count_nonzero(noise) / n), 1))
    into = (np.cumsum(into == np.arange(len(into))) - 1)[into]
    total = np.bincount(into, weight)
    return into, group_sum(weight[:, None] * points, into, len(total)) / total[:, None], total


def merge_nearest(points, neighbours, most):
    """Merge mutual nearest neighbours, round by round, as long as it is worth it.

    Parameters
    ----------
    points : (n, 3) float array
        All different.
    neighbours : (n, k) int array
        Their nearest neighbours, the point itself first.
    most : (n,) float array
        Points that may become one with each, itself included.

    Returns
    -------
    (n,) int array
        The point that each was merged into; itself for those that are left.
    """
    left, into, mass = np.ones(len(points), bool), np.arange(len(points)), np.ones(len(points))
    while True:
        keeper, swallowed = _mutual(points, neighbours, left & (mass + 1 <= most))
        both = mass[keeper] + mass[swallowed]
        fine = both <= np.minimum(most[keeper], most[swallowed])
        if np.count_nonzero(fine) < WORTH * len(points):
            return _ends(into)
        keeper, swallowed = keeper[fine], swallowed[fine]
        into[swallowed], mass[keeper] = keeper, both[fine]
        left[swallowed] = False


def _ends(into):
    while (into != into[into]).any():
        into = into[into]
    return into


def _mutual(points, neighbours, left):
    """Pairs of points left that are each other's nearest; of each pair the one with more room around it is kept."""
    rows = np.flatnonzero(left)
    candidates = neighbours[rows, 1:]
    there = left.take(candidates)
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
