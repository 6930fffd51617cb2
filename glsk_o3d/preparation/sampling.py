"""A sample that stands for a large cloud."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..numerics.morton import MORTON_BITS, morton_codes, sort_within
from ..numerics.vectors import dot
from .frame import check_extent

GRID_TAIL = 0.001  # fitted: share of the points that may be far off, at either end of each axis
TAIL_SAMPLE, TAIL_MARGIN = (
    20000,
    16,
)  # measured: points that say about where the tails end, and how much farther to look


class Sample(NamedTuple):
    """Points that stand for a cloud."""

    kept: np.ndarray  # (c,) points of the cloud
    representative: np.ndarray  # (m,) for every point the position in `kept` of the one that stands for it
    counts: np.ndarray  # (c,) points that each stands for; copies in a row of the grid's finest cells count once


def sample_cloud(points: np.ndarray, n: int) -> Sample:
    """About n points that stand for a cloud of more than twice as many, or all of a smaller one.

    Parameters
    ----------
    points : (m, 3) float array
    n : int
    """
    return sample_grid(points, n) if len(points) > 2 * n else everybody(points)


def everybody(points: np.ndarray) -> Sample:
    """All points, each for itself."""
    return Sample(np.arange(len(points)), np.arange(len(points)), np.ones(len(points)))


def sample_grid(points: np.ndarray, n: int) -> Sample:
    """Keep of every cell of a cubic grid with about n occupied cells the point nearest to the mean of its points.

    Parameters
    ----------
    points : (m, 3) float array
    n : int
        Less than m.

    Returns
    -------
    Sample
        One point per cell, about n. Points far off share the cells at the border.

    Raises
    ------
    InvalidCloudError
        See `check_extent`.
    """
    check_extent(points)
    # A few points far off must not decide how wide the cells are.
    tail = int(GRID_TAIL * len(points))
    low, high = (sign * np.array([_least(sign * x, tail) for x in points.T]) for sign in (1, -1))
    inner = np.clip(points, 2 * low - high, 2 * high - low)
    code = morton_codes(inner, 2**MORTON_BITS - 1)
    order = sort_within(points, code, np.argsort(code, kind="stable"))
    ordered = code[order]
    counts = [1]
    while counts[-1] < n:  # cells half as wide
        if len(counts) > MORTON_BITS:
            return everybody(points)
        counts.append(1 + np.count_nonzero(np.diff(ordered >> np.uint64(3 * (MORTON_BITS - len(counts))))))
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
    representative = np.empty(len(points), int)
    representative[order] = cell
    return Sample(kept, representative, counts)


def _least(values: np.ndarray, k: int) -> float:
    """The value that k others are below: found among the few that are no more than one from the start of a sample."""
    some = values[:: 1 + len(values) // TAIL_SAMPLE]
    rank = min(2 * (k * len(some) // len(values)) + TAIL_MARGIN, len(some) - 1)
    bound = np.partition(some, rank)
    few = values[values <= bound[rank]]
    return np.partition(few if len(few) > k else values, k)[k]
