"""Skeletons of tiles joined into one: nothing lost at a seam, nothing twice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.cluster.hierarchy import DisjointSet
from scipy.spatial import cKDTree

from ...analysis.comparison import matched
from ...analysis.curves import along, pieces, simple_edges
from ...data.skeleton import Skeleton
from ...geometry.groups import component_labels
from ...geometry.polylines import maximal_paths
from ...geometry.vectors import dot, norm
from .tiles import CUT_REACH, Grid, Tile

SAMPLE_STEP = 0.25  # fitted: of the scale of a curve, between the places at which others are compared with it
MOST_SAMPLES = 1000  # derived: places on an edge, where the part has no thickness: a thousandth of it is near enough
CLAIM_SHARE = 0.5  # fitted: of how far beyond its box a tile counts, up to where a piece must come to be its own
LONGEST_STUB = 2.0  # fitted: of its scale, up to which what ends at a seam is the foot of a limb that forks beyond it

RADIUS, SCALE = 3, 5
"""Columns of the values of `Strands`."""
CROSSING, BORDER, INNER = 0, 1, 2
"""Columns of marks: vertices put where an edge crosses a plane, cut ends at the border of what counts, and cut ends
where the curve goes on in what is there already."""


@dataclass(frozen=True)
class Strands:
    """A graph of which parts are taken.

    The values of a vertex are x, y, z, radius, confidence, scale, half width and half thickness. The scale is how far
    another skeleton of the same part may be away: the radius, or the longest edge there, whatever is more.
    """

    values: np.ndarray  # (n, 8) float
    edges: np.ndarray  # (e, 2) int
    marks: np.ndarray  # (n, 3) bool

    @classmethod
    def of(cls, skeleton: Skeleton) -> Strands:
        """The graph of a skeleton."""
        longest = np.zeros(len(skeleton.vertices))
        np.maximum.at(longest, skeleton.edges, skeleton.edge_lengths[:, None])
        facts = skeleton.radii, skeleton.confidence, np.fmax(skeleton.radii, longest)
        values = np.column_stack([skeleton.vertices, *facts, skeleton.half_width, skeleton.half_thickness])
        return cls(values, skeleton.edges, np.zeros((len(values), 3), bool))

    @property
    def middles(self) -> np.ndarray:
        """The values half-way along every edge, (e, 8) float array."""
        return self.values[self.edges].mean(axis=1)

    @property
    def degree(self) -> np.ndarray:
        """(n,) int array."""
        return np.bincount(self.edges.ravel(), minlength=len(self.values))

    @property
    def pieces(self) -> np.ndarray:
        """Connected component of every vertex, (n,) int array."""
        return component_labels(len(self.values), self.edges)

    def split(self, axis: int, value: float) -> Strands:
        """The same with a vertex wherever an edge crosses a plane."""
        side = self.values[:, axis] - value
        crosses = np.prod(np.sign(side)[self.edges], axis=1) < 0
        a, b = self.edges[crosses].T
        share = (side[a] / (side[a] - side[b]))[:, None]
        new = self.values[a] + share * (self.values[b] - self.values[a])
        new[:, axis] = value
        at = len(self.values) + np.arange(len(new))
        halves = [np.stack([a, at], axis=1), np.stack([at, b], axis=1)]
        return Strands(
            np.concatenate([self.values, new]),
            np.concatenate([self.edges[~crosses], *halves]),
            np.concatenate([self.marks, np.tile([True, False, False], (len(new), 1))]),
        )

    def keep(self, edges: np.ndarray, alone: np.ndarray, mark: int) -> Strands:
        """Some edges with their vertices, and of the vertices that have none those that are chosen by `alone`.

        Vertices that lose some of their edges are marked in the column `mark`.
        """
        degree = np.bincount(self.edges[edges].ravel(), minlength=len(self.values))
        marks = self.marks.copy()
        marks[:, mark] |= (degree > 0) & (degree < self.degree)
        return Strands(self.values, self.edges[edges], marks)._compact((degree > 0) | (alone & (self.degree == 0)))

    def with_pieces(self, chosen: np.ndarray) -> Strands:
        """The connected pieces that have one of some vertices, (n,) bool array."""
        pieces = self.pieces
        whole = np.isin(pieces, pieces[chosen])
        return Strands(self.values, self.edges[whole[self.edges[:, 0]]], self.marks)._compact(whole)

    def within(self, low: np.ndarray, high: np.ndarray) -> Strands:
        """What is in a box, cut at its faces."""
        cut = self
        for axis in range(3):
            for value in (low[axis], high[axis]):
                cut = cut.split(axis, float(value)) if np.isfinite(value) else cut
        return cut.keep(inside(cut.middles, low, high), inside(cut.values, low, high), BORDER)

    def touching(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Vertices in a box, or with an edge whose middle is, (n,) bool array."""
        touches = inside(self.values, low, high)
        touches[self.edges[inside(self.middles, low, high)]] = True
        return touches

    def outward(self) -> np.ndarray:
        """At every cut end at the border the direction in which its curve would go on, (n, 3) float array; else 0."""
        a, b = self.edges.T
        step = self.values[b, :3] - self.values[a, :3]
        step = step / np.maximum(norm(step), np.finfo(float).tiny)[:, None]
        directions = np.zeros((len(self.values), 3))
        np.add.at(directions, b, step)
        np.add.at(directions, a, -step)
        return directions * self.marks[:, [BORDER]]

    def mended(self) -> Strands:
        """Without the vertices that were made in vain, in the middle of edges that went on."""
        kept = ~self.marks[:, CROSSING] | self.marks[:, [BORDER, INNER]].any(axis=1) | (self.degree != 2)
        paths = (np.compress(kept[path], path) for path, _ in maximal_paths(len(kept), self.edges))
        links = [np.empty((0, 2), np.int64), *(np.stack([path[:-1], path[1:]], axis=1) for path in paths)]
        return Strands(self.values, simple_edges(np.concatenate(links)), self.marks)._compact(kept)

    def _compact(self, kept: np.ndarray) -> Strands:
        number = np.cumsum(kept) - 1
        return Strands(self.values[kept], number[self.edges].reshape(-1, 2), self.marks[kept])


class Seams(NamedTuple):
    """How cut ends met at the seams of tiles."""

    joined: int  # pairs that were made one, and ends that were tied to a curve beside them
    unmatched: int  # ends that nobody went on from, since one of two tiles lost what the other has; kept as ends
    thickest: float  # radius of the thickest part within reach of a cut through the points

    def messages(self, grid: Grid) -> list[str]:
        """What is to be beware of, in sentences."""
        messages = []
        if self.unmatched:
            cuts = f"{self.unmatched} of {self.joined + self.unmatched} cuts at seams have nothing to meet"
            messages.append(f"{cuts} on the other side, and end there: give larger tiles, or more overlap")
        if self.thickest > grid.thickest:
            parts = f"at seams there are parts thicker than the overlap of {grid.overlap:g} allows"
            enough = grid.overlap * self.thickest / grid.thickest
            messages.append(f"{parts}, radius up to {self.thickest:.3g}: give {enough:.3g} or more")
        return messages


class Samples(NamedTuple):
    """Places along the curves of earlier tiles."""

    places: np.ndarray  # (m, 3)
    scale: np.ndarray  # (m,)
    vertex: np.ndarray  # (m,) number of the nearer end of the edge
    outward: np.ndarray  # (m, 3) where the curve would go on, at cut ends; 0 elsewhere

    @classmethod
    def of(cls, strands: Strands, first: int) -> Samples:
        """Vertices, of which the first has that number, and places between them."""
        places, edges = strands.values[:, :3], strands.edges
        row, part, between = np.empty(0, int), np.empty(0), np.empty((0, 8))
        if len(edges):
            scale = np.fmax(np.fmin(*strands.values[edges, SCALE].T), np.finfo(float).tiny)
            length = norm(places[edges[:, 1]] - places[edges[:, 0]])
            row, part = pieces(places, edges, np.fmax(SAMPLE_STEP * scale, length / MOST_SAMPLES))
            between = along(edges, row, part, strands.values)
        values = np.concatenate([strands.values, between])
        vertex = np.concatenate([np.arange(len(places)), edges[row, (part > 0.5).astype(int)]])
        outward = np.concatenate([strands.outward(), np.zeros((len(row), 3))])
        return cls(values[:, :3], values[:, SCALE], first + vertex, outward)

    def covers(self, values: np.ndarray) -> np.ndarray:
        """Which places are on these curves: no farther away than either is thick, and not past a cut end."""
        distance, nearest = cKDTree(self.places).query(values[:, :3])
        past = dot(values[:, :3] - self.places[nearest], self.outward[nearest]) > 0
        return (distance <= np.fmax(values[:, SCALE], self.scale[nearest])) & ~past


def join_tiles(skeletons: Mapping[Tile, Skeleton], grid: Grid) -> tuple[Skeleton, Seams]:
    """Join the skeletons of overlapping tiles, whatever their order; the result has no points.

    What crosses a face was seen whole by the tiles on both sides, and their skeletons nearly coincide there. Tiles are
    taken in the order of their numbers. Each brings the pieces of its skeleton that come into its box, or a little
    beyond it, less what lies on what others brought; where that ends, their cut ends are at hand, and the two are made
    one. So a curve is cut once where it crosses from tile to tile, and not at all where it runs along a face. Parts are
    farther apart than either is thick: what lies nearer to another tile's skeleton than the radius is the same part.

    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> points = torus(8000, radius=0.05).points
    >>> grid = Grid.over(points.min(axis=0), points.max(axis=0), size=0.6, overlap=0.15)
    >>> ring, seams = join_tiles({tile: skeletonize(points[rows]) for tile, rows in grid.parted(points)}, grid)
    >>> ring.n_components, ring.n_loops, seams.joined, seams.unmatched
    (1, 1, 4, 0)
    """
    union = _Union()
    samples: dict[Tile, Samples] = {}
    for tile in sorted(skeletons):
        near = [other for other in samples if max(abs(a - b) for a, b in zip(other, tile, strict=True)) <= 1]
        strands = Strands.of(skeletons[tile]).within(*grid.box(tile, grid.trust))
        # the skeleton of a part within reach of a cut through the points is not to be trusted
        cut = ~inside(strands.values, *grid.box(tile, grid.overlap), CUT_REACH * strands.values[:, RADIUS])
        union.thickest = float(np.nanmax(strands.values[cut, RADIUS], initial=union.thickest))
        strands = strands.with_pieces(strands.touching(*grid.box(tile, CLAIM_SHARE * grid.trust)))
        earlier = Samples(*map(np.concatenate, zip(*(samples[other] for other in near), strict=True))) if near else None
        if earlier is not None and len(earlier.places):
            strands, tips = _new_strands(strands, earlier, grid, tile, near)
            union.tips.append(tips)
        samples[tile] = union.add(strands, earlier)
    return union.skeleton()


def _new_strands(
    strands: Strands, earlier: Samples, grid: Grid, tile: Tile, near: Sequence[Tile]
) -> tuple[Strands, np.ndarray]:
    """What earlier tiles lack, and the values of the ends of the object that they have."""
    for axis, value in grid.seams(tile):
        strands = strands.split(axis, value)
    covered = earlier.covers(strands.middles)
    tips = (strands.degree == 1) & ~strands.marks[:, BORDER]
    tips[strands.edges[~covered]] = False
    new = strands.keep(~covered, ~earlier.covers(strands.values), INNER)
    # a stretch of a curve that is also in the box of an earlier tile, but elsewhere in its skeleton, is that tile's;
    # unless that has nothing of the whole piece
    middles, labels = new.middles, new.pieces
    shared = np.any([inside(middles, *grid.box(other, grid.trust), middles[:, SCALE]) for other in near], axis=0)
    own = ~np.isin(labels, labels[new.marks[:, INNER]])
    own[new.edges[~shared]] = True
    return new.with_pieces(own).mended(), strands.values[tips]


class _Union:
    """The strands of all tiles so far. Vertices are numbered through."""

    def __init__(self) -> None:
        self._values = [np.empty((0, 8))]
        self._edges = [np.empty((0, 2), np.int64)]
        self._merged: list[tuple[int, int]] = []  # a cut end, and the earlier one that is the same place
        self._touching: list[tuple[int, int]] = []  # a cut end without such a one, and the earlier vertex nearest to it
        self._open: dict[int, np.ndarray] = {}  # the values of cut ends at the border that nothing continues
        self.tips = [np.empty((0, 8))]  # ends of the object in several tiles: there a cut end has no counterpart
        self.thickest = 0.0

    def add(self, strands: Strands, earlier: Samples | None) -> Samples:
        """Add the strands of a tile, join their inner cut ends to earlier ones, and sample them."""
        first = sum(map(len, self._values))
        self._values.append(strands.values)
        self._edges.append(strands.edges + first)
        border, inner = strands.marks[:, BORDER], strands.marks[:, INNER]
        self._open |= {first + row: strands.values[row] for row in np.flatnonzero(border & ~inner).tolist()}
        if inner.any():
            assert earlier is not None
            self._match({first + row: strands.values[row] for row in np.flatnonzero(inner).tolist()}, earlier)
        return Samples.of(strands, first)

    def _match(self, inner: dict[int, np.ndarray], earlier: Samples) -> None:
        """Match inner cut ends with open ones, the nearest first, one to one; others touch what is nearest."""
        known = set(earlier.vertex.tolist())
        border = {vertex: values for vertex, values in self._open.items() if vertex in known}
        a, b = (np.array(list(ends.values())).reshape(-1, 8) for ends in (inner, border))
        inner_ends, border_ends, unmatched = list(inner), list(border), dict(inner)
        for row, column in matched(a[:, :3], b[:, :3], a[:, None, SCALE] + b[:, SCALE]):
            pair = inner_ends[row], border_ends[column]
            self._merged.append(pair)
            del unmatched[pair[0]], self._open[pair[1]]
        if unmatched:
            nearest = cKDTree(earlier.places).query(np.array(list(unmatched.values()))[:, :3])[1]
            self._touching += zip(unmatched, earlier.vertex[nearest].tolist(), strict=True)

    def skeleton(self) -> tuple[Skeleton, Seams]:
        """The skeleton of all strands, merged, tied and without stubs; and how its seams are."""
        values, representative = self._merged_values()
        edges = simple_edges(representative[np.concatenate(self._edges)])
        touching = representative[np.array(self._touching, np.int64).reshape(-1, 2)]
        tied = _closing_no_loop(touching, component_labels(len(values), edges))
        edges, loose = simple_edges(np.concatenate([edges, touching[tied]])), touching[~tied, 0]
        ends = np.concatenate([np.array(list(self._open), np.int64), loose])
        ends = ends[np.bincount(edges.ravel(), minlength=len(values))[ends] < 2]  # at a fork the curve goes on
        stubs, ends = _stubs(values, edges, ends)
        tips = np.concatenate(self.tips)
        if len(tips):
            distance, nearest = cKDTree(tips[:, :3]).query(values[ends, :3])
            ends = ends[distance > values[ends, SCALE] + tips[nearest, SCALE]]
        seams = Seams(len(self._merged) + int(tied.sum()), len(ends), self.thickest)
        kept = representative == np.arange(len(values))
        kept[stubs] = False
        number, none = np.cumsum(kept) - 1, np.empty((0, 3))
        edges, values = simple_edges(number[edges[kept[edges].all(axis=1)]]), values[kept]
        names = ("radii", "confidence", "half_width", "half_thickness")
        sections = dict(zip(names, values.T[[3, 4, 6, 7]], strict=True))
        return Skeleton(values[:, :3], edges, vertex_of_point=none, points=none, normals=none, **sections), seams

    def _merged_values(self) -> tuple[np.ndarray, np.ndarray]:
        """The values, of two merged ends their mean, and the representative of every vertex."""
        values = np.concatenate(self._values)
        representative = np.arange(len(values))
        merged, target = np.array(self._merged, np.int64).reshape(-1, 2).T
        representative[merged] = target
        values[target] = (values[target] + values[merged]) / 2
        return values, representative


def _closing_no_loop(pairs: np.ndarray, component: np.ndarray) -> np.ndarray:
    """Which pairs of vertices, (k, 2) int array, join two components when they are tied in their order."""
    connected = DisjointSet(range(len(component)))
    return np.array([connected.merge(*pair) for pair in component[pairs].tolist()], bool)


def _stubs(values: np.ndarray, edges: np.ndarray, ends: np.ndarray) -> tuple[list[int], np.ndarray]:
    """Vertices of short limbs that end in a cut: on the other side they fork elsewhere; and the other cut ends."""
    degree = np.bincount(edges.ravel(), minlength=len(values))
    stubs, others = list[int](), set(ends.tolist())
    for path, _ in maximal_paths(len(values), edges):
        path = path if path[0] in others else path[::-1]
        if path[0] in others and degree[path[-1]] > 2:
            length = norm(np.diff(values[path, :3], axis=0)).sum()
            if length <= LONGEST_STUB * values[path[0], SCALE]:
                stubs += path[:-1]
                others.remove(path[0])
                degree[path[-1]] -= 1
    return stubs, np.array(sorted(others), np.int64)


def inside(values: np.ndarray, low: np.ndarray, high: np.ndarray, by: np.ndarray | float = 0.0) -> np.ndarray:
    """Which rows, whose first columns are x, y and z, lie in a box, so far from its faces at least, (n,) bool array."""
    places, by = values[:, :3], np.reshape(by, (-1, 1))
    return np.all((places >= low + by) & (places <= high - by), axis=1)
