"""A sample that stands for a large cloud."""

import numpy as np

from ..numerics.morton import BITS, morton_codes
from ..numerics.vectors import dot

TAIL = 0.001  # share of the points that may be far off, at either end of each axis


def thin_to_grid(points, n):
    """Keep of every cell of a cubic grid with about n occupied cells the point nearest to the mean of its points.

    Parameters
    ----------
    points : (m, 3) float array
    n : int
        Less than m.

    Returns
    -------
    kept : (c,) int array
        Points left, about n, one per cell. Points far off share the cells at the border.
    into : (m,) int array
        Position in `kept` of the point that stands for each.
    counts : (c,) float array
        Points in the cell of each of `kept`; copies in a row of the grid's finest cells count once.
    """
    # A few points far off must not decide how wide the cells are.
    low, high = np.quantile(points[:: 1 + len(points) // 100000], [TAIL, 1 - TAIL], axis=0)
    inner = np.clip(points, 2 * low - high, 2 * high - low)
    code = morton_codes(inner, 2**BITS - 1)
    order = np.argsort(code, kind="stable")
    ordered = code[order]
    counts = [1]
    while counts[-1] < n:  # cells half as wide
        if len(counts) > BITS:
            return np.arange(len(points)), np.arange(len(points)), np.ones(len(points))
        counts.append(1 + np.count_nonzero(np.diff(ordered >> np.uint64(3 * (BITS - len(counts))))))
    wider = np.log(counts[-1] / n) / np.log(counts[-1] / counts[-2])
    code = morton_codes(inner, 2 ** (len(counts) - 1 - wider))[order]
    again = np.argsort(code, kind="stable")
    order, code = order[again], code[again]
    begin = np.flatnonzero(np.append(True, code[1:] != code[:-1]))
    size = np.diff(np.append(begin, len(code)))
    cell = np.repeat(np.arange(len(begin)), size)
    ordered = points[order]
    x, y, z = (ordered[1:] != ordered[:-1]).T
    fresh = np.append(True, x | y | z)  # no copy of the one before
    counts = np.bincount(cell, fresh)
    mean = np.add.reduceat(ordered * fresh[:, None], begin) / counts[:, None]
    away = ordered - np.repeat(mean, size, axis=0)
    squared = dot(away, away)
    nearest = np.flatnonzero(squared == np.repeat(np.minimum.reduceat(squared, begin), size))
    kept = np.empty(len(begin), int)
    kept[cell[nearest[::-1]]] = order[nearest[::-1]]
    into = np.empty(len(points), int)
    into[order] = cell
    return kept, into, counts


def usual_number(n: int) -> int:
    """Points to contract: at most 25000, but 64 times the square root of their number from 152588 points on.

    More points make the axis hardly more exact, since neither noise nor the thickness of parts shrinks with their
    spacing; they only cost time.
    """
    return min(n, max(25000, round(64 * np.sqrt(n))))


def _sample(points, n):
    """About n points that stand for a cloud of more than twice as many, which of them does for each, for how many."""
    if len(points) > 2 * n:
        return thin_to_grid(points, n)
    everybody = np.arange(len(points))
    return everybody, everybody, np.ones(len(points))
