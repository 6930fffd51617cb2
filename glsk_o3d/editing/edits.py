"""One component, no loops, another root, fewer branches, fewer vertices, smoother curves."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from ..analysis.branches import branch_table
from ..errors import InvalidParameterError
from ..numerics.near_links import linked
from ..numerics.polylines import arc_lengths
from ..numerics.vectors import TINY, norm
from ..parameters import check_number
from ..refinement.merging import merge_into, some_vertices
from ..refinement.rooted import RootPlace, numbered_from, root_among
from ..skeleton import Skeleton

SHRINK, SWELL = 0.5, -0.53  # published: factors of a pass there and back, which leave long waves as they are


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
        vertex_of_point=np.append(index, -1)[vertex],
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
        Vertex 0 is the root, `report.root` is its place, and the first vertex of every edge is nearer to it. Other
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
            f"the skeleton has {skeleton.n_loops} loops: only trees have a root; see cut_loops (--cut-loops)"
        )
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: it has no vertex to be the root")
    rooted = numbered_from(skeleton, root_among(skeleton.vertices, skeleton, root))
    return replace(rooted, report=replace(rooted.report, root=tuple(rooted.vertices[0].tolist())))


def prune(
    skeleton: Skeleton,
    *,
    length: float = 0.0,
    radius: float = 0.0,
    order: int | None = None,
    root: RootPlace | None = None,
) -> Skeleton:
    """Drop branches with a free end that are short, thin, or of a high order.

    Parameters
    ----------
    skeleton : Skeleton
    length : float
        Least length of a branch, from junction to tip, in the cloud's units. At every junction the shortest is dropped
        first and the rest is measured anew, so the longest path through it stays.
    radius : float
        Least mean radius of a branch, in the same way.
    order : int, optional
        Highest order that stays, as `branch_table` counts: 0 for the stem alone.
    root : str, int or (x, y, z), optional
        Where orders count from, see `branch_table`.

    Returns
    -------
    Skeleton
        Points of a branch belong to the vertex that it grew from.

    Raises
    ------
    InvalidParameterError
        A number is out of range, radii are unknown, or `order` is given for a skeleton with loops.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tree
    >>> whole = pipelines.tree()(tree(8000, forks=3).points)
    >>> len(whole.leaves), len(prune(whole, order=0).leaves)
    (9, 2)
    """
    check_number("length", length, "float", low=0)
    check_number("radius", radius, "float", low=0)
    check_number("order", order, "int?", low=0)
    if radius and not np.isfinite(skeleton.radii).all():
        raise InvalidParameterError("the skeleton has no radii: it cannot be pruned by them")
    if order is not None:
        skeleton = _without_orders(skeleton, order, root)
    if length:
        skeleton = _without_ends(skeleton, length, lambda now, path: norm(np.diff(now.vertices[path], axis=0)).sum())
    if radius:
        skeleton = _without_ends(skeleton, radius, lambda now, path: now.radii[path[1:]].mean())
    return skeleton


def _without_orders(skeleton: Skeleton, order: int, root: RootPlace | None) -> Skeleton:
    if skeleton.n_loops:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_loops} loops: branches have an order in a tree; see cut_loops (--cut-loops)"
        )
    table = branch_table(skeleton, root)
    group = np.arange(len(skeleton.vertices))
    for row in np.argsort(table.level, kind="stable").tolist():  # parents before their children
        if table.order[row] > order:
            path = skeleton.branches[row]
            away = path[1:] if path[0] == table.start[row] else path[:-1]
            group[away] = group[table.start[row]]
    return merge_into(skeleton, group)


def _without_ends(skeleton: Skeleton, least: float, measure: Callable[[Skeleton, np.ndarray], float]) -> Skeleton:
    """Without branches that end and measure less, the least of each junction first."""
    while True:
        worst: dict[int, tuple[float, np.ndarray]] = {}
        for path in skeleton.branches:
            path = path[::-1] if skeleton.degree[path[0]] == 1 else path
            if skeleton.degree[path[0]] > 2 and skeleton.degree[path[-1]] == 1:
                size, fork = measure(skeleton, path), int(path[0])
                if size < min(least, worst.get(fork, (np.inf,))[0]):
                    worst[fork] = size, path
        if not worst:
            return skeleton
        group = np.arange(len(skeleton.vertices))
        for fork, (_, path) in worst.items():
            group[path] = fork
        skeleton = merge_into(skeleton, group)


def simplify(skeleton: Skeleton, *, tolerance: float | None = None, n: int | None = None) -> Skeleton:
    """Drop vertices where the curve is straight, branch by branch (Douglas and Peucker 1973).

    Parameters
    ----------
    skeleton : Skeleton
    tolerance : float, optional
        How far a dropped vertex may be from the simpler curve, in the cloud's units.
    n : int, optional
        Number of vertices to keep, the most important first; give either this or `tolerance`. Ends, junctions, and the
        vertices that keep every loop always stay.

    Returns
    -------
    Skeleton
        Points of a dropped vertex belong to the nearest remaining one along the branch.

    Raises
    ------
    InvalidParameterError
        Neither is given, or both, or one is out of range.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(2000).points)
    >>> simplify(ring, n=12)
    Skeleton(12 vertices, 12 edges, 1 components, 1 loops, 0 leaves, 0 junctions)
    """
    if (tolerance is None) == (n is None):
        raise InvalidParameterError("simplify needs either a tolerance or n")
    check_number("tolerance", tolerance, "float?", low=0)
    check_number("n", n, "int?", low=1)
    matters = np.full(len(skeleton.vertices), np.inf)
    twins = Counter(tuple(sorted((path[0], path[-1]))) for path in skeleton.branches)
    for path in skeleton.branches:
        here = _significance(skeleton.vertices[path])
        if path[0] == path[-1]:  # a ring is at least a triangle
            here[np.argsort(here[1:-1])[-2:] + 1] = np.inf
        elif twins[tuple(sorted((path[0], path[-1])))] > 1 and len(path) > 2:
            here[np.argmax(here[1:-1]) + 1] = np.inf
        matters[path[1:-1]] = here[1:-1]
    if n is None:
        stays = matters > tolerance
    else:
        stays = np.zeros(len(matters), bool)
        stays[np.argsort(-matters, kind="stable")[: max(n, np.isinf(matters).sum())]] = True
    group = np.arange(len(matters))
    for path in skeleton.branches:
        along, kept = arc_lengths(skeleton.vertices[path]), np.flatnonzero(stays[path])
        if len(kept):  # of a ring without a junction the first vertex may go, and is the last one too
            nearest = np.abs(along[:, None] - along[kept]).argmin(axis=1)
            group[path[1:-1]] = path[kept[nearest[1:-1]]]
    return merge_into(skeleton, group)


def _significance(curve: np.ndarray) -> np.ndarray:
    """Largest tolerance at which every place of a curve stays, infinite at its ends, (p,) float array."""
    found = np.full(len(curve), np.inf)
    parts = [(0, len(curve) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        offset, chord = curve[first + 1 : last] - curve[first], curve[last] - curve[first]
        along = np.clip(offset @ chord / max(chord @ chord, TINY), 0, 1)
        away = norm(offset - along[:, None] * chord)
        farthest = first + 1 + int(away.argmax())
        # no more than that of the ends of its part, without which it would not be asked
        found[farthest] = min(float(away.max()), found[first], found[last])
        parts += [(first, farthest), (farthest, last)]
    return found


def smooth(skeleton: Skeleton, *, passes: int = 10) -> Skeleton:
    """Smooth the curves without shrinking them (Taubin 1995, "A signal processing approach to fair surface design").

    Parameters
    ----------
    skeleton : Skeleton
    passes : int
        Number of passes; more remove longer waves. Ends and junctions do not move.

    Returns
    -------
    Skeleton

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(2000, noise=0.01).points)
    >>> abs(smooth(ring).length / ring.length - 1) < 0.02
    True
    """
    check_number("passes", passes, "int", low=0)
    inner = np.flatnonzero(skeleton.degree == 2)
    ends = np.concatenate([skeleton.edges, skeleton.edges[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    beside = ends[skeleton.degree[ends[:, 0]] == 2, 1].reshape(-1, 2)  # in the order of `inner`
    vertices = skeleton.vertices.copy()
    for factor in (SHRINK, SWELL) * passes:
        vertices[inner] += factor * (vertices[beside].mean(axis=1) - vertices[inner])
    return replace(skeleton, vertices=vertices)
