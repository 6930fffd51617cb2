"""Merge vertices of a skeleton."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.groups import group_sum
from ..skeleton import Skeleton


def support(skeleton: Skeleton) -> np.ndarray:
    """Input points that each vertex owns, at least 1, (M,) float array."""
    vertex = skeleton.vertex_of_point[skeleton.supporting_points]
    return np.maximum(np.bincount(vertex, minlength=len(skeleton.vertices)), 1).astype(float)


def merge_vertices(skeleton: Skeleton, group: np.ndarray) -> Skeleton:
    """Make one vertex of each group, at the mean of its members weighted by the points they own.

    Parameters
    ----------
    skeleton : Skeleton
    group : (M,) int array
        Any labels.

    Returns
    -------
    Skeleton
        Points of merged vertices belong to the merged one.
    """
    label, group = np.unique(group, return_inverse=True)
    n, weight = len(label), support(skeleton)[:, None]
    total = group_sum(weight, group, n)
    edges = np.sort(group[skeleton.edges], axis=1)
    vertex = skeleton.vertex_of_point
    return replace(
        skeleton,
        vertices=group_sum(weight * skeleton.vertices, group, n) / total,
        edges=np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0),
        radii=(group_sum(weight * skeleton.radii[:, None], group, n) / total)[:, 0],
        vertex_of_point=np.where(vertex >= 0, group[vertex], -1),
    )
