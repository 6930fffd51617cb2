"""Morton order: points that are near in space become near in memory (Morton 1966)."""

from typing import Any

import numpy as np

from .vectors import TINY, box

MORTON_BITS = 21  # derived: per axis: 63 bits in all
MORTON_CHUNK = 8192  # speed: points at a time: the work arrays then stay in the cache
FINEST_CELLS: int = 2**MORTON_BITS - 1  # derived: cells along the longest side of the finest grid


def morton_order(points: np.ndarray) -> np.ndarray:
    """Permutation, (n,) int array, that sorts points (n, 3) along the Morton curve of their box, or by coordinates."""
    low, high = box(points)
    codes = morton_codes(points, FINEST_CELLS, low, (high - low).max())
    return sort_within(points, codes, np.argsort(codes))


def sort_within(points: np.ndarray, codes: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Sort points of equal codes by their coordinates, in an `order` that sorts the codes and is changed in place."""
    ordered = codes.take(order)
    same = ordered[1:] == ordered[:-1]
    if same.any():
        rows = np.flatnonzero(np.append(False, same) | np.append(same, False))
        crowded = order[rows]
        order[rows] = crowded[np.lexsort((crowded, *points[crowded].T, codes[crowded]))]
    return order


def morton_codes(
    points: np.ndarray, cells: float, corner: np.ndarray, extent: float, limits: tuple[Any, Any] | None = None
) -> np.ndarray:
    """Morton code of the cell of every point, (n,) uint64, in a cubic grid around the points.

    `cells`, at most 2^21 - 1, lie along its side `extent`, and its lowest corner is `corner` (3,). Coordinates out of
    the `limits`, two (3,) float arrays, count as the nearest within them.
    """
    code = np.zeros(len(points), np.uint64)
    for start in range(0, len(points), MORTON_CHUNK):
        part = slice(start, start + MORTON_CHUNK)
        for axis, column in enumerate((points[part] if limits is None else np.clip(points[part], *limits)).T):
            cell = ((column - corner[axis]) / max(extent, TINY) * cells).astype(np.uint64)
            code[part] |= _spread(cell) << np.uint64(axis)
    return code


def _spread(x: np.ndarray) -> np.ndarray:
    """21-bit integers with two zero bits between their bits."""
    masks = (0x1F00000000FFFF, 0x1F0000FF0000FF, 0x100F00F00F00F00F, 0x10C30C30C30C30C3, 0x1249249249249249)
    for shift, mask in zip((32, 16, 8, 4, 2), masks, strict=True):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x
