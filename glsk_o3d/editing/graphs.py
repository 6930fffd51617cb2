"""One component, no loops, another root."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from ..errors import InvalidParameterError
from ..numerics.near_links import linked
from ..refinement.merging import some_vertices
from ..refinement.rooted import RootPlace, numbered_from, root_among
from ..skeleton import Skeleton


def largest_component(skeleton: Skeleton) -> Skeleton:
    """The connected component with the greatest length.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
        Points of the others have no vertex any more, -1.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import two_rings
    >>> largest_component(skeletonize(two_rings(3000).points)).n_components
    1
    """
    if skeleton.n_components < 2:
        return skeleton
    part = skeleton.component_of_vertex
    length = np.bincount(part[skeleton.edges[:, 0]], skeleton.edge_lengths, skeleton.n_components)
    stays = part == length.argmax()
    index = np.where(stays, np.cumsum(stays) - 1, -1)
    vertex = skeleton.vertex_of_point
    return replace(
        skeleton,
        **some_vertices(skeleton, stays),
        edges=index[skeleton.edges[stays[skeleton.edges[:, 0]]]],
        vertex_of_point=np.where(vertex >= 0, index[vertex], -1),
    )


def cut_loops(skeleton: Skeleton) -> tuple[Skeleton, np.ndarray]:
    """Drop an edge of every loop, and keep a spanning forest of least length.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
        Without loops; its vertices are the same.
    cut : (k, 2, 3) float64 array
        Both ends of every edge that was dropped.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> line, cut = cut_loops(skeletonize(torus(2000).points))
    >>> line.n_loops, len(line.leaves), cut.shape
    (0, 2, (1, 2, 3))
    """
    forest = minimum_spanning_tree(linked(skeleton.vertices, skeleton.edges))
    left = np.sort(np.column_stack(forest.nonzero()), axis=1)
    m = len(skeleton.vertices)
    stays = np.isin(skeleton.edges @ [m, 1], left @ [m, 1])
    return replace(skeleton, edges=skeleton.edges[stays]), skeleton.vertices[skeleton.edges[~stays]]


def reroot(skeleton: Skeleton, root: RootPlace = "z") -> Skeleton:
    """Number the vertices from a root outwards, as `pipelines.tree` does.

    Parameters
    ----------
    skeleton : Skeleton
        Without loops.
    root : str, int or (x, y, z)
        ``"x"`` to ``"-z"`` for the vertex that is lowest along this axis, ``"thickest"`` for the thickest end, a
        vertex, or the vertex nearest to a point.

    Returns
    -------
    Skeleton
        Vertex 0 is the root, `report.root` says where it is, and the first vertex of every edge is nearer to it. Other
        components follow, each from its vertex nearest to the root.

    Raises
    ------
    InvalidParameterError
        There are loops, no vertices, or no such root.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import tube
    >>> line = reroot(skeletonize(tube(1000).points), "x")
    >>> bool(line.vertices[0, 0] == line.vertices[:, 0].min())
    True
    """
    if skeleton.n_loops:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_loops} loops: only trees have a root; see cut_loops()"
        )
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: it has no vertex to be the root")
    vertex = root_among(skeleton.vertices, skeleton, root)
    rooted = numbered_from(skeleton, vertex)
    return replace(rooted, report=replace(rooted.report, root=tuple(rooted.vertices[0].tolist())))
