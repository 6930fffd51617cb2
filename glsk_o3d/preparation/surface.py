"""The points that say where the surface is, and fewer of them where there are more than it takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..numerics.eigen import principal_parts
from ..numerics.neighbourhoods import nearest_left, principal, sphericity
from ..numerics.pairing import Pairs, merge_pairs
from ..numerics.vectors import PAIRS, TINY
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
    spread: np.ndarray  # (m, 3) as from `principal`
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
        """The surface with noise, normals and spread measured in the neighbourhoods."""
        spread, normals = principal(points, neighbours)
        noise = noise_share(spread, neighbours)
        return cls(frame, points, neighbours, weight, merged, noise, normals, spread, normals, representative, outlier)

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


ASK_AGAIN = 0.25  # speed: share of the points left, below which the neighbours are looked up anew
DENSE_FROM = 2000  # fitted: points from which on more than enough are merged
ENOUGH = 2400  # fitted: points on a body without thin parts
PACKED = 0.42  # measured: points left on an area of 1 if none are to be nearer than 1
SMOOTHING = 8  # fitted: steps over which the thickness of parts is averaged
LEAST_MERGED = 0.001  # measured: share of the points that a round must merge: along a spiral it is one each
LEAST_AROUND = 3  # derived: points around the thinnest part
WIDER_STEPS = 3  # measured: steps from neighbour to neighbour: fewer see no more than noise, more see other parts
SHEET_FROM = 0.4  # measured: second over third variance of these, from which on they are a sheet; tubes of 10 have it
WIDER_BIAS = 1.25  # measured: on tubes with 18 to 80 points around them, noise of up to a fifth of their spacing
STEADY_SHARE = 0.9  # fitted: share of the points left by a pass at which passes end


class Thinned(NamedTuple):
    """The points to contract."""

    survivors: np.ndarray  # (n,) rows of the surface
    representative: np.ndarray  # (m,) for every point of the surface the position in `survivors` of what it went into
    neighbours: np.ndarray  # (n, k) among the survivors
    spread: np.ndarray  # (n, 3) of these, as from `principal`
    ring_normals: np.ndarray  # (n, 3) of their planes: among points of one scan line any that has the line in it is one


def thin_surface(surface: Surface, around: float, most: int, k: Callable[[int], int]) -> Thinned:
    """Merge points where there are more than enough, and then until no more than `most` are left.

    See `spacing_enough` for how many points `around` a part are enough; 0 merges none for this. `k` says how many
    neighbours to have among so many points.
    """
    points, all_of_them = surface.points, np.arange(len(surface))
    thinned = Thinned(all_of_them, all_of_them, surface.neighbours, surface.spread, surface.ring_normals)
    before = np.inf
    while around and DENSE_FROM <= len(thinned.survivors) <= STEADY_SHARE * before:
        before, here = len(thinned.survivors), points[thinned.survivors]
        apart = spacing_enough(here, thinned.neighbours, thinned.spread, around)
        thinned = _merged(points, thinned, thin_nearer(here, thinned.neighbours, apart), k)
    if most < len(thinned.survivors):
        thinned = _merged(points, thinned, thin(points[thinned.survivors], thinned.neighbours, most), k)
    return thinned


def _merged(points: np.ndarray, thinned: Thinned, representative: np.ndarray, k: Callable[[int], int]) -> Thinned:
    """What is left when survivors are merged into others."""
    kept = representative == np.arange(len(representative))
    rank = np.cumsum(kept) - 1
    survivors = thinned.survivors[kept]
    neighbours = nearest_left(points[thinned.survivors], thinned.neighbours, kept, k(len(survivors)))
    measured = principal(points[survivors], neighbours)
    return Thinned(survivors, rank[representative][thinned.representative], neighbours, *measured)


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


def thin_nearer(points: np.ndarray, neighbours: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Merge mutual nearest neighbours that are nearer than they are to be, round by round, as long as it is worth it.

    Of two points the lesser distance `apart` (n,) counts, and the one stays that more were merged into, so that none
    wanders along rows of points that get ever denser. Returned is the point that each was merged into.
    """

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        reach = np.minimum(apart[kept], apart[swallowed])
        nearer = ((points[kept] - points[swallowed]) ** 2).sum(axis=1) < reach**2
        nearer &= np.count_nonzero(nearer) > LEAST_MERGED * len(points)
        kept, swallowed = kept[nearer], swallowed[nearer]
        swap = mass[kept] < mass[swallowed]
        return np.where(swap, swallowed, kept), np.where(swap, kept, swallowed)

    return merge_pairs(points, neighbours, choose)


def spacing_enough(points: np.ndarray, neighbours: np.ndarray, spread: np.ndarray, around: float) -> np.ndarray:
    """How far apart points may be, (n,), so that `around` of them are around every part, and enough on the body.

    The circumference of the part that a point is on is its points around times their spacing, see `points_around`;
    measured point by point it is rough, and what is left would be as uneven. So its inverse is averaged over the
    surface. Flat and thick parts have no more than their share of 2400 points, spread evenly over all of the surface.
    Nowhere more than twice the spacing that there is: fewer points are measured again, with less noise.
    """
    k = neighbours.shape[1]
    # the variance of a disc is a quarter of R^2, that of a row of points a twelfth of its length squared
    disc = np.sqrt(4 * np.pi * np.sqrt(spread[:, 1] * spread[:, 2])) / k
    spacing = np.maximum(disc, np.sqrt(12 * spread[:, 2] / k) / k)
    average = mean_over(neighbours)
    bent = 1 / (np.maximum(points_around(points, average, spread), LEAST_AROUND) * np.maximum(spacing, TINY))
    for _ in range(SMOOTHING):
        bent = average @ bent
    among = np.minimum(1 / (max(around, 1) * np.maximum(bent, TINY)), np.sqrt(spacing @ spacing / ENOUGH))
    return np.minimum(np.sqrt(PACKED) * among, 2 * spacing)


def points_around(points: np.ndarray, average: csr_array, spread: np.ndarray) -> np.ndarray:
    r"""Points around the part that each point is on, its circumference over their spacing, whatever the noise.

    A disc of k points of a tube with N points around it rises above its plane by :math:`\sigma_1 / \sigma_3 =
    \pi k / (4 N^2)`, the least over the largest principal variance; and noise adds to :math:`\sigma_1`. In wider
    surroundings, where :math:`\sigma_3` is s times as large, noise adds the same, but the tube rises s^2 times as
    much: their difference, over :math:`s^2 - 1`, is free of noise. These are the surroundings of the neighbours of the
    neighbours, all together. In them edges, gaps and other parts look like thin parts. Where they are no sheet but a
    line, a part with less than ten points around it, all of :math:`\sigma_1` is its thickness.

    `average` is `mean_over` the neighbours, and `spread` as from `principal`. (n,) float array, infinite where nothing
    but noise is seen.
    """
    k = average.nnz // len(points)
    moments = np.column_stack([points, *(points[:, i] * points[:, j] for i, j in PAIRS)])
    for _ in range(WIDER_STEPS):
        moments = average @ moments
    mean, square = moments[:, :3].T, moments[:, 3:].T
    wider = principal_parts(square - [mean[i] * mean[j] for i, j in PAIRS])[0]
    near = np.maximum(spread.T / k, TINY)
    sheet = np.minimum(wider[1] / (SHEET_FROM * np.maximum(wider[2], TINY)), 1)
    bent = np.maximum(wider[0] - near[0], 0) / np.maximum((wider[2] / near[2]) ** 2 - 1, TINY)
    bent = sheet * bent + (1 - sheet) * np.maximum(wider[0], 0)
    with np.errstate(divide="ignore"):
        return WIDER_BIAS * np.sqrt(np.pi * k / 4 * near[2] / bent)


def mean_over(neighbours: np.ndarray) -> csr_array:
    """The matrix that takes values to their means over the neighbours."""
    n, k = neighbours.shape
    return csr_array((np.full(neighbours.size, 1 / k), neighbours.ravel(), k * np.arange(n + 1)), shape=(n, n))
