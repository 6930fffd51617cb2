"""A scene is taken apart into files of its own, a block at a time: a file per label, or per tile."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BatchError, InvalidCloudError, InvalidParameterError, did_you_mean
from ..interop.atomic import write_json
from ..io.clouds.blocks import read_blocks
from ..io.clouds.scanned import Scan
from ..preparation.frame import not_finite
from .grid import Grid, TooManyParts, tile_name, tile_of
from .part_files import PartFiles, writing

PARTS_FOLDER = ".parts"
MOST_PARTS = 10_000  # fitted: more things than anybody numbers in a file; fewer than a scanner's intensities
LONGEST_LABEL = 24  # derived: characters of the longest number of 64 bits, -2.2250738585072014e-308
SPLIT_VERSION = 1


@dataclass(frozen=True)
class Cut:
    """How scenes are taken apart.

    Attributes
    ----------
    by : str or None
        A part for each value of this attribute.
    tiles, overlap : float or None
        A part for each tile of this size.
    where : str or None
        Only points for which this holds.
    drop_invalid : bool
        Pass over points that are not finite, which belong to no tile, instead of refusing them.
    """

    by: str | None = None
    tiles: float | None = None
    overlap: float | None = None
    where: str | None = None
    drop_invalid: bool = False

    def __str__(self) -> str:
        return f"by = {self.by!r}" if self.tiles is None else f"tiles = {self.tiles:g}"


@dataclass(frozen=True)
class Split:
    """A scene, taken apart.

    Attributes
    ----------
    input_hash : str
        Of the scene.
    parts : dict of str to str
        What to say of which points they are, by labels that can stand in names.
    points, dropped : int
        In all, and those that are in no part: without a label, or a place.
    grid : Grid or None
        Of the tiles.
    """

    input_hash: str
    parts: dict[str, str]
    points: int
    dropped: int
    grid: Grid | None = None

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Split:
        """From what `asdict` makes and JSON keeps; ValueError where a label is none: files are named by them."""
        found = data["grid"]
        grid = found and Grid(tuple(found["low"]), tuple(found["cell"]), tuple(found["counts"]), found["overlap"])
        for label, meant in data["parts"].items():
            if not isinstance(meant, str) or label != (
                label_text(float(label)) if grid is None else tile_name(tile_of(label))
            ):
                raise ValueError(f"{label!r} names no part")
        return cls(**{**data, "grid": grid})


class Splitter:
    """Takes scenes apart, each once: what it found is kept in the output folder.

    Parameters
    ----------
    out : Path
    cut : Cut
    hashed : callable
        The hash of a file.
    write : bool
        Also write the parts; else only find out what they would be.
    """

    def __init__(self, out: Path, cut: Cut, hashed: Callable[[Path], str], write: bool):
        self.cut, self.folder, self._hash, self._write = cut, out / PARTS_FOLDER, hashed, write

    def split(self, name: str, path: Path) -> Split:
        """Take a scene apart, unless that has been done.

        Parameters
        ----------
        name : str
            Of its results.
        path : Path

        Raises
        ------
        FileNotFoundError, FileFormatError, InvalidCloudError
            It cannot be read, or has points that belong to no part.
        InvalidParameterError
            It lacks what is asked for.
        BatchError
            The parts cannot be written, or there is something in their place that is not from here.
        """
        self._check_place(name)
        known = self._known(name, path)
        if known is not None:
            return known
        return self._divide(name, path) if self._write else _divided(path, self.cut, self._hash(path), None)

    def file(self, name: str, label: str) -> Path:
        """Where a part is, or will be."""
        return self.folder / name / f"{label}.ply"

    def supply(self, name: str, path: Path, labels: Container[str]) -> None:
        """Write some parts anew that were removed when they had been done."""
        self._divide(name, path, labels)

    def _known(self, name: str, path: Path) -> Split | None:
        try:
            told = json.loads(self._told(name).read_text(encoding="utf-8"))
            same = (SPLIT_VERSION, str(path), asdict(self.cut)) == (told["version"], told["input"], told["cut"])
            split = Split.from_json(told["split"]) if same else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):  # none, or not of ours
            return None
        return split if split is not None and split.input_hash == self._hash(path) else None

    def _check_place(self, name: str) -> None:
        """Raise BatchError where parts would be somewhere else, through a link, or where others keep something."""
        place = self.folder / name
        straight = Path(os.path.realpath(self.folder.parent), PARTS_FOLDER, name)
        if Path(os.path.realpath(place)) != straight or (place.exists() and not self._told(name).is_file()):
            raise BatchError(
                f"{place}: is not of a batch, which would keep the parts of a scene there: move it away, or give the "
                "results another folder"
            )

    def _divide(self, name: str, path: Path, labels: Container[str] | None = None) -> Split:
        with writing(self.folder):
            self._told(name).parent.mkdir(parents=True, exist_ok=True)
            write_json(self._told(name), {})  # of a batch that is killed the next one knows whose the folder is
            if labels is None:
                shutil.rmtree(self.folder / name, ignore_errors=True)
            (self.folder / name).mkdir(exist_ok=True)
        files = PartFiles(self.folder / name, labels)
        try:
            split = _divided(path, self.cut, self._hash(path), files)
            files.close()
        except BaseException:
            self._forget(name)
            raise
        with writing(self.folder):
            told = {"version": SPLIT_VERSION, "input": str(path), "cut": asdict(self.cut), "split": asdict(split)}
            write_json(self._told(name), told)
        return split

    def _forget(self, name: str) -> None:
        shutil.rmtree(self.folder / name, ignore_errors=True)
        with suppress(OSError):  # on Windows nobody removes what is open; above, there may be other scenes
            self._told(name).unlink()
            for above in (self.folder / name).relative_to(self.folder.parent).parents[:-1]:
                (self.folder.parent / above).rmdir()

    def _told(self, name: str) -> Path:
        return self.folder / f"{name}.json"


def _divided(path: Path, cut: Cut, digest: str, files: PartFiles | None) -> Split:
    grid = None if cut.tiles is None else _grid(path, cut)
    parts: dict[str, str] = {}
    points = kept = 0
    for scan in read_blocks(path, where=cut.where):
        found = list(_by_label(scan, cut.by) if grid is None else _by_tile(scan, grid))
        parts |= {label: meant for label, meant, _ in found}
        if len(parts) > MOST_PARTS:
            why = "it numbers no things" if grid is None else "give larger tiles"
            raise TooManyParts(f"{cut}: has {len(parts)} parts or more in {path}: {why}")
        points += len(scan)
        kept += sum(len(rows) for _, _, rows in found) if grid is None else int(_finite(scan).sum())
        if files is not None:
            files.add(scan, {label: rows for label, _, rows in found})
    ordered = sorted(parts, key=lambda label: [float(each) for each in ([label] if grid is None else label.split("-"))])
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


def _by_tile(scan: Scan, grid: Grid) -> Iterator[tuple[str, str, np.ndarray]]:
    finite = np.flatnonzero(_finite(scan))
    for tile, rows in grid.parted(scan.positions[finite]):
        yield tile_name(tile), f"tile {tile_name(tile)}", finite[rows]


def _by_label(scan: Scan, by: str | None) -> Iterator[tuple[str, str, np.ndarray]]:
    if by not in scan.attributes:
        raise InvalidParameterError(did_you_mean(str(by), scan.given, "attribute of its points"))
    values, group = np.unique(scan.attributes[by], return_inverse=True)
    order = np.argsort(group, kind="stable")
    for value, rows in zip(values.tolist(), np.split(order, np.cumsum(np.bincount(group))[:-1]), strict=True):
        if math.isfinite(value):  # points without a label are NaN, say
            try:
                label = label_text(value)
            except InvalidParameterError as error:
                raise InvalidParameterError(f"{by}: {error}") from None
            yield label, f"where {by} == {value!r}", rows


def label_text(value: float) -> str:
    """A label as part of a name: all digits, since others may differ in the last one.

    Raises
    ------
    InvalidParameterError
        It is too long for a name.

    Examples
    --------
    >>> label_text(17.0), label_text(0.25)
    ('17', '0.25')
    """
    text = str(int(value)) if value == int(value) else repr(value)
    if len(text) > LONGEST_LABEL:
        raise InvalidParameterError(f"{value!r} is no label: no name has that many digits")
    return text
