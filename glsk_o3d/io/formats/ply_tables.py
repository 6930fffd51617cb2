"""The tables of PLY files, read without trust: what a header promises and the file does not hold is an error."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import BinaryIO, NamedTuple

import numpy as np

_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
_COUNTS = [name for name, kind in _KINDS.items() if kind[0] != "f"]
LONGEST_LINE = 1 << 16  # derived: far beyond any line of a header, so that an endless file without lines ends
LONGEST_HEADER = 1 << 12  # derived: in lines, likewise


class Column(NamedTuple):
    """A property of an element: its name, NumPy's type without byte order, and that of the counts if it is a list."""

    name: str
    kind: str
    counts: str | None = None


class Element(NamedTuple):
    """What the header of a PLY file says of a table of its data: a name such as ``"vertex"``, and its columns."""

    name: str
    rows: int
    columns: list[Column]

    @property
    def names(self) -> list[str]:
        """The names of the columns."""
        return [column.name for column in self.columns]

    def dtype(self, order: str, counts: Iterable[int] = ()) -> np.dtype:
        """A row of binary data in a byte order, whose lists have so many values."""
        lengths = iter(counts)
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for i, (name, kind, count) in enumerate(self.columns):
            if count is None:
                fields.append((name, f"{order}{kind}"))
            else:
                fields += [(f"{i} counts", f"{order}{count}"), (name, f"{order}{kind}", (next(lengths),))]
        return np.dtype(fields)


class Lists(NamedTuple):
    """A column of lists: how many values each row has, and all of them one after the other."""

    counts: np.ndarray
    values: np.ndarray


Table = dict[str, "np.ndarray | Lists"]


def read_header(stream: BinaryIO) -> tuple[str, list[Element]]:
    """Read the header of a PLY file; what the stream gives next are the data.

    Gives NumPy's byte order, empty for text, and the elements. ValueError if it is no PLY file, or damaged.
    """
    if stream.readline(16).strip() != b"ply":
        raise ValueError("it does not start with 'ply'")
    order: str | None = None
    elements: list[Element] = []
    for line in islice(iter(lambda: stream.readline(LONGEST_LINE), b""), LONGEST_HEADER):
        match line.decode("ascii", "replace").split():
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count), []))
            case ["property", "list", counts, kind, name] if elements and kind in _KINDS and counts in _COUNTS:
                elements[-1].columns.append(Column(name, _KINDS[kind], _KINDS[counts]))
            case ["property", kind, name] if elements and kind in _KINDS:
                elements[-1].columns.append(Column(name, _KINDS[kind]))
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["end_header"] if order is not None:
                return order, elements
            case _:
                raise ValueError(f"its header has the line {line[:80]!r}")
    raise ValueError("its header does not end")


def read_tables(stream: BinaryIO, wanted: Iterable[str]) -> dict[str, Table]:
    """Read elements of a PLY file; those that it has none of are left out.

    Parameters
    ----------
    stream : binary stream
        At its beginning; it can be sought.
    wanted : iterable of str
        The names of the elements. What follows the last of them is not looked at.

    Returns
    -------
    dict of str to dict
        By element and column: arrays, float64 in text; or `Lists`.

    Raises
    ------
    ValueError
        It is no PLY file, or damaged, or it ends before an element does.
    """
    order, elements = read_header(stream)
    last = max((i for i, element in enumerate(elements) if element.name in set(wanted)), default=-1)
    tables: dict[str, Table] = {}
    _check_names(elements[: last + 1])
    for element in elements[: last + 1]:
        tables[element.name] = _text(stream, element) if order == "" else _binary(stream, element, order)
    return {name: table for name, table in tables.items() if name in set(wanted)}


def find_rows(stream: BinaryIO, name: str, without: Iterable[str] = ()) -> tuple[np.dtype, int] | None:
    """Find an element whose rows can be read a few at a time.

    Parameters
    ----------
    stream : binary stream
        At its beginning; it can be sought, and is left at the first row.
    name : str
        Of the element.
    without : iterable of str
        Elements that the file must not have a row of.

    Returns
    -------
    dtype and int, or None
        What a row is, and how many there are. None if the data are text, or there are lists in it or before it, or
        there is none.

    Raises
    ------
    ValueError
        It is no PLY file, or damaged, or it ends before the element does.
    """
    order, elements = read_header(stream)
    at = next((i for i, element in enumerate(elements) if element.name == name), None)
    if order == "" or at is None or any(element.rows for element in elements if element.name in set(without)):
        return None
    if any(column.counts for element in elements[: at + 1] for column in element.columns):
        return None
    _check_names(elements[: at + 1])
    stream.seek(sum(element.rows * element.dtype(order).itemsize for element in elements[:at]), os.SEEK_CUR)
    element, left = elements[at], max(_bytes_left(stream), 0)
    row = element.dtype(order)
    if left < element.rows * row.itemsize:
        raise _broken_off(element, left // row.itemsize)
    return row, element.rows


def _check_names(elements: Iterable[Element]) -> None:
    for element in elements:
        if len(set(element.names)) < len(element.names):
            raise ValueError(f"element {element.name!r} has two properties of one name")


def _broken_off(element: Element, found: int) -> ValueError:
    what = "points" if element.name == "vertex" else f"rows of {element.name!r}"
    return ValueError(f"it promises {element.rows} {what} and holds {found}: it breaks off")


def _text(stream: BinaryIO, element: Element) -> Table:
    lines = [line.decode("ascii", "replace") for line in islice(_not_blank(stream), element.rows)]
    if len(lines) < element.rows:
        raise _broken_off(element, len(lines))
    if not lines or not element.columns:
        return {column.name: _joined([], column.counts) for column in element.columns}
    first = _row(lines[0], element)
    counts = [len(values) for values, column in zip(first, element.columns, strict=True) if column.counts]
    rows = _even_rows(lines, len(counts) + sum(map(len, first)), bool(counts))
    start, table = 0, dict[str, "np.ndarray | Lists"]()
    for values, column in zip(first, element.columns, strict=True):
        head = start
        start += bool(column.counts)
        if rows is None or (column.counts and (rows[:, head] != len(values)).any()):
            return _walked_text(lines, element)  # lists differ in length
        part = rows[:, start : start + len(values)]
        table[column.name] = Lists(rows[:, head].astype(np.int64), part.ravel()) if column.counts else part[:, 0]
        start += len(values)
    return table


def _even_rows(lines: list[str], width: int, may_differ: bool) -> np.ndarray | None:
    """All lines at once, (n, width) float array; None where some are shorter, if they may be."""
    try:
        return np.loadtxt(lines, ndmin=2, comments=None, usecols=range(width))
    except ValueError:
        if not may_differ:
            raise
        return None


def _walked_text(lines: list[str], element: Element) -> Table:
    rows = [_row(line, element) for line in lines]
    return {column.name: _joined([row[i] for row in rows], column.counts) for i, column in enumerate(element.columns)}


def _row(line: str, element: Element) -> list[list[float]]:
    """The values of a line, by column."""
    words, found = iter(map(float, line.split())), list[list[float]]()
    for column in element.columns:
        n = int(next(words, -1)) if column.counts else 1
        values = list(islice(words, max(n, 0)))
        if len(values) != n:
            raise ValueError(f"a row of {element.name!r} is too short: {line[:80].strip()!r}")
        found.append(values)
    return found


def _joined(rows: list[list[float]], counts: str | None) -> np.ndarray | Lists:
    values = np.array([value for row in rows for value in row], float)
    return values if counts is None else Lists(np.array([len(row) for row in rows], np.int64), values)


def _not_blank(stream: BinaryIO) -> Iterator[bytes]:
    return (line for line in stream if line.strip())


def _binary(stream: BinaryIO, element: Element, order: str) -> Table:
    left = _bytes_left(stream)
    lists = [i for i, column in enumerate(element.columns) if column.counts]
    counts = _first_counts(stream, element, order) if lists and element.rows else [0] * len(lists)
    dtype = element.dtype(order, counts)
    if not element.rows:
        none = Lists(np.empty(0, np.int64), np.empty(0))
        return {name: np.empty(0, kind) if count is None else none for name, kind, count in element.columns}
    if left >= element.rows * dtype.itemsize:
        start = stream.tell()
        rows = np.frombuffer(stream.read(element.rows * dtype.itemsize), dtype)
        if all((rows[f"{i} counts"] == n).all() for i, n in zip(lists, counts, strict=True)):
            return {
                name: rows[name] if count is None else Lists(rows[f"{i} counts"].astype(np.int64), rows[name].ravel())
                for i, (name, _, count) in enumerate(element.columns)
            }
        stream.seek(start)
    if not lists:
        raise _broken_off(element, left // max(dtype.itemsize, 1))
    return _walked(stream, element, order)


def _first_counts(stream: BinaryIO, element: Element, order: str) -> list[int]:
    """How long the lists of the first row are."""
    start = stream.tell()
    table = _walked(stream, element._replace(rows=1), order)
    stream.seek(start)
    return [int(column.counts[0]) for column in table.values() if isinstance(column, Lists)]


def _walked(stream: BinaryIO, element: Element, order: str) -> Table:
    """Rows whose lists differ in length, one after the other."""
    kinds = [np.dtype(f"{order}{kind}") for _, kind, _ in element.columns]
    heads = [np.dtype(f"{order}{counts}") if counts else None for _, _, counts in element.columns]
    found: dict[str, list[np.ndarray]] = {name: [] for name in element.names}
    left = _bytes_left(stream)
    for row in range(element.rows):
        for name, kind, head in zip(element.names, kinds, heads, strict=True):
            n = 1
            if head is not None:
                data, left = stream.read(head.itemsize), left - head.itemsize
                n = int(np.frombuffer(data, head)[0]) if left >= 0 else -1
            left -= n * kind.itemsize
            if n < 0 or left < 0:
                raise _broken_off(element, row)
            found[name].append(np.frombuffer(stream.read(n * kind.itemsize), kind))
    empty = [np.empty(0, kind) for kind in kinds]
    flat = {name: np.concatenate([none, *rows]) for none, (name, rows) in zip(empty, found.items(), strict=True)}
    return {
        name: flat[name] if counts is None else Lists(np.array([len(row) for row in found[name]], np.int64), flat[name])
        for name, _, counts in element.columns
    }


def _bytes_left(stream: BinaryIO) -> int:
    here = stream.tell()
    end = stream.seek(0, os.SEEK_END)
    stream.seek(here)
    return end - here
