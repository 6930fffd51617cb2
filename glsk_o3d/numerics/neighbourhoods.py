"""Nearest neighbours and the tangent planes they span."""

import numpy as np
from scipy.spatial import cKDTree

_CHUNK = 16384


def nearest_neighbours(points, k):
    """The k nearest points of every point, itself among them.

    Parameters
    ----------
    points : (n, 3) float array
    k : int

    Returns
    -------
    distance : (n, k) float array
    neighbour : (n, k) int array
        Nearest first.
    """
    # One worker: SciPy's threads outlive their arrays when they are interrupted, and crash the process.
    return cKDTree(points).query(points, k)


def isolation(distance, neighbours):
    """How much farther a point is from its neighbours than these are from theirs (after Breunig et al. 2000, LOF).

    Near 1 on a surface, whatever its density; an outlier has more.

    Parameters
    ----------
    distance : (n, k) float array
    neighbours : (n, k) int array
        As from `nearest_neighbours`.

    Returns
    -------
    (n,) float array
    """
    mean = distance[:, 1:].mean(axis=1)
    return mean / np.median(mean[neighbours[:, 1:]], axis=1)


def tangent_planes(points, neighbours):
    """Principal axes of every neighbourhood.

    Parameters
    ----------
    points : (n, 3) float array
    neighbours : (n, k) int array

    Returns
    -------
    axes : (n, 3, 3) float array
        Orthonormal columns, least variance first: column 0 is the normal, columns 1 and 2 span the tangent plane.
    """
    axes = np.empty((len(points), 3, 3))
    for start in range(0, len(points), _CHUNK):
        part = slice(start, start + _CHUNK)
        patch = points[neighbours[part]]
        patch -= patch.mean(axis=1, keepdims=True)
        axes[part] = np.linalg.eigh(np.matmul(patch.transpose(0, 2, 1), patch))[1]
    return axes


def plane_axes(normals):
    """Two orthonormal axes perpendicular to each normal (Duff et al. 2017, "Building an orthonormal basis, revisited").

    Parameters
    ----------
    normals : (n, 3) float array
        Unit vectors.

    Returns
    -------
    (n, 3, 2) float array
    """
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([first, second], axis=2)
