"""Eigenvalues of many symmetric 3 x 3 matrices in closed form (Smith 1961), and the directions of the outer ones.

The matrices are a (6, n) array of their entries xx, xy, xz, yy, yz, zz: sums over many then run along the memory.
"""

import numpy as np

from .vectors import FULL, TINY, unit

# precision: distance of two eigenvalues over their spread, below which the closed form is not exact enough
EIGENVALUES_APART = 1e-3


def principal_parts(entries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues, (3, n) ascending, and unit eigenvectors of the least, (n, 3): any of them if it is multiple."""
    mean, size, shape = _reduced(entries)
    least, most = _outer(shape)
    return mean + size * np.stack([least, -least - most, most]), _direction(shape, least, 0)


def largest_eigenvalue(entries: np.ndarray) -> np.ndarray:
    """Largest eigenvalue of each matrix, (n,)."""
    mean, size, shape = _reduced(entries)
    return mean + size * _outer(shape)[1]


def main_direction(entries: np.ndarray) -> np.ndarray:
    """Unit eigenvector of the largest eigenvalue of each matrix, (n, 3): any of them if it is multiple."""
    shape = _reduced(entries)[2]
    return _direction(shape, _outer(shape)[1], 2)


def _reduced(entries: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean of the eigenvalues, and size and shape of what deviates from it; the shape's eigenvalues are -2 to 2."""
    a, b, c, d, e, f = entries
    mean = (a + d + f) / 3
    shape = np.stack([a - mean, b, c, d - mean, e, f - mean])
    a, b, c, d, e, f = shape
    size = np.sqrt((a * a + d * d + f * f + 2 * (b * b + c * c + e * e)) / 6)
    shape /= np.maximum(size, TINY)
    return mean, size, shape


def _outer(shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest eigenvalue of a shape."""
    a, b, c, d, e, f = shape
    half = (a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)) / 2  # of the determinant
    angle = np.arccos(np.clip(half, -1, 1)) / 3
    return 2 * np.cos(angle + 2 * np.pi / 3), 2 * np.cos(angle)


def _direction(shape: np.ndarray, value: np.ndarray, which: int) -> np.ndarray:
    """Unit eigenvectors of these eigenvalues; by NumPy where the eigenvalue hardly stands out."""
    a, b, c, d, e, f = shape[0] - value, shape[1], shape[2], shape[3] - value, shape[4], shape[5] - value
    # The adjugate of a matrix of rank two is a multiple of v v^T: take its longest column.
    adjugate = np.stack([d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b])
    diagonal = adjugate[[0, 3, 5]]
    longest = np.argmax(diagonal, axis=0)
    vectors = unit(adjugate.T[np.arange(len(longest))[:, None], FULL[longest]])
    # its trace is the product of the distances to the two other eigenvalues
    unclear = np.flatnonzero(diagonal.sum(axis=0) < 3 * EIGENVALUES_APART)
    if len(unclear):
        vectors[unclear] = np.linalg.eigh(shape.T[unclear][:, FULL])[1][:, :, which]
    return vectors
