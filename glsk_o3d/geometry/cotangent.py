"""The cotangent Laplacian on one-rings."""

import numpy as np
from scipy.sparse import csr_matrix

from .rings import Rings
from .vectors import TINY

WEIGHT_CAP = 1e4  # published, in both codes


def cotangent_laplacian(points: np.ndarray, rings: Rings, cap: float = WEIGHT_CAP) -> csr_matrix:
    r"""Cotangent Laplacian of points (n, 3) with one-rings, (n, n) csr_matrix (Wen et al. 2024, equations 1 and 2).

    In every fan triangle (i, j, k) the angle at k adds its cotangent to :math:`w_{ij}` and the angle at j to
    :math:`w_{ik}`; :math:`L_{ii} = -\sum_j w_{ij}`. A row whose weights sum to more than `cap` in absolute value is
    scaled down to it, as in the published codes; triangles without area add nothing. Rows sum to zero, ``L @ points``
    are the Laplacian coordinates, and the matrix is not symmetric, because rings are not mutual.

    The weight is the sum of both cotangents, without the factor 1/2: on a closed manifold mesh this matrix is ``2 *
    igl.cotmatrix(V, F)`` and ``-2 *`` the matrix of robust_laplacian.
    """
    x = np.ascontiguousarray(points.T)
    entry, after = rings.fans
    here = x.take(rings.centres[entry], axis=1)
    one, other = (x.take(rings.indices[at], axis=1) - here for at in (entry, after))
    opposite = other - one
    (a, b, c), (u, v, w) = one, other
    area = np.sqrt((b * w - c * v) ** 2 + (c * u - a * w) ** 2 + (a * v - b * u) ** 2)
    inverse = np.where(area > 0, 1 / np.maximum(area, TINY), 0)
    weight = np.zeros(len(rings.indices))
    weight[entry] = (other * opposite).sum(axis=0) * inverse  # Wen (1)
    weight[after] -= (one * opposite).sum(axis=0) * inverse
    n, centres = len(points), rings.centres
    total = np.bincount(centres, weight, n)
    scale = cap / np.maximum(np.abs(total), cap)
    # every row is its diagonal entry and then its ring
    indptr, ring, every = rings.indptr + np.arange(n + 1), np.arange(len(centres)) + centres + 1, np.arange(n)
    data, indices = np.empty(n + len(ring)), np.empty(n + len(ring), np.int32)
    data[ring], indices[ring] = weight * scale[centres], rings.indices
    data[indptr[:-1]], indices[indptr[:-1]] = -total * scale, every
    return csr_matrix((data, indices, indptr.astype(np.int32)), shape=(n, n))
