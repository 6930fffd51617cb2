"""PLY: skeletons, of which it keeps vertices, edges, radii and half axes to the last bit, and clouds and meshes.

Skeletons have the radii as ``radius`` and ``quality``, by which MeshLab colours, and lose all else; Open3D's
``read_line_set`` opens them. Scans keep every scalar property of a vertex, and faces as triangles. A skeleton is a
file that has edges and no faces. What a header promises and the file does not hold is an error.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ...errors import FileFormatError
from ...skeleton import Skeleton
from ..paths import breaks_off
from ..scan import COLOR_CHANNELS, NO_TRIANGLES, NORMAL_NAMES, Scan, brightest, named_attributes, unit_colors
from .graphs import NoEdges, graph_skeleton

SECTION = ("half_width", "half_thickness")
LONGEST_LINE = 1 << 16  # derived: far beyond any line of a header, so that an endless file without lines ends
LONGEST_HEADER = 1 << 12  # derived: in lines, likewise
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

    def dtype(self, order: str, lengths: Iterable[int] = ()) -> np.dtype:
        """A row of binary data in a byte order, whose lists have so many values."""
        left = iter(lengths)
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for i, (name, kind, counts) in enumerate(self.columns):
            if counts is None:
                fields.append((name, f"{order}{kind}"))
            else:
                fields += [(f"{i} counts", f"{order}{counts}"), (name, f"{order}{kind}", (next(left),))]
        return np.dtype(fields)

    def breaks_off(self, found: int) -> ValueError:
        """The error where the file holds fewer rows."""
        return breaks_off(self.rows, found, "points" if self.name == "vertex" else f"rows of {self.name!r}")


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


def ply_elements(path: str | os.PathLike) -> dict[str, list[str]]:
    """The elements that a PLY file holds at least one of, with the names of their properties."""
    with open(path, "rb") as stream:
        try:
            _, elements = read_header(stream)
        except ValueError as error:
            raise FileFormatError(f"{os.fspath(path)}: not a valid .ply file: {error}") from None
    return {element.name: [column.name for column in element.columns] for element in elements if element.rows}


def holds_lines(stream: BinaryIO) -> bool:
    """Whether a PLY file is a drawing of lines and no scan: it has edges and no faces."""
    with suppress(ValueError):
        rows = {element.name: element.rows for element in read_header(stream)[1]}
        return "edge" in rows and not rows.get("face")
    return False


# -------------------------------------------------------------------------------------------------------------- tables


class Lists(NamedTuple):
    """A column of lists: how many values each row has, and all of them one after the other."""

    counts: np.ndarray
    values: np.ndarray


Table = Mapping[str, "np.ndarray | Lists"]
_Take = Callable[[str, int], Any]  # the next so many values of a type


def read_tables(stream: BinaryIO, *wanted: str) -> dict[str, Table]:
    """Elements that a file has, columns by name; text becomes float64. What follows them is not looked at."""
    order, elements = read_header(stream)
    last = max((i for i, element in enumerate(elements) if element.name in wanted), default=-1)
    _check_names(elements[: last + 1])
    if not order:
        lines = (line.decode("ascii", "replace") for line in stream if line.strip())
        return {element.name: _text(lines, element) for element in elements[: last + 1]}
    tables, data, at = dict[str, Table](), stream.read(), 0
    for element in elements[: last + 1]:
        tables[element.name], at = _binary(data, at, element, order)
    return tables


def _text(lines: Iterator[str], element: Element) -> Table:
    held = list(islice(lines, element.rows))
    if len(held) < element.rows:
        raise element.breaks_off(len(held))
    if not any(column.counts for column in element.columns):
        shape = len(held), len(element.columns)
        rows = np.loadtxt(held, ndmin=2, comments=None, usecols=range(shape[1])) if all(shape) else np.empty(shape)
        return dict(zip([column.name for column in element.columns], rows.T, strict=True))

    def row(line: str) -> _Take:
        words = iter([float(word) for word in line.split()])
        return lambda kind, n: list(islice(words, n))

    return _row_by_row(element, map(row, held), "f8")


def _binary(data: bytes, at: int, element: Element, order: str) -> tuple[Table, int]:
    """A table and where it ends: at once if the lists of a column are as long as that of the first row."""
    place, lists = at, [i for i, column in enumerate(element.columns) if column.counts]

    def take(kind: str, n: int) -> np.ndarray:
        nonlocal place
        values = np.frombuffer(data, order + kind, n, place) if n else np.empty(0, kind)
        place += values.nbytes
        return values

    lengths = [0] * len(lists)
    if lists and element.rows:
        first = _row_by_row(element._replace(rows=1), [take])
        lengths = [int(column.counts[0]) for column in first.values() if isinstance(column, Lists)]
    row = element.dtype(order, lengths)
    end = at + element.rows * row.itemsize
    if end <= len(data):
        rows = np.frombuffer(data, row, element.rows, at) if end > at else np.empty(element.rows, row)
        if all((rows[f"{i} counts"] == n).all() for i, n in zip(lists, lengths, strict=True)):
            return {
                name: Lists(rows[f"{i} counts"].astype(np.int64), rows[name].ravel()) if counts else rows[name]
                for i, (name, _, counts) in enumerate(element.columns)
            }, end
    elif not lists:
        raise element.breaks_off((len(data) - at) // row.itemsize)
    place = at
    return _row_by_row(element, (take for _ in range(element.rows))), place


def _row_by_row(element: Element, rows: Iterable[_Take], kind: str | None = None) -> Table:
    """A table of rows that each give their values in turn, so many of a type; `kind` is that of text."""
    found: list[list[Any]] = [[] for _ in element.columns]
    for done, take in enumerate(rows):
        for column, held in zip(element.columns, found, strict=True):
            try:
                n = int(take(column.counts, 1)[0]) if column.counts else 1
                held.append(take(column.kind, n))
            except (ValueError, IndexError):
                raise element.breaks_off(done) from None
            if n < 0 or len(held[-1]) < n:
                raise element.breaks_off(done)
    table: dict[str, np.ndarray | Lists] = {}
    for (name, own, counts), held in zip(element.columns, found, strict=True):
        values = np.concatenate([np.empty(0, kind or own), *held])
        table[name] = Lists(np.array([len(each) for each in held], np.int64), values) if counts else values
    return table


def _check_names(elements: Iterable[Element]) -> None:
    for element in elements:
        if len({column.name for column in element.columns}) < len(element.columns):
            raise ValueError(f"element {element.name!r} has two properties of one name")


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
    """Text, meshes, and files with lists before the last vertex are read whole."""
    with path.open("rb") as stream:
        order, elements = read_header(stream)
        start = stream.tell()
    names = [element.name for element in elements]
    ahead = elements[: names.index("vertex") + 1] if "vertex" in names else []
    lists = any(column.counts for element in ahead for column in element.columns)
    if not order or not ahead or lists or any(element.rows for element in elements if element.name == "face"):
        return None, map(_whole, [path])
    _check_names(ahead)
    start += sum(element.rows * element.dtype(order).itemsize for element in ahead[:-1])
    vertex, row = ahead[-1], ahead[-1].dtype(order)
    held = max(path.stat().st_size - start, 0) // max(row.itemsize, 1)
    if held < vertex.rows:
        raise vertex.breaks_off(held)
    return vertex.rows, _blocks(path, start, row, vertex.rows, rows, bare)


def _whole(path: Path) -> Scan:
    with path.open("rb") as stream:
        tables = read_tables(stream, "vertex", "face")
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    scan = _scan(tables["vertex"])
    return replace(scan, triangles=_triangles(tables.get("face", {}), len(scan)), types={})


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


def _triangles(faces: Table, n: int) -> np.ndarray:
    """Polygons as fans of triangles; those with a corner that is not there are left out."""
    corners = faces.get("vertex_indices", faces.get("vertex_index"))
    if not isinstance(corners, Lists) or len(corners.counts) == 0:
        return NO_TRIANGLES
    first = np.cumsum(corners.counts) - corners.counts
    fans = np.maximum(corners.counts - 2, 0)
    face = np.repeat(np.arange(len(fans)), fans)
    step = np.arange(len(face)) - np.repeat(np.cumsum(fans) - fans, fans)
    at = first[face]
    found = corners.values.astype(np.int64)[np.column_stack([at, at + step + 1, at + step + 2])]
    return found[((found >= 0) & (found < n)).all(axis=1)]


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
