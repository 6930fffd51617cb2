"""Local thickness: how far the surface is from a vertex, also where noise has tilted the normals."""

import numpy as np

from .groups import group_median, group_sum
from .neighbourhoods import PAIRS
from .vectors import dot

ROWS, COLUMNS = np.array(PAIRS).T
TIMES = np.where(ROWS == COLUMNS, 1, 2)  # that an entry stands in a symmetric matrix


def witnesses(vertex_of_point, normals):
    """Points that have a vertex and a normal, int array."""
    return np.flatnonzero((vertex_of_point >= 0) & np.isfinite(np.einsum("ni->n", normals)))


def plane_distance_radii(vertices, vertex_of_point, points, normals, otherwise=0.0):
    """Local thickness: median distance from each vertex to the tangent planes of the points it owns.

    On the axis of a tube this is the tube's radius, however far along the axis a point lies from its vertex.

    Parameters
    ----------
    vertices : (M, 3) float array
    vertex_of_point : (N,) int array
        -1 for points that belong to no vertex.
    points, normals : (N, 3) float array
        Points without a normal (NaN) do not count.
    otherwise : (M,) float array or float
        Radius of the vertices without points.

    Returns
    -------
    (M,) float array
    """
    owned = witnesses(vertex_of_point, normals)
    owner = vertex_of_point[owned]
    offset = points[owned] - vertices[owner]
    distance = np.abs(dot(offset, normals[owned]))
    radii = group_median(distance, owner, len(vertices))
    return np.where(np.bincount(owner, minlength=len(vertices)) > 0, radii, otherwise)


def robust_radii(planes, distance, doubt, normals, owner):
    r"""Radii between the distances to the tangent planes of a vertex's points and those to the points themselves.

    The distance to the planes is exact on tubes and cones, and on a flat part it is half its thickness. But noise tilts
    normals, and the plane of a tilted normal passes nearer than its point: radii come out small, most where parts are
    thin and where they meet. The distance of the points knows no normals. Its weight is

    .. math:: \sqrt d (1 - \varphi)

    with the doubt d of `fit_axis` and :math:`\varphi = |a - b|`, the difference of the shares a + b = 1 that the two
    directions across the axis have of the squared normals: 0 around a tube, or half of one, and 1 on a sheet, where the
    distance of the points would measure its width.

    Parameters
    ----------
    planes : (M,) float array
        Distance to the planes, from `plane_distance_radii`.
    distance : (n,) float array
        Of points to the curve.
    doubt : (M,) float array
        Share of the squared distances that the normals do not explain, 0 to 1.
    normals : (n, 3) float array
    owner : (n,) int array
        The vertex of each point.

    Returns
    -------
    (M,) float array
        `planes` at vertices without points.
    """
    m = len(planes)
    count = np.bincount(owner, minlength=m)
    shares = group_sum(normals[:, ROWS] * normals[:, COLUMNS], owner, m) / np.maximum(count, 1)[:, None]
    # (a - b)^2 = 2 (a^2 + b^2) - 1
    flat = np.sqrt(np.clip(2 * shares**2 @ TIMES - 1, 0, 1))
    weight = np.where(count > 0, np.sqrt(doubt) * (1 - flat), 0)
    return (1 - weight) * planes + weight * group_median(distance, owner, m)
