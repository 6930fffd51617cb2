"""Local radius: how far the surface is from a vertex, also where noise has tilted the normals."""

import numpy as np

from .groups import group_median, group_sum
from .vectors import COLUMNS, ROWS, Floats, dot, finite_rows

TIMES = np.where(ROWS == COLUMNS, 1, 2)  # that an entry stands in a symmetric matrix


def supporting_points(vertex_of_point: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Points that have a vertex and a normal, int array."""
    return np.flatnonzero((vertex_of_point >= 0) & finite_rows(normals))


def plane_distance_radii(
    vertices: np.ndarray,
    vertex_of_point: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    otherwise: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Local radius: median distance from each vertex to the tangent planes of the points it owns, (M,) float array.

    On the axis of a tube this is the tube's radius, however far along the axis a point lies from its vertex. Points
    without a vertex (-1) or a normal (NaN) do not count; vertices without points have the radius `otherwise`.
    """
    supporting = supporting_points(vertex_of_point, normals)
    vertex = vertex_of_point[supporting]
    distance = np.abs(dot(points[supporting] - vertices[vertex], normals[supporting]))
    radii = group_median(distance, vertex, len(vertices))
    return np.where(np.bincount(vertex, minlength=len(vertices)) > 0, radii, otherwise)


def robust_radii(
    planes: Floats, distance: np.ndarray, doubt: np.ndarray, normals: np.ndarray, vertex: np.ndarray
) -> np.ndarray:
    r"""Radii between the distances to the tangent planes of a vertex's points and those to the points themselves, (M,).

    The distance to the planes is exact on tubes and cones, and on a flat part it is half its thickness. But noise tilts
    normals, and the plane of a tilted normal passes nearer than its point: radii come out small, most where parts are
    thin and where they meet. The `distance` (n,) of the points from the curve knows no normals. Its weight is
    :math:`\sqrt d (1 - \varphi)`, with the `doubt` d (M,) of `fit_axis` and :math:`\varphi = |a - b|`, the difference
    of the shares a + b = 1 that the two directions across the axis have of the squared normals: 0 around a tube, or
    half of one, and 1 on a sheet, where it would measure the width. Vertices without points keep their `planes` (M,).
    """
    m = len(planes)
    count = np.bincount(vertex, minlength=m)
    shares = group_sum(normals[:, ROWS] * normals[:, COLUMNS], vertex, m) / np.maximum(count, 1)[:, None]
    flat = np.sqrt(np.clip(2 * shares**2 @ TIMES - 1, 0, 1))  # (a - b)^2 = 2 (a^2 + b^2) - 1
    weight: Floats = np.where(count > 0, np.sqrt(doubt) * (1 - flat), 0)
    return (1 - weight) * planes + weight * group_median(distance, vertex, m)
