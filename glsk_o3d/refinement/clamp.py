"""Bring vertices back that the contraction threw out of their points."""

from dataclasses import replace

import numpy as np

from ..numerics.groups import group_sum
from ..numerics.vectors import norm

REACH = 0.7  # farthest a vertex may be from the mean of its points, over their own root mean square distance from it
FEW = 4  # points, below which they do not say where their vertex is


def anchor(skeleton):
    """Pull vertices to within reach of the mean of their points: thin tips run away in late solves.

    The axis of a half tube is 0.83 of the points' root mean square distance away from their mean; what is cut off there
    the fit to the axis gives back.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
    """
    owned = skeleton.witnesses
    owner, m = skeleton.vertex_of_point[owned], len(skeleton.vertices)
    count = np.bincount(owner, minlength=m)
    mean = group_sum(skeleton.points[owned] - skeleton.vertices[owner], owner, m) / np.maximum(count, 1)[:, None]
    spread = group_sum((skeleton.points[owned] - (skeleton.vertices + mean)[owner]) ** 2, owner, m).sum(axis=1)
    reach = REACH * np.sqrt(spread / np.maximum(count, 1))
    away = norm(mean)
    back = np.where((count >= FEW) & (away > reach), 1 - reach / np.maximum(away, np.finfo(float).tiny), 0)
    return replace(skeleton, vertices=skeleton.vertices + back[:, None] * mean)
