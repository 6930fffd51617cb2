"""A graph as curves in space: the nearest places on it, directions, frames, curvature, paths and sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import ConvexHull, QhullError, cKDTree

from ..errors import InvalidParameterError
from ..geometry.near_links import linked
from ..geometry.polylines import arc_lengths, nearest_on_edges, places_on_edges, twist_free_frames
from ..geometry.vectors import TINY, cross, dot, norm, unit
from ..parameters import check_number, shown
from .derived import derived
from .graph import Graph

CLOSEST_PIECES = (
    8  # speed: pieces of the curve that are looked at first; more where these may not hold the nearest place
)
SECTION_THICKNESS = 0.25  # fitted: of the slab whose points show a section, either way, over the radius
BOTH_ENDS = slice(-1), slice(1, None)  # of the edges along a path
LEAST_SECTION = 3  # derived: points that span a plane figure


@dataclass(frozen=True, eq=False)
class CurvePlaces:
    """Places on the curve of a skeleton: arrays with a row each.

    Attributes
    ----------
    branch, edge : (n,) int arrays
        Rows of `Skeleton.branches` and `Skeleton.edges`; -1 at a vertex without edges.
    arc_length : (n,) float array
        Along the branch, from its first vertex; 0 at a vertex without edges.
    position, tangent : (n, 3) float arrays
        The place, and the unit direction in which the branch goes on there; NaN at a vertex without edges.
    radius : (n,) float array
        Between those of the ends of the edge; NaN if unknown.
    distance : (n,) float array
        From the point that was asked about; 0 if none was.
    """

    branch: np.ndarray
    edge: np.ndarray
    arc_length: np.ndarray
    position: np.ndarray
    tangent: np.ndarray
    radius: np.ndarray
    distance: np.ndarray

    def __len__(self) -> int:
        return len(self.branch)

    @property
    def clearance(self) -> np.ndarray:
        """Distance from the surface of a round tube with the radii of the skeleton, (n,): negative inside it."""
        return self.distance - self.radius


@dataclass(frozen=True, eq=False)
class Section:
    """The cut of a part across its curve.

    Attributes
    ----------
    position, tangent : (3,) float arrays
        The place, and the normal of the plane of the section.
    points : (p,) int array
        Points of the skeleton within a quarter of the radius of that plane, in the order in which they go around.
    outline : (q, 3) float array
        The convex outline of these points, in the plane and closed when its first corner follows its last.
    area : float
        Of the outline; NaN with fewer than three points.
    half_width, half_thickness : float
        Half axes of the part there, as of `Skeleton.half_width`.
    """

    position: np.ndarray
    tangent: np.ndarray
    points: np.ndarray
    outline: np.ndarray
    area: float
    half_width: float
    half_thickness: float


@dataclass(frozen=True, eq=False)
class SpaceCurve(Graph):
    """A graph whose edges are straight pieces of curves."""

    @derived("edges")
    def _edges_along(self) -> np.ndarray:
        """Rows of the edges along the branches, one branch after the other, (E,) int array."""
        return self.edges_along([*self.branches])

    def edges_along(self, paths: Sequence[np.ndarray]) -> np.ndarray:
        """Rows of the edges along paths of vertices, one path after the other."""
        before, after = (np.concatenate([*(path[part] for path in paths), np.empty(0, int)]) for part in BOTH_ENDS)
        m = len(self.vertices)
        return np.searchsorted(self.edges @ [m, 1], np.minimum(before, after) * m + np.maximum(before, after))

    @derived("edges")
    def branch_of_edge(self) -> np.ndarray:
        """Row of `branches` that every edge is on, (E,) int array."""
        branch = np.empty(len(self.edges), int)
        branch[self._edges_along] = np.repeat(np.arange(len(self.branches)), [len(path) - 1 for path in self.branches])
        return branch

    @derived("edges")
    def _runs_backwards(self) -> np.ndarray:
        """Whether the branch of an edge leads from its second vertex to its first, (E,) bool array."""
        backwards = np.empty(len(self.edges), bool)
        starts = np.concatenate([*(path[:-1] for path in self.branches), np.empty(0, int)])
        backwards[self._edges_along] = starts != self.edges[self._edges_along, 0]
        return backwards

    @derived("vertices", "edges")
    def _arc_length_before(self) -> np.ndarray:
        """Arc length along its branch at which every edge begins, (E,) float array."""
        begin = np.empty(len(self.edges))
        lengths = [arc_lengths(self.vertices[path])[:-1] for path in self.branches]
        begin[self._edges_along] = np.concatenate([*lengths, np.empty(0)])
        return begin

    def nearest(self, points: Any) -> CurvePlaces:
        """The place on the curve that is nearest to each point.

        Parameters
        ----------
        points : (n, 3) array_like
            Finite, in the units of the cloud.

        Returns
        -------
        CurvePlaces
            With n rows. The distance is exact; of two places equally near it is one.

        Raises
        ------
        InvalidParameterError
            The points have another shape or are not finite, or the skeleton is empty.

        Examples
        --------
        >>> from glsk_o3d import skeletonize
        >>> from glsk_o3d.samples import torus
        >>> ring = skeletonize(torus(1000).points)
        >>> place = ring.nearest([[0.4, 0, 0.05]])
        >>> abs(float(place.distance[0]) - 0.05) < 0.02, bool(place.clearance[0] < 0)
        (True, True)
        """
        points = _checked_points(points)
        if len(self.vertices) == 0:
            raise InvalidParameterError("the skeleton is empty: no place on it is nearest")
        detached = np.flatnonzero(self.degree == 0)
        edges = np.concatenate([self.edges, np.repeat(detached, 2).reshape(-1, 2)])
        edge, share = _nearest(self.vertices, edges, points)
        position = places_on_edges(self.vertices, edges, edge, share)
        return self._places(edge, share, position, norm(points - position))

    def places(self, branch: Any, arc_length: Any) -> CurvePlaces:
        """Places on branches by their arc lengths.

        Parameters
        ----------
        branch : int or (n,) int array
            Rows of `branches`.
        arc_length : float or (n,) float array
            From the first vertex of the branch; what is beyond an end is that end.

        Returns
        -------
        CurvePlaces
            With a row for each of them, as they broadcast.

        Raises
        ------
        InvalidParameterError
            There is no such branch, or an arc length is no finite number.
        """
        branch, arc_length = np.broadcast_arrays(np.atleast_1d(branch), np.atleast_1d(arc_length))
        if branch.dtype.kind not in "iu" or not ((branch >= 0) & (branch < len(self.branches))).all():
            raise InvalidParameterError(
                f"branch = {shown(branch.tolist())}: there are branches 0 to {len(self.branches) - 1}"
            )
        if arc_length.dtype.kind not in "iuf" or not np.isfinite(arc_length).all():
            raise InvalidParameterError(f"arc_length = {shown(arc_length.tolist())}: must be finite numbers")
        edge, share = np.empty(len(branch), int), np.empty(len(branch))
        for row in np.unique(branch).tolist():
            asked, path = np.flatnonzero(branch == row), self.branches[row]
            along = arc_lengths(self.vertices[path])
            piece = np.clip(np.searchsorted(along, arc_length[asked], side="right") - 1, 0, len(path) - 2)
            part = (arc_length[asked] - along[piece]) / np.maximum(np.diff(along)[piece], TINY)
            edge[asked] = self.edges_along([path])[piece]
            share[asked] = np.clip(part, 0, 1)
        share = np.where(self._runs_backwards[edge], 1 - share, share)
        return self._places(edge, share, places_on_edges(self.vertices, self.edges, edge, share), np.zeros(len(edge)))

    def _places(self, edge: np.ndarray, share: np.ndarray, position: np.ndarray, distance: np.ndarray) -> CurvePlaces:
        """Places on edges, from 0 at the first vertex of each to 1 at the second; those after the last are vertices."""
        detached = np.flatnonzero(self.degree == 0)
        alone = edge >= len(self.edges)
        of_edges = (self.branch_of_edge, self._runs_backwards, self.edge_lengths, self._arc_length_before)
        branch, backwards, length, begin = (np.append(values, 0 * detached)[edge] for values in of_edges)
        first, second = np.concatenate([self.edges, np.column_stack([detached, detached])])[edge].T
        tangent = (1 - 2 * backwards)[:, None] * unit(self.vertices[second] - self.vertices[first])
        tangent[alone] = np.nan
        radius = (1 - share) * self.radii[first] + share * self.radii[second]
        arc_length = begin + np.where(backwards, 1 - share, share) * length
        branch, edge = np.where(alone, -1, branch), np.where(alone, -1, edge)
        return CurvePlaces(branch, edge, arc_length, position, tangent, radius, distance)

    @derived("vertices", "edges")
    def frames(self) -> np.ndarray:
        """A frame at every vertex that turns along each branch, and does not twist around it.

        (M, 3, 3) float array whose columns are the tangent and two directions across it: every frame follows from the
        one before by the smallest rotation that takes one tangent to the next (Bishop 1975). Branches lead from the end
        with the smaller number; a junction has the frame of its longest branch, and a vertex without edges NaN.
        """
        frames = np.full((len(self.vertices), 3, 3), np.nan)
        if len(self.branches) == 0:
            return frames
        lengths = np.bincount(self.branch_of_edge, self.edge_lengths)
        paths = [self.branches[row] for row in np.argsort(lengths, kind="stable")]  # the longest has the last word
        flat, first = np.concatenate(paths), np.cumsum([0, *map(len, paths[:-1])])
        frames[flat] = twist_free_frames(self.vertices[flat], first)
        return frames

    @property
    def tangents(self) -> np.ndarray:
        """Unit direction of the curve at every vertex, (M, 3) float array: the first axis of `frames`."""
        return self.frames[:, :, 0]

    @derived("vertices", "edges")
    def curvature(self) -> np.ndarray:
        """Curvature at every vertex with two edges, (M,) float array, over the cloud's unit; NaN at other vertices.

        One over the radius of the circle through it and the vertices next to it (Menger). Noise of the vertices shows
        in it: smooth the skeleton first, see `glsk_o3d.editing.smooth`.
        """
        curvature, inner = np.full(len(self.vertices), np.nan), np.flatnonzero(self.degree == 2)
        if len(inner):
            ends = np.concatenate([self.edges, self.edges[:, ::-1]])
            ends = ends[np.argsort(ends[:, 0], kind="stable")]
            before, after = ends[self.degree[ends[:, 0]] == 2, 1].reshape(-1, 2).T
            a, b = self.vertices[inner] - self.vertices[before], self.vertices[after] - self.vertices[inner]
            product = norm(a) * norm(b) * norm(a + b)
            curvature[inner] = 2 * norm(cross(a, b)) / np.where(product > 0, product, np.nan)
        return curvature

    def path(self, a: Any, b: Any) -> np.ndarray:
        """The shortest path along the curve between two vertices.

        Parameters
        ----------
        a, b : int or (x, y, z)
            A vertex, or a place whose nearest vertex is meant.

        Returns
        -------
        (n,) int array
            Vertices in order, from that of `a` to that of `b`; one, if they are the same.

        Raises
        ------
        InvalidParameterError
            There is no such vertex, or no path between them.

        Examples
        --------
        >>> from glsk_o3d import skeletonize
        >>> from glsk_o3d.samples import y_junction
        >>> fork = skeletonize(y_junction(1000).points)
        >>> route = fork.path(*fork.leaves[:2])
        >>> bool(np.isin(fork.junctions, route).all())
        True
        """
        start, stop = (self._vertex_at(name, which) for name, which in (("a", a), ("b", b)))
        links = linked(self.vertices, self.edges)
        _, before = dijkstra(links, directed=False, indices=start, return_predecessors=True)
        route = [stop]
        while route[-1] != start:
            if before[route[-1]] < 0:
                raise InvalidParameterError(f"vertices {start} and {stop} are in different components: no path")
            route.append(int(before[route[-1]]))
        return np.array(route[::-1])

    def _vertex_at(self, name: str, which: Any) -> int:
        if isinstance(which, int | np.integer) and not isinstance(which, bool):
            if not 0 <= which < len(self.vertices):
                raise InvalidParameterError(f"{name} = {which}: there are vertices 0 to {len(self.vertices) - 1}")
            return int(which)
        place = _checked_points([which], name)
        if len(self.vertices) == 0:
            raise InvalidParameterError("the skeleton is empty: it has no vertex")
        return int(norm(self.vertices - place).argmin())

    def section(self, branch: int, arc_length: float) -> Section:
        """The cut of a part across its curve, by the points around it.

        Parameters
        ----------
        branch : int
            Row of `branches`.
        arc_length : float
            From the first vertex of the branch, in the cloud's units.

        Returns
        -------
        Section
            Of the points that belong to the vertices of the edge there, or to those next to these.

        Raises
        ------
        InvalidParameterError
            There is no such branch, the arc length is no number, or the skeleton has no radii.
        """
        check_number("arc_length", arc_length)
        place = self.places(branch, arc_length)
        (edge,), (position,), (tangent,), (radius,) = place.edge, place.position, place.tangent, place.radius
        if not radius >= 0:
            raise InvalidParameterError("the skeleton has no radii there, which say how thick a section is")
        around = np.isin(self.edges, self.edges[edge]).any(axis=1)
        near = np.flatnonzero(np.isin(self.vertex_of_point, self.edges[around]))
        height = dot(self.points[near] - position, tangent[None])
        rows = near[np.abs(height) <= SECTION_THICKNESS * radius]
        axes = np.linalg.svd(tangent[None])[2][1:]
        flat = (self.points[rows] - position) @ axes.T
        rows = rows[np.argsort(np.arctan2(*flat.T[::-1]), kind="stable")]
        outline, area = _convex_outline(flat)
        share = norm(position - self.vertices[self.edges[edge, 0]]) / max(self.edge_lengths[edge], TINY)
        half_axes = [
            np.interp(share, (0, 1), values[self.edges[edge]]) for values in (self.half_width, self.half_thickness)
        ]
        return Section(position, tangent, rows, position + outline @ axes, area, *map(float, half_axes))


def _nearest(vertices: np.ndarray, edges: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edge nearest to each point, and from 0 to 1 how far along it the nearest place is."""
    # Strategy: edges in pieces of about equal length; the nearest place is on one of the pieces whose middles are
    # nearest, unless the farthest of these is hardly farther than the place: then on one of four times as many.
    length = norm(vertices[edges[:, 1]] - vertices[edges[:, 0]])
    count = np.maximum(np.ceil(length / max(np.median(length), length.sum() / (4 * len(edges)), TINY)), 1).astype(int)
    of_piece = np.repeat(np.arange(len(edges)), count)
    part = (np.arange(len(of_piece)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[of_piece]
    reach = (length / count).max() / 2
    tree = cKDTree(places_on_edges(vertices, edges, of_piece, part))
    edge, share, rows, k = np.zeros(len(points), int), np.zeros(len(points)), np.arange(len(points)), CLOSEST_PIECES
    while len(rows):
        k = min(k, len(of_piece))
        distance, piece = (values.reshape(len(rows), k) for values in tree.query(points[rows], k))
        edge[rows], share[rows] = nearest_on_edges(vertices, edges, of_piece[piece], points[rows])
        offset = points[rows] - places_on_edges(vertices, edges, edge[rows], share[rows])
        rows = rows[(norm(offset) > distance[:, -1] - reach) & (k < len(of_piece))]
        k *= 4
    return edge, share


def _checked_points(points: Any, name: str = "points") -> np.ndarray:
    """Finite points, (n, 3) float64 array; InvalidParameterError for anything else."""
    try:
        array = np.asarray(points, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidParameterError(
            f"{name} = {shown(points)}: must be a row (x, y, z) for each place: [[x, y, z], ...]"
        )
    if not np.isfinite(array).all():
        raise InvalidParameterError(f"{name}: row {int((~np.isfinite(array)).any(axis=1).argmax())} is not finite")
    return array


def _convex_outline(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Corners of the convex hull of points (p, 2), counterclockwise, and its area; none, and NaN, if it has no area."""
    if len(points) < LEAST_SECTION:
        return np.empty((0, 2)), np.nan
    try:
        hull = ConvexHull(points)
    except QhullError:  # all on a line
        return np.empty((0, 2)), np.nan
    return points[hull.vertices], float(hull.volume)
