"""Clouds as text: CSV, TXT, ASC and XYZ, with or without a line of names; all numbers are kept.

The columns are parted by spaces, tabs, commas or semicolons, and lines ahead of the first three numbers are a header.
Where commas do not part columns, they are decimal points.
"""

import logging
import math
import re
from array import array
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np

from ...geometry.groups import quantile
from ..paths import NoPoints
from ..scan import Scan, scan_of

_log = logging.getLogger(__name__)

_COMMENTS = ("#", "//", "%")
HEADER_LINES = 100  # fitted to nothing: longer headers are those of other files
MOST_COLUMNS = 1000  # fitted: a point has a few
AMBIGUOUS = "between columns and in numbers are not understood: part columns by semicolons"
_ROLES = {
    **dict.fromkeys(("x", "easting"), "x"),
    **dict.fromkeys(("y", "northing"), "y"),
    **dict.fromkeys(("z", "height", "elevation", "altitude"), "z"),
    **dict.fromkeys(("r", "red", "rf"), "red"),
    **dict.fromkeys(("g", "green", "gf"), "green"),
    **dict.fromkeys(("b", "blue", "bf"), "blue"),
    **{f"{word}{mark}{axis}": f"n{axis}" for word in ("normal", "n") for mark in ("_", "") for axis in "xyz"},
}


class Layout(NamedTuple):
    """How a file of text is laid out."""

    skip: int  # lines of the header
    delimiter: str | None  # None for any white space
    names: list[str]  # of the columns with numbers, empty where the file has none
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
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        layout = _layout(stream)
        stream.seek(0)
        rows = _rows(stream, layout, path)
    names = layout.names or [*"xyz", *(f"column_{column + 1}" for column in layout.columns[3:])]
    columns: dict[str, np.ndarray] = {}
    for name, values in zip(names, rows.T, strict=True):
        role = _role(name)
        if role in columns:
            role = name
        while role in columns:
            role += "_2"
        columns[role] = values if role in _ROLES.values() else _whole(values)
    return scan_of(columns)


def _layout(stream: TextIO) -> Layout:
    names: list[str] = []
    above: list[str] = []  # the words of the line before, if they may be names
    first = ""
    for skip, line in enumerate(islice(stream, HEADER_LINES)):
        comment = next((mark for mark in _COMMENTS if line.lstrip().startswith(mark)), "")
        line = line.strip().removeprefix(comment)
        delimiter = ";" if ";" in line else "," if "," in line else None
        if delimiter == "," and len(_numeric(_split(line, ","))) < 3 <= len(_numeric(_split(line, None))):
            delimiter = None  # its commas are decimal points
        words = _split(line, delimiter)
        columns = [] if comment else _numeric(words)
        if len(columns) > MOST_COLUMNS:
            raise ValueError(f"a line has {len(columns)} numbers, and at most {MOST_COLUMNS} are read")
        if len(columns) >= 3:
            if not names and len(above) == len(words):
                raise NoPoints(f"its columns are called {', '.join(above)}: call three of them x, y and z")
            if delimiter == "," and _has_decimal_commas(names, [line, *islice(stream, HEADER_LINES)]):
                raise NoPoints(f"commas {AMBIGUOUS}")
            named = len(names) == len(words)
            return Layout(skip, delimiter, [names[i] for i in columns] if named else [], columns)
        if words[:1] == ["ncols"]:
            raise NoPoints("it is a grid of heights, no cloud")
        first = first or line
        if set("xyz") <= set(map(_role, words)):
            names = words
        above = words if delimiter and not comment and not columns else []
    raise NoPoints(f"no line of its beginning has three numbers: it begins with {first[:60]!r}")


def _rows(stream: TextIO, layout: Layout, path: Path) -> np.ndarray:
    """The numbers, (N, C) float array; cells without a number are NaN, but rows without a place are left out."""
    form: Any = dict(delimiter=layout.delimiter, comments=_COMMENTS, usecols=layout.columns, ndmin=2)
    with suppress(ValueError):  # some line is not like the others
        return np.loadtxt(stream, skiprows=layout.skip, **form)
    stream.seek(0)
    cells, skipped = array("d"), 0
    for line in islice(stream, layout.skip, None):
        words = _split(line.partition("#")[0], layout.delimiter, quotes="")  # a number in quotes is none
        if not any(words):
            continue
        row = [_number(words[i]) if i < len(words) else None for i in layout.columns]
        cut = not line.endswith("\n") and len(words) <= layout.columns[-1]  # its last number may have been longer
        if cut or None in row[:3]:
            skipped += 1
        else:
            cells.extend(math.nan if number is None else number for number in row)
    rows = np.array(cells).reshape(-1, len(layout.columns))
    if skipped > len(rows):
        raise NoPoints(f"{skipped} of {skipped + len(rows)} lines hold no point; commas {AMBIGUOUS}")
    if skipped:
        _log.warning("%s: %d of %d lines hold no point and were skipped", path, skipped, skipped + len(rows))
    return rows


def _role(name: str) -> str:
    """What a column is, by its name; a unit in brackets does not matter."""
    word = re.sub(r"[\[(].*", "", name).strip().lower()
    return _ROLES.get(word, name)


def _whole(values: np.ndarray) -> np.ndarray:
    """As integers, where they all are."""
    with np.errstate(invalid="ignore"):
        whole = np.isfinite(values).all() and (np.abs(values) < 2**31).all() and (values == np.round(values)).all()
    return values.astype(np.int32) if whole else values


def _split(line: str, delimiter: str | None, quotes: str = "\"'") -> list[str]:
    """The words of a line, without quotes; commas that are no delimiters are decimal points."""
    line = line if delimiter == "," else line.replace(",", ".")
    return [word.strip().strip(quotes) for word in line.split(delimiter)]


def _numeric(words: list[str]) -> list[int]:
    """Which words are numbers."""
    return [i for i, word in enumerate(words) if _number(word) is not None]


def _has_decimal_commas(names: list[str], lines: list[str]) -> bool:
    """Whether commas that part words are decimal points, too: more words than names, or zeros ahead of a number."""
    rows = [_split(line.strip().rstrip(","), ",") for line in lines if "." not in line]
    if names:
        sizes = [len(words) - len(names) for words in rows] if len(rows) == len(lines) else [0]
        more = quantile(np.array(sizes))  # a whole place among them has no commas
        return more >= 3 or (more > 0 and min(sizes) < max(sizes))
    padded = [[re.fullmatch(r"0\d+", word) for word in words[:4]] for words in rows if len(words) > 3]
    return any(x[1] or x[3] for x in padded) and not any(x[0] or x[2] for x in padded)


def _number(word: str) -> float | None:
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None
