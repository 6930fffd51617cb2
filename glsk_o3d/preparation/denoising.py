"""Draw noisy points to the ridges of their density."""

import numpy as np

from ..numerics.eigen import main_direction
from ..numerics.neighbourhoods import PAIRS, fullness, nearest_neighbours
from ..numerics.vectors import dot

NEIGHBOURS = 32  # among which a ridge is sought: more than for rings, a noisy shell is thick
CLEAN, NOISY = 0.2, 0.35  # scatter of clean neighbourhoods at most, and of nothing but noise
_CHUNK = 16384


def noise_share(spread, neighbours):
    """How far the neighbourhoods of a cloud are noise, from 0 to 1.

    That is how much they fill space: the least over the largest principal spread, smoothed by the median, is near 0 on
    a surface and along a curve, however dense, and 1 in a ball of noise (Demantke et al. 2011, "Dimensionality based
    scale selection in 3D lidar point clouds"); from CLEAN to NOISY it is mapped to 0 to 1.

    Parameters
    ----------
    spread : (n, 3) float array
        As from `principal`.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) float array
    """
    return np.clip((fullness(spread, neighbours) - CLEAN) / (NOISY - CLEAN), 0, 1)


def to_ridges(points, noise, passes, weight=None):
    """Move points with noisy neighbourhoods to the ridge of the density; clean points stay.

    Mean shift across the main direction of the neighbourhood (subspace-constrained mean shift, Ozertem and Erdogmus
    2011): along it, points would clump. Neighbours are those of the noisy cloud, weighted by a Gaussian whose variance
    is their mean squared distance.

    Parameters
    ----------
    points : (n, 3) float array
    noise : (n,) float array
        As from `noise_share`: the share of each step that is taken.
    passes : int
    weight : (n,) float array, optional
        Points that each stands for; one by default.

    Returns
    -------
    (n, 3) float array
    """
    noisy = np.flatnonzero(noise)
    if passes == 0 or len(noisy) == 0:
        return points
    weight = np.ones(len(points)) if weight is None else weight
    moved = points.copy()
    around = nearest_neighbours(points, min(NEIGHBOURS, len(points)), of=points[noisy])[1]
    for start in range(0, len(noisy), _CHUNK):
        part = slice(start, start + _CHUNK)
        patch, mass = points.take(around[part], axis=0), weight.take(around[part])
        step, x = noise[noisy[part], None], points[noisy[part]]
        for _ in range(passes):
            apart = patch - x[:, None]
            squared = np.einsum("nki,nki->nk", apart, apart)
            kernel = mass * np.exp(-squared / (2 * squared.mean(axis=1, keepdims=True)))
            kernel /= kernel.sum(axis=1, keepdims=True)
            mean = np.matmul(kernel[:, None], patch)[:, 0]
            offset = patch - mean[:, None]
            spread = np.matmul((kernel[:, :, None] * offset).transpose(0, 2, 1), offset)
            along = main_direction(np.stack([spread[:, i, j] for i, j in PAIRS]))
            shift = mean - x
            shift -= dot(shift, along)[:, None] * along
            x = x + step * shift
        moved[noisy[part]] = x
    return moved
