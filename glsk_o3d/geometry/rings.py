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
    `closed` (n,) is an umbrella: its last and first neighbour share a triangle with the point. An open one is a fan, at
    the border of a scan. Rings of clouds are never empty, since the nearest neighbour of a point is always in its ring;
    `mean_lengths` and `nearest` rely on that.
    """

    indptr: np.ndarray
    indices: np.ndarray
    closed: np.ndarray

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
        some = self.sizes > 0
        last = self.indptr[1:][some] - 1
        following[last] = np.where(self.closed[some], self.indptr[:-1][some], -1)
        entry = np.flatnonzero(following >= 0)
        return entry, following[entry]

    @property
    def triangles(self) -> np.ndarray:
        """Fan triangles (i, j, k): a point and two consecutive neighbours, (t, 3) int array."""
        entry, after = self.fans
        return np.column_stack([self.centres[entry], self.indices[entry], self.indices[after]])

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
        """Nearest ring neighbour of every point and its distance: ((n,) int array, (n,) float array).

        Of equally near neighbours the first in the ring.
        """
        asked, found = self.__dict__.get("_nearest", (None, None))
        if asked is not points:  # the reducer asks what the contractor asked before it
            length = self.edge_lengths(points)
            distance = np.minimum.reduceat(length, self.indptr[:-1])
            hits = np.flatnonzero(length == np.repeat(distance, self.sizes))
            centre = self.centres[hits]
            first = np.append(True, centre[1:] != centre[:-1])
            found = self.indices[hits[first]], distance
            self.__dict__["_nearest"] = points, found
        return found

    def mean_over(self, values: np.ndarray) -> np.ndarray:
        """Mean of the neighbours' values, (n, d) float array from `values` (n, d); 0 for an empty ring."""
        return self._adjacency @ values / np.maximum(self.sizes, 1)[:, None]

    @cached_property
    def _adjacency(self) -> csr_array:
        return csr_array((np.ones(len(self.indices)), self.indices, self.indptr), shape=(len(self),) * 2)

    def folded(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Closed rings that, seen along the normals (n, 3), do not turn once around their point, (n,) bool array.

        From one neighbour to the next the angle grows, from 0 to a whole turn; these add up to one turn, or, seen from
        below, to all turns but one.
        """
        across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
        way, up = points[self.indices] - points[self.centres], np.cross(normals, across)
        around = np.arctan2(dot(way, up[self.centres]), dot(way, across[self.centres]))
        entry, after = self.fans
        turn = (around[after] - around[entry]) % (2 * np.pi)
        turns = np.rint(np.bincount(self.centres[entry], turn, len(self)) / (2 * np.pi))
        return self.closed & (turns != 1) & (turns != self.sizes - 1)

    def take(self, points: np.ndarray) -> Rings:
        """The rings of some points, in the order given; the indices stay as they are."""
        sizes = self.sizes[points]
        indptr = np.concatenate([[0], np.cumsum(sizes)])
        source = np.repeat(self.indptr[points] - indptr[:-1], sizes) + np.arange(indptr[-1])
        return Rings(indptr, self.indices[source], self.closed[points])

    def replace(self, points: np.ndarray, rings: Rings) -> Rings:
        """These rings with those of `points` replaced by `rings`."""
        both, source = Rings.concatenate([self, rings]), np.arange(len(self))
        source[points] = len(self) + np.arange(len(rings))
        return both.take(source)

    def rename(self, index: np.ndarray) -> Rings:
        """These rings with neighbour j called index[j]; neighbours that fall together in a row become one."""
        indices, centres = index[self.indices], self.centres
        repeats = np.zeros(len(indices), bool)
        repeats[1:] = (indices[1:] == indices[:-1]) & (centres[1:] == centres[:-1])
        kept = np.flatnonzero(~repeats)
        sizes = np.bincount(centres[kept], minlength=len(self))
        several = self.closed & (sizes > 1)
        last = np.cumsum(sizes)[several] - 1
        first = last + 1 - sizes[several]
        kept = np.delete(kept, last[indices[kept[first]] == indices[kept[last]]])
        sizes = np.bincount(centres[kept], minlength=len(self))
        return Rings(np.concatenate([[0], np.cumsum(sizes)]), indices[kept], self.closed)

    def padded(self, points: np.ndarray) -> np.ndarray:
        """The rings of some points as rows padded with -1, (c, r) int array."""
        rings = self.take(points)
        column = np.arange(rings.sizes.max(initial=0))
        present = column < rings.sizes[:, None]
        rows = np.full(present.shape, -1)
        rows[present] = rings.indices
        return rows

    @classmethod
    def of_faces(cls, n: int, faces: np.ndarray) -> Rings:
        """The neighbours of n vertices in a mesh (f, 3), each of which has a face; closed where there is no border.

        They are ascending, not in rotational order, since in a mesh that is no manifold there is none.
        """
        sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        number, count = np.unique(sides @ [n, 1], return_counts=True)
        edges = np.column_stack([number // n, number % n])
        both = np.sort(np.concatenate([number, edges @ [1, n]]))
        centre, neighbour, closed = both // n, both % n, np.ones(n, bool)
        closed[edges[count == 1]] = False
        return cls(np.searchsorted(centre, np.arange(n + 1)), neighbour, closed)

    @classmethod
    def from_padded(cls, ring: np.ndarray, closed: np.ndarray) -> Rings:
        """Rings from an (n, r) int array padded with -1 and an (n,) bool array."""
        present = ring >= 0
        indptr = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
        return cls(indptr, ring[present], closed)

    @classmethod
    def concatenate(cls, parts: Sequence[Rings]) -> Rings:
        """One Rings from several, in order."""
        sizes = np.concatenate([np.zeros(1, int), *(part.sizes for part in parts)])
        indices = np.concatenate([np.empty(0, int), *(part.indices for part in parts)])
        closed = np.concatenate([np.empty(0, bool), *(part.closed for part in parts)])
        return cls(np.cumsum(sizes), indices, closed)


def star_rings(points: np.ndarray, centres: np.ndarray, neighbours: np.ndarray, axes: np.ndarray) -> Rings:
    """Ring of each centre (n,) among its neighbours (n, k), padded with -1: its Delaunay star in a plane.

    Both are rows of `points`; the plane is that of two orthonormal axes, (n, 3, 2).
    """
    chunks = []
    for start in range(0, len(centres), STAR_CHUNK):
        part = slice(start, start + STAR_CHUNK)
        candidates = neighbours[part]
        offsets = np.matmul(points.take(candidates, axis=0) - points[centres[part], None], axes[part])
        position, closed = delaunay_star(offsets, candidates >= 0)
        ring = np.take_along_axis(candidates, np.maximum(position, 0), axis=1)
        chunks.append(Rings.from_padded(np.where(position >= 0, ring, -1), closed))
    return Rings.concatenate(chunks)
