"""The points that say where the surface is, and fewer of them where there are more than it takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..numerics.neighbourhoods import nearest_left, principal, sphericity
from ..numerics.pairing import Pairs, merge_pairs
from .frame import Frame

# Fitted: median sphericity of clean neighbourhoods at most, and of nothing but noise.
CLEAN_SPHERICITY, NOISE_SPHERICITY = 0.2, 0.35


@dataclass(frozen=True, eq=False)
class Surface:
    """Points in the working frame, and what their neighbourhoods are like.

    On the way to the rings points are merged, copies, noisy and near ones, and outliers are set aside. A point that is
    left represents those that went into it, and the outliers nearest to it; its `weight` and `merged` say how many.
    """

    frame: Frame
    points: np.ndarray  # (m, 3)
    neighbours: np.ndarray  # (m, k) nearest first, the point itself ahead of them
    weight: np.ndarray  # (m,) points of the cloud that each stands for
    merged: np.ndarray  # (m,) distinct points that each is the mean of
    noise: np.ndarray  # (m,) see `noise_share`
    normals: np.ndarray  # (m, 3) of the surface as it came, up to their sign: on a ridge there are none any more
    ring_normals: np.ndarray  # (m, 3) of the planes that the rings lie in: those of the points as they are now
    representative: np.ndarray  # (s,) of every sampled point its row
    outlier: np.ndarray  # (s,) sampled points that were set aside

    @classmethod
    def measured(
        cls,
        frame: Frame,
        points: np.ndarray,
        neighbours: np.ndarray,
        weight: np.ndarray,
        merged: np.ndarray,
        representative: np.ndarray,
        outlier: np.ndarray,
    ) -> Surface:
        """The surface with noise and normals measured in the neighbourhoods."""
        spread, normals = principal(points, neighbours)
        noise = noise_share(spread, neighbours)
        return cls(frame, points, neighbours, weight, merged, noise, normals, normals, representative, outlier)

    def __len__(self) -> int:
        return len(self.points)


def noise_share(spread: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """How far the neighbourhoods of a cloud are noise, from 0 to 1, (n,) float array.

    That is how much they fill space: the sphericity, smoothed by the median, is near 0 on a surface and along a curve,
    however dense, and 1 in a ball of noise (Demantke et al. 2011, "Dimensionality based scale selection in 3D lidar
    point clouds"); from 0.2 to 0.35 it is mapped to 0 to 1.
    """
    rise = (sphericity(spread, neighbours) - CLEAN_SPHERICITY) / (NOISE_SPHERICITY - CLEAN_SPHERICITY)
    return np.clip(rise, 0, 1)


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
