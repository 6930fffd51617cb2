"""Denoiser: points -> averaged where there are plenty, and noisy ones drawn to the ridge of their density."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..curve.numbers import CURVE
from ..data.points import POINTS, Points, default_k
from ..geometry.eigen import main_direction
from ..geometry.frame import MIN_POINTS
from ..geometry.groups import group_sum
from ..geometry.neighbourhoods import (
    local_outlier_ratio,
    mean_distances,
    nearest_left,
    nearest_moved,
    nearest_neighbours,
)
from ..geometry.numbers import fitted, speed
from ..geometry.pairing import Pairs, merge_pairs
from ..geometry.vectors import PAIRS
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@dataclass(frozen=True)
class DenoiserNumbers:
    """Numbers of the Denoiser."""

    chunk: int = speed(1024, "points at a time: their work arrays then stay in the cache")
    most_in_one: int = fitted(4, "noisy points that are averaged in a pass")
    merge_worth: float = fitted(0.01, "share of the points that another round of a pass must merge")
    outlier_ratio: float = fitted(1.8, "local outlier ratio of a denoised outlier")


DENOISER = DenoiserNumbers()


@documented
@dataclass(frozen=True, kw_only=True)
class Denoiser(Filter[Points, Points]):
    """Average dense noisy points, then move noisy points to the ridge of their density.

    A neighbourhood narrower than the noise is a ball and does not show the surface. The mean of several points has less
    noise. Isolated points on a ridge are outliers.

    References
    ----------
    Ozertem and Erdogmus 2011, Locally defined principal curves and surfaces.

    Examples
    --------
    >>> from glsk_o3d import Sampler
    >>> from glsk_o3d.samples import tube
    >>> noisy = Sampler()(tube(800, radius=0.1, noise=0.04).points)
    >>> bool(Denoiser()(noisy).spread[:, 0].mean() < noisy.spread[:, 0].mean())
    True
    """

    denoise: int = parameter(
        4,
        "Passes that draw the points of noisy neighbourhoods to the ridge of their density. 0 leaves all as it is.",
        unit="passes",
        low=0,
    )

    def run(self, points: Points, context: RunContext) -> Points:
        if not self.denoise:
            return points
        points.check_not_thinned(self)
        return to_ridges(averaged(points), self.denoise)


def averaged(points: Points) -> Points:
    """Points with means in the place of noisy ones, while there are plenty of these."""
    while np.count_nonzero(points.noise) >= 2 * CURVE.enough_points:
        row, mean, weight = average_noisy(
            points.cloud, points.neighbours, points.noise, points.weight, CURVE.enough_points
        )
        neighbours = nearest_neighbours(mean, default_k(len(mean)))[1]
        points = points.with_rows(row, mean, neighbours, weight=weight, merged=np.bincount(row, points.merged))
        if 2 * len(mean) > len(row):
            break
    return points


def to_ridges(points: Points, passes: int) -> Points:
    """Noisy points drawn to the ridges of their density, without those that then are outliers.

    The points keep the normals that they came with, since a ridge has none.
    """
    if not points.noise.any():
        return points
    denoised = subspace_mean_shift(points.cloud, points.noise, passes, points.weight)
    k = points.neighbours.shape[1]
    neighbours = nearest_moved(denoised, points.neighbours, points.noise > 0)
    mean_distance = mean_distances(denoised, neighbours)
    outlier = (local_outlier_ratio(mean_distance, neighbours) > DENOISER.outlier_ratio) & (points.noise > 0)
    if outlier.sum() > len(denoised) - max(k, MIN_POINTS):  # too few would be left
        outlier[:] = False
    remaining, row = np.flatnonzero(~outlier), np.cumsum(~outlier) - 1
    if len(remaining) < len(denoised):
        row[outlier] = cKDTree(denoised[remaining]).query(denoised[outlier])[1]
        denoised, neighbours = denoised[remaining], nearest_left(denoised, neighbours, ~outlier, k)
        points = replace(points, map=points.map.set_aside(outlier))
    kept = {name: getattr(points, name)[remaining] for name in ("weight", "merged", "noise", "normals")}
    return points.with_rows(row, denoised, neighbours, **kept)


def average_noisy(
    points: np.ndarray, neighbours: np.ndarray, noise: np.ndarray, weight: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Put the mean of at most four points in their place where there is noise, but keep about n of them or more.

    A neighbourhood that is narrower than the noise is a ball, wherever the surface is. The mean of m points has less
    noise, and its neighbourhood is wider. Returns the mean that each point is in, (m,) int array, the means (c, 3),
    and their `weight` (c,), the sum of that of their points (m,).
    """
    most = np.where(noise > 0, min(DENOISER.most_in_one, np.count_nonzero(noise) / n), 1)

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        fine = mass[kept] + mass[swallowed] <= np.minimum(most[kept], most[swallowed])
        worth_it = np.count_nonzero(fine) >= DENOISER.merge_worth * len(points)
        return kept[fine & worth_it], swallowed[fine & worth_it]

    representative = merge_pairs(points, neighbours, choose, most)
    representative = (np.cumsum(representative == np.arange(len(representative))) - 1)[representative]
    total = np.bincount(representative, weight)
    return representative, group_sum(weight[:, None] * points, representative, len(total)) / total[:, None], total


def subspace_mean_shift(
    points: np.ndarray, noise: np.ndarray, passes: int, weight: np.ndarray | None = None
) -> np.ndarray:
    """Move points with noisy neighbourhoods to the ridge of the density, (n, 3) float array; clean points stay.

    Mean shift across the main direction of the neighbourhood (subspace-constrained mean shift, Ozertem and Erdogmus
    2011): along it, points would clump. Neighbours are those of the noisy cloud, weighted by a Gaussian whose variance
    is their mean squared distance, and by `weight` (n,). The `noise` (n,) of a point, see `noise_share`, is the share
    of each step that is taken.
    """
    noisy = np.flatnonzero(noise)
    if passes == 0 or len(noisy) == 0:
        return points
    weight = np.ones(len(points)) if weight is None else weight
    moved, coordinates = points.copy(), np.ascontiguousarray(points.T)
    around = nearest_neighbours(points, min(POINTS.ridge_neighbours, len(points)), of=points[noisy])[1]
    for start in range(0, len(noisy), DENOISER.chunk):
        part = slice(start, start + DENOISER.chunk)
        patch, mass = coordinates.take(around[part], axis=1), weight.take(around[part])
        step, x = noise[noisy[part]], coordinates[:, noisy[part]]
        for _ in range(passes):
            offset = patch - x[:, :, None]
            squared = (offset * offset).sum(axis=0)
            kernel = mass * np.exp(squared / (-2 * squared.mean(axis=1, keepdims=True)))
            kernel /= kernel.sum(axis=1, keepdims=True)
            heavy = kernel * offset
            shift = heavy.sum(axis=2)
            spread = [np.einsum("nk,nk->n", heavy[i], offset[j]) - shift[i] * shift[j] for i, j in PAIRS]
            along = main_direction(np.stack(spread)).T
            shift -= (shift * along).sum(axis=0) * along
            x = x + step * shift
        moved[noisy[part]] = x.T
    return moved
