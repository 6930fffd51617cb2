"""Clouds as text: CSV, TXT, ASC, PTS and the XYZ family, with or without a line of names; all numbers are kept.

The columns are parted by spaces, tabs, commas or semicolons, numbers may have a decimal comma, and lines ahead of the
first three numbers are a header. Without names the columns after z are colours if three are whole numbers up to 255,
normals if they have the length 1.
"""

import io
import logging
import os
import re
from array import array
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from ..paths import check_line, check_promised
from ..scan import COLOR_CHANNELS, NORMAL_NAMES, NoPoints, Scan, named_attributes, unit_colors

_log = logging.getLogger(__name__)

_COMMENTS = ["#", "//", "%"]
LOOK_AHEAD = 20  # fitted: lines in which a decimal comma shows
HEADER_LINES = 100  # fitted to nothing: longer headers are those of other files
MOST_COLUMNS = 1000  # fitted: a point has a few
UNIT_SLACK = 0.01  # measured: normals in text have two digits at the least
_ROLES = {
    **dict.fromkeys(("x", "easting"), "x"),
    **dict.fromkeys(("y", "northing"), "y"),
    **dict.fromkeys(("z", "height", "elevation", "altitude"), "z"),
    **dict.fromkeys(("r", "red", "rf"), "red"),
    **dict.fromkeys(("g", "green", "gf"), "green"),
    **dict.fromkeys(("b", "blue", "bf"), "blue"),
    **{name: name for name in NORMAL_NAMES},
    **{f"{word}{mark}{axis}": f"n{axis}" for word in ("normal", "n") for mark in ("_", "") for axis in "xyz"},
}
_BY_ENDING = {
    ".xyzn": [*"xyz", *NORMAL_NAMES],
    ".xyzrgb": [*"xyz", *COLOR_CHANNELS],
    ".pts": [*"xyz", "intensity", *COLOR_CHANNELS],
}


class Layout(NamedTuple):
    """How a file of text is laid out."""

    skip: int  # lines of the header
    delimiter: str | None  # None for any white space
    decimal_comma: bool
    names: list[str]  # of the columns, empty where the file has none
    columns: list[int]  # those with numbers, by the first line that has three


def holds_points(path: Path) -> bool:
    """Whether a file of text looks like a cloud: a line has three numbers, and columns with names have x, y and z."""
    if not path.is_file():  # a pipe may never end
        return False
    with suppress(NoPoints, OSError), path.open(encoding="utf-8-sig", errors="replace") as stream:
        return bool(_layout(stream))
    return False


def read(path: Path) -> Scan:
    """The points of a file of text; NoPoints if there is none. Lines that hold no point are skipped and logged."""
    ending, first = path.suffix.lower(), ""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        if ending == ".pts":
            first = stream.readline(64).strip()
            if not first.isdigit():
                raise ValueError("its first line is not the number of points")
            stream.seek(0)
        layout = _layout(stream)
        stream.seek(0)
        rows = _rows(stream, layout, path)
    if first:
        check_promised(int(first), len(rows))
        with path.open("rb") as data:
            data.seek(-1, os.SEEK_END)
            check_line(data.read())
    names = [layout.names[column] for column in layout.columns] if layout.names else []
    roles = [_role(name) for name in names] or _guess(rows, ending)
    used = [roles.index(axis) for axis in "xyz"]

    def together(wanted: list[str]) -> np.ndarray | None:
        if not set(wanted) <= set(roles):
            return None
        chosen = [roles.index(role) for role in wanted]
        used.extend(chosen)
        return rows[:, chosen]

    positions, colors, normals = rows[:, used], together(COLOR_CHANNELS), together(NORMAL_NAMES)
    called = names or [role or f"column_{column + 1}" for role, column in zip(roles, layout.columns, strict=True)]
    attributes = named_attributes((name, _whole(rows[:, i])) for i, name in enumerate(called) if i not in used)
    return Scan(positions, None if colors is None else unit_colors(colors), normals, attributes)


def _layout(stream: TextIO) -> Layout:
    names: list[str] = []
    first = ""
    strange: list[str] = []  # names right above the data of which none is x
    for skip, line in enumerate(islice(stream, HEADER_LINES)):
        comment = re.match(r"\s*(" + "|".join(_COMMENTS) + ")", line)
        words, delimiter, decimal_comma = _parted(line[comment.end() :] if comment else line)
        columns = [] if comment else [i for i, word in enumerate(words) if _is_number(word)]
        if len(columns) > MOST_COLUMNS:
            raise ValueError(f"a line has {len(columns)} numbers, and at most {MOST_COLUMNS} are read")
        if len(columns) >= 3:
            following = [_parted(next_line) for next_line in islice(stream, LOOK_AHEAD)]
            decimal_comma |= delimiter != "," and any(comma for _, _, comma in following)
            if strange and len(strange) == len(words):
                raise NoPoints(f"its columns are called {', '.join(strange)}: call three of them x, y and z")
            return Layout(skip, delimiter, decimal_comma, names if len(names) == len(words) else [], columns)
        strange, first = [], first or line.strip()
        if words[:1] == ["ncols"]:
            raise NoPoints("it is a grid of heights, no cloud")
        if len(words) >= 3 and sum(map(_is_number, words)) < len(words) / 2:
            called = [word.strip().strip("\"'") for word in words]
            if set("xyz") <= set(map(_role, called)):
                names = called
            elif not comment and delimiter and not names:
                strange = called
    raise NoPoints(f"no line of its beginning has three numbers: it begins with {first[:60]!r}")


def _parted(line: str) -> tuple[list[str], str | None, bool]:
    """The words of a line, what parts them, and whether they have a decimal comma."""
    line = line.strip()
    delimiter = ";" if ";" in line else "," if "," in line else None
    words = [word.strip() for word in line.split(delimiter if delimiter == ";" else None)]
    if "," in line and len(words) >= 3 and all(re.fullmatch(r"[-+]?\d*(,\d+)?([eE][-+]?\d+)?", word) for word in words):
        return [word.replace(",", ".") for word in words], delimiter if delimiter == ";" else None, True
    return [word.strip() for word in line.split(delimiter)], delimiter, False


def _rows(stream: TextIO, layout: Layout, path: Path) -> np.ndarray:
    """The numbers, (N, C) float array; cells without a number are NaN, but rows without a place are left out."""
    if layout.decimal_comma:
        stream = io.StringIO(stream.read().replace(",", "."))
    with suppress(ValueError):  # some line is not like the others
        return np.loadtxt(
            stream,
            delimiter=layout.delimiter,
            comments=_COMMENTS,
            skiprows=layout.skip,
            usecols=layout.columns,
            ndmin=2,
        )
    stream.seek(0)
    found, lost, last = array("d"), 0, layout.columns[-1]
    comment = re.compile("|".join(_COMMENTS))
    for line in islice(stream, layout.skip, None):
        text = comment.split(line, maxsplit=1)[0].strip()
        if not text:
            continue
        words = text.split(layout.delimiter)
        with suppress(ValueError, IndexError):  # most lines are like the first
            if "_" not in text:
                found.extend([float(words[i]) for i in layout.columns])
                continue
        row = [float(words[i]) if i < len(words) and _is_number(words[i]) else np.nan for i in layout.columns]
        broken_off = not line.endswith("\n") and len(words) <= last  # its last number may be cut
        if broken_off or any(i >= len(words) or not _is_number(words[i]) for i in layout.columns[:3]):
            lost += 1
        else:
            found.extend(row)
    rows = np.array(found).reshape(-1, len(layout.columns))
    if lost:
        _log.warning("%s: %d of %d lines hold no point and were skipped", path, lost, lost + len(rows))
    return rows


def _guess(rows: np.ndarray, ending: str) -> list[str]:
    """What the columns of a file without names are; empty where nothing is known."""
    n = rows.shape[1]
    known = _BY_ENDING.get(ending, [])
    if ending == ".pts" and n == 6:
        known = [*"xyz", *COLOR_CHANNELS]
    roles = [*(known[:n] or "xyz")]
    roles += [""] * (n - len(roles))
    for start in (3, 4) if not known else ():
        three = rows[:, start : start + 3]
        if three.shape[1] == 3 and "red" not in roles and "nx" not in roles:
            if (three == np.round(three)).all() and three.min() >= 0 and 1 < three.max() <= 255:
                roles[start : start + 3] = COLOR_CHANNELS
            elif (np.abs(np.linalg.norm(three, axis=1) - 1) < UNIT_SLACK).all():
                roles[start : start + 3] = NORMAL_NAMES
    return roles


def _role(name: str) -> str:
    """What a column is, by its name; a unit in brackets does not matter."""
    word = re.sub(r"[\[(].*", "", name).strip().lower()
    return _ROLES.get(word, name)


def _whole(values: np.ndarray) -> np.ndarray:
    """As integers, where they all are."""
    with np.errstate(invalid="ignore"):
        whole = np.isfinite(values).all() and (np.abs(values) < 2**31).all() and (values == np.round(values)).all()
    return values.astype(np.int64) if whole else values


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word
