"""Points merged into their nearest neighbours, pair by pair."""

from __future__ import annotations

import numpy as np

MERGE_WORTH = 0.01  # fitted: share of the points that another round must merge


def merge_nearest(points: np.ndarray, neighbours: np.ndarray, most: np.ndarray) -> np.ndarray:
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
    left, representative, mass = np.ones(len(points), bool), np.arange(len(points)), np.ones(len(points))
    while True:
        kept, swallowed = mutual_pairs(points, neighbours, left & (mass + 1 <= most))
        both = mass[kept] + mass[swallowed]
        fine = both <= np.minimum(most[kept], most[swallowed])
        if np.count_nonzero(fine) < MERGE_WORTH * len(points):
            return final_representatives(representative)
        kept, swallowed = kept[fine], swallowed[fine]
        representative[swallowed], mass[kept] = kept, both[fine]
        left[swallowed] = False


def final_representatives(representative: np.ndarray) -> np.ndarray:
    """Where each point ends that was merged into one which was merged on, (n,) int array."""
    while (representative != representative[representative]).any():
        representative = representative[representative]
    return representative


def mutual_pairs(points: np.ndarray, neighbours: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
