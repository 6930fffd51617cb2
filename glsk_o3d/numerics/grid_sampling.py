"""A sample that stands for a large cloud: of one in memory, and of one that comes in blocks."""

from collections.abc import Callable, Iterable
from typing import NamedTuple, TypeAlias

import numpy as np

from .frame import check_extent
from .morton import MORTON_BITS, morton_codes, sort_within
from .vectors import dot

GRID_TAIL = 0.001  # fitted: share of the points that may be far off, at either end of each axis
TAIL_POINTS = 100000  # fitted: points by which that is told
# derived: odd numbers with bits everywhere, by which coordinates are mixed
MIXING = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
ALL_BITS = np.uint64(2**64 - 1)  # derived


Sample: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Rows (c,) of the points kept of a cloud; for each of its points the position among these of what stands for it; and
how many points each of these stands for, copies in a row of the grid's finest cells once."""


def sample_cloud(points: np.ndarray, n: int, counts: np.ndarray | None = None) -> Sample:
    """About n points that stand for a cloud of more than twice as many, or all of a smaller one.

    Each of the points may stand for `counts` (m,) points of another cloud already.
    """
    kept, position, weight = sample_grid(points, n) if len(points) > 2 * n else everybody(points)
    return kept, position, weight if counts is None else np.bincount(position, counts)


def everybody(points: np.ndarray) -> Sample:
    """All points, each for itself."""
    return np.arange(len(points)), np.arange(len(points)), np.ones(len(points))


class Grid(NamedTuple):
    """Where the cells of a cubic grid around a cloud are. Points far off share the cells at its border."""

    low: np.ndarray  # (3,) to which coordinates are raised
    high: np.ndarray  # (3,) and lowered
    corner: np.ndarray  # (3,) lowest coordinates then
    extent: float  # longest side of the box around the points then

    def codes(self, points: np.ndarray, cells: float) -> np.ndarray:
        """Morton codes of the cells of points, (m,) uint64 array, with so many cells along the longest side."""
        return morton_codes(np.clip(points, self.low, self.high), cells, self.corner, self.extent)


class Extent:
    """How far a cloud of `n` points reaches, told by its points in any number of blocks, whatever their order."""

    def __init__(self) -> None:
        self.n = 0
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._some, self._mixed, self._share = np.empty((0, 3)), np.empty(0, np.uint64), np.uint64(0)

    def add(self, points: np.ndarray) -> None:
        """Take in some points, (m, 3) float array, at least one."""
        self._low, self._high = np.minimum(self._low, points.min(axis=0)), np.maximum(self._high, points.max(axis=0))
        mixed = _mixed(points)
        few = mixed & self._share == 0
        self._some = np.concatenate([self._some, points[few]])
        self._mixed = np.concatenate([self._mixed, mixed[few]])
        while len(self._some) > TAIL_POINTS and self._share < ALL_BITS:  # those that one more bit chooses
            self._share = self._share << np.uint64(1) | np.uint64(1)
            few = self._mixed & self._share == 0
            self._some, self._mixed = self._some[few], self._mixed[few]
        self.n += len(points)

    def grid(self) -> Grid:
        """A grid around the points, see `check_extent`: a few far off do not decide how wide its cells are."""
        ends = np.stack([self._low, self._high])
        check_extent(ends, self.n)
        some = self._some if len(self._some) else ends  # nothing but copies
        low, high = np.quantile(some, [GRID_TAIL, 1 - GRID_TAIL], axis=0)
        low, high = 2 * low - high, 2 * high - low
        corner, top = np.clip(ends, low, high)
        return Grid(low, high, corner, float((top - corner).max()))


def _mixed(points: np.ndarray) -> np.ndarray:
    """A number for every point that is random but for its coordinates, (m,) uint64 array."""
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64)  # -0 is 0
    mixed = (bits * MIXING).sum(axis=1, dtype=np.uint64) + MIXING[1]  # nor is the origin, whose bits are 0, special
    mixed = (mixed ^ mixed >> np.uint64(31)) * MIXING[2]
    mixed = (mixed ^ mixed >> np.uint64(32)) * MIXING[0]
    return mixed ^ mixed >> np.uint64(29)


def occupied_cells(codes: np.ndarray, bits: int, n: int) -> list[int]:
    """Numbers of occupied cells of grids each twice as fine as the one before, from one cell to at least n, or to all.

    `codes` are sorted Morton codes of the occupied cells of the finest grid, with so many `bits` per axis; they may
    repeat.
    """
    counts = [1]
    while counts[-1] < n and len(counts) <= bits:
        counts.append(1 + np.count_nonzero(np.diff(codes >> np.uint64(3 * (bits - len(counts))))))
    return counts


def cells_along(counts: list[int], n: int) -> float:
    """How many cells a grid must have along its longest side for about n to be occupied, by `occupied_cells`."""
    if len(counts) == 1:
        return 1.0
    if counts[-1] < n:
        return 2**MORTON_BITS - 1
    wider = np.log(counts[-1] / n) / np.log(counts[-1] / counts[-2])
    return 2 ** (len(counts) - 1 - wider)


def sample_grid(points: np.ndarray, n: int) -> Sample:
    """Keep of every cell of a cubic grid with about n occupied cells the point nearest to the mean of its points."""
    extent = Extent()
    extent.add(points)
    grid = extent.grid()
    code = grid.codes(points, 2**MORTON_BITS - 1)
    order = sort_within(points, code, np.argsort(code, kind="stable"))
    counts = occupied_cells(code[order], MORTON_BITS, n)
    if counts[-1] < n:
        return everybody(points)
    code = grid.codes(points, cells_along(counts, n))[order]
    again = np.argsort(code, kind="stable")
    order, code = order[again], code[again]
    begin = np.flatnonzero(np.append(True, code[1:] != code[:-1]))
    size = np.diff(np.append(begin, len(code)))
    cell = np.repeat(np.arange(len(begin)), size)
    ordered = points[order]
    x, y, z = (ordered[1:] != ordered[:-1]).T
    fresh = np.append(True, x | y | z)  # no copy of the one before
    weight = np.bincount(cell, fresh)
    mean = np.add.reduceat(ordered * fresh[:, None], begin) / weight[:, None]
    away = ordered - np.repeat(mean, size, axis=0)
    squared = dot(away, away)
    nearest = np.flatnonzero(squared == np.repeat(np.minimum.reduceat(squared, begin), size))
    kept = np.empty(len(begin), int)
    kept[cell[nearest[::-1]]] = order[nearest[::-1]]
    representative = np.empty(len(points), int)
    representative[order] = cell
    return kept, representative, weight


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
