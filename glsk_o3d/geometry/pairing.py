"""Merge points into their nearest neighbours, pair by pair."""

from collections.abc import Callable

import numpy as np

from .vectors import dot

Pairs = tuple[np.ndarray, np.ndarray]
"""Points that are kept, and for each of them the one that it swallows."""


def merge_pairs(
    points: np.ndarray,
    neighbours: np.ndarray,
    choose: Callable[[Pairs, np.ndarray], Pairs],
    most: np.ndarray | float = np.inf,
    least: float = 0,
) -> np.ndarray:
    """Merge mutual nearest neighbours, round by round, while `choose` takes pairs and more than `least` remain.

    Points (n, 3) are all different, and their nearest neighbours (n, k) begin with the point itself. `choose` is given
    pairs and the mass of every point: how many it stands for, at most `most`; 0 if it was swallowed. Returned is the
    point that each was merged into, (n,) int array, maybe itself.
    """
    representative, mass, nearest = np.arange(len(points)), np.ones(len(points)), neighbours[:, 1].copy()
    while np.count_nonzero(mass > 0) > least:  # of truth values it is faster
        kept, swallowed = choose(_mutual_pairs(points, neighbours, (mass > 0) & (mass + 1 <= most), nearest), mass)
        if len(kept) == 0:
            break
        representative[swallowed] = kept
        mass[kept] += mass[swallowed]
        mass[swallowed] = 0
    return final_representatives(representative)


def final_representatives(representative: np.ndarray) -> np.ndarray:
    """Where each point ends that was merged into one which was merged on, (n,) int array."""
    while (representative != representative[representative]).any():
        representative = representative[representative]
    return representative


def _mutual_pairs(points: np.ndarray, neighbours: np.ndarray, remaining: np.ndarray, nearest: np.ndarray) -> Pairs:
    """Pairs of remaining points that are each other's `nearest` (n,), which is updated: the roomier point is kept."""
    stale = np.flatnonzero(remaining & ~remaining.take(nearest))
    candidates = neighbours.take(stale, axis=0)
    present = remaining.take(candidates)
    present[:, 0] = False
    nearest[stale] = candidates[np.arange(len(stale)), np.argmax(present, axis=1)]
    one = np.flatnonzero(remaining & (np.arange(len(points)) < nearest))
    one = one[nearest[nearest[one]] == one]
    other = nearest[one]
    rooms = [points.take(neighbours[p, -1], axis=0) - points.take(p, axis=0) for p in (one, other)]
    swap = dot(rooms[1], rooms[1]) > dot(rooms[0], rooms[0])
    return np.where(swap, other, one), np.where(swap, one, other)
