"""Thin a surface where there are more points than it takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..numerics.neighbourhoods import nearest_left, principal
from ..numerics.pairing import Pairs, merge_pairs
from .surface import Surface

ASK_AGAIN = 0.25  # measured: share of the points left, below which the neighbours are looked up anew
STEADY_SHARE = 0.9  # fitted: share of the points left by a pass at which passes end


class Thinned(NamedTuple):
    """The points to contract."""

    survivors: np.ndarray  # (n,) rows of the surface
    representative: np.ndarray  # (m,) for every point of the surface the position in `survivors` of what it went into
    neighbours: np.ndarray  # (n, k) among the survivors
    ring_normals: np.ndarray  # (n, 3) of their planes: among points of one scan line any that has the line in it is one


def thin_surface(surface: Surface, most: int, k: Callable[[int], int]) -> Thinned:
    """Merge points until no more than `most` are left; `k` says how many neighbours to have among so many."""
    points, all_of_them = surface.points, np.arange(len(surface))
    thinned = Thinned(all_of_them, all_of_them, surface.neighbours, surface.ring_normals)
    if most >= len(points):
        return thinned
    representative = thin(points, surface.neighbours, most)
    kept = representative == all_of_them
    survivors = all_of_them[kept]
    neighbours = nearest_left(points, surface.neighbours, kept, k(len(survivors)))
    ring_normals = principal(points[survivors], neighbours)[1]
    return Thinned(survivors, (np.cumsum(kept) - 1)[representative], neighbours, ring_normals)


def thin(points: np.ndarray, neighbours: np.ndarray, n: int) -> np.ndarray:
    """Merge mutual nearest neighbours, round by round, in the last one the nearest, until n >= 1 points are left.

    Gaps stay smaller than in a random sample, and dense parts stay dense: scanners and meshes have them where there is
    detail. No point moves. It does not depend on the order of the points, nor on how they are turned, but where
    distances are equal: on grids a point's nearest neighbour is any of several, and more than n points may be left
    because no two choose each other. Returned is the point that each was merged into, as by `merge_pairs`.
    """

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        too_many = np.count_nonzero(mass) - n
        if len(kept) <= too_many:
            return pairs
        nearest = np.argsort(((points[kept] - points[swallowed]) ** 2).sum(axis=1), kind="stable")[:too_many]
        return kept[nearest], swallowed[nearest]

    representative = merge_pairs(points, neighbours, choose, least=max(n, ASK_AGAIN * len(points)))
    left = representative == np.arange(len(points))
    rows = np.flatnonzero(left)
    if n < len(rows) < len(points):
        around = nearest_left(points, neighbours, left, min(neighbours.shape[1], len(rows)))
        representative = rows[thin(points[rows], around, n)][(np.cumsum(left) - 1)[representative]]
    return representative
