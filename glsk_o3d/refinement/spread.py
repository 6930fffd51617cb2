"""How far points scatter around a curve."""

from __future__ import annotations

import numpy as np

from ..numerics.groups import group_median
from ..numerics.near_links import linked, steps
from ..numerics.nearest_edges import incident_edges, nearest_on_edges
from ..numerics.vectors import norm
from ..skeleton import Skeleton


def spread_around(skeleton: Skeleton) -> np.ndarray:
    """Median distance from the curve to the points around every vertex and its neighbours, (M,) float array.

    Of points on a tube its radius, and outliers have little say.
    """
    m, edges = len(skeleton.vertices), skeleton.edges
    some = np.flatnonzero(skeleton.vertex_of_point >= 0)
    vertex, points = skeleton.vertex_of_point[some], skeleton.points[some]
    edge, t = nearest_on_edges(skeleton.vertices, edges, incident_edges(edges, m)[vertex], points)
    start, stop = skeleton.vertices[edges[edge]].transpose(1, 0, 2)
    away = norm(points - start - t[:, None] * (stop - start))
    around = steps(linked(skeleton.vertices, edges))[vertex]
    return group_median(np.repeat(away, np.diff(around.indptr)), around.indices, m)
