"""Tiles: boxes that partition space, and scenes that are split into a file for each."""

from __future__ import annotations

import json
import math
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InvalidCloudError, InvalidParameterError
from ...geometry.vectors import finite_rows
from ...interop.atomic import check_ends, write_json
from ...io.formats import ply
from ...io.scan import COLOR_CHANNELS, NORMAL_NAMES, Scan
from ...io.scans import read_blocks
from ...io.streaming import finite_blocks
from ...parameters import check_number

Tile = tuple[int, ...]

OVERLAP_SHARE = 1 / 8  # fitted: of the size of a tile, how far it looks beyond itself unless told
MOST_OVERLAP = 1 / 4  # derived: of the size; tiles may be half as wide: a point is of two along an axis at most
SEAM_SHARE = 1 / 4  # fitted: of the overlap, how far beyond a tile its skeleton counts: more than tiles differ
CUT_REACH = 2.0  # measured: radii from a cut through a tube up to which its skeleton strays by over 1 % of the radius
PARTS_FOLDER, PARTS_FILE = ".parts", "parts.json"
MOST_TILES = 10_000  # fitted: more than anybody waits for; each is a file


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
            spans = " x ".join(f"{side:.4g}" for side in extent)
            cure = "remove far ones with a condition, or give larger tiles"
            raise InvalidParameterError(f"tiles = {size:g}: the points span {spans}: {cure}")
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
        index, last = np.array(tile), np.array(self.counts) - 1
        low = np.where(index > 0, self.low + index * np.array(self.cell) - beyond, -np.inf)
        return low, np.where(index < last, self.low + (index + 1) * np.array(self.cell) + beyond, np.inf)

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
        rows, labels = [], []
        for upper in product((False, True), repeat=3):
            tiles = np.where(upper, second, first)
            new = (tiles != first).sum(axis=1) == sum(upper)
            rows.append(np.flatnonzero(new))
            labels.append(np.ravel_multi_index(tuple(tiles[new].T), self.counts))
        row, label = np.concatenate(rows), np.concatenate(labels)
        order = np.lexsort((row, label))
        numbers, starts = np.unique(label[order], return_index=True)
        for number, chosen in zip(numbers, np.split(row[order], starts[1:]), strict=False):
            yield tuple(map(int, np.unravel_index(number, self.counts))), chosen


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


# --------------------------------------------------------------------------------------------- scenes, a file per tile


@dataclass(frozen=True)
class Cut:
    """How scenes are split."""

    tiles: float  # size at most
    overlap: float
    where: str | None = None  # only points for which this holds
    drop_invalid: bool = False  # pass over points that are not finite, which belong to no tile, instead of refusing


@dataclass(frozen=True)
class Split:
    """A scene that is split."""

    of: list[Any]  # which file, and how
    labels: tuple[str, ...]  # names of the tiles
    points: int
    dropped: int  # points that are in no tile, since they have no place
    grid: Grid


def read_split(path: Path) -> Split:
    """What is known of the parts of a scene, from its file."""
    check_ends(path)
    kept = json.loads(path.read_text(encoding="utf-8"))
    grid: Any = {name: tuple(v) if isinstance(v, list) else v for name, v in kept["grid"].items()}
    return Split(kept["of"], tuple(kept["labels"]), kept["points"], kept["dropped"], Grid(**grid))


def known_split(folder: Path, of: list[Any]) -> Split | None:
    """The split of a scene whose parts are in a folder, if it is that of the same file in the same way."""
    with suppress(OSError, ValueError, KeyError, TypeError):  # it was not split, or not to the end
        split = read_split(folder / PARTS_FILE)
        return split if split.of == of else None
    return None


def divide(path: Path, folder: Path, cut: Cut, of: list[Any]) -> Split:
    """Split a scene, a block at a time: a file for each tile, and one for what is known of them.

    InvalidParameterError where there would be too many.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        grid, counts = _grid(path, cut), Counter[str]()
        points = kept = 0
        for scan in map(Scan.by_area, read_blocks(path, where=cut.where)):
            points += len(scan)
            scan = scan[finite_rows(scan.positions)]
            kept += len(scan)
            rows = {tile_name(tile): chosen for tile, chosen in grid.parted(scan.positions)}
            if (n := len(counts.keys() | rows.keys())) > MOST_TILES:
                raise InvalidParameterError(f"has {n} tiles or more: give larger ones")
            add_to_parts(folder, scan, rows, counts)
        split = Split(of, tuple(sorted(counts, key=tile_of)), points, points - kept, grid)
        write_json(folder / PARTS_FILE, asdict(split))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return split


def add_to_parts(folder: Path, scan: Scan, rows: Mapping[str, np.ndarray], counts: Counter[str]) -> None:
    """Append to each part, by its label, some points of a block: as PLY, with normals, colours and all digits.

    The counts are of the points that the parts have.
    """
    columns: dict[str, np.ndarray] = dict(zip("xyz", scan.positions.astype("<f8").T, strict=True))
    for names, values in ((NORMAL_NAMES, scan.normals), (COLOR_CHANNELS, scan.colors)):
        if values is not None:
            columns |= dict(zip(names, values.astype("<f4").T, strict=True))
    table = ply.rows_of(columns)
    for label, chosen in rows.items():
        counts[label] = ply.append(folder / f"{label}.ply", table[chosen], counts[label])


def _grid(path: Path, cut: Cut) -> Grid:
    """The grid over the box of the points."""
    corners = [(points.min(axis=0), points.max(axis=0)) for points in finite_blocks(path, cut.where, cut.drop_invalid)]
    if not corners:
        raise InvalidCloudError("none of its points is finite")
    lows, highs = zip(*corners, strict=True)
    return Grid.over(np.min(lows, axis=0), np.max(highs, axis=0), cut.tiles, cut.overlap)
