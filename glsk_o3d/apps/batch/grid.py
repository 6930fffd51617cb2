"""Tiles: boxes that partition space, and how far each looks beyond itself."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...errors import InvalidParameterError
from ...parameters import check_number

Tile = tuple[int, ...]

OVERLAP_SHARE = 1 / 8  # fitted: of the size of a tile, how far it looks beyond itself unless told
MOST_OVERLAP = 1 / 4  # derived: of the size; tiles may be half as wide: a point is of two along an axis at most
SEAM_SHARE = 1 / 4  # fitted: of the overlap, how far beyond a tile its skeleton counts: more than tiles differ
CUT_REACH = 2.0  # measured: radii from a cut through a tube up to which its skeleton strays by over 1 % of the radius


@dataclass(frozen=True)
class Grid:
    """Boxes of equal size that partition space; those at the border reach to infinity."""

    low: tuple[float, ...]  # corner of the first one
    cell: tuple[float, ...]  # their sides
    counts: Tile  # how many there are along each axis
    overlap: float  # how far beyond its box a tile takes points, at most half a side

    @classmethod
    def over(cls, low: np.ndarray, high: np.ndarray, size: float, overlap: float) -> Grid:
        """The grid over a box: along an axis that is longer than `size` as many equal tiles as it takes, else one."""
        extent = np.asarray(high, float) - low
        if not (np.isfinite(extent).all() and (extent / size < 2**20).all()):
            raise InvalidParameterError(
                f"tiles = {size:g}: the points span {' x '.join(f'{each:.4g}' for each in extent)}: remove far ones "
                "with a condition, or give larger tiles"
            )
        counts = np.maximum(np.ceil(extent / size), 1)
        cell = np.where(counts > 1, extent / counts, size)
        return cls(tuple(map(float, low)), tuple(map(float, cell)), tuple(map(int, counts)), float(overlap))

    @property
    def trust(self) -> float:
        """How far beyond its box the skeleton of a tile counts."""
        return SEAM_SHARE * self.overlap

    @property
    def thickest(self) -> float:
        """Radius of the thickest part that the overlap allows at a seam: the ends of what was cut stay clear of it."""
        return (self.overlap - self.trust) / CUT_REACH

    def box(self, tile: Tile, beyond: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Corners of a tile, widened where it has neighbours; infinite where it has none."""
        at, last = np.array(tile), np.array(self.counts) - 1
        low = np.where(at > 0, self.low + at * np.array(self.cell) - beyond, -np.inf)
        return low, np.where(at < last, self.low + (at + 1) * np.array(self.cell) + beyond, np.inf)

    def seams(self, tile: Tile) -> Iterator[tuple[int, float]]:
        """Planes, axis and coordinate, where the skeletons of a tile's neighbours cease to count."""
        for axis, bounds in enumerate(zip(*self.box(tile, -self.trust), strict=True)):
            yield from ((axis, float(value)) for value in bounds if math.isfinite(value))

    def parted(self, points: np.ndarray) -> Iterator[tuple[Tile, np.ndarray]]:
        """Every tile with the rows, in order, of those of (n, 3) finite points that it takes, its overlap included."""
        last = np.array(self.counts) - 1
        first, second = (
            np.clip(np.floor((points + side - self.low) / self.cell), 0, last).astype(np.int64)
            for side in (-self.overlap, self.overlap)
        )
        rows, tiles = [], []
        for upper in product((False, True), repeat=3):
            both = np.where(upper, second, first)
            there = (both != first).sum(axis=1) == sum(upper)
            rows.append(np.flatnonzero(there))
            tiles.append(both[there])
        row, tile = np.concatenate(rows), np.concatenate(tiles)
        order = np.lexsort((row, *tile.T[::-1]))
        row, tile = row[order], tile[order]
        starts: Any = np.flatnonzero(np.r_[True, (np.diff(tile, axis=0) != 0).any(axis=1)]) if len(row) else []
        for start, stop in zip(starts, [*starts[1:], len(row)], strict=True):
            yield tuple(tile[start].tolist()), row[start:stop]


def checked_sizes(tiles: Any, overlap: Any) -> tuple[float, float]:
    """The size of tiles and their overlap, by default an eighth of it; InvalidParameterError where they are none."""
    size = check_number("tiles", tiles, low=0, open_low=True)
    if overlap is None:
        return size, OVERLAP_SHARE * size
    name = "overlap (at most a quarter of tiles)"
    return size, check_number(name, overlap, low=0, open_low=True, high=MOST_OVERLAP * size)


def tile_name(tile: Tile) -> str:
    """A tile as part of a name: ``0-2-0``."""
    return "-".join(map(str, tile))


def tile_of(name: str) -> Tile:
    """The tile that `tile_name` names."""
    x, y, z = map(int, name.split("-"))
    return x, y, z
