"""Edits of the graph: parts that go, loops that are cut, another root, more or less detail, fewer vertices."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from ..analysis.branches import branch_table
from ..curve.detail import with_limbs
from ..curve.merging import merge_into
from ..curve.rooted import RootPlace, numbered_from, root_among
from ..data.graph import all_of_vertices
from ..data.skeleton import Skeleton, check_skeleton, of_input
from ..errors import InvalidParameterError
from ..geometry.near_links import linked
from ..geometry.polylines import arc_lengths, significance
from ..geometry.vectors import norm
from ..parameters import check_number

Edit = TypeVar("Edit", bound=Callable[..., Skeleton])


def with_all_points(edit: Edit) -> Edit:
    """The same edit with the points by area that stand for a mesh, which a user does not see."""

    @wraps(edit)
    def edited(skeleton: Skeleton, *args: Any, **options: Any) -> Skeleton:
        check_skeleton(skeleton)
        return of_input(edit(skeleton.whole, *args, **options))

    return cast(Edit, edited)


@with_all_points
def largest_component(skeleton: Skeleton) -> Skeleton:
    """The connected component with the greatest length.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
        Points of other components have no vertex, -1.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> largest_component(skeletonize(samples.two_rings(3000).points)).n_components
    1
    """
    if skeleton.n_components < 2:
        return skeleton
    component = skeleton.component_of_vertex
    length = np.bincount(component[skeleton.edges[:, 0]], skeleton.edge_lengths, skeleton.n_components)
    stays = component == length.argmax()
    index = np.where(stays, np.cumsum(stays) - 1, -1)
    return skeleton.changed(
        **all_of_vertices(skeleton, stays),
        edges=index[skeleton.edges[stays[skeleton.edges[:, 0]]]],
        vertex_of_point=np.append(index, -1)[skeleton.vertex_of_point],
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
        Both ends of every dropped edge.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> line, cut = cut_loops(skeletonize(samples.torus(2000).points))
    >>> line.n_loops, len(line.leaves), cut.shape
    (0, 2, (1, 2, 3))
    """
    check_skeleton(skeleton)
    forest = minimum_spanning_tree(linked(skeleton.vertices, skeleton.edges))
    remaining = np.sort(np.column_stack(forest.nonzero()), axis=1)
    m = len(skeleton.vertices)
    stays = np.isin(skeleton.edges @ [m, 1], remaining @ [m, 1])
    without_loops = of_input(skeleton.whole.changed(edges=skeleton.edges[stays]))
    return without_loops, skeleton.vertices[skeleton.edges[~stays]]


@with_all_points
def detailed(skeleton: Skeleton, *, limb: float) -> Skeleton:
    """Turn the detail up or down: limbs from another probability on than `Refiner.limb`, without a new run.

    The least probable branch goes first; what is then left at its junction is one branch, and a limb if one of those
    beyond the junction is. What goes can come back, with its curve and radii, but without confidence, sections and
    support, and with the points nearest to it. The root of a tree stays.

    Parameters
    ----------
    skeleton : Skeleton
        Of a Refiner with a `limb` above 0, or from a .json or .npz file of such a one. Others, without decisions about
        limbs in their report, stay as they are.
    limb : float
        Least probability that a branch with an end is a limb, from 0 to 1.

    Returns
    -------
    Skeleton
        `report.decisions` says what is there now.

    Raises
    ------
    InvalidParameterError
        The probability is out of range.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> animal = skeletonize(samples.sauropod(2000).points)
    >>> len(animal.leaves), len(detailed(animal, limb=0.0).leaves)
    (6, 7)
    """
    check_number("limb", limb, low=0, high=1)
    return with_limbs(skeleton, limb)


@with_all_points
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
        Vertex 0 is the root, `report.root` is its place, and the first vertex of every edge is nearer to it. Other
        components follow, each from its vertex nearest to the root.

    Raises
    ------
    InvalidParameterError
        There are loops, no vertices, or no such root.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> line = reroot(skeletonize(samples.tube(1000).points), "x")
    >>> bool(line.vertices[0, 0] == line.vertices[:, 0].min())
    True
    """
    _check_no_loops(skeleton, "only trees have a root")
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: it has no vertex to be the root")
    rooted = numbered_from(skeleton, root_among(skeleton.vertices, skeleton, root))
    return rooted.changed(report=replace(rooted.report, root=tuple(rooted.vertices[0].tolist())))


def _check_no_loops(skeleton: Skeleton, why: str) -> None:
    if skeleton.n_loops:
        raise InvalidParameterError(f"the skeleton has {skeleton.n_loops} loops: {why}; see cut_loops (--cut-loops)")


@with_all_points
def prune(skeleton: Skeleton, *, length: float = 0.0, order: int | None = None) -> Skeleton:
    """Drop branches with a free end that are short, or of a high order.

    Parameters
    ----------
    skeleton : Skeleton
    length : float
        Least length of a branch, from junction to tip, in the cloud's units. At every junction the shortest is dropped
        first and the rest is measured anew, so the longest path through it stays.
    order : int, optional
        Highest order that stays, as `branch_table` counts from the root: 0 for the stem alone.

    Returns
    -------
    Skeleton
        Points of a branch belong to the vertex that it grew from.

    Raises
    ------
    InvalidParameterError
        A number is out of range, or `order` is given for a skeleton with loops.

    Examples
    --------
    >>> from glsk_o3d import pipelines, samples
    >>> whole = pipelines.tree()(samples.tree(8000, forks=3).points)
    >>> len(whole.leaves), len(prune(whole, order=0).leaves)
    (9, 2)
    """
    check_number("length", length, "float", low=0)
    check_number("order", order, "int?", low=0)
    if order is not None:
        _check_no_loops(skeleton, "branches have an order in a tree")
        table, group = branch_table(skeleton), np.arange(len(skeleton.vertices))
        for row in np.argsort(table.level, kind="stable").tolist():  # parents before their children
            if table.order[row] > order:
                group[skeleton.branches[row]] = group[table.start[row]]
        skeleton = merge_into(skeleton, group)
    while short := _short_ends(skeleton, length):
        group = np.arange(len(skeleton.vertices))
        for path in short:
            group[path] = path[0]
        skeleton = merge_into(skeleton, group)
    return skeleton


def _short_ends(skeleton: Skeleton, least: float) -> list[np.ndarray]:
    """At each junction the shortest of the branches that end, from there to the tip, if it is too short."""
    shortest: dict[int, tuple[float, np.ndarray]] = {}
    for path in skeleton.branches:
        path = path[::-1] if skeleton.degree[path[0]] == 1 else path
        if skeleton.degree[path[0]] > 2 and skeleton.degree[path[-1]] == 1:
            length, fork = norm(np.diff(skeleton.vertices[path], axis=0)).sum(), int(path[0])
            if length < min(least, shortest.get(fork, (np.inf,))[0]):
                shortest[fork] = length, path
    return [path for _, path in shortest.values()]


@with_all_points
def simplify(skeleton: Skeleton, *, tolerance: float = 0.0) -> Skeleton:
    """Drop vertices where the curve is straight, branch by branch (Douglas and Peucker 1973).

    Parameters
    ----------
    skeleton : Skeleton
    tolerance : float
        How far a dropped vertex may be from the simpler curve, in the cloud's units.

    Returns
    -------
    Skeleton
        Ends, junctions, and the vertices that keep every loop stay. Points of a dropped vertex belong to the nearest
        remaining one along the branch.

    Raises
    ------
    InvalidParameterError
        The tolerance is negative.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> simplify(skeletonize(samples.torus(2000).points), tolerance=1.0)
    Skeleton(3 vertices, 3 edges, 1 components, 1 loops, 0 leaves, 0 junctions)
    """
    check_number("tolerance", tolerance, low=0)
    group = np.arange(len(skeleton.vertices))
    ends = [tuple(sorted((path[0], path[-1]))) for path in skeleton.branches]
    parallel = Counter(ends)
    for path, pair in zip(skeleton.branches, ends, strict=True):
        curve = skeleton.vertices[path]
        weight = significance(curve, [0, len(curve) - 1])
        inner = weight[1:-1]
        if path[0] == path[-1]:  # a ring is at least a triangle
            inner[np.argsort(inner)[-2:]] = np.inf
        elif parallel[pair] > 1 and len(path) > 2:
            inner[np.argmax(inner)] = np.inf
        along, kept = arc_lengths(curve), np.flatnonzero(weight > tolerance)
        nearest = np.abs(along[1:-1, None] - along[kept]).argmin(axis=1)
        group[path[1:-1]] = path[kept[nearest]]
    return merge_into(skeleton, group)
