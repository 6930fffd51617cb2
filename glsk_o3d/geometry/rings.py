"""One-rings of a point cloud: which neighbours surround each point, in rotational order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from .delaunay_star import delaunay_star
from .vectors import dot

STAR_CHUNK = 1536  # speed: rows at a time: the (rows, k) work arrays then stay in the cache


@dataclass(frozen=True, eq=False)
class Rings:
    """One-rings of n points in compressed-row form.

    The ring of point i is ``indices[indptr[i]:indptr[i + 1]]``, its neighbours in rotational order. One that is
    `closed` (n,) is an umbrella: its last and first neighbour share a triangle with the point; an open one is a fan.
    Rings of clouds are never empty, since the nearest neighbour is always in them: `mean_lengths` and `nearest` rely
    on that.
    """

    indptr: np.ndarray
    indices: np.ndarray
    closed: np.ndarray

    @classmethod
    def of_sizes(cls, sizes: np.ndarray, indices: np.ndarray, closed: np.ndarray) -> Rings:
        """Rings from the number of neighbours of each point, (n,), and all of these in a row, (m,)."""
        return cls(np.concatenate([[0], np.cumsum(sizes)]), indices, closed)

    @classmethod
    def of_faces(cls, n: int, faces: np.ndarray) -> Rings:
        """Ascending neighbours of n vertices in a mesh (f, 3), each of which has a face; closed where no border is."""
        sides = faces[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
        number, count = np.unique(sides @ [n, 1], return_counts=True)
        closed = np.ones(n, bool)
        closed[number[count == 1] // n] = False
        return cls(np.searchsorted(number // n, np.arange(n + 1)), number % n, closed)

    @classmethod
    def from_padded(cls, ring: np.ndarray, closed: np.ndarray) -> Rings:
        """Rings from an (n, r) int array padded with -1 and an (n,) bool array."""
        present = ring >= 0
        return cls.of_sizes(present.sum(axis=1), ring[present], closed)

    @classmethod
    def concatenate(cls, parts: Sequence[Rings]) -> Rings:
        """One Rings from several, in order."""
        empty = cls.from_padded(np.empty((0, 0), int), np.empty(0, bool))
        names = ("sizes", "indices", "closed")
        return cls.of_sizes(*(np.concatenate([getattr(part, name) for part in (empty, *parts)]) for name in names))

    def __len__(self) -> int:
        return len(self.closed)

    def __getitem__(self, point: int) -> np.ndarray:
        return self.indices[self.indptr[point] : self.indptr[point + 1]]

    @cached_property
    def sizes(self) -> np.ndarray:
        """Neighbours per ring, (n,) int array."""
        return np.diff(self.indptr)

    @cached_property
    def centres(self) -> np.ndarray:
        """The point that each entry of `indices` belongs to, (m,) int array."""
        return np.repeat(np.arange(len(self)), self.sizes)

    @cached_property
    def fans(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions in `indices` of two neighbours that share a triangle with their point: two (t,) int arrays."""
        following = np.arange(1, len(self.indices) + 1)
        filled = self.sizes > 0
        following[self.indptr[1:][filled] - 1] = np.where(self.closed, self.indptr[:-1], -1)[filled]
        entry = np.flatnonzero(following >= 0)
        return entry, following[entry]

    @property
    def triangles(self) -> np.ndarray:
        """Fan triangles (i, j, k): a point and two consecutive neighbours, (t, 3) int array."""
        entry, after = self.fans
        return np.stack([self.centres[entry], self.indices[entry], self.indices[after]], axis=1)

    def edge_lengths(self, points: np.ndarray) -> np.ndarray:
        """Distance from every point to each of its ring neighbours, (m,) float array."""
        squared = np.zeros(len(self.indices))
        for x in points.T:
            edge = x.take(self.indices) - x.take(self.centres)
            squared += edge * edge
        return np.sqrt(squared)

    def mean_lengths(self, points: np.ndarray) -> np.ndarray:
        """Mean ring edge of every point with a ring, (n,) float array."""
        return np.add.reduceat(self.edge_lengths(points), self.indptr[:-1]) / self.sizes

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nearest ring neighbour of every point, (n,) int array, the first if several are, and its distance, (n,)."""
        known, result = self.__dict__.get("_nearest", (None, None))
        if known is not points:  # the reducer asks what the contractor asked before it
            length = self.edge_lengths(points)
            distance = np.minimum.reduceat(length, self.indptr[:-1])
            hits = np.flatnonzero(length == np.repeat(distance, self.sizes))
            result = self.indices[hits[np.searchsorted(hits, self.indptr[:-1])]], distance
            self.__dict__["_nearest"] = points, result
        return result

    def mean_over(self, values: np.ndarray) -> np.ndarray:
        """Mean of the neighbours' values, (n, d) float array from `values` (n, d); 0 for an empty ring."""
        return self._adjacency @ values / np.maximum(self.sizes, 1)[:, None]

    @cached_property
    def _adjacency(self) -> csr_array:
        return csr_array((np.ones(len(self.indices)), self.indices, self.indptr), shape=(len(self),) * 2)

    def folded(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Closed rings that, seen along the normals (n, 3) or against, do not turn once around their point, (n,)."""
        across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
        edge, up = points[self.indices] - points[self.centres], np.cross(normals, across)
        angle = np.arctan2(dot(edge, up[self.centres]), dot(edge, across[self.centres]))
        entry, after = self.fans
        turn = (angle[after] - angle[entry]) % (2 * np.pi)
        turns = np.rint(np.bincount(self.centres[entry], turn, len(self)) / (2 * np.pi))
        return self.closed & (turns != 1) & (turns != self.sizes - 1)

    def take(self, points: np.ndarray) -> Rings:
        """The rings of the given points, in their order; the indices stay as they are."""
        sizes = self.sizes[points]
        stop = np.cumsum(sizes)
        source = np.repeat(self.indptr[points] - stop + sizes, sizes) + np.arange(sizes.sum())
        return Rings.of_sizes(sizes, self.indices[source], self.closed[points])

    def replace(self, points: np.ndarray, rings: Rings) -> Rings:
        """These rings with those of `points` replaced by `rings`."""
        source = np.arange(len(self))
        source[points] = len(self) + np.arange(len(rings))
        return Rings.concatenate([self, rings]).take(source)

    def rename(self, index: np.ndarray) -> Rings:
        """These rings with neighbour j called index[j]; neighbours that fall together in a row become one."""
        indices, centres = index[self.indices], self.centres
        repeats = (indices[1:] == indices[:-1]) & (centres[1:] == centres[:-1])
        kept = np.flatnonzero(np.append(True, ~repeats)[: len(indices)])
        sizes = np.bincount(centres[kept], minlength=len(self))
        several = self.closed & (sizes > 1)
        last = np.cumsum(sizes)[several] - 1
        first = last + 1 - sizes[several]
        kept = np.delete(kept, last[indices[kept[first]] == indices[kept[last]]])
        return Rings.of_sizes(np.bincount(centres[kept], minlength=len(self)), indices[kept], self.closed)

    def padded(self, points: np.ndarray) -> np.ndarray:
        """The rings of the given points as rows padded with -1, (c, r) int array."""
        rings = self.take(points)
        present = np.arange(rings.sizes.max(initial=0)) < rings.sizes[:, None]
        rows = np.full(present.shape, -1)
        rows[present] = rings.indices
        return rows


def star_rings(points: np.ndarray, centres: np.ndarray, neighbours: np.ndarray, axes: np.ndarray) -> Rings:
    """Delaunay star of each centre (n,) among its neighbours (n, k), padded with -1, in the plane of axes (n, 3, 2)."""
    chunks = []
    for start in range(0, len(centres), STAR_CHUNK):
        part = slice(start, start + STAR_CHUNK)
        candidates = neighbours[part]
        offsets = np.matmul(points.take(candidates, axis=0) - points[centres[part], None], axes[part])
        position, closed = delaunay_star(offsets, candidates >= 0)
        ring = np.take_along_axis(candidates, np.maximum(position, 0), axis=1)
        chunks.append(Rings.from_padded(np.where(position >= 0, ring, -1), closed))
    return Rings.concatenate(chunks)
