"""A sample that stands for a large cloud: of one in memory, and of one that comes in blocks."""

# Strategy: a cubic grid is laid around the cloud, with about n occupied cells, and of each the point nearest to the
# mean of its points is kept. Sorting the Morton codes of cells brings the points of a cell together, and three bits
# less are a grid half as fine, so that the finest grid says how many cells all coarser ones have. A cloud in memory is
# sorted once. One in blocks is read once for each step, and what is kept between blocks is one row per cell.

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import NamedTuple

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
BLOCK_THREADS = 4  # speed: each takes 110 MB for a block of a million points
CELLS_KEPT = 8  # derived: cells of the finest grid kept, over those wanted: of one half as fine an eighth are left


class Sample(NamedTuple):
    """Some of the points of a cloud, which stand for all."""

    kept: np.ndarray  # (c,) their rows
    position: np.ndarray  # (m,) for each point of the cloud the position in `kept` of the one that stands for it
    weight: np.ndarray  # (c,) how many points each stands for, copies once


class Grid(NamedTuple):
    """A cubic grid around a cloud. Points far off share the cells at its border."""

    low: np.ndarray  # (3,) to which coordinates are raised
    high: np.ndarray  # (3,) and lowered
    corner: np.ndarray  # (3,) lowest coordinates then
    extent: float  # longest side of the box around the points then

    def codes(self, points: np.ndarray, cells: float) -> np.ndarray:
        """Morton codes of the cells of points, (m,) uint64 array, with so many cells along the longest side."""
        return morton_codes(points, cells, self.corner, self.extent, (self.low, self.high))

    def codes_in_threads(self, points: np.ndarray, cells: float) -> np.ndarray:
        """The same, computed on all threads."""
        return np.concatenate([*in_threads(lambda chunk: self.codes(chunk, cells), _chunks(points))])


def sample_cloud(points: np.ndarray, n: int, counts: np.ndarray | None = None) -> Sample:
    """About n points that stand for a cloud of more than twice as many, or all of a smaller one.

    Each of the points may stand for `counts` (m,) points of another cloud already.
    """
    every = np.arange(len(points))
    sample = sample_grid(points, n) if len(points) > 2 * n else Sample(every, every, np.ones(len(points)))
    return sample if counts is None else sample._replace(weight=np.bincount(sample.position, counts))


def sample_grid(points: np.ndarray, n: int) -> Sample:
    """Keep of every cell of a cubic grid with about n occupied cells the point nearest to the mean of its points."""
    grid = _grid(*_survey([points]))
    code = grid.codes_in_threads(points, FINEST_CELLS)
    order = sort_within(points, code, np.argsort(code))
    cells = cells_along(code[order], MORTON_BITS, n)
    if cells == FINEST_CELLS:
        return sample_cloud(points, len(points))
    code = grid.codes_in_threads(points, cells)[order]
    by_cell = np.argsort(code, kind="stable")
    order, code = order[by_cell], code[by_cell]
    begin = np.append(_begins(code), len(code))

    def representatives(cell_range: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """The first of the points nearest to the mean of each cell, and how many are in it, without copies."""
        first, stop = cell_range
        rows, starts = order[begin[first] : begin[stop]], begin[first:stop] - begin[first]
        inside = points.take(rows, axis=0)
        fresh = np.append(True, (inside[1:] != inside[:-1]).any(axis=1))  # copies are one behind the other
        weight = np.add.reduceat(fresh, starts, dtype=float)
        nearest, _ = _nearest_to(np.add.reduceat(inside * fresh[:, None], starts) / weight[:, None], inside, starts)
        return rows[nearest[np.searchsorted(nearest, starts)]], weight

    bounds = np.searchsorted(begin, range(0, len(code) + GRID_CHUNK, GRID_CHUNK)).clip(max=len(begin) - 1)
    parts = in_threads(representatives, pairwise(np.unique(bounds).tolist()))
    kept, weight = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    position = np.empty(len(points), int)
    position[order] = np.repeat(np.arange(len(kept)), np.diff(begin))
    return Sample(kept, position, weight)


def cells_along(codes: np.ndarray, bits: int, n: int) -> float:
    """Cells along the longest side of a grid of which about n are occupied; `FINEST_CELLS` if none is.

    `codes` are sorted Morton codes of the occupied cells of the finest grid, with so many `bits` per axis; they may
    repeat.
    """
    counts = [1]  # of occupied cells, from one cell on
    while counts[-1] < n and len(counts) <= bits:
        counts.append(1 + np.count_nonzero(np.diff(codes >> np.uint64(3 * (bits - len(counts))))))
    if len(counts) == 1:
        return 1.0
    if counts[-1] < n:
        return FINEST_CELLS
    excess: float = np.log(counts[-1] / n) / np.log(counts[-1] / counts[-2])
    return 2 ** (len(counts) - 1 - excess)


def _chunks(points: np.ndarray) -> list[np.ndarray]:
    return np.array_split(points, len(points) // GRID_CHUNK + 1)


def _survey(blocks: Iterable[np.ndarray]) -> tuple[int, np.ndarray, np.ndarray]:
    """The number of points in blocks, their least and largest coordinates (2, 3), and some of them (s, 3), by hash."""
    n, low, high = 0, np.full(3, np.inf), np.full(3, -np.inf)
    drawn, drawn_hash, mask = np.empty((0, 3)), np.empty(0, np.uint64), np.uint64(0)
    chunks = (chunk for block in blocks for chunk in _chunks(block))
    for points, (least, most), number in in_threads(lambda chunk: (chunk, box(chunk), _hash(chunk)), chunks):
        n, low, high = n + len(points), np.minimum(low, least), np.maximum(high, most)
        chosen = number & mask == 0
        drawn, drawn_hash = np.concatenate([drawn, points[chosen]]), np.concatenate([drawn_hash, number[chosen]])
        while len(drawn) > SAMPLED_POINTS and mask < ALL_BITS:  # those that one more bit chooses
            mask = mask << np.uint64(1) | np.uint64(1)
            chosen = drawn_hash & mask == 0
            drawn, drawn_hash = drawn[chosen], drawn_hash[chosen]
    return n, np.stack([low, high]), drawn


def _hash(points: np.ndarray) -> np.ndarray:
    """A hash of the coordinates of every point, by multiplications and shifts, (m,) uint64 array."""
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64)  # -0 is 0
    mixed = (bits * MIXING).sum(axis=1, dtype=np.uint64) + MIXING[1]  # nor is the origin, whose bits are 0, special
    mixed = (mixed ^ mixed >> np.uint64(31)) * MIXING[2]
    mixed = (mixed ^ mixed >> np.uint64(32)) * MIXING[0]
    return mixed ^ mixed >> np.uint64(29)


def _grid(n: int, ends: np.ndarray, drawn: np.ndarray) -> Grid:
    """The grid around what was surveyed: a few points far off do not decide how wide its cells are."""
    check_extent(ends, n)
    low, high = np.quantile(drawn if len(drawn) else ends, [GRID_TAIL, 1 - GRID_TAIL], axis=0)  # none: only copies
    low, high = 2 * low - high, 2 * high - low
    corner, top = np.clip(ends, low, high)
    return Grid(low, high, corner, float((top - corner).max()))


def _begins(ordered: np.ndarray) -> np.ndarray:
    """Where each run of equal numbers begins."""
    return np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)])


def _nearest_to(mean: np.ndarray, points: np.ndarray, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (k,) of all points that are nearest to the `mean` (c, 3) of their cell, and squared distances (k,).

    The points (m, 3) of each cell are together, from the row `begin` (c,) on.
    """
    size = np.diff(begin, append=len(points))
    offset = points - np.repeat(mean, size, axis=0)
    squared = dot(offset, offset)
    rows = np.flatnonzero(squared == np.repeat(np.minimum.reduceat(squared, begin), size))
    return rows, squared[rows]


Blocks = Callable[[], Iterable[np.ndarray]]
"""Gives the (m, 3) float arrays of a cloud, none of them empty, whenever it is asked."""


def sample_blocks(blocks: Blocks, size: Callable[[int], int]) -> tuple[np.ndarray, np.ndarray]:
    """The points (c, 3) that `sample_cloud` keeps, and how many each stands for, (c,); `size` says how many of so many.

    The cloud is read four times, a small one twice. Memory does not grow with it, but with the threads. Copies of a
    point count, unlike those in memory.
    """
    total, ends, drawn = _survey(blocks())
    n = size(total)
    if total <= 2 * n:
        return np.concatenate([np.empty((0, 3)), *blocks()]), np.ones(total, int)
    grid, codes, bits = _grid(total, ends, drawn), np.empty(0, np.uint64), MORTON_BITS
    for finest in in_threads(lambda points: np.unique(grid.codes(points, FINEST_CELLS)), blocks(), BLOCK_THREADS):
        codes = np.unique(np.concatenate([codes, finest >> np.uint64(3 * (MORTON_BITS - bits))]))
        while len(codes) > CELLS_KEPT * n:
            codes, bits = np.unique(codes >> np.uint64(3)), bits - 1
    cells = cells_along(codes, bits, n)
    codes, counts, means = _means(blocks, grid, cells)
    return _nearest(blocks, grid, cells, codes, means), counts


def _by_cell(points: np.ndarray, grid: Grid, cells: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Codes of occupied cells (c,), ascending, the rows (c,) where their points begin, and the points (m, 3) so."""
    code = grid.codes(points, cells)
    order = np.argsort(code, kind="stable")
    begin = _begins(code[order])
    return code[order[begin]], begin, points.take(order, axis=0)


def _means(blocks: Blocks, grid: Grid, cells: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Codes (c,) of the occupied cells, ascending, and the number (c,) and mean (c, 3) of the points in each."""

    def sums_of(block: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        code, begin, points = _by_cell(block, grid, cells)
        return code, np.diff(begin, append=len(points)), np.add.reduceat(points, begin)

    codes, counts, sums = np.empty(0, np.uint64), np.empty(0, int), np.empty((0, 3))
    for code, count, total in in_threads(sums_of, blocks(), BLOCK_THREADS):
        codes, cell = np.unique(np.concatenate([codes, code]), return_inverse=True)
        counts = np.bincount(cell, np.concatenate([counts, count])).astype(int)
        sums = group_sum(np.concatenate([sums, total]), cell, len(codes))
    return codes, counts, sums / counts[:, None]


def _nearest(blocks: Blocks, grid: Grid, cells: float, codes: np.ndarray, means: np.ndarray) -> np.ndarray:
    """The point nearest to the mean of each cell, (c, 3); of equally near ones the first in Morton order."""

    def candidates(block: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        code, begin, points = _by_cell(block, grid, cells)
        cell = np.searchsorted(codes, code)
        rows, squared = _nearest_to(means[cell], points, begin)
        return points[rows], np.repeat(cell, np.diff(begin, append=len(points)))[rows], squared

    nearest, least = np.zeros(means.shape), np.full(len(means), np.inf)
    for points, cell, squared in in_threads(candidates, blocks(), BLOCK_THREADS):
        closer = np.flatnonzero(squared <= least[cell])
        points, cell, squared = points[closer], cell[closer], squared[closer]
        tied = np.unique(cell[squared == least[cell]])  # cells whose point so far is as near: it competes
        least[cell] = squared  # all of a cell are equally far
        points, cell = np.concatenate([points, nearest[tied]]), np.append(cell, tied)
        order = np.lexsort((*points.T, grid.codes(points, FINEST_CELLS), cell))
        first = order[_begins(cell[order])]
        nearest[cell[first]] = points[first]
    return nearest
