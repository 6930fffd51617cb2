"""Which points a curve is refined by, and in which order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.groups import first_in_their_place, group_rank
from ..geometry.morton import morton_order
from .curve import Curve
from .numbers import CURVE

REFINED_POINTS = 16384  # measured: points without noise that a graph is refined by: of 65536 it takes half of the time


def surface_sample(curve: Curve) -> np.ndarray:
    """Points to refine a curve by: its surface points, or, where there are many, fewer of them, int array.

    Of every vertex there is a regular sample, so that thin parts keep all. The more of the cloud is noise, the more
    points are taken, since their mean is what is known of the surface.
    """
    rows, m = curve.surface_points, len(curve.vertices)
    clean = 1 - curve.report.noise
    if not len(rows):  # all points that have a vertex
        return np.flatnonzero(curve.vertex_of_point >= 0)
    if len(rows) * clean <= REFINED_POINTS:
        return rows
    rows = rows[morton_order(curve.points[rows])]
    vertex = curve.vertex_of_point[rows]
    count = np.bincount(vertex, minlength=m)
    most = max(REFINED_POINTS / clean / np.count_nonzero(count), 2 * CURVE.vertex_points)
    every = np.ceil(count / most).astype(int)
    return rows[group_rank(vertex, m) % every[vertex] == 0]


def along_a_morton_curve(curve: Curve, distinct: bool = False) -> np.ndarray:
    """Points that have a vertex in an order that does not depend on that in which they came, int array.

    The order would show in the last digit of sums, and where one thing is as good as another, as on grids, it decides.
    If they are to be `distinct`, there is one point of every place.
    """
    rows = np.flatnonzero(curve.vertex_of_point >= 0)
    rows = rows[first_in_their_place(curve.points[rows])] if distinct else rows
    return rows[morton_order(curve.points[rows])] if len(rows) else rows


def on_points(step: Callable[[Curve], Curve], curve: Curve, rows: np.ndarray) -> Curve:
    """What a step makes of a curve with some of its points alone, `rows` (n,), in their order; all have a vertex.

    In the result another point that had a vertex has that of its representative, or of the nearest of the rows.
    """
    others = curve.vertex_of_point >= 0
    others[rows] = False
    others = np.flatnonzero(others)
    points, vertex = curve.points[rows], curve.vertex_of_point[rows]
    result = step(
        curve.changed(
            points=points,
            normals=curve.normals[rows],
            vertex_of_point=vertex,
            representative_of_point=np.full(len(rows), -1),
        )
    )
    owner, normals = np.full(len(curve.points), -1), curve.normals.copy()
    owner[rows], normals[rows] = result.vertex_of_point, result.normals
    representative = curve.representative_of_point[others]
    unknown = (representative < 0) | (curve.vertex_of_point[representative] < 0)
    representative = np.where(unknown, others, representative)
    alone = others[representative == others]
    if len(alone):
        alone = alone[morton_order(curve.points[alone])]  # the tree is quicker with what is near in turn
        owner[alone] = result.vertex_of_point[cKDTree(points).query(curve.points[alone])[1]]
    owner[others] = owner[representative]
    normals[others[np.isnan(normals[representative, 0])]] = np.nan
    return result.changed(
        points=curve.points,
        normals=normals,
        vertex_of_point=owner,
        representative_of_point=curve.representative_of_point,
    )
