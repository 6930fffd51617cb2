"""The tables of PLY files, read without trust: what a header promises and the file does not hold is an error."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ..paths import breaks_off

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
    """The wanted elements of a PLY file, columns by name, those left out that it has none of; text becomes float64.

    What follows the last of them is not looked at. ValueError where the file is damaged or ends before an element does.
    """
    order, elements = read_header(stream)
    last = max((i for i, element in enumerate(elements) if element.name in set(wanted)), default=-1)
    tables: dict[str, Table] = {}
    _check_names(elements[: last + 1])
    for element in elements[: last + 1]:
        tables[element.name] = _text(stream, element) if order == "" else _binary(stream, element, order)
    return {name: table for name, table in tables.items() if name in set(wanted)}


def find_rows(stream: BinaryIO, name: str, without: Iterable[str] = ()) -> tuple[np.dtype, int] | None:
    """What a row of an element is, and how many there are, where these can be read a few at a time: the stream is left
    at the first. None for text, lists in it or before it, rows of an element in `without`, or where there is none.

    ValueError where the file is damaged, or ends before the element does.
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
    return breaks_off(element.rows, found, "points" if element.name == "vertex" else f"rows of {element.name!r}")


def _text(stream: BinaryIO, element: Element) -> Table:
    not_blank = (line.decode("ascii", "replace") for line in stream if line.strip())
    lines = list(islice(not_blank, element.rows))
    if len(lines) < element.rows:
        raise _broken_off(element, len(lines))
    if any(column.counts for column in element.columns):
        return _joined(element, [_row(line, element) for line in lines], float)
    shape = len(lines), len(element.columns)
    rows = np.loadtxt(lines, ndmin=2, comments=None, usecols=range(shape[1])) if all(shape) else np.empty(shape)
    return dict(zip(element.names, rows.T, strict=True))


def _row(line: str, element: Element) -> list[list[float]]:
    """The values of a line of text, by column."""
    words, found = iter(map(float, line.split())), list[list[float]]()
    for column in element.columns:
        n = int(next(words, -1)) if column.counts else 1
        values = list(islice(words, max(n, 0)))
        if len(values) != n:
            raise ValueError(f"a row of {element.name!r} is too short: {line[:80].strip()!r}")
        found.append(values)
    return found


def _binary(stream: BinaryIO, element: Element, order: str) -> Table:
    """Rows at once where all lists of a column are as long as that of the first row, or else one after the other."""
    start, left = stream.tell(), _bytes_left(stream)
    lists = [i for i, column in enumerate(element.columns) if column.counts]
    if lists and element.rows:
        first = _walked(stream, element._replace(rows=1), order)
        stream.seek(start)
        lengths = [int(column.counts[0]) for column in first.values() if isinstance(column, Lists)]
    else:
        lengths = [0] * len(lists)
    row = element.dtype(order, lengths)
    if left >= element.rows * row.itemsize > 0:
        rows = np.frombuffer(stream.read(element.rows * row.itemsize), row)
        if all((rows[f"{i} counts"] == n).all() for i, n in zip(lists, lengths, strict=True)):
            return {
                name: rows[name] if count is None else Lists(rows[f"{i} counts"].astype(np.int64), rows[name].ravel())
                for i, (name, _, count) in enumerate(element.columns)
            }
        stream.seek(start)
    if element.rows and not lists:
        raise _broken_off(element, left // max(row.itemsize, 1))
    return _walked(stream, element, order)


def _walked(stream: BinaryIO, element: Element, order: str) -> Table:
    """Rows of binary data one after the other."""
    left, rows = _bytes_left(stream), list[list[np.ndarray]]()
    kinds = [np.dtype(f"{order}{kind}") for _, kind, _ in element.columns]
    heads = [np.dtype(f"{order}{counts}") if counts else None for _, _, counts in element.columns]
    for _ in range(element.rows):
        row = []
        for value, head in zip(kinds, heads, strict=True):
            n = 1
            if head is not None:
                data, left = stream.read(head.itemsize), left - head.itemsize
                n = int(np.frombuffer(data, head)[0]) if left >= 0 else -1
            left -= n * value.itemsize
            if n < 0 or left < 0:
                raise _broken_off(element, len(rows))
            row.append(np.frombuffer(stream.read(n * value.itemsize), value))
        rows.append(row)
    return _joined(element, rows, None)


def _joined(element: Element, rows: Sequence[Sequence[Any]], dtype: type | None) -> Table:
    """The columns of rows, each a list of values per column; of the element's own types by default."""
    table: Table = {}
    for i, (name, kind, counts) in enumerate(element.columns):
        values = np.concatenate([np.empty(0, dtype or kind), *(row[i] for row in rows)])
        lengths = np.array([len(row[i]) for row in rows], np.int64)
        table[name] = values if counts is None else Lists(lengths, values)
    return table


def _bytes_left(stream: BinaryIO) -> int:
    here = stream.tell()
    end = stream.seek(0, os.SEEK_END)
    stream.seek(here)
    return end - here
