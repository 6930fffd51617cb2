"""Bring vertices back that the contraction threw out of their points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.groups import group_sum
from ..numerics.vectors import TINY, norm
from ..skeleton import Skeleton

# the axis of half a tube is 2 / pi radii away from the mean of its points, which scatter around that by their standard
# deviation; no axis is farther off
HALF_TUBE_REACH = (2 / np.pi) / np.sqrt(1 - (2 / np.pi) ** 2)


def recall_runaways(skeleton: Skeleton) -> Skeleton:
    """Pull vertices as near to the mean of their points as half a tube's axis is: thin tips run away in late solves.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
        A vertex without points stays; one whose points are in one place is in that place.
    """
    supporting = skeleton.supporting_points
    vertex, m = skeleton.vertex_of_point[supporting], len(skeleton.vertices)
    count = np.bincount(vertex, minlength=m)
    mean = group_sum(skeleton.points[supporting] - skeleton.vertices[vertex], vertex, m) / np.maximum(count, 1)[:, None]
    spread = group_sum((skeleton.points[supporting] - (skeleton.vertices + mean)[vertex]) ** 2, vertex, m).sum(axis=1)
    reach = HALF_TUBE_REACH * np.sqrt(spread / np.maximum(count, 1))
    away = norm(mean)
    back = 1 - np.minimum(reach, away) / np.maximum(away, TINY)
    return replace(skeleton, vertices=skeleton.vertices + back[:, None] * mean)
