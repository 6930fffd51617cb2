"""The medial axis of a solid, as the part of a Voronoi diagram that is inside, and the curve that it burns down to."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from math import dist

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

from .numbers import derived, precision, speed
from .solver import solve_contraction
from .vectors import TINY, dot, norm


@dataclass(frozen=True)
class MedialNumbers:
    """Numbers of the curve on a medial axis."""

    limb: float = derived(1.5, "half widths from the curve where a limb begins: corners of square sections are at 1.41")
    flat: float = precision(1e-12, "of the product of its edges: volume of a tetrahedron that has no circumsphere")
    least_apart: float = precision(1e-2, "of a length to smooth over: edges shorter than that count as that long")
    rounds: int = precision(3, "solves, each along the curve of the one before")
    chunk: int = speed(64, "places at a time whose distances from all points are computed")


MEDIAL = MedialNumbers()
CORNERS = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]  # derived: of the triangles of a tetrahedron
SIDES = [[0, 1], [0, 2], [1, 2]]  # derived: of a triangle


@dataclass(frozen=True, eq=False)
class MedialAxis:
    """The cells of the Voronoi diagram of points on a closed surface that are inside (Amenta and Bern 1999).

    A solid and this complex can be deformed into each other where the points are dense: both have the same loops.

    Attributes
    ----------
    places, radii : (p, 3), (p,) float64 array
        Voronoi vertices: centre and radius of the ball around each of Delaunay's tetrahedra; the mean of its corners,
        and their distance, where that centre is outside.
    edges : (e, 2) int64 array
        Places whose tetrahedra share a triangle.
    edge_radii : (e,) float64 array
        Radius of the circle around that triangle.
    face_edges : (s, 2) int64 array
        Every Voronoi face with each of its edges; a face belongs to an edge between points that is inside.
    pole_of_point : (n,) int64 array
        The place with the largest ball that touches each point; -1 without any.
    """

    places: np.ndarray
    radii: np.ndarray
    edges: np.ndarray
    edge_radii: np.ndarray
    face_edges: np.ndarray
    pole_of_point: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, is_inside: Callable[[np.ndarray], np.ndarray]) -> MedialAxis:
        """That of points (n, 3) on a closed surface; `is_inside` says of places (m, 3) whether they are inside."""
        corners = np.sort(Delaunay(points).simplices, axis=1).astype(np.int64)
        corners = corners[is_inside(points[corners].mean(axis=1))]
        places = _circumcentres(points[corners])
        flat = ~is_inside(places)  # the sphere through nearly flat ones has its centre anywhere
        places[flat] = points[corners[flat]].mean(axis=1)
        radii = norm(places - points[corners[:, 0]])
        triangles, edges = _shared(corners[:, CORNERS].reshape(-1, 3), len(points))
        sides = triangles[:, SIDES].reshape(-1, 2) @ [len(points), 1]
        of_tetrahedra = corners[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2) @ [len(points), 1]
        around, tetrahedra = np.unique(of_tetrahedra, return_counts=True)
        number, count = np.searchsorted(around, sides), np.zeros(len(around), int)
        np.add.at(count, number, 1)
        closed = count == tetrahedra  # as many triangles as tetrahedra around an edge: they close a ring
        kept = closed[number]
        face = (np.cumsum(closed) - 1)[number[kept]]
        pole, order = np.full(len(points), -1), np.argsort(radii, kind="stable")
        pole[corners[order].ravel()] = np.repeat(order, 4)  # of several writes the last one stays
        face_edges = np.column_stack([face, np.repeat(np.arange(len(edges)), 3)[kept]])
        return cls(places, radii, edges, _circumradii(points[triangles]), face_edges, pole)


def _circumcentres(corners: np.ndarray) -> np.ndarray:
    """Centres (t, 3) of the spheres through tetrahedra (t, 4, 3); means of flat ones."""
    first, sides = corners[:, 0], corners[:, 1:] - corners[:, :1]
    size = np.abs(sides).max(axis=(1, 2))
    round_ = np.abs(np.linalg.det(sides)) > MEDIAL.flat * size**3
    offset = corners.mean(axis=1) - first
    offset[round_] = np.linalg.solve(sides[round_], dot(sides, sides)[round_, :, None] / 2)[..., 0]
    return first + offset


def _circumradii(corners: np.ndarray) -> np.ndarray:
    """Radii of the circles through triangles (t, 3, 3)."""
    sides = corners - np.roll(corners, 1, axis=1)
    double_area = norm(np.cross(sides[:, 0], sides[:, 1]))
    return np.prod(np.linalg.norm(sides, axis=2), axis=1) / np.maximum(2 * double_area, TINY)


def _shared(triangles: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Of four triangles of each tetrahedron, sorted, over n points: those that two share, and the two, (e, 2)."""
    key = (triangles[:, 0] * n + triangles[:, 1]) * n + triangles[:, 2]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(key[order][1:] == key[order][:-1])
    return triangles[order[first]], np.column_stack([order[first], order[first + 1]]) // 4


@dataclass(frozen=True, eq=False)
class Burnt:
    """What is left of a medial axis when fire has come in from the borders of its sheets, and from loose ends.

    Attributes
    ----------
    core : (e,) bool array
        Edges that cannot burn: they are on loops, or between loops.
    has_sheets : bool
        Whether faces are left: closed ones around a cavity have no border.
    times : (e,) float64 array
        When the last sheet at an edge had burnt: the half width of the solid across the curve there.
    onward : (p,) int64 array
        The place to which fire went on along the curve from each place; -1 on the core, and where fire ended.
    """

    core: np.ndarray
    has_sheets: bool
    times: np.ndarray
    onward: np.ndarray

    @classmethod
    def of(cls, axis: MedialAxis) -> Burnt:
        """Burn an axis: sheets from their borders, where a fire starts when the ball there has burnt, then curves.

        As in erosion thickness (Yan, Sykes, Chambers, Letscher and Ju 2016, section 4), but from cell to cell, with one
        cell collapsed through another that belongs to no third (Liu, Chambers, Letscher and Ju 2010): so loops stay.
        """
        fire = _Fire(axis)
        while fire.queue:
            fire.burn(*heapq.heappop(fire.queue))
        core, has_sheets = np.array(fire.is_left, bool), any(fire.faces_of_edge)
        return cls(core, has_sheets, np.array(fire.times), np.array(fire.onward, int))


class _Fire:
    """The state of a burning axis: plain lists, since cells burn one by one."""

    def __init__(self, axis: MedialAxis) -> None:
        places, (n_edges, n_places) = axis.places, (len(axis.edges), len(axis.places))
        ends = places[axis.edges]
        self.middles, self.lengths = ends.mean(axis=1).tolist(), norm(ends[:, 1] - ends[:, 0]).tolist()
        self.edges, self.radii = axis.edges.tolist(), axis.edge_radii.tolist()
        self.faces_of_edge: list[list[int]] = [[] for _ in range(n_edges)]
        self.edges_of_face: list[list[int]] = [[] for _ in range(int(axis.face_edges[:, 0].max(initial=-1)) + 1)]
        for face, edge in axis.face_edges.tolist():
            self.faces_of_edge[edge].append(face)
            self.edges_of_face[face].append(edge)
        self.edges_of_place: list[set[int]] = [set() for _ in range(n_places)]
        for edge, (a, b) in enumerate(self.edges):
            self.edges_of_place[a].add(edge)
            self.edges_of_place[b].add(edge)
        self.is_left, self.onward = [True] * n_edges, [-1] * n_places
        self.times = list(self.radii)
        # a time, an edge, and the loose end that fire comes from, or -1 where it comes from a face's border
        self.queue = [(self.radii[k], k, -1) for k, faces in enumerate(self.faces_of_edge) if len(faces) == 1]
        heapq.heapify(self.queue)
        for place in range(n_places):
            self.reach(0.0, place)

    def reach(self, time: float, place: int) -> None:
        """Let fire go on from a place at which one edge is left, if its sheets have burnt."""
        if len(self.edges_of_place[place]) == 1:
            (edge,) = self.edges_of_place[place]
            if not self.faces_of_edge[edge]:
                heapq.heappush(self.queue, (max(time, self.times[edge]) + self.lengths[edge], edge, place))

    def burn(self, time: float, edge: int, place: int) -> None:
        """Burn an edge, and the face that it borders, if nothing has changed since fire came near."""
        if not self.is_left[edge]:
            return
        if place < 0 and len(self.faces_of_edge[edge]) == 1:
            self.burn_face(time, edge, self.faces_of_edge[edge].pop())
        elif place < 0 or len(self.edges_of_place[place]) != 1:
            return
        else:
            a, b = self.edges[edge]
            self.onward[place] = b if a == place else a
        self.is_left[edge] = False
        for end in self.edges[edge]:
            self.edges_of_place[end].discard(edge)
        for end in self.edges[edge]:
            self.reach(time, end)

    def burn_face(self, time: float, edge: int, face: int) -> None:
        """Burn a face from one of its edges; fire reaches the others."""
        self.times[edge] = time
        for other in self.edges_of_face[face]:
            faces = self.faces_of_edge[other]
            if other == edge or not self.is_left[other]:
                continue
            faces.remove(face)
            arrival = max(time + dist(self.middles[edge], self.middles[other]), self.radii[other])
            if len(faces) == 1:
                heapq.heappush(self.queue, (arrival, other, -1))
            elif not faces:
                self.times[other] = arrival
                for end in self.edges[other]:
                    self.reach(arrival, end)


def medial_curve(axis: MedialAxis, burnt: Burnt, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curve on a medial axis, as edges (m, 2), and the half width (p,) of the solid at each place.

    The curve is loops, what joins them, and a way from every limb. The half width is that across the curve, or of the
    ball there if that is larger.

    `points` (n, 3) are those on the surface. Where one is farther from the curve than one and a half times the half
    width of the solid there, a limb begins: the way of the fire from the pole of the farthest becomes part of the
    curve, until all are near, as in TEASAR (Sato et al. 2000). Where no loop is, the curve begins where fire ended.
    """
    is_on = burnt.onward < 0
    width = np.maximum(axis.radii, _latest(axis, burnt))
    has_pole = axis.pole_of_point >= 0
    pole, points = axis.pole_of_point[has_pole], points[has_pole]
    depth = _depths(axis.places, burnt.onward)[pole]
    distance = _nearest(points, axis.places, width, np.flatnonzero(is_on))
    while (beyond := distance > MEDIAL.limb).any():
        farthest = int(np.where(beyond, depth, -1.0).argmax())
        distance[farthest], place, way = 0.0, int(pole[farthest]), list[int]()
        while not is_on[place]:
            is_on[place] = True
            way.append(place)
            place = int(burnt.onward[place])
        distance = np.minimum(distance, _nearest(points, axis.places, width, np.array(way, int)))
    along = np.flatnonzero(is_on & (burnt.onward >= 0))
    return np.concatenate([axis.edges[burnt.core], np.column_stack([along, burnt.onward[along]])]), width


def without_waves(places: np.ndarray, edges: np.ndarray, length: np.ndarray) -> np.ndarray:
    r"""Places (p, 3) of a graph without waves along it that are shorter than a `length` (p,), more than 0, at each.

    They minimise :math:`\int |x - p|^2 + (\ell / 2 \pi)^4 |x''|^2` along the edges, as a smoothing spline does (Reinsch
    1967): waves of this length keep half their height, those of half the length a 17th. The second derivative is the
    Laplacian over the edges, at ends none. Every place has an edge. A zigzag is longer than the curve in its middle, so
    that lengths are measured anew along the answer.
    """
    a, b = edges.T
    least = MEDIAL.least_apart * (length[a] + length[b]) / 2
    difference = csr_array((np.tile([1.0, -1.0], len(edges)), edges.ravel(), 2 * np.arange(len(edges) + 1)))
    bend = np.where(np.bincount(edges.ravel()) > 1, (length / (2 * np.pi)) ** 2, 0)
    smooth = places
    for _ in range(MEDIAL.rounds):
        apart = np.maximum(norm(smooth[a] - smooth[b]), least)
        weight = np.sqrt(np.bincount(edges.ravel(), np.repeat(apart / 2, 2)))
        laplacian = difference.T @ diags_array(1 / apart) @ difference
        smooth, _ = solve_contraction(laplacian, bend / weight, weight, places)
    return smooth


def _latest(axis: MedialAxis, burnt: Burnt) -> np.ndarray:
    """The latest time at which the sheets at each place had burnt, (p,)."""
    latest = np.zeros(len(axis.places))
    np.maximum.at(latest, axis.edges, burnt.times[:, None])
    return latest


def _depths(places: np.ndarray, onward: np.ndarray) -> np.ndarray:
    """The way of the fire from every place to where it ended, (p,)."""
    start, n = np.flatnonzero(onward >= 0), len(places)
    length = np.maximum(norm(places[onward[start]] - places[start]), TINY)
    forest = coo_array((length, (onward[start], start)), shape=(n, n)).tocsr()
    depth: np.ndarray = dijkstra(forest, indices=np.flatnonzero(onward < 0), min_only=True)
    return depth


def _nearest(points: np.ndarray, places: np.ndarray, width: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Least distance of points (n, 3) from some places, each over the half width there, (n,)."""
    nearest = np.full(len(points), np.inf)
    for start in range(0, len(rows), MEDIAL.chunk):
        part = rows[start : start + MEDIAL.chunk]
        apart = np.linalg.norm(points[:, None] - places[part], axis=2) / width[part]
        np.minimum(nearest, apart.min(axis=1), out=nearest)
    return nearest
