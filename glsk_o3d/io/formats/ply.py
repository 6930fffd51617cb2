"""PLY: skeletons, of which it keeps vertices, edges, radii and half axes to the last bit, and clouds and meshes.

Skeletons have the radii as ``radius`` and ``quality``, by which MeshLab colours, and lose all else; Open3D's
``read_line_set`` opens them. Scans keep every scalar property of a vertex, and faces as triangles. A skeleton is a
file that has edges and no faces. What a header promises and the file does not hold is an error.
"""

import io
import os
import struct
from array import array
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ...skeleton import Skeleton
from ..paths import check_budget, check_promised, number_rows, text_lines
from ..scan import COLOR_CHANNELS, NO_TRIANGLES, NORMAL_NAMES, Scan, brightest, named_attributes, unit_colors
from .graphs import NoEdges, graph_skeleton

SECTION = ("half_width", "half_thickness")
LONGEST_LINE = 1 << 16  # derived: far beyond any line of a header, so that an endless file without lines ends
LONGEST_HEADER = 1 << 12  # derived: in lines, likewise
LIST_BYTES, MOST_IN_LISTS = 32, 16  # derived: taken for a row with a list; fitted: times the size of a file, for all
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
_COUNTS = [name for name, kind in _KINDS.items() if kind[0] != "f"]
WRITTEN_KINDS = {"u1": "uchar", "i4": "int", "f4": "float", "f8": "double"}
"""The types that Open3D reads: of others it leaves the column out."""


# -------------------------------------------------------------------------------------------------------------- header


class Column(NamedTuple):
    """A property of an element: its name, NumPy's type without byte order, and that of the counts if it is a list."""

    name: str
    kind: str
    counts: str | None = None


class Element(NamedTuple):
    """What a header says of a table: a name such as ``"vertex"``, and its columns."""

    name: str
    rows: int
    columns: list[Column]

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in length."""
        return any(column.counts for column in self.columns)

    def dtype(self, order: str) -> np.dtype:
        """A row of binary data without lists in a byte order."""
        return np.dtype([(column.name, order + column.kind) for column in self.columns])

    def least(self, order: str) -> int:
        """The bytes of a row at the least: in text two for a number, of a face those of one corner."""
        columns = [
            (each.counts, each.kind) if self.name == "face" else (each.counts or each.kind,) for each in self.columns
        ]
        return sum(np.dtype(kind).itemsize if order else 2 for kinds in columns for kind in kinds if kind)

    def check(self, held: int) -> None:
        """Raise ValueError where there are less rows."""
        check_promised(self.rows, held, "points" if self.name == "vertex" else f"rows of {self.name!r}")


def check_elements(elements: list[Element], order: str, size: int) -> int:
    """What elements take of so many bytes at the least; ValueError where that is more, or names repeat."""
    at = 0
    for element in elements:
        if len({column.name for column in element.columns}) < max(len(element.columns), element.rows > 0):
            raise ValueError(f"element {element.name!r} has two properties of one name, or none")
        least = element.least(order)
        element.check((size - at) // max(least, 1))
        at += element.rows * least
    return at


def read_header(stream: BinaryIO) -> tuple[str, list[Element]]:
    """NumPy's byte order, empty for text, and the elements; what the stream gives next are the data."""
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


def holds_lines(stream: BinaryIO) -> bool:
    """Whether a PLY file is a drawing of lines and no scan: it has edges and no faces."""
    with suppress(ValueError):
        rows = {element.name: element.rows for element in read_header(stream)[1]}
        return "edge" in rows and not rows.get("face")
    return False


# -------------------------------------------------------------------------------------------------------------- tables


class Lists(NamedTuple):
    """A column of lists: how many values each row has, and where the first is; the next is a `step` behind it."""

    counts: np.ndarray
    first: np.ndarray
    values: np.ndarray
    step: int


Table = Mapping[str, Any]  # of arrays and lists


def read_tables(stream: BinaryIO, *wanted: str) -> dict[str, Table]:
    """Elements that a file has, columns by name; text becomes float64. The others are read over: nothing may lack."""
    order, elements = read_header(stream)
    start = stream.tell()
    end = stream.seek(0, os.SEEK_END)
    check_elements(elements, order, end - start + (not order))  # the last line of text may have no end
    stream.seek(start)
    elements = [element for element in elements if element.columns]
    tables = dict[str, Table]()
    if order:
        data, at = stream.read(), 0
        for element in elements:
            tables[element.name], at = _binary(data, at, element, order)
        rest = data[at : at + LONGEST_LINE].strip()
    else:
        lines = text_lines(stream)
        for element in elements:
            tables[element.name] = text_table(lines, element)
        rest = next(lines, "").encode()
    if rest and sum(element.rows > 0 for element in elements) > 1:  # then a wrong count shifts what comes after it
        raise ValueError("it holds more than its header promises")
    return {name: table for name, table in tables.items() if name in wanted}


def text_table(lines: Iterator[str], element: Element) -> Table:
    """The next rows of text as a table."""
    if not element.has_lists:
        rows = number_rows(lines, element.rows, len(element.columns))
        element.check(len(rows))
        return dict(zip([column.name for column in element.columns], rows.T, strict=True))
    words, ends = array("d"), array("q", [0])
    for line in islice(lines, element.rows):
        words.extend(map(float, line.split()))
        ends.append(len(words))
    element.check(len(ends) - 1)
    held = np.frombuffer(words, float)
    return _columns(element, np.frombuffer(ends, np.int64), lambda kind: (held, 1))[0]


def _binary(data: bytes, at: int, element: Element, order: str) -> tuple[Table, int]:
    """A table and where it ends; at once if its rows are all as long as the first."""
    if not element.has_lists:
        row = element.dtype(order)
        end = at + element.rows * row.itemsize
        element.check((len(data) - at) // row.itemsize)
        rows = np.frombuffer(data[at:end], row)
        return {name: rows[name] for name in row.names or ()}, end
    check_budget(LIST_BYTES * element.rows, len(data), MOST_IN_LISTS)
    sizes = [
        (np.dtype(kind).itemsize, struct.Struct(order + np.dtype(counts).char) if counts else None)
        for _, kind, counts in element.columns
    ]

    def end_of(place: int) -> int:
        for size, count in sizes:
            n = 1
            if count is not None:
                (n,) = count.unpack_from(data, place)
                place += count.size
            place += size * max(n, 0)  # that none is negative is asked of the columns
        return place

    def values(kind: str) -> tuple[np.ndarray, int]:
        size = np.dtype(kind).itemsize
        return np.ndarray(max(len(data) - size + 1, 0), order + kind, data, strides=(1,)), size  # one at every byte

    starts = array("q", [at])
    with suppress(struct.error):  # there is no more count
        alike = at + (end_of(at) - at) * np.arange(element.rows + 1)
        with suppress(ValueError, IndexError):
            table, ends = _columns(element, alike, values)
            if (ends == alike[1:]).all() and alike[-1] <= len(data):
                return table, int(alike[-1])
        while len(starts) <= element.rows and (after := end_of(starts[-1])) <= len(data):
            starts.append(after)
    element.check(len(starts) - 1)
    return _columns(element, np.frombuffer(starts, np.int64), values)[0], starts[-1]


def _columns(
    element: Element, starts: np.ndarray, values: Callable[[str], tuple[np.ndarray, int]]
) -> tuple[Table, np.ndarray]:
    """Columns of rows that begin where they do, and where the rows end, among the values of a type, a step apart."""
    table: dict[str, Any] = {}
    place, ends = starts[:-1], starts[1:]

    def passed(size: int | np.ndarray) -> np.ndarray:
        nonlocal place
        before, place = place, place + size
        if (short := place > ends).any():
            element.check(int(short.argmax()))
        return before

    for name, kind, counts in element.columns:
        held, size = values(counts or kind)
        column = held[passed(size)]
        if counts:
            if not ((column >= 0) & (column <= len(held)) & (column % 1 == 0)).all():
                raise ValueError(f"a list of {element.name!r} has an impossible number of values")
            held, size = values(kind)
            n = column.astype(np.int64)
            table[name] = Lists(n, passed(n * size), held, size)
        else:
            table[name] = column
    return table, place


# ----------------------------------------------------------------------------------------------------------- skeletons


def write(skeleton: Skeleton) -> bytes:
    """The content of a PLY file of a skeleton."""
    columns = dict(zip("xyz", skeleton.vertices.T, strict=True)) | {"radius": skeleton.radii, "quality": skeleton.radii}
    vertices = rows_of(columns | {name: getattr(skeleton, name) for name in SECTION})
    edges = f"element edge {len(skeleton.edges)}\nproperty int vertex1\nproperty int vertex2\n"
    header = header_of(
        vertices.dtype, len(vertices), comment="comment curve skeleton written by glsk-o3d\n", more=edges
    )
    return header + vertices.tobytes() + skeleton.edges.astype("<i4").tobytes()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a PLY file."""
    tables = read_tables(io.BytesIO(data), "vertex", "edge")
    if "edge" not in tables:
        raise NoEdges
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    known = {name: vertex[name] for name in SECTION if set(SECTION) <= vertex.keys()}
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii, **known)


# --------------------------------------------------------------------------------------------------------------- scans


def blocks(path: Path, rows: int, bare: bool) -> tuple[int | None, Iterator[Scan]]:
    """Text, and files with lists, are read whole."""
    with path.open("rb") as stream:
        order, elements = read_header(stream)
        start = stream.tell()
    held = [element for element in elements if element.rows]
    names = [element.name for element in held]
    if not order or "vertex" not in names or any(element.has_lists for element in held):
        return None, map(_whole, [path])
    size = path.stat().st_size - start
    if size > check_elements(held, order, size) and len(held) > 1:
        raise ValueError("it holds more than its header promises")
    at = names.index("vertex")
    start += sum(element.rows * element.dtype(order).itemsize for element in held[:at])
    return held[at].rows, _blocks(path, start, held[at].dtype(order), held[at].rows, rows, bare)


def _whole(path: Path) -> Scan:
    with path.open("rb") as stream:
        tables = read_tables(stream, "vertex", "face")
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    scan = _scan(tables["vertex"])
    return replace(scan, triangles=triangles(tables.get("face", {}), len(scan)), types={})


def _blocks(path: Path, start: int, row: np.dtype, n: int, rows: int, bare: bool) -> Iterator[Scan]:
    def tables() -> Iterator[np.ndarray]:
        with path.open("rb") as stream:
            stream.seek(start)
            for begin in range(0, n, rows):
                yield np.frombuffer(stream.read(min(rows, n - begin) * row.itemsize), row)

    names, top = row.names or (), None
    colored = {*COLOR_CHANNELS} <= {*names} and any(row[name] != np.uint8 for name in COLOR_CHANNELS)
    if rows < n and colored and not bare:  # the scale of the colours depends on the brightest of all
        top = max(brightest(table[name]) for table in tables() for name in COLOR_CHANNELS)
    for table in tables():
        yield _scan({name: table[name] for name in names if not bare or name in "xyz"}, top)


def _scan(table: Table, top: float | None = None) -> Scan:
    """Points of a table of vertices; `top` is the largest number among the colours of all, if these are not all."""
    known = {name: values for name, values in table.items() if isinstance(values, np.ndarray)}
    if not set("xyz") <= known.keys():
        raise ValueError("its vertices have no x, y and z")
    types: dict[str, np.dtype] = {}

    def together(names: list[str]) -> np.ndarray | None:
        if not set(names) <= known.keys():
            return None
        types.update((name, known[name].dtype.newbyteorder("=")) for name in names)
        return np.column_stack([known.pop(name) for name in names])

    positions, colors, normals = (together(names) for names in ([*"xyz"], COLOR_CHANNELS, NORMAL_NAMES))
    attributes = named_attributes(
        (name, values.astype(values.dtype.newbyteorder("="))) for name, values in known.items()
    )
    return Scan(
        np.ascontiguousarray(positions, float),
        None if colors is None else unit_colors(colors, top),
        None if normals is None else np.ascontiguousarray(normals, float),
        attributes,
        types=types | {name: values.dtype for name, values in attributes.items()},
    )


def triangles(faces: Table, n: int) -> np.ndarray:
    """Polygons as fans of triangles; ValueError for one without corners, or with one that is not there."""
    corners = faces.get("vertex_indices", faces.get("vertex_index"))
    if not isinstance(corners, Lists) or len(corners.counts) == 0:
        return NO_TRIANGLES
    fans = np.maximum(corners.counts - 2, 0)
    first = np.repeat(corners.first, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    found = np.column_stack([corners.values[first + corners.step * each] for each in (0, step + 1, step + 2)])
    if corners.counts.min() < 1 or not ((found >= 0) & (found < n)).all():
        raise ValueError("a face has no corners, or one that is no vertex")
    return found.astype(np.int64)


# ------------------------------------------------------------------------------------------------------------- writing


def rows_of(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Columns of equal length, (n,) arrays by name, side by side: a structured array of little-endian rows."""
    n = len(next(iter(columns.values())))
    rows = np.empty(n, [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    return rows


def header_of(row: np.dtype, n: int, *, width: int = 0, comment: str = "", more: str = "") -> bytes:
    """What stands before n such rows; the count can be padded to a width, so that another one fits in its place, and
    `more` are lines of elements that follow.
    """
    properties = "".join(f"property {WRITTEN_KINDS[row[name].str[1:]]} {name}\n" for name in row.names or ())
    vertices = f"{comment}element vertex {n:{width}d}\n"
    return f"ply\nformat binary_little_endian 1.0\n{vertices}{properties}{more}end_header\n".encode()
