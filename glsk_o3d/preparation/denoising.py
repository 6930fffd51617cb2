"""Denoise a surface: average points where there are plenty, and draw noisy ones to the ridge of their density."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..numerics.eigen import main_direction
from ..numerics.groups import group_sum
from ..numerics.neighbourhoods import local_outlier_ratio, nearest_left, nearest_moved, nearest_neighbours, principal
from ..numerics.pairing import Pairs, merge_pairs
from ..numerics.vectors import PAIRS
from .frame import MIN_POINTS
from .surface import STEADY_SHARE, Surface

RIDGE_NEIGHBOURS = 32  # fitted: among which a ridge is sought: more than for rings, a noisy shell is thick
RIDGE_CHUNK = 1024  # speed: points at a time: the (3, points, 32) work arrays then stay in the cache
MOST_IN_ONE = 4  # fitted: noisy points that are averaged in a pass
MERGE_WORTH = 0.01  # fitted: share of the points that another round of a pass must merge
ENOUGH_NOISY = 4096  # fitted: noisy points that are enough; down to about so many they are averaged
DENOISED_RATIO, DENOISED_NOISE = 1.8, 0.2  # fitted: local outlier ratio of a denoised outlier, and its least noise


def average_noise(surface: Surface, k: Callable[[int], int]) -> Surface:
    """Put means in the place of noisy points while there are plenty; of n points `k(n)` neighbours are looked up."""
    while np.count_nonzero(surface.noise) >= 2 * ENOUGH_NOISY:
        representative, mean, weight = average_noisy(
            surface.points, surface.neighbours, surface.noise, surface.weight, ENOUGH_NOISY
        )
        if len(mean) > STEADY_SHARE * len(representative):
            break
        neighbours = nearest_neighbours(mean, k(len(mean)))[1]
        merged = np.bincount(representative, surface.merged)
        of_sample = representative[surface.representative]
        surface = Surface.measured(surface.frame, mean, neighbours, weight, merged, of_sample, surface.outlier)
    return surface


def denoise(surface: Surface, passes: int, set_aside: bool) -> Surface:
    """Draw noisy points to the ridges of their density, and set aside those that then are outliers, if `set_aside`.

    The surface keeps the normals that it came with, since a ridge has none.
    """
    if not (passes and surface.noise.any()):
        return surface
    denoised = subspace_mean_shift(surface.points, surface.noise, passes, surface.weight)
    k, outlier = surface.neighbours.shape[1], np.zeros(len(denoised), bool)
    neighbours = nearest_moved(denoised, surface.neighbours, surface.noise > 0)
    away = denoised[neighbours[:, 1:]] - denoised[:, None]
    mean_distance = np.sqrt(np.einsum("nki,nki->nk", away, away)).mean(axis=1)
    found = local_outlier_ratio(mean_distance, neighbours) > DENOISED_RATIO
    found &= (surface.noise > DENOISED_NOISE) & set_aside
    if 0 < found.sum() <= len(denoised) - max(k, MIN_POINTS):
        outlier = found
    left, representative = np.flatnonzero(~outlier), np.cumsum(~outlier) - 1
    if len(left) < len(denoised):
        representative[outlier] = cKDTree(denoised[left]).query(denoised[outlier])[1]
        denoised, neighbours = denoised[left], nearest_left(denoised, neighbours, ~outlier, k)
    spread, ring_normals = principal(denoised, neighbours)
    return replace(
        surface,
        points=denoised,
        neighbours=neighbours,
        weight=surface.weight[left],
        merged=surface.merged[left],
        noise=surface.noise[left],
        normals=surface.normals[left],
        spread=spread,
        ring_normals=ring_normals,
        representative=representative[surface.representative],
        outlier=surface.outlier | outlier[surface.representative],
    )


def average_noisy(
    points: np.ndarray, neighbours: np.ndarray, noise: np.ndarray, weight: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Put the mean of at most four points in their place where there is noise, but keep about n of them or more.

    A neighbourhood that is narrower than the noise is a ball, wherever the surface is. The mean of m points has less
    noise, and its neighbourhood is wider. Returns the mean that each point is in, (m,) int array, the means (c, 3),
    and their `weight` (c,), the sum of that of their points (m,).
    """
    most = np.where(noise > 0, min(MOST_IN_ONE, np.count_nonzero(noise) / n), 1)

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        fine = mass[kept] + mass[swallowed] <= np.minimum(most[kept], most[swallowed])
        worth_it = np.count_nonzero(fine) >= MERGE_WORTH * len(points)
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
    around = nearest_neighbours(points, min(RIDGE_NEIGHBOURS, len(points)), of=points[noisy])[1]
    for start in range(0, len(noisy), RIDGE_CHUNK):
        part = slice(start, start + RIDGE_CHUNK)
        patch, mass = coordinates.take(around[part], axis=1), weight.take(around[part])
        step, x = noise[noisy[part]], coordinates[:, noisy[part]]
        for _ in range(passes):
            apart = patch - x[:, :, None]
            squared = (apart * apart).sum(axis=0)
            kernel = mass * np.exp(squared / (-2 * squared.mean(axis=1, keepdims=True)))
            kernel /= kernel.sum(axis=1, keepdims=True)
            heavy = kernel * apart
            shift = heavy.sum(axis=2)
            spread = [np.einsum("nk,nk->n", heavy[i], apart[j]) - shift[i] * shift[j] for i, j in PAIRS]
            along = main_direction(np.stack(spread)).T
            shift -= (shift * along).sum(axis=0) * along
            x = x + step * shift
        moved[noisy[part]] = x.T
    return moved
