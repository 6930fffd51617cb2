"""Draw noisy points to the ridges of their density."""

import numpy as np

from .neighbourhoods import nearest_neighbours

NEIGHBOURS = 32  # among which a ridge is sought: more than for rings, a noisy shell is thick
CLEAN, NOISY = 0.2, 0.35  # scatter below which a point stays, and from which on it moves all the way
_CHUNK = 16384


def scatter(spread, neighbours):
    """How much neighbourhoods fill space: least over largest principal spread, smoothed by the median.

    Near 0 on a surface and along a curve, however dense; 1 in a ball of noise (Demantke et al. 2011, "Dimensionality
    based scale selection in 3D lidar point clouds").

    Parameters
    ----------
    spread : (n, 3) float array
        As from `principal`.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) float array
    """
    ratio = spread[:, 0] / np.maximum(spread[:, 2], np.finfo(float).tiny)
    return np.median(ratio[neighbours], axis=1)


def to_ridges(points, noise, passes):
    """Move points with noisy neighbourhoods to the ridge of the density; clean points stay.

    Mean shift across the main direction of the neighbourhood (subspace-constrained mean shift, Ozertem and Erdogmus
    2011): along it, points would clump. Neighbours are those of the noisy cloud, weighted by a Gaussian whose variance
    is their mean squared distance.

    Parameters
    ----------
    points : (n, 3) float array
    noise : (n,) float array
        As from `scatter`.
    passes : int

    Returns
    -------
    (n, 3) float array
    """
    weight = np.clip((noise - CLEAN) / (NOISY - CLEAN), 0, 1)
    noisy = np.flatnonzero(weight)
    if passes == 0 or len(noisy) == 0:
        return points
    moved = points.copy()
    around = nearest_neighbours(points, min(NEIGHBOURS, len(points)), of=points[noisy])[1]
    for start in range(0, len(noisy), _CHUNK):
        part = slice(start, start + _CHUNK)
        patch, step, x = points[around[part]], weight[noisy[part], None], points[noisy[part]]
        for _ in range(passes):
            squared = ((patch - x[:, None]) ** 2).sum(axis=2)
            kernel = np.exp(-squared / (2 * squared.mean(axis=1, keepdims=True)))
            kernel /= kernel.sum(axis=1, keepdims=True)
            mean = np.einsum("nk,nki->ni", kernel, patch)
            offset = patch - mean[:, None]
            along = np.linalg.eigh(np.matmul((kernel[:, :, None] * offset).transpose(0, 2, 1), offset))[1][:, :, 2]
            shift = mean - x
            shift -= np.einsum("ni,ni->n", shift, along)[:, None] * along
            x = x + step * shift
        moved[noisy[part]] = x
    return moved
