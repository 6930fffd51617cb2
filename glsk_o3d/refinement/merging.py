"""Merge vertices of a skeleton."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..numerics.groups import group_sum
from ..skeleton import OF_VERTICES, Skeleton
from .vertex_points import VertexPoints


def some_vertices(skeleton: Skeleton, which: np.ndarray) -> dict[str, Any]:
    """The arrays of some vertices, by name, for `replace`: their places and all that is known of them."""
    return {name: getattr(skeleton, name)[which] for name in ("vertices", *OF_VERTICES)}


def merge_vertices(skeleton: Skeleton, group: np.ndarray) -> Skeleton:
    """Make one vertex of each group (M,), at the mean of its members weighted by the points they own.

    Groups have any labels. Points of merged vertices belong to the merged one.
    """
    label, group = np.unique(group, return_inverse=True)
    n, weight = len(label), VertexPoints(skeleton).mass
    total = group_sum(weight, group, n)
    edges = np.sort(group[skeleton.edges], axis=1)
    vertex = skeleton.vertex_of_point
    known = some_vertices(skeleton, np.arange(len(group)))
    return replace(
        skeleton,
        **{name: (group_sum((weight * values.T).T, group, n).T / total).T for name, values in known.items()},
        edges=np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0),
        vertex_of_point=np.where(vertex >= 0, group[vertex], -1),
    )


def merge_into(skeleton: Skeleton, into: np.ndarray) -> Skeleton:
    """Merge vertices `into` others (M,), which stay where and what they are, and in their order.

    Points of merged vertices belong to the one that stays.
    """
    stay = np.unique(into)
    return replace(merge_vertices(skeleton, into), **some_vertices(skeleton, stay))


def drop_edges(skeleton: Skeleton, gone: ArrayLike) -> Skeleton:
    """Drop some edges, each named by its two vertices, the lower first; vertices stay."""
    dropped = (skeleton.edges[:, None] == np.asarray(gone)).all(axis=2).any(axis=1)
    return replace(skeleton, edges=skeleton.edges[~dropped])


def drop_lone_vertices(skeleton: Skeleton) -> Skeleton:
    """Drop vertices without edges, unless there is nothing else; their points go to the nearest vertex left."""
    left = np.flatnonzero(skeleton.degree > 0)
    if len(left) in (0, len(skeleton.vertices)):
        return skeleton
    representative = cKDTree(skeleton.vertices[left]).query(skeleton.vertices)[1]
    representative[left] = np.arange(len(left))
    vertex = skeleton.vertex_of_point
    return replace(
        skeleton,
        **some_vertices(skeleton, left),
        edges=representative[skeleton.edges],
        vertex_of_point=np.where(vertex >= 0, representative[vertex], -1),
    )


def binary_size(skeleton: Skeleton) -> float:
    """The power of two next to the extent of a skeleton, so that scaling by it rounds nothing; 1 if it has none."""
    extent = np.ptp(skeleton.vertices, axis=0).max(initial=0)
    return float(2.0 ** np.round(np.log2(extent))) if extent > 0 else 1.0


def scaled(skeleton: Skeleton, factor: float) -> Skeleton:
    """The same in another unit of length: vertices, radii and points."""
    vertices, points, radii = (factor * values for values in (skeleton.vertices, skeleton.points, skeleton.radii))
    return replace(skeleton, vertices=vertices, points=points, radii=radii)
