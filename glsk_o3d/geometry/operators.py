"""A Laplacian with the areas of its places: what it makes of functions, and its eigenvalues."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import LinearOperator

from .cotangent import cotangent_laplacian
from .rings import Rings
from .solver import factorised
from .vectors import TINY, dot, norm

N_EIGENVALUES = 50  # precision: of the smallest; they know the shape down to a seventh of its size
LEAST_AREA = 0.1  # fitted: of a point, over a third of its fan
EIGENVALUE_TOLERANCE = 1e-6  # precision: relative


class Operator(NamedTuple):
    """A Laplacian of n places (n, 3): negative semi-definite, with half cotangents, and the area of each place (n,)."""

    places: np.ndarray
    laplacian: Any
    area: np.ndarray


def ring_operator(points: np.ndarray, rings: Rings) -> Operator:
    """The Laplacian that contracts points (n, 3), over the Voronoi areas of their rings (Meyer et al. 2003).

    Such areas tile the surface although rings are not mutual, and cocircular neighbours may be left out of them; thirds
    of fan triangles would not. Where triangles are obtuse, an area is at most that of the fan, and not nothing.
    """
    laplacian = cotangent_laplacian(points, rings) / 2
    a, b, c = points[rings.triangles].transpose(1, 0, 2)
    third = np.bincount(rings.triangles[:, 0], norm(np.cross(b - a, c - a)) / 6, len(points))
    entries = laplacian.tocoo()
    way = points[entries.row] - points[entries.col]
    voronoi = np.bincount(entries.row, entries.data * dot(way, way), len(points)) / 4
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
    """The smallest eigenvalues of ``-L f = l M f``, ascending, by `scipy.sparse.linalg.eigsh` or `eigs`.

    Rings are not mutual, so that their Laplacian is not symmetric: `eigs`, whose real parts count.
    """
    n, mass = len(operator.area), diags_array(operator.area).tocsc()
    matrix, shift = -operator.laplacian.tocsc(), -1 / operator.area.sum()
    inverse = LinearOperator((n, n), factorised(matrix - shift * mass).solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(n)
    asked = dict(k=min(count, n // 4), M=mass, sigma=shift, OPinv=inverse, v0=start, tol=EIGENVALUE_TOLERANCE)
    return np.sort(solver(matrix, **asked, return_eigenvectors=False).real)
