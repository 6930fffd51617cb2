"""The cotangent Laplacian on one-rings."""

import numpy as np
from scipy.sparse import csr_matrix

WEIGHT_CAP = 1e4


def cotangent_laplacian(points, rings, cap=WEIGHT_CAP):
    r"""Cotangent Laplacian of a point cloud with one-rings (Wen et al. 2024, equations 1 and 2).

    In every fan triangle (i, j, k) the angle at k adds its cotangent to :math:`w_{ij}` and the angle at j adds its
    cotangent to :math:`w_{ik}`; :math:`L_{ii} = -\sum_j w_{ij}`.

    Parameters
    ----------
    points : (n, 3) float array
    rings : Rings
    cap : float
        A row whose weights sum to more than this, in absolute value, is scaled down to it, as in the published codes.

    Returns
    -------
    (n, n) csr_matrix
        Rows sum to zero; ``L @ points`` are the Laplacian coordinates. Not symmetric, because rings are not mutual.

    Notes
    -----
    The weight is the sum of both cotangents, without the factor 1/2: on a closed manifold mesh this matrix is
    ``2 * igl.cotmatrix(V, F)`` and ``-2 *`` the matrix of robust_laplacian. Triangles without area add nothing.
    """
    i, j, k = rings.triangles.T
    n = len(points)
    weight = np.concatenate([_cotangent(points, k, i, j), _cotangent(points, j, i, k)])
    row, column = np.concatenate([i, i]), np.concatenate([j, k])
    total = np.bincount(row, weight, n)
    scale = cap / np.maximum(np.abs(total), cap)
    diagonal = np.arange(n)
    return csr_matrix(
        (
            np.concatenate([weight * scale[row], -total * scale]),
            (np.concatenate([row, diagonal]), np.concatenate([column, diagonal])),
        ),
        shape=(n, n),
    )


def _cotangent(points, apex, a, b):
    """Cotangent of the angle at `apex` between `a` and `b`."""
    u, v = points[a] - points[apex], points[b] - points[apex]
    dot = np.einsum("ij,ij->i", u, v)
    area = np.linalg.norm(np.cross(u, v), axis=1)
    return np.divide(dot, area, out=np.zeros_like(dot), where=area > 0)
