"""The cotangent Laplacian on one-rings: its matrix, and with areas what it maps functions to and its eigenvalues."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.linalg import LinearOperator

from .rings import Rings
from .solver import factorised
from .vectors import TINY, dot, norm

WEIGHT_CAP = 1e4  # published, in both codes
N_EIGENVALUES = 50  # precision: of the smallest; they know the shape down to a seventh of its size
LEAST_AREA = 0.1  # fitted: of a point, over a third of its fan
EIGENVALUE_TOLERANCE = 1e-6  # precision: relative


def cotangent_laplacian(points: np.ndarray, rings: Rings, cap: float = WEIGHT_CAP) -> csr_matrix:
    r"""Cotangent Laplacian of points (n, 3) with one-rings, (n, n) csr_matrix (Wen et al. 2024, equations 1 and 2).

    In every fan triangle (i, j, k) the angle at k adds its cotangent to :math:`w_{ij}` and the angle at j to
    :math:`w_{ik}`; :math:`L_{ii} = -\sum_j w_{ij}`. Weights are sums of both cotangents, without the factor 1/2: on a
    closed manifold mesh this is ``2 * igl.cotmatrix(V, F)`` and ``-2 *`` the matrix of robust_laplacian. A row whose
    weights sum to more than `cap` in absolute value is scaled down to it, as in the published codes; triangles without
    area add nothing. The matrix is not symmetric, because rings are not mutual.
    """
    x = np.ascontiguousarray(points.T)
    entry, after = rings.fans
    centre = x.take(rings.centres[entry], axis=1)
    one, other = (x.take(rings.indices[rows], axis=1) - centre for rows in (entry, after))
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
    indptr, ring = rings.indptr + np.arange(n + 1), np.arange(len(centres)) + centres + 1
    data, indices = np.empty(n + len(ring)), np.empty(n + len(ring), np.int32)
    data[ring], indices[ring] = weight * scale[centres], rings.indices
    data[indptr[:-1]], indices[indptr[:-1]] = -total * scale, np.arange(n)
    return csr_matrix((data, indices, indptr.astype(np.int32)), shape=(n, n))


class Operator(NamedTuple):
    """A Laplacian of n places, negative semi-definite with half cotangents, and the area of each place."""

    places: np.ndarray  # (n, 3)
    laplacian: Any  # (n, n) sparse
    area: np.ndarray  # (n,)


def ring_operator(points: np.ndarray, rings: Rings) -> Operator:
    """The Laplacian that contracts points (n, 3), over the Voronoi areas of their rings (Meyer et al. 2003).

    These tile the surface, although rings are not mutual. With obtuse triangles they are a tenth to thrice of a third
    of the fan.
    """
    laplacian = cotangent_laplacian(points, rings) / 2
    a, b, c = points[rings.triangles].transpose(1, 0, 2)
    third = np.bincount(rings.triangles[:, 0], norm(np.cross(b - a, c - a)) / 6, len(points))
    entries = laplacian.tocoo()
    edge = points[entries.row] - points[entries.col]
    voronoi = np.bincount(entries.row, entries.data * dot(edge, edge), len(points)) / 4
    return Operator(points, laplacian, np.maximum(np.clip(voronoi, LEAST_AREA * third, 3 * third), TINY))


def mapped(operator: Operator, values: np.ndarray, length: float) -> np.ndarray:
    """What an operator makes of values (n, c), averaged over a length: ``(u - f) / l^2`` of ``(M - l^2 L) u = M f``.

    Of the places it is the mean curvature vector, whose length is the sum of both principal curvatures; the solution is
    an implicit step of mean curvature flow (Desbrun et al. 1999), which is what the contraction is made of.
    """
    system = (diags_array(operator.area) - length**2 * operator.laplacian).tocsc()
    moved: np.ndarray = factorised(system).solve(operator.area[:, None] * values) - values
    return moved / length**2


def eigenvalues(operator: Operator, solver: Callable[..., Any], count: int = N_EIGENVALUES) -> np.ndarray:
    """The smallest eigenvalues of ``-L f = l M f``, ascending, by `scipy.sparse.linalg.eigsh`, or `eigs` for rings."""
    n, mass = len(operator.area), diags_array(operator.area).tocsc()
    matrix, shift = -operator.laplacian.tocsc(), -1 / operator.area.sum()
    inverse = LinearOperator((n, n), factorised(matrix - shift * mass).solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(n)
    options = dict(k=min(count, n // 4), M=mass, sigma=shift, OPinv=inverse, v0=start, tol=EIGENVALUE_TOLERANCE)
    return np.sort(solver(matrix, **options, return_eigenvectors=False).real)
