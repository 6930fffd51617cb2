"""Skeletons of what files hold, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...skeleton import Skeleton


class NoEdges(Exception):
    """A file in a format that clouds have too holds no edges, and was not written as a skeleton."""


def graph_skeleton(
    vertices: ArrayLike, edges: ArrayLike, radii: ArrayLike | None = None, **known: ArrayLike
) -> Skeleton:
    """A skeleton without a cloud, its edges sorted and each once.

    Parameters
    ----------
    vertices : (M, 3) array_like
    edges : (E, 2) array_like of int
        In any order; repeated ones and those from a vertex to itself are dropped.
    radii : (M,) array_like, optional
        By default unknown: NaN.
    **known : (M,) array_like
        What else is known of the vertices, by the name of the field.

    Raises
    ------
    ValueError
        As from `checked`.
    """
    vertices = np.asarray(vertices, float).reshape(-1, 3)
    edges = np.sort(np.asarray(edges, np.int64).reshape(-1, 2), axis=1)
    edges = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)
    radii = np.full(len(vertices), np.nan) if radii is None else np.asarray(radii)
    none = np.empty(0)
    return checked(Skeleton(vertices, edges, radii, vertex_of_point=none, points=none, normals=none, **known))  # type: ignore[arg-type]


def checked(skeleton: Skeleton) -> Skeleton:
    """A skeleton, if its arrays fit together and can be true; ValueError where lengths differ, something names a vertex
    that is not there, a vertex is nowhere, a radius is negative, or a confidence is none.
    """
    m, vertex_of_point = len(skeleton.vertices), skeleton.vertex_of_point
    if skeleton.edges.size and (skeleton.edges.min() < 0 or skeleton.edges.max() >= m):
        raise ValueError(f"an edge names a vertex that is not there: there are {m}")
    if vertex_of_point.size and (vertex_of_point.min() < -1 or vertex_of_point.max() >= m):
        raise ValueError(f"vertex_of_point names a vertex that is not there: there are {m}")
    if len(skeleton.radii) != m:
        raise ValueError(f"{len(skeleton.radii)} radii for {m} vertices")
    if len({len(array) for array in (vertex_of_point, skeleton.points, skeleton.normals)} - {0}) > 1:
        raise ValueError("points, normals and vertex_of_point differ in length")
    if not np.isfinite(skeleton.vertices).all():
        raise ValueError("a vertex has coordinates that are not finite")
    for name, values, high in (
        ("radius", skeleton.radii, np.inf),
        ("confidence", skeleton.confidence, 1.0),
        ("half_width", skeleton.half_width, np.inf),
        ("half_thickness", skeleton.half_thickness, skeleton.half_width),
        ("support", skeleton.support, 1.0),
    ):
        wrong = values[(values < 0) | (values > high)]
        if len(wrong):
            raise ValueError(f"a {name} is {wrong[0]:g}")
    return skeleton
