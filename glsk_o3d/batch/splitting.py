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

from ..errors import InvalidCloudError, InvalidParameterError
from ..interop.atomic import check_ends, write_json
from ..io.formats import ply
from ..io.scan import COLOR_CHANNELS, Scan
from ..io.scans import read_blocks
from ..numerics.frame import not_finite
from ..numerics.vectors import finite_rows
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
        files = PartFiles(folder)
        split = _divided(path, cut, of, files)
        files.close()
        write_json(folder / PARTS_FILE, asdict(split))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return split


class PartFiles:
    """Parts of a scene written side by side as PLY, with normals and colours; coordinates keep all digits."""

    def __init__(self, folder: Path):
        self._folder, self._row = folder, np.dtype([])
        self._counts: Counter[Path] = Counter()

    def add(self, scan: Scan, rows: Mapping[str, np.ndarray]) -> None:
        """Append to each part, by its label, some of the points of a block."""
        columns: dict[str, np.ndarray] = dict(zip("xyz", scan.positions.astype("<f8").T, strict=True))
        for names, values in ((("nx", "ny", "nz"), scan.normals), (COLOR_CHANNELS, scan.colors)):
            if values is not None:
                columns |= dict(zip(names, values.astype("<f4").T, strict=True))
        table = ply.rows_of(columns)
        self._row = table.dtype
        for label, chosen in rows.items():
            path = self._folder / f"{label}.ply"
            with path.open("ab") as stream:
                if path not in self._counts:
                    stream.write(self._header(0))
                stream.write(table[chosen].tobytes())
            self._counts[path] += len(chosen)

    def close(self) -> None:
        """Put into every file how many points it has: before, it is an empty cloud with something behind it."""
        for path, count in self._counts.items():
            with path.open("r+b") as stream:
                stream.write(self._header(count))

    def _header(self, count: int) -> bytes:
        return ply.header_of(self._row, count, width=ply.COUNT_WIDTH)


def _divided(path: Path, cut: Cut, of: list[Any], files: PartFiles) -> Split:
    """Hand out the points of a scene to the files of its parts, a block at a time."""
    grid = _grid(path, cut)
    labels: set[str] = set()
    points = kept = 0
    for scan in map(Scan.by_area, read_blocks(path, where=cut.where)):
        points += len(scan)
        scan = scan[finite_rows(scan.positions)]
        kept += len(scan)
        rows = {tile_name(tile): chosen for tile, chosen in grid.parted(scan.positions)}
        labels.update(rows)
        if len(labels) > MOST_TILES:
            raise InvalidParameterError(f"has {len(labels)} tiles or more: give larger ones")
        files.add(scan, rows)
    return Split(of, tuple(sorted(labels, key=tile_of)), points, points - kept, grid)


def _grid(path: Path, cut: Cut) -> Grid:
    """The grid over the box of the points."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    points = invalid = first = 0
    for scan in map(Scan.by_area, read_blocks(path, where=cut.where)):
        finite = finite_rows(scan.positions)
        if not (invalid or finite.all()):
            first = points + int(np.argmin(finite))
        points, invalid = points + len(scan), invalid + int(len(scan) - finite.sum())
        low = np.minimum(low, scan.positions[finite].min(axis=0, initial=np.inf))
        high = np.maximum(high, scan.positions[finite].max(axis=0, initial=-np.inf))
    if invalid and not cut.drop_invalid:
        raise not_finite(invalid, points, first)
    if not (low <= high).all():
        raise InvalidCloudError("none of its points is finite")
    return Grid.over(low, high, cut.tiles, cut.overlap)
