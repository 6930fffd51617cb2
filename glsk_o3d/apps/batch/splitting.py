"""A scene is taken apart into files of its own, a block at a time: a file per tile."""

import json
import shutil
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
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
from .grid import Grid, tile_name, tile_of

PARTS_FOLDER, PARTS_FILE = ".parts", "parts.json"
MOST_TILES = 10_000  # fitted: more than anybody waits for; each is a file


@dataclass(frozen=True)
class Cut:
    """How scenes are taken apart."""

    tiles: float  # size at most
    overlap: float
    where: str | None = None  # only points for which this holds
    drop_invalid: bool = False  # pass over points that are not finite, which belong to no tile, instead of refusing


@dataclass(frozen=True)
class Split:
    """A scene, taken apart."""

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
    """How a scene was taken apart, if its parts are in a folder, and of the same file in the same way."""
    with suppress(OSError, ValueError, KeyError, TypeError):  # it was not taken apart, or not to the end
        split = read_split(folder / PARTS_FILE)
        return split if split.of == of else None
    return None


def divide(path: Path, folder: Path, cut: Cut, of: list[Any]) -> Split:
    """Take a scene apart: a file for each tile, and one for what is known of them.

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
    """Append to each part, by its label, some points of a block: as PLY, with normals and colours.

    The counts are of the points that the parts have. Coordinates keep all digits.
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
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for points in finite_blocks(path, cut.where, cut.drop_invalid):
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    if not (low <= high).all():
        raise InvalidCloudError("none of its points is finite")
    return Grid.over(low, high, cut.tiles, cut.overlap)
