"""Graphs that are cut: the edges of a skeleton with what is known at their ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.groups import component_labels
from ..numerics.vectors import norm
from ..skeleton import Skeleton

MADE, BORDER, INNER = 0, 1, 2
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
        found = inside(self.values, low, high)
        found[self.edges[inside(self.middles, low, high)]] = True
        return found

    def outward(self) -> np.ndarray:
        """At every cut end at the border the direction in which its curve would go on, (n, 3) float array; else 0."""
        a, b = self.edges.T
        step = self.values[b, :3] - self.values[a, :3]
        step = step / np.maximum(norm(step), np.finfo(float).tiny)[:, None]
        found = np.zeros((len(self.values), 3))
        np.add.at(found, b, step)
        np.add.at(found, a, -step)
        return found * self.marks[:, [BORDER]]

    def mended(self) -> Strands:
        """Without the vertices that were made in vain, in the middle of edges that went on."""
        around = neighbours(self.edges)
        vain = self.marks[:, MADE] & ~self.marks[:, [BORDER, INNER]].any(axis=1)
        for at in np.flatnonzero(vain).tolist():
            if len(around[at]) == 2:
                one, other = around.pop(at)
                around[one] = around[one] - {at} | {other}
                around[other] = around[other] - {at} | {one}
        edges = np.array([(a, b) for a in sorted(around) for b in sorted(around[a]) if a < b], np.int64).reshape(-1, 2)
        kept = self.degree == 0
        kept[list(around)] = True
        return Strands(self.values, edges, self.marks)._compact(kept)

    def _compact(self, kept: np.ndarray) -> Strands:
        number = np.cumsum(kept) - 1
        return Strands(self.values[kept], number[self.edges].reshape(-1, 2), self.marks[kept])


def inside(values: np.ndarray, low: np.ndarray, high: np.ndarray, by: np.ndarray | float = 0.0) -> np.ndarray:
    """Which rows, whose first columns are x, y and z, lie in a box, so far from its faces at least, (n,) bool array."""
    places, by = values[:, :3], np.reshape(by, (-1, 1))
    return np.all((places >= low + by) & (places <= high - by), axis=1)


def neighbours(edges: np.ndarray) -> dict[int, set[int]]:
    """The vertices that edges join to each."""
    around: dict[int, set[int]] = {}
    for a, b in edges.tolist():
        around.setdefault(a, set()).add(b)
        around.setdefault(b, set()).add(a)
    return around
