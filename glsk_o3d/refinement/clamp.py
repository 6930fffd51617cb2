"""Bring vertices back that the contraction threw out of their points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.groups import group_sum
from ..numerics.vectors import TINY, norm
from ..skeleton import Skeleton

# fitted: farthest a vertex may be from the mean of its points, over their root mean square distance from that
CLAMP_REACH = 0.7
CLAMP_MIN_POINTS = 4  # fitted: points, below which they do not say where their vertex is


def clamp_to_points(skeleton: Skeleton) -> Skeleton:
    """Pull vertices to within reach of the mean of their points: thin tips run away in late solves.

    The axis of a half tube is 0.83 of the points' root mean square distance away from their mean; what is cut off there
    the fit to the axis gives back.
    """
    supporting = skeleton.supporting_points
    vertex, m = skeleton.vertex_of_point[supporting], len(skeleton.vertices)
    count = np.bincount(vertex, minlength=m)
    mean = group_sum(skeleton.points[supporting] - skeleton.vertices[vertex], vertex, m) / np.maximum(count, 1)[:, None]
    spread = group_sum((skeleton.points[supporting] - (skeleton.vertices + mean)[vertex]) ** 2, vertex, m).sum(axis=1)
    reach = CLAMP_REACH * np.sqrt(spread / np.maximum(count, 1))
    away = norm(mean)
    back = np.where((count >= CLAMP_MIN_POINTS) & (away > reach), 1 - reach / np.maximum(away, TINY), 0)
    return replace(skeleton, vertices=skeleton.vertices + back[:, None] * mean)
