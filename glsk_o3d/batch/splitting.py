"""A scene is taken apart into files of its own, a block at a time: a file per label, or per tile."""

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BatchError, InvalidCloudError, InvalidParameterError, did_you_mean
from ..interop.atomic import write_json
from ..io.formats import ply
from ..io.scan import COLOR_CHANNELS, Scan
from ..io.scans import read_blocks
from ..numerics.frame import not_finite
from .grid import Grid, tile_name, tile_of

PARTS_FOLDER = ".parts"
MOST_PARTS = 10_000  # fitted: more things than anybody numbers in a file; fewer than a scanner's intensities
LONGEST_LABEL = 24  # derived: characters of the longest number of 64 bits, -2.2250738585072014e-308
SPLIT_VERSION = 1
_COUNT_WIDTH = 20  # derived: digits of the largest 64-bit number: the header is written before the count is known


@dataclass(frozen=True)
class Cut:
    """How scenes are taken apart: into a part for each value of an attribute, or for each tile of a size."""

    by: str | None = None
    tiles: float | None = None
    overlap: float | None = None
    where: str | None = None  # only points for which this holds
    drop_invalid: bool = False  # pass over points that are not finite, which belong to no tile, instead of refusing

    def __str__(self) -> str:
        return f"by = {self.by!r}" if self.tiles is None else f"tiles = {self.tiles:g}"


@dataclass(frozen=True)
class Split:
    """A scene, taken apart: its parts by labels that can stand in names, with words for the points that they hold."""

    input_hash: str
    parts: dict[str, str]
    points: int
    dropped: int  # points that are in no part: without a label, or a place
    grid: Grid | None = None  # of the tiles


class Splitter:
    """Takes scenes apart, each once: what it found is kept in the output folder.

    `hashed` gives the hash of a file. Without `write` the parts are not written, only found out.
    """

    def __init__(self, out: Path, cut: Cut, hashed: Callable[[Path], str], write: bool):
        self.cut, self.folder, self._hash, self._write = cut, out / PARTS_FOLDER, hashed, write

    def split(self, name: str, path: Path) -> Split:
        """Take a scene apart, unless that has been done.

        InvalidParameterError where the file lacks what is asked for, BatchError where the parts cannot be written.
        """
        self._check_place(name)
        known = self._known(name, path)
        if known is not None:
            return known
        return self.divide(name, path) if self._write else divided(path, self.cut, self._hash(path), None)

    def file(self, name: str, label: str) -> Path:
        """Where a part is, or will be."""
        return self.folder / name / f"{label}.ply"

    def _known(self, name: str, path: Path) -> Split | None:
        """What is kept of a scene, None where it is damaged or of something else: files are named by its labels."""
        try:
            kept = json.loads(self._list(name).read_text(encoding="utf-8"))
            if (SPLIT_VERSION, str(path), asdict(self.cut)) != (kept["version"], kept["input"], kept["cut"]):
                return None
            found = kept["split"]["grid"]
            grid = found and Grid(tuple(found["low"]), tuple(found["cell"]), tuple(found["counts"]), found["overlap"])
            split = Split(**{**kept["split"], "grid": grid})
            for label, part in split.parts.items():
                same = label_text(float(label)) if grid is None else tile_name(tile_of(label))
                if label != same or len(label) > LONGEST_LABEL or not isinstance(part, str):
                    return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):  # none, or not of ours
            return None
        return split if split.input_hash == self._hash(path) else None

    def _check_place(self, name: str) -> None:
        """Raise BatchError where parts would be somewhere else, through a link, or where others keep something."""
        place = self.folder / name
        straight = Path(os.path.realpath(self.folder.parent), PARTS_FOLDER, name)
        if Path(os.path.realpath(place)) != straight or (place.exists() and not self._list(name).is_file()):
            raise BatchError(
                f"{place}: was not made by a batch, which keeps the parts of a scene there: move it away, or give the "
                "results another folder"
            )

    def divide(self, name: str, path: Path) -> Split:
        """Write the parts of a scene."""
        with _writing(self.folder):
            self._list(name).parent.mkdir(parents=True, exist_ok=True)
            write_json(self._list(name), {})  # of a batch that is killed the next one knows whose the folder is
            shutil.rmtree(self.folder / name, ignore_errors=True)
            (self.folder / name).mkdir(exist_ok=True)
        files = PartFiles(self.folder / name)
        try:
            split = divided(path, self.cut, self._hash(path), files)
            files.close()
        except BaseException:
            self._forget(name)
            raise
        with _writing(self.folder):
            kept = {"version": SPLIT_VERSION, "input": str(path), "cut": asdict(self.cut), "split": asdict(split)}
            write_json(self._list(name), kept)
        return split

    def _forget(self, name: str) -> None:
        shutil.rmtree(self.folder / name, ignore_errors=True)
        with suppress(OSError):  # on Windows nobody removes what is open; above, there may be other scenes
            self._list(name).unlink()
            for above in (self.folder / name).relative_to(self.folder.parent).parents[:-1]:
                (self.folder.parent / above).rmdir()

    def _list(self, name: str) -> Path:
        return self.folder / f"{name}.json"


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
        with _writing(self._folder):
            for label, chosen in rows.items():
                path = self._folder / f"{label}.ply"
                with path.open("ab") as stream:
                    if path not in self._counts:
                        stream.write(self._header(0))
                    stream.write(table[chosen].tobytes())
                self._counts[path] += len(chosen)

    def close(self) -> None:
        """Put into every file how many points it has: before, it is an empty cloud with something behind it."""
        with _writing(self._folder):
            for path, count in self._counts.items():
                with path.open("r+b") as stream:
                    stream.write(self._header(count))

    def _header(self, count: int) -> bytes:
        return ply.header_of(self._row, count, width=_COUNT_WIDTH)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Raise BatchError where parts of a scene cannot be written into a folder."""
    try:
        yield
    except OSError as error:
        raise BatchError(f"{folder}: the parts of a scene cannot be written there: {error.strerror}") from error


def divided(path: Path, cut: Cut, digest: str, files: PartFiles | None) -> Split:
    """The parts of a scene; their points go to the files, if there are any."""
    grid = None if cut.tiles is None else _grid(path, cut)
    parts: dict[str, str] = {}
    points = kept = 0
    for scan in read_blocks(path, where=cut.where):
        rows: dict[str, np.ndarray] = {}
        valid = np.flatnonzero(_finite(scan) if grid is not None else np.isfinite(_labels(scan, cut.by)))
        for label, meant, chosen in _parted(scan, valid, cut.by, grid):
            parts[label], rows[label] = meant, valid[chosen]
        if len(parts) > MOST_PARTS:
            why = "it numbers no things" if grid is None else "give larger tiles"
            raise InvalidParameterError(f"has {len(parts)} parts or more: {why}")
        points, kept = points + len(scan), kept + len(valid)
        if files is not None:
            files.add(scan, rows)
    ordered = sorted(parts, key=float if grid is None else tile_of)
    return Split(digest, {label: parts[label] for label in ordered}, points, points - kept, grid)


def _grid(path: Path, cut: Cut) -> Grid:
    """The grid over the box of the points."""
    assert cut.tiles is not None
    assert cut.overlap is not None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    points = invalid = first = 0
    for scan in read_blocks(path, where=cut.where):
        finite = _finite(scan)
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


def _finite(scan: Scan) -> np.ndarray:
    return np.isfinite(scan.positions).all(axis=1)


def _labels(scan: Scan, by: Any) -> np.ndarray:
    """The labels of points; without one it is NaN, say."""
    if by not in scan.attributes:
        raise InvalidParameterError(did_you_mean(str(by), scan.given, "attribute of its points"))
    return scan.attributes[by]


def _parted(scan: Scan, valid: np.ndarray, by: Any, grid: Grid | None) -> Iterator[tuple[str, str, np.ndarray]]:
    """The parts of the valid points: label, what it means, and which of them."""
    if grid is not None:
        for tile, rows in grid.parted(scan.positions[valid]):
            yield tile_name(tile), f"tile {tile_name(tile)}", rows
        return
    values, group = np.unique(_labels(scan, by)[valid], return_inverse=True)
    rows_of = np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1])
    for value, rows in zip(values.tolist(), rows_of, strict=False):  # of no values, split makes one group
        label = label_text(value)
        if len(label) > LONGEST_LABEL:
            raise InvalidParameterError(f"{by}: {value!r} is no label: it has too many digits for a file name")
        yield label, f"where {by} == {value!r}", rows


def label_text(value: float) -> str:
    """A label as part of a name, such as 17 or 0.25: all digits, since others may differ in the last one."""
    return str(int(value)) if value == int(value) else repr(value)
