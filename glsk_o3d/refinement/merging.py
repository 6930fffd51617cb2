"""Merge vertices of a skeleton."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

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
    radii, confidence = (
        group_sum(weight * values[:, None], group, n)[:, 0] / total[:, 0]
        for values in (skeleton.radii, skeleton.confidence)
    )
    return replace(
        skeleton,
        vertices=group_sum(weight * skeleton.vertices, group, n) / total,
        edges=np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0),
        radii=radii,
        confidence=confidence,
        vertex_of_point=np.where(vertex >= 0, group[vertex], -1),
    )


def merge_into(skeleton: Skeleton, into: np.ndarray) -> Skeleton:
    """Merge vertices into others, which stay where and what they are.

    Parameters
    ----------
    skeleton : Skeleton
    into : (M,) int array
        The vertex that each becomes part of; itself if it stays.

    Returns
    -------
    Skeleton
        Vertices that stay keep their order. Points of merged vertices belong to the one that stays.
    """
    stay = np.unique(into)
    kept = {name: getattr(skeleton, name)[stay] for name in ("vertices", "radii", "confidence")}
    return replace(merge_vertices(skeleton, into), **kept)


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
        vertices=skeleton.vertices[left],
        edges=representative[skeleton.edges],
        radii=skeleton.radii[left],
        confidence=skeleton.confidence[left],
        vertex_of_point=np.where(vertex >= 0, representative[vertex], -1),
    )
