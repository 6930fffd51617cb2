"""The same sample of a cloud that comes in blocks, again and again, and never is in memory as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ..numerics.morton import MORTON_BITS
from ..numerics.vectors import dot
from .sampling import Extent, Grid, cells_along, occupied_cells

Blocks = Callable[[], Iterable[np.ndarray]]
"""Gives the (m, 3) float arrays of a cloud, none of them empty, whenever it is asked."""

CELLS_KEPT = 8  # derived: cells of the finest grid kept, over those wanted: of one half as fine an eighth are left


def sample_blocks(blocks: Blocks, size: Callable[[int], int]) -> tuple[np.ndarray, np.ndarray]:
    """The points (c, 3) that `sample_cloud` keeps, and how many each stands for, (c,); `size` says how many of so many.

    The cloud is read four times, and memory does not grow with it: for how far it reaches, how fine the grid must be,
    the means of the cells, and the points nearest to them; a small one twice. Copies of a point count, unlike those in
    memory.
    """
    extent = Extent()
    for points in blocks():
        extent.add(points)
    n = size(extent.n)
    if extent.n <= 2 * n:
        return np.concatenate([np.empty((0, 3)), *blocks()]), np.ones(extent.n, int)
    grid = extent.grid()
    cells = _fineness(blocks, grid, n)
    means = _Means()
    for points in blocks():
        means.add(points, grid.codes(points, cells))
    nearest = _Nearest(means, grid)
    for points in blocks():
        nearest.add(points, grid.codes(points, cells))
    return nearest.points, means.counts


def _fineness(blocks: Blocks, grid: Grid, n: int) -> float:
    """Cells along the grid for about n to be occupied."""
    codes, bits = np.empty(0, np.uint64), MORTON_BITS
    for points in blocks():
        found = _distinct(np.sort(grid.codes(points, 2**MORTON_BITS - 1) >> np.uint64(3 * (MORTON_BITS - bits))))
        found = found[~_known(codes, found)[1]]
        if len(found):
            codes = np.sort(np.concatenate([codes, found]))
        while len(codes) > CELLS_KEPT * n:
            codes, bits = _distinct(codes >> np.uint64(3)), bits - 1
    return cells_along(occupied_cells(codes, bits, n), n)


def _distinct(ordered: np.ndarray) -> np.ndarray:
    return ordered[np.append(True, ordered[1:] != ordered[:-1])]


class _Means:
    """Sums and numbers of points by cell, in the order of the codes."""

    def __init__(self) -> None:
        self.codes = np.empty(0, np.uint64)
        self.counts = np.empty(0, int)
        self._sums = np.empty((0, 3))

    def add(self, points: np.ndarray, code: np.ndarray) -> None:
        order, codes, begin = _by_cell(code)
        counts = np.diff(np.append(begin, len(code)))
        sums = np.add.reduceat(points.take(order, axis=0), begin)
        at, known = _known(self.codes, codes)
        self.counts[at[known]] += counts[known]
        self._sums[at[known]] += sums[known]
        if not known.all():
            self.codes = np.concatenate([self.codes, codes[~known]])
            order = np.argsort(self.codes, kind="stable")
            self.codes = self.codes[order]
            self.counts = np.concatenate([self.counts, counts[~known]])[order]
            self._sums = np.concatenate([self._sums, sums[~known]]).take(order, axis=0)

    @property
    def means(self) -> np.ndarray:
        return self._sums / self.counts[:, None]


class _Nearest:
    """The point nearest to the mean of each cell; where two are, as in every cell of two, the first in Morton order."""

    def __init__(self, means: _Means, grid: Grid) -> None:
        self._codes, self._means, self._grid = means.codes, means.means, grid
        self._squared = np.full(len(means.codes), np.inf)
        self.points = np.empty((len(means.codes), 3))

    def add(self, points: np.ndarray, code: np.ndarray) -> None:
        order, codes, begin = _by_cell(code)
        cell = np.searchsorted(self._codes, codes)
        size = np.diff(np.append(begin, len(code)))
        points = points.take(order, axis=0)
        away = points - np.repeat(self._means[cell], size, axis=0)
        squared = dot(away, away)
        least = np.minimum.reduceat(squared, begin)
        at = np.flatnonzero(squared == np.repeat(least, size))
        group = np.repeat(np.arange(len(cell)), size)[at]
        first = np.empty(len(cell), int)
        first[group[::-1]] = at[::-1]
        tied = np.flatnonzero(np.bincount(group)[group] > 1)
        tied = tied[np.lexsort((*points[at[tied]].T, self._fine(points[at[tied]])))][::-1]
        first[group[tied]] = at[tied]
        points, best = points[first], self._squared[cell]
        nearer, same = least < best, np.flatnonzero(least == best)
        nearer[same] = self._before(points[same], self.points[cell[same]])
        self._squared[cell[nearer]] = least[nearer]
        self.points[cell[nearer]] = points[nearer]

    def _before(self, points: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Which come before others in Morton order; in one cell of it by their coordinates, the last first."""
        ours, theirs = self._fine(points), self._fine(others)
        before, same = ours < theirs, ours == theirs
        for axis in (2, 1, 0):
            before |= same & (points[:, axis] < others[:, axis])
            same &= points[:, axis] == others[:, axis]
        return before

    def _fine(self, points: np.ndarray) -> np.ndarray:
        return self._grid.codes(points, 2**MORTON_BITS - 1)


def _by_cell(code: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The order by cells, the codes of these, and where in that order each begins."""
    row_bits = np.uint64(len(code).bit_length())
    if int(code.max()).bit_length() + int(row_bits) <= 64:  # sorted together with its row: five times as fast
        both = np.sort(code << row_bits | np.arange(len(code), dtype=np.uint64))
        order, ordered = (both & ((np.uint64(1) << row_bits) - np.uint64(1))).astype(np.int64), both >> row_bits
    else:
        order = np.argsort(code, kind="stable")
        ordered = code[order]
    begin = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
    return order, ordered[begin], begin


def _known(codes: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where in sorted codes others would stand, and whether they do."""
    at = np.searchsorted(codes, wanted)
    return at, np.append(codes, np.uint64(0)).take(at) == wanted if len(codes) else np.zeros(len(wanted), bool)
