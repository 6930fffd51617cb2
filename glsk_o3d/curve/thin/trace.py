"""Trace parts without a surface along shortest paths through their points, and make a tree of a curve."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from ...geometry.groups import component_labels, group_median
from ...geometry.near_links import LINK_SPACINGS, join_pieces, linked, slice_centres, steps
from ...geometry.numbers import fitted
from ...geometry.polylines import incident_edges, nearest_on_edges, places_on_edges
from ...geometry.vectors import dot, norm, unit
from ..curve import Curve
from ..merging import merge_into
from ..rooted import RootPlace, numbered_from, root_among
from .continuation import continuations
from .detect import THIN, SpacedPoints, mostly_on_loops, without_detached_clumps, without_surface


@dataclass(frozen=True)
class TraceNumbers:
    """Numbers of `trace`, fitted on trees whose twigs are thinner than their points are far apart."""

    slice: float = fitted(0.5, "width of slices of geodesic distance, over the median scale of the points")
    cover_scales: float = fitted(1.2, "radius around a path in which points need none of their own, over the same")
    cover_radii: float = fitted(1.3, "the same over the radius of a part with a surface")
    join: float = fitted(8.0, "longest gap that is none, over the scale of the points")
    piece: int = fitted(3, "points of a group; fewer say nothing of a radius, and far from others are left out")
    meeting: float = fitted(0.8, "cosine of two tips that meet, as near as linked points")


TRACE = TraceNumbers()


def trace(curve: Curve, surface: float, root: RootPlace | None) -> Curve:
    """Replace what has no surface by shortest paths through its points; with a root make one tree of everything.

    Points are linked with near ones (`near_links`), and with the vertices of parts that have a surface. From a root a
    shortest path leads to every point; those of the farthest points, each until it meets one before, are the parts, and
    cover the points around (Sato et al. 2000, TEASAR). The vertices of a path lie in the middle of slices of geodesic
    distance, and have the spread of their points for a radius, and confidence 0; their points have no normals any more.
    Of a tree, vertex 0 is the root, and the first vertex of an edge is nearer to it.

    See `without_surface` for `surface`, 0 for no traced parts, and `Tracer.root` for the root. Without one, nothing
    is traced if most of what would be is on loops.
    """
    cloud, m = SpacedPoints(curve), len(curve.vertices)
    thin = np.zeros(m, bool)
    if surface and m:
        thin = without_surface(cloud, surface)
    if m == 0 or (root is None and (not thin.any() or mostly_on_loops(curve, thin))):
        return curve
    mixed, ends = _Mixed.of(curve, cloud, thin), curve.leaves[~thin[curve.leaves]]
    roots = None if root is None else np.array([root_among(mixed.places, curve, root, ends)])
    mixed, continued = mixed.continued(cloud.points, roots)
    mixed, joined = mixed.joined(anywhere=root is not None)
    joined, roots = np.concatenate([continued, joined]), mixed.roots() if roots is None else roots
    paths = _Paths(mixed, roots)
    traced = _assembled(curve, mixed, paths, tree=root is not None)
    if thin.any():
        kept = None if root is None else paths.index[roots[0]]
        traced, stays = drop_spurious(traced, paths.nodes < mixed.n, TRACE.cover_radii, kept)
    else:
        stays = np.arange(len(paths.nodes))
    point = paths.nodes[stays] < mixed.n
    if point.any() and len(traced.edges):
        traced = traced.changed(radii=np.where(point, thickness_around(traced), traced.radii))
    loose = thin[curve.vertex_of_point] & (curve.vertex_of_point >= 0)
    traced = traced.with_gaps(mixed.places[joined])
    report = replace(traced.report, n_traced=int(loose.sum()))
    if root is None:
        traced = without_detached_clumps(traced)
    else:
        traced = numbered_from(traced, int(np.searchsorted(stays, paths.index[roots[0]])))
        report = replace(report, root=tuple(traced.vertices[0].tolist()))
    return traced.changed(normals=np.where(loose[:, None], np.nan, traced.normals), report=report)


@dataclass(frozen=True, eq=False)
class _Mixed:
    """A graph of points where there is no surface, and after them of vertices where there is one."""

    n: int  # points
    places: np.ndarray
    links: csr_matrix
    edges: np.ndarray  # those between vertices
    vertices: np.ndarray  # of the curve
    radius: np.ndarray  # of the vertices; 0 of points
    scale: float

    @classmethod
    def of(cls, curve: Curve, cloud: SpacedPoints, thin: np.ndarray) -> _Mixed:
        thin_rows, scale = np.empty(0, int), 0.0
        if thin.any():
            scale = float(np.median(cloud.away[:, -1]))
            piece = connected_components(cloud.links, directed=False)[1]
            floats = cloud.away[:, min(TRACE.piece - 1, cloud.away.shape[1] - 1)] > TRACE.join * scale
            floats &= (np.bincount(piece) < TRACE.piece)[piece]
            thin_rows = np.flatnonzero(thin[cloud.vertex] & ~floats)
        thick, n = np.flatnonzero(~thin), len(thin_rows)
        index = np.full(len(thin), -1)
        index[thick] = n + np.arange(len(thick))
        edges = index[curve.edges]
        ends = edges = edges[(edges >= 0).all(axis=1)]
        if n:
            node = index[cloud.vertex]
            node[thin_rows] = np.arange(n)
            near = node[np.column_stack(cloud.links.nonzero())]
            ends = np.concatenate([edges, near[(near >= 0).all(axis=1) & (near < n).any(axis=1)]])
        places = np.concatenate([cloud.points[thin_rows], curve.vertices[thick]])
        radius = np.concatenate([np.zeros(n), curve.radii[thick]])
        return cls(n, places, linked(places, ends), edges, thick, radius, scale)

    def continued(self, points: np.ndarray, roots: np.ndarray | None) -> tuple[_Mixed, np.ndarray]:
        """The trunk of one tree joined across gaps, if it has a root; and the new links."""
        if roots is None:
            return self, np.empty((0, 2), int)
        added = continuations(self.places, self.edges, self.radius, points, int(roots[0]))
        ends = np.concatenate([np.stack(self.links.nonzero(), axis=1), added])
        return replace(self, links=linked(self.places, ends) if len(added) else self.links), added

    def joined(self, anywhere: bool) -> tuple[_Mixed, np.ndarray]:
        """Its pieces joined, anywhere or only where at least one is without a surface and near; and the new links."""
        reach = np.full(len(self.places), np.inf if anywhere else TRACE.join * self.scale)
        reach[self.n :] = np.inf if anywhere else 0
        links, added = join_pieces(self.places, self.links, reach)
        return replace(self, links=links), added

    def roots(self) -> np.ndarray:
        """Of every piece the thickest vertex, or else the point at one end."""
        piece = connected_components(self.links, directed=False)[1]
        _, first = np.unique(piece, return_index=True)
        order = np.lexsort((dijkstra(self.links, indices=first, min_only=True), self.radius, piece))
        return order[np.append(piece[order][1:] != piece[order][:-1], True)]


class _Paths:
    """Shortest paths from tips to the roots, each until it meets one before."""

    def __init__(self, mixed: _Mixed, roots: np.ndarray) -> None:
        n, size, scale = mixed.n, len(mixed.places), mixed.scale
        self.mixed, self.roots, self.steps = mixed, roots, list[tuple[int, int]]()
        self._distance, self._before, _ = dijkstra(mixed.links, indices=roots, return_predecessors=True, min_only=True)
        self.centre = mixed.places.copy()
        self.centre[:n] = slice_centres(mixed.places[:n], mixed.links[:n, :n], self._distance[:n], TRACE.slice * scale)
        self._reach = np.maximum(TRACE.cover_scales * scale, TRACE.cover_radii * mixed.radius)
        self._tree = cKDTree(mixed.places)
        self._inside, self._covered = np.zeros(size, bool), np.arange(size) >= n
        self._inside[roots] = True
        self._cover(roots)
        self._take_surfaces()
        for tip in np.argsort(-self._distance[:n]).tolist():
            if not self._covered[tip]:
                self._cover(self._trace(tip))
        self.index = np.cumsum(self._inside) - 1
        self.nodes = np.flatnonzero(self._inside)

    def _take_surfaces(self) -> None:
        """What has a surface is there, and is only asked how it hangs together."""
        n = self.mixed.n
        nodes = np.arange(n, len(self._covered))
        part = component_labels(len(nodes), self.mixed.edges - n)
        order = np.lexsort((self._distance[n:], part))
        entries = nodes[order[np.append(True, np.diff(part[order]) > 0)[: len(order)]]]
        for entry in entries[np.argsort(self._distance[entries])].tolist():
            self._cover(self._trace(entry))
            self._inside[nodes[part == part[entry - n]]] = True
        self._cover(nodes)

    def _trace(self, tip: int) -> list[int]:
        path = [tip]
        while not self._inside[path[-1]]:
            path.append(int(self._before[path[-1]]))
        self.steps += pairwise(path)
        self._inside[path] = True
        return path

    def _cover(self, path: np.ndarray | list[int]) -> None:
        for points in self._tree.query_ball_point(self.centre[path], self._reach[path]):
            self._covered[points] = True


def _assembled(curve: Curve, mixed: _Mixed, paths: _Paths, tree: bool) -> Curve:
    """The paths and what has a surface as one curve; points go to the nearest vertex, or stay where theirs stays."""
    nodes, edges = paths.nodes, mixed.edges
    if tree:  # of a loop its longest edge goes
        edges = np.column_stack(minimum_spanning_tree(linked(mixed.places, edges)).nonzero())
    edges = paths.index[np.concatenate([edges, np.array(paths.steps, int).reshape(-1, 2)])]
    degree, point = np.bincount(edges.ravel(), minlength=len(nodes)), nodes < mixed.n
    inner = (point & (degree > 1))[:, None]
    vertices = np.where(inner, paths.centre[nodes], mixed.places[nodes])
    met = np.empty((0, 2), int) if tree else _meetings(vertices, edges, point & (degree == 1), mixed.scale)
    edges = np.concatenate([edges, met])
    index = np.full(len(curve.vertices), -1)
    index[mixed.vertices] = paths.index[mixed.n :]
    owner = curve.vertex_of_point
    vertex = np.append(index, -1)[owner]
    free = np.flatnonzero((owner >= 0) & (vertex < 0))
    vertex[free] = cKDTree(vertices).query(curve.points[free])[1]
    radii, confidence = np.zeros((2, len(nodes)))
    stays = mixed.vertices[nodes[~point] - mixed.n]
    radii[~point], confidence[~point] = curve.radii[stays], curve.confidence[stays]
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    traced = curve.rewired(edges, vertices=vertices, radii=radii, confidence=confidence, vertex_of_point=vertex)
    if point.any() and len(edges):
        traced = traced.changed(radii=np.where(point, spread_around(traced), radii))
    return traced.with_gaps(vertices[met])


def _meetings(vertices: np.ndarray, edges: np.ndarray, tips: np.ndarray, scale: float) -> np.ndarray:
    """Tips that run into each other, (k, 2) int array: where the shortest paths around a loop do."""
    tips, beside = np.flatnonzero(tips), np.empty(len(vertices), int)
    beside[edges.ravel()] = edges[:, ::-1].ravel()
    ahead = unit(vertices[tips] - vertices[beside[tips]])
    a, b = cKDTree(vertices[tips]).query_pairs(LINK_SPACINGS * scale, output_type="ndarray").T
    gap = vertices[tips[b]] - vertices[tips[a]]
    straight = np.minimum(dot(ahead[a], unit(gap)), -dot(ahead[b], unit(gap)))
    matched: list[int] = []
    for k in np.argsort(norm(gap)).tolist():
        if straight[k] > TRACE.meeting and not {a[k], b[k]} & set(matched):
            matched += [a[k], b[k]]
    return tips[matched].reshape(-1, 2)


def spread_around(curve: Curve) -> np.ndarray:
    """Median distance from the curve to the points around every vertex and its neighbours, (M,) float array.

    Of points on a tube its radius, and outliers have little say.
    """
    return group_median(*_distances(curve), len(curve.vertices))


def thickness_around(curve: Curve) -> np.ndarray:
    """The same of points that the curve does not run through; where they are too few, that of the nearest with more.

    Their median is the radius of a part whose vertices are some of its points.
    """
    away, vertex = _distances(curve)
    off = away > THIN.same_place * np.ptp(curve.vertices, axis=0).max()
    thickness = group_median(away[off], vertex[off], len(curve.vertices))
    known = np.flatnonzero(np.bincount(vertex[off], minlength=len(thickness)) >= TRACE.piece)
    if not len(known):  # a line
        return thickness
    links = linked(curve.vertices, curve.edges)
    nearest = dijkstra(links, indices=known, return_predecessors=True, min_only=True)[2]
    reached = nearest >= 0
    thickness[reached] = thickness[nearest[reached]]
    return thickness


def _distances(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """How far points are from the curve, and each time the vertex, for that of a point and those beside it."""
    m, edges = len(curve.vertices), curve.edges
    owned = np.flatnonzero(curve.vertex_of_point >= 0)
    vertex, points = curve.vertex_of_point[owned], curve.points[owned]
    edge, t = nearest_on_edges(curve.vertices, edges, incident_edges(edges, m)[vertex], points)
    away = norm(points - places_on_edges(curve.vertices, edges, edge, t))
    around = steps(linked(curve.vertices, edges))[vertex]
    return np.repeat(away, np.diff(around.indptr)), around.indices


def drop_spurious(curve: Curve, traced: np.ndarray, radii: float, root: int | None = None) -> tuple[Curve, np.ndarray]:
    """Drop twigs whose tip is as near to the rest as points scatter there; say which vertices stay, in their order.

    Of N points that scatter normally around a curve, with a median distance of r, one is expected to be farther off
    than ``r sqrt(log2 N)``. Only twigs of `traced` (M,) vertices, whose radius is the spread of their points, are
    dropped, and not the vertex `root`. From a part that has a surface a tip must be `radii` of its radii away. Points
    of a twig belong to the vertex that it grew from.
    """
    stays = np.arange(len(curve.vertices))
    scatter = math.sqrt(math.log2(max(int((curve.vertex_of_point >= 0).sum()), 1)))
    while True:
        twigs = _twigs(curve, traced, root)
        if not twigs:
            return curve, stays
        forks, tips = np.array([path[[0, -1]] for path in twigs]).T
        body = np.concatenate([path[1:] for path in twigs])
        twig = np.repeat(np.arange(len(tips)), [len(path) - 1 for path in twigs])
        others = np.delete(np.arange(len(traced)), body)
        away, nearest = cKDTree(curve.vertices[others]).query(curve.vertices[tips])
        beside = others[nearest]
        beyond = away - np.where(traced[beside], scatter, radii) * curve.radii[beside]
        order = np.argsort(beyond)
        # of each fork the least, since the others may be what is left of the limb
        order = order[np.unique(forks[order], return_index=True)[1]]
        chosen = order[beyond[order] < 0]
        if not len(chosen):
            return curve, stays
        group, gone = np.arange(len(traced)), np.isin(twig, chosen)
        group[body[gone]] = forks[twig[gone]]
        remaining = np.unique(group)
        root = None if root is None else int(np.searchsorted(remaining, root))
        curve, traced, stays = merge_into(curve, group), traced[remaining], stays[remaining]
        curve = curve.changed(radii=np.where(traced, spread_around(curve), curve.radii))


def _twigs(curve: Curve, traced: np.ndarray, root: int | None) -> list[np.ndarray]:
    """Traced branches that end, as paths from the junctions that they leave, by their tips."""
    degree, free = curve.degree, traced & (np.arange(len(traced)) != (-1 if root is None else root))
    paths = [branch[::-1] if degree[branch[0]] == 1 else branch for branch in curve.branches]
    twigs = [path for path in paths if degree[path[0]] > 2 and degree[path[-1]] == 1 and free[path[1:]].all()]
    return sorted(twigs, key=lambda path: int(path[-1]))
