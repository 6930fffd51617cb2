"""How far points scatter around a curve."""

from __future__ import annotations

import numpy as np

from ..numerics.groups import group_sum
from ..numerics.vectors import dot
from ..skeleton import Skeleton
from .axis_fit import incident_edges, nearest_on_edges


def spread_around(skeleton: Skeleton) -> np.ndarray:
    """Root mean square distance from the curve to the points around every vertex and its neighbours, (M,) float array.

    Of points on a tube its radius, however few they are, or noisy.
    """
    m, edges = len(skeleton.vertices), skeleton.edges
    some = np.flatnonzero(skeleton.vertex_of_point >= 0)
    vertex, points = skeleton.vertex_of_point[some], skeleton.points[some]
    edge, t = nearest_on_edges(skeleton.vertices, edges, incident_edges(edges, m)[vertex], points)
    start, stop = skeleton.vertices[edges[edge]].transpose(1, 0, 2)
    offset = points - start - t[:, None] * (stop - start)
    total = group_sum(np.column_stack([dot(offset, offset), np.ones(len(some))]), vertex, m)
    ends, others = np.concatenate([edges, edges[:, ::-1]]).T
    total += group_sum(total[others], ends, m)
    return np.sqrt(total[:, 0] / np.maximum(total[:, 1], 1))
