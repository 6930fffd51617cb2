"""A sample that stands for a large cloud: of one in memory, and of one that comes in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np

from .cores import in_threads
from .frame import check_extent
from .groups import group_sum
from .morton import FINEST_CELLS, MORTON_BITS, morton_codes, sort_within
from .vectors import box, dot

GRID_TAIL = 0.001  # fitted: share of the points that may be far off, at either end of each axis
SAMPLED_POINTS = 100_000  # measured: points by which that is told, and parts traced; with fewer, thick ones look thin
# derived: odd numbers with bits everywhere, by which coordinates are mixed
MIXING = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
GRID_CHUNK = 65536  # speed: points at a time: the work arrays then stay in the cache
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
        return morton_codes(points, cells, self.corner, self.extent, (self.low, self.high))


def _chunks(points: np.ndarray) -> Iterator[np.ndarray]:
    """The rows of (m, 3), some at a time."""
    return (points[start : start + GRID_CHUNK] for start in range(0, len(points), GRID_CHUNK))


def _codes(points: np.ndarray, grid: Grid, cells: float) -> np.ndarray:
    """`Grid.codes` of many points, on all threads."""
    return np.concatenate([*in_threads(lambda part: grid.codes(part, cells), _chunks(points))])


def _reach(blocks: Iterable[np.ndarray]) -> tuple[int, np.ndarray, np.ndarray]:
    """The number of points in some blocks, their least and largest coordinates (2, 3), and some of them (s, 3).

    These are chosen by chance, but the same whatever the order of the points and the size of the blocks.
    """
    n, low, high = 0, np.full(3, np.inf), np.full(3, -np.inf)
    some, mixed, share = np.empty((0, 3)), np.empty(0, np.uint64), np.uint64(0)
    parts = (part for block in blocks for part in _chunks(block))
    for points, (least, most), numbers in in_threads(lambda part: (part, box(part), _mixed(part)), parts):
        n, low, high = n + len(points), np.minimum(low, least), np.maximum(high, most)
        few = numbers & share == 0
        some, mixed = np.concatenate([some, points[few]]), np.concatenate([mixed, numbers[few]])
        while len(some) > SAMPLED_POINTS and share < ALL_BITS:  # those that one more bit chooses
            share = share << np.uint64(1) | np.uint64(1)
            few = mixed & share == 0
            some, mixed = some[few], mixed[few]
    return n, np.stack([low, high]), some


def _grid(n: int, ends: np.ndarray, some: np.ndarray) -> Grid:
    """A grid around n points, see `_reach` and `check_extent`: a few far off do not decide how wide its cells are."""
    check_extent(ends, n)
    low, high = np.quantile(some if len(some) else ends, [GRID_TAIL, 1 - GRID_TAIL], axis=0)  # ends: nothing but copies
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


def cells_along(codes: np.ndarray, bits: int, n: int) -> float:
    """How many cells a grid must have along its longest side for about n to be occupied; `FINEST_CELLS` if none has n.

    It lies between two grids of which one is twice as fine. `codes` are sorted Morton codes of the occupied cells of
    the finest grid, with so many `bits` per axis; they may repeat.
    """
    counts = [1]  # of occupied cells, from one cell on
    while counts[-1] < n and len(counts) <= bits:
        counts.append(1 + np.count_nonzero(np.diff(codes >> np.uint64(3 * (bits - len(counts))))))
    if len(counts) == 1:
        return 1.0
    if counts[-1] < n:
        return FINEST_CELLS
    wider: float = np.log(counts[-1] / n) / np.log(counts[-1] / counts[-2])
    return 2 ** (len(counts) - 1 - wider)


def sample_grid(points: np.ndarray, n: int) -> Sample:
    """Keep of every cell of a cubic grid with about n occupied cells the point nearest to the mean of its points."""
    grid = _grid(*_reach([points]))
    code = _codes(points, grid, FINEST_CELLS)
    order = sort_within(points, code, np.argsort(code))
    cells = cells_along(code[order], MORTON_BITS, n)
    if cells == FINEST_CELLS:
        return everybody(points)
    code = _codes(points, grid, cells)[order]
    again = np.argsort(code, kind="stable")
    order, code = order[again], code[again]
    begin = np.append(_begins(code), len(code))

    def middles(span: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        first, last = span
        rows = order[begin[first] : begin[last]]
        middle, weight = _middles(points.take(rows, axis=0), begin[first:last] - begin[first])
        return rows[middle], weight

    parts = np.searchsorted(begin, range(0, len(code) + GRID_CHUNK, GRID_CHUNK)).clip(max=len(begin) - 1)
    found = in_threads(middles, pairwise(np.unique(parts).tolist()))
    kept, weight = (np.concatenate(each) for each in zip(*found, strict=True))
    representative = np.empty(len(points), int)
    representative[order] = np.repeat(np.arange(len(kept)), np.diff(begin))
    return kept, representative, weight


def _middles(points: np.ndarray, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first of the points nearest to the mean of each cell, (c,), and how many are in it, without copies, (c,).

    The points (m, 3) of each cell are together, from the row `begin` (c,) on, and copies one behind the other.
    """
    size = np.diff(begin, append=len(points))
    x, y, z = (points[1:] != points[:-1]).T
    fresh = np.append(True, x | y | z)
    weight = np.add.reduceat(fresh, begin, dtype=float)
    mean = np.add.reduceat(points * fresh[:, None], begin) / weight[:, None]
    nearest, _ = _nearest_to(mean, points, begin, size)
    return nearest[np.searchsorted(nearest, begin)], weight


def _nearest_to(
    mean: np.ndarray, points: np.ndarray, begin: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (k,) of the points nearest to a place of each cell, `mean` (c, 3), all that are, and squared distances (k,).

    The points (m, 3) of each cell are together: `size` (c,) of them from the row `begin` (c,) on.
    """
    away = points - np.repeat(mean, size, axis=0)
    squared = dot(away, away)
    rows = np.flatnonzero(squared == np.repeat(np.minimum.reduceat(squared, begin), size))
    return rows, squared[rows]


def _begins(ordered: np.ndarray) -> np.ndarray:
    """Where each run of equal numbers begins."""
    return np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))


Blocks = Callable[[], Iterable[np.ndarray]]
"""Gives the (m, 3) float arrays of a cloud, none of them empty, whenever it is asked."""

BLOCK_THREADS = 4  # speed: each takes 110 MB for a block of a million points
CELLS_KEPT = 8  # derived: cells of the finest grid kept, over those wanted: of one half as fine an eighth are left


def sample_blocks(blocks: Blocks, size: Callable[[int], int]) -> tuple[np.ndarray, np.ndarray]:
    """The points (c, 3) that `sample_cloud` keeps, and how many each stands for, (c,); `size` says how many of so many.

    The cloud is read four times: for how far it reaches, how fine the grid must be, the means of the cells, and the
    points nearest to them; a small one twice. Memory does not grow with it, but with the threads, each of which holds a
    block or two. Copies of a point count, unlike those in memory.
    """
    total, ends, some = _reach(blocks())
    n = size(total)
    if total <= 2 * n:
        return np.concatenate([np.empty((0, 3)), *blocks()]), np.ones(total, int)
    grid = _grid(total, ends, some)
    cells = _fineness(blocks, grid, n)
    codes, counts, means = _means(blocks, grid, cells)
    return _nearest(blocks, grid, cells, codes, means), counts


def _fineness(blocks: Blocks, grid: Grid, n: int) -> float:
    """Cells along the grid for about n to be occupied."""
    codes, bits = np.empty(0, np.uint64), MORTON_BITS
    for found in in_threads(lambda points: np.unique(grid.codes(points, FINEST_CELLS)), blocks(), BLOCK_THREADS):
        codes = np.unique(np.concatenate([codes, found >> np.uint64(3 * (MORTON_BITS - bits))]))
        while len(codes) > CELLS_KEPT * n:
            codes, bits = np.unique(codes >> np.uint64(3)), bits - 1
    return cells_along(codes, bits, n)


class _Cells(NamedTuple):
    """Some points, those of each cell of a grid together."""

    codes: np.ndarray  # (c,) of the cells, ascending
    begin: np.ndarray  # (c,) rows where those of each cell begin
    size: np.ndarray  # (c,) their number
    points: np.ndarray  # (m, 3)

    @classmethod
    def of(cls, points: np.ndarray, grid: Grid, cells: float) -> _Cells:
        code = grid.codes(points, cells)
        order = np.argsort(code, kind="stable")
        begin = _begins(code[order])
        return cls(code[order[begin]], begin, np.diff(begin, append=len(code)), points.take(order, axis=0))


def _means(blocks: Blocks, grid: Grid, cells: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Codes (c,) of the occupied cells, ascending, and the number (c,) and mean (c, 3) of the points in each."""

    def summed(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        each = _Cells.of(points, grid, cells)
        return each.codes, each.size, np.add.reduceat(each.points, each.begin)

    codes, counts, sums = np.empty(0, np.uint64), np.empty(0, int), np.empty((0, 3))
    for there, size, total in in_threads(summed, blocks(), BLOCK_THREADS):
        codes, cell = np.unique(np.concatenate([codes, there]), return_inverse=True)
        counts = np.bincount(cell, np.concatenate([counts, size])).astype(int)
        sums = group_sum(np.concatenate([sums, total]), cell, len(codes))
    return codes, counts, sums / counts[:, None]


def _nearest(blocks: Blocks, grid: Grid, cells: float, codes: np.ndarray, means: np.ndarray) -> np.ndarray:
    """The point nearest to the mean of each cell, (c, 3); of equally near ones, as two are, the first in Morton order.

    Within a cell of the finest grid their coordinates decide, the last first.
    """

    def candidates(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of every cell of a block the points nearest to its mean, with their cells and squared distances."""
        each = _Cells.of(points, grid, cells)
        cell = np.searchsorted(codes, each.codes)
        some, squared = _nearest_to(means[cell], each.points, each.begin, each.size)
        return each.points[some], np.repeat(cell, each.size)[some], squared

    nearest, least = np.zeros(means.shape), np.full(len(means), np.inf)
    for points, cell, squared in in_threads(candidates, blocks(), BLOCK_THREADS):
        some = np.flatnonzero(squared <= least[cell])
        if not len(some):
            continue
        points, cell, squared = points[some], cell[some], squared[some]
        again = np.unique(cell[squared == least[cell]])  # cells whose point so far is as near: it competes
        least[cell] = squared  # all of a cell are equally far
        points, cell = np.concatenate([points, nearest[again]]), np.append(cell, again)
        order = np.lexsort((*points.T, grid.codes(points, FINEST_CELLS), cell))
        first = order[_begins(cell[order])]
        nearest[cell[first]] = points[first]
    return nearest
