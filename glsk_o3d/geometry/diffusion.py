"""Diffusion over a surface that is known by its points."""

import numpy as np
from scipy.sparse import csr_array

from .vectors import TINY, Floats, dot

DIFFUSION_STEPS = 10  # measured: conjugate gradients, after which places along a curve stand still
LEAST_BEND = 1e-12  # derived: of what a step may gain, that is more than roundings: points in one place have none


class Diffusion:
    r"""Implicit diffusion over the links between points (n, 3) and their nearest neighbours (n, k), itself first.

    One step of backward Euler, :math:`(I + \ell^2 L) u' = u` (Desbrun et al. 1999), with the Laplacian of the links: on
    a plane their lengths have a mean square :math:`\rho^2` at every point, and :math:`L = 4 / \rho^2 (I - D^{-1} W)`
    tends to :math:`-\Delta` as points grow. What varies over less than the length :math:`\ell` is smoothed.
    """

    def __init__(self, points: np.ndarray, neighbours: np.ndarray) -> None:
        n, k = neighbours.shape
        row, column = np.repeat(np.arange(n), k - 1), neighbours[:, 1:].ravel()
        links = csr_array((np.full(len(row), 0.5), column, (k - 1) * np.arange(n + 1)), shape=(n, n))
        self._links = (links + links.T).tocsr()
        offset = points.take(row, axis=0) - points.take(column, axis=0)
        squared = dot(offset, offset) / 2
        squared = np.bincount(row, squared, n) + np.bincount(column, squared, n)
        self._degree = np.asarray(self._links.sum(axis=1)).ravel()
        self._stiffness = squared / 4  # degree times mean square, over 4

    def __call__(self, values: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Diffuse `values` (n, c) over a `length` (n,) of each point, by conjugate gradients from the values on."""
        # over less than a thousandth of its links a value stays what it is
        hold = self._stiffness / np.maximum(length**2, 1e-6 * np.maximum(self._stiffness, TINY))
        # as wide as the values: NumPy is slow at stretching columns
        diagonal = np.maximum(hold + self._degree, TINY).repeat(values.shape[1]).reshape(values.shape)
        mean: Floats = values.mean(axis=0)  # what is far from the origin would lose digits
        x: Floats = values - mean
        residual, inverse = self._links @ x - self._degree[:, None] * x, 1 / diagonal
        ahead = residual * inverse
        size = np.einsum("nc,nc->", residual, ahead)  # of all columns: those of positions turn with them
        for _ in range(DIFFUSION_STEPS):
            curved = diagonal * ahead - self._links @ ahead
            bend = np.einsum("nc,nc->", ahead, curved)
            if not bend > LEAST_BEND * size:
                break
            share = size / bend
            residual -= share * curved
            x += share * ahead
            step = residual * inverse
            before, size = size, np.einsum("nc,nc->", residual, step)
            ahead = step + size / before * ahead
        return x + mean
