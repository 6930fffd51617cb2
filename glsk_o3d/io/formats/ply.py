"""PLY: skeletons, of which it keeps vertices, edges, radii and half axes to the last bit, and clouds and meshes.

Skeletons have the radii as ``radius`` and ``quality``, by which MeshLab colours, and lose all else; Open3D's
``read_line_set`` opens them. Scans keep every scalar property of a vertex, and faces as triangles. A skeleton is a
file that has edges and no faces. What a header promises and the file does not hold is an error.
"""

from __future__ import annotations

import io
import os
import struct
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import islice, takewhile
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...data.skeleton import Skeleton
from ...interop.atomic import write_atomically
from ..paths import binary_rows, check_promised, numbers, text_lines
from ..scan import COLOR_CHANNELS, NO_TRIANGLES, NORMAL_NAMES, Scan, color_bytes, scan_of
from .graphs import NoEdges, graph_skeleton

SECTION = ("half_width", "half_thickness")
LONGEST_LINE = 1 << 16  # derived: far beyond any line of a header, so that an endless file without lines ends
LONGEST_HEADER = 1 << 12  # derived: in lines, likewise
COUNT_WIDTH = 20  # derived: digits of the largest 64-bit number: another count fits in its place
MORE_THAN_PROMISED = "it holds more than its header promises"
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
_COUNTS = [name for name, kind in _KINDS.items() if kind[0] != "f"]
WRITTEN_KINDS = {"u1": "uchar", "i4": "int", "f4": "float", "f8": "double"}
"""The types that Open3D reads: of others it leaves the column out."""
_PROPERTIES = {"positions": [*"xyz"], "normals": NORMAL_NAMES, "colors": COLOR_CHANNELS}


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
    def lists(self) -> list[str]:
        """The names of the columns of lists: rows differ in length if there are any."""
        return [column.name for column in self.columns if column.counts]

    def as_text(self) -> Element:
        """The same in text, all numbers of which are read as doubles."""
        return self._replace(columns=[Column(name, "f8", counts and "f8") for name, _, counts in self.columns])

    def dtype(self, order: str, sizes: Mapping[str, int] = {}) -> np.dtype:
        """A row in a byte order, if its lists have these sizes: with a column of counts for each."""
        fields: list[Any] = []
        for name, kind, counts in self.columns:
            if counts:
                fields.append((f"{name} count", order + counts))
            fields.append((name, order + kind, (sizes[name],)) if counts else (name, order + kind))
        return np.dtype(fields)

    def least(self) -> int:
        """The bytes of all rows at the least: lists may be empty, but a face has a corner."""
        kinds = [column.counts or column.kind for column in self.columns]
        kinds += [column.kind for column in self.columns if column.counts and self.name == "face"]
        return self.rows * sum(np.dtype(kind).itemsize for kind in kinds)


def check_elements(elements: list[Element], size: int) -> None:
    """Raise ValueError where elements take more than so many bytes, or fewer of several without lists, or names repeat.

    After a wrong count what follows is shifted.
    """
    start = 0
    for element in elements:
        if len({column.name for column in element.columns}) < max(len(element.columns), element.rows > 0):
            raise ValueError(f"element {element.name!r} has two properties of one name, or none")
        what = "points" if element.name == "vertex" else f"rows of {element.name!r}"
        check_promised(element.rows, (size - start) * element.rows // max(element.least(), 1), what)
        start += element.least()
    filled = [element for element in elements if element.rows]
    if start < size and len(filled) > 1 and not any(element.lists for element in filled):
        raise ValueError(MORE_THAN_PROMISED)


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


class Lists(NamedTuple):
    """A column of lists: how many values each row has, and all values, those of a row after those before it."""

    counts: np.ndarray
    values: np.ndarray


Table = Mapping[str, Any]  # of arrays and lists


def read_tables(stream: BinaryIO) -> dict[str, Table]:
    """The elements of a file, columns by name; in text floats become float64. ValueError where anything is missing."""
    order, elements = read_header(stream)
    data = stream.read() if order else numbers(text_lines(stream)).tobytes()
    stored, order = (elements, order) if order else ([element.as_text() for element in elements], "=")
    check_elements(stored, len(data))
    tables: dict[str, Table] = {}
    start = 0
    for element, in_file in zip(elements, stored, strict=True):
        if element.columns:
            table, start = _table(data, start, in_file, order)
            tables[element.name] = {name: _typed(table[name], kind) for name, kind, _ in element.columns}
    several = sum(element.rows > 0 for element in elements) > 1
    if data[start : start + LONGEST_LINE].strip() and (several or order == "="):
        raise ValueError(MORE_THAN_PROMISED)
    return tables


@np.errstate(invalid="ignore")
def _typed(values: Any, kind: str) -> Any:
    """Integers in the type of their column; floats of text keep all their digits."""
    return values if isinstance(values, Lists) or kind[0] == "f" else values.astype(kind)


def _table(data: bytes, start: int, element: Element, order: str) -> tuple[Table, int]:
    """The columns of an element and where it ends; at once if its lists are all as long as in the first row."""
    first = _row_by_row(data, start, element._replace(rows=min(element.rows, 1)), order)[0] if element.lists else {}
    sizes = {name: len(first[name].values) for name in element.lists}
    row = element.dtype(order, sizes)
    end = start + element.rows * row.itemsize
    if end <= len(data):
        rows = np.frombuffer(data[start:end], row)
        if all((rows[f"{name} count"] == size).all() for name, size in sizes.items()):
            lists = {name: Lists(rows[f"{name} count"], rows[name].ravel()) for name in sizes}
            return {column.name: rows[column.name] for column in element.columns} | lists, end
    return _row_by_row(data, start, element, order)


def _row_by_row(data: bytes, start: int, element: Element, order: str) -> tuple[Table, int]:
    """The same where rows differ in length."""

    def take(kind: str, n: int) -> Sequence[float]:
        nonlocal start
        before, start = start, start + n * np.dtype(kind).itemsize
        check_promised(start, len(data), "bytes")
        return struct.unpack_from(f"{order}{n}{np.dtype(kind).char}", data, before)

    columns = [(array("q"), array("d")) for _ in element.columns]
    for _ in range(element.rows):
        for (_, kind, counted), (counts, values) in zip(element.columns, columns, strict=True):
            promised = take(counted, 1)[0] if counted else 1
            n = int(promised)
            if not 0 <= n == promised:
                raise ValueError(f"a list of {element.name!r} has an impossible number of values")
            counts.append(n)
            values.extend(take(kind, n))
    return {
        name: Lists(np.array(counts), np.array(values)) if counted else np.array(values)
        for (name, _, counted), (counts, values) in zip(element.columns, columns, strict=True)
    }, start


# ----------------------------------------------------------------------------------------------------------- skeletons


def write(skeleton: Skeleton) -> bytes:
    """The content of a PLY file of a skeleton."""
    columns = {"positions": skeleton.vertices, "radius": skeleton.radii, "quality": skeleton.radii}
    vertices = rows_of(columns_of(columns | {name: getattr(skeleton, name) for name in SECTION}))
    edges = f"element edge {len(skeleton.edges)}\nproperty int vertex1\nproperty int vertex2\n"
    header = header_of(vertices.dtype, len(vertices), comment="curve skeleton written by glsk-o3d", more=edges)
    return header + vertices.tobytes() + skeleton.edges.astype("<i4").tobytes()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a PLY file."""
    tables = read_tables(io.BytesIO(data))
    if "edge" not in tables:
        raise NoEdges
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    section = {name: vertex[name] for name in SECTION if set(SECTION) <= vertex.keys()}
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii, **section)


# --------------------------------------------------------------------------------------------------------------- scans


def blocks(path: Path, rows: int, bare: bool) -> tuple[int | None, Iterator[Scan]]:
    """Text, and files with lists, are read whole."""
    with path.open("rb") as stream:
        order, elements = read_header(stream)
        start = stream.tell()
    filled = {element.name: element for element in elements if element.rows}
    if not order or "vertex" not in filled or any(element.lists for element in filled.values()):
        return None, map(_whole, [path])
    check_elements(elements, path.stat().st_size - start)
    start += sum(element.least() for element in takewhile(lambda element: element.name != "vertex", elements))
    vertex = filled["vertex"]
    return vertex.rows, _blocks(path, start, vertex.dtype(order), vertex.rows, rows, bare)


def _whole(path: Path) -> Scan:
    with path.open("rb") as stream:
        tables = read_tables(stream)
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    scan = _scan(tables["vertex"])
    return replace(scan, triangles=triangles(tables.get("face", {}), len(scan)))


def _blocks(path: Path, start: int, row: np.dtype, n: int, rows: int, bare: bool) -> Iterator[Scan]:
    for table in binary_rows(path, start, row, n, rows):
        yield _scan({name: table[name] for name in row.names or () if not bare or name in "xyz"})


def _scan(table: Table) -> Scan:
    """Points of a table of vertices; integers of 16 bits are colours up to 65535, others up to 255, floats up to 1."""
    columns = {name: values for name, values in table.items() if isinstance(values, np.ndarray)}
    kind = columns["red"].dtype.str[1:] if "red" in columns else ""
    return scan_of(columns, 1 if kind[:1] == "f" else 65535 if kind == "u2" else 255)


def triangles(faces: Table, n: int) -> np.ndarray:
    """Polygons as fans of triangles; ValueError for one without corners, or with one that is not there."""
    corners = faces.get("vertex_indices", faces.get("vertex_index"))
    if not isinstance(corners, Lists) or len(corners.counts) == 0:
        return NO_TRIANGLES
    counts = corners.counts.astype(np.int64)
    if counts.min() < 1 or not ((corners.values >= 0) & (corners.values < n) & (corners.values % 1 == 0)).all():
        raise ValueError("a face has no corners, or one that is no vertex")
    fans = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, fans)
    step = np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.column_stack([corners.values[first + corner] for corner in (0, step + 1, step + 2)]).astype(np.int64)


# ------------------------------------------------------------------------------------------------------------- writing


def save(path: Path, arrays: Mapping[str, ArrayLike], triangles: ArrayLike | None = None) -> None:
    """Write points with what `columns_of` takes, and triangles (T, 3) between them, as `write_atomically` does."""
    vertices, more, faces = rows_of(columns_of(arrays)), "", b""
    if triangles is not None:
        corners = np.asarray(triangles).reshape(-1, 3)
        more = f"element face {len(corners)}\nproperty list uchar int vertex_indices\n"
        rows = np.zeros(len(corners), [("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, corners
        faces = rows.tobytes()
    data = header_of(vertices.dtype, len(vertices), more=more) + vertices.tobytes() + faces
    write_atomically(path, lambda temporary: temporary.write_bytes(data))


def columns_of(arrays: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Columns of the types that Open3D reads, of arrays, (n,) or (n, 3), by the names that its clouds have."""
    columns: dict[str, np.ndarray] = {}
    for name, array_like in arrays.items():
        values = np.asarray(array_like)
        if name == "colors" and values.dtype.kind == "f":
            values = color_bytes(values)
        elif values.dtype.str[1:] not in WRITTEN_KINDS:
            values = values.astype(np.int32 if np.can_cast(values.dtype, np.int32) else float)
        columns |= dict(zip(_PROPERTIES.get(name, [name]), values.reshape(len(values), -1).T, strict=True))
    return columns


def rows_of(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Columns of equal length, (n,) arrays by name, side by side: a structured array of little-endian rows."""
    n = len(next(iter(columns.values())))
    rows = np.empty(n, [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    return rows


def append(path: Path, rows: np.ndarray, n: int) -> int:
    """Add rows to the n that a file has, which is made for the first; gives how many it has, as its header says."""
    n += len(rows)
    with path.open("r+b" if n > len(rows) else "wb") as stream:
        stream.write(header_of(rows.dtype, n, width=COUNT_WIDTH))
        stream.seek(0, os.SEEK_END)
        stream.write(rows.tobytes())
    return n


def header_of(row: np.dtype, n: int, *, width: int = 0, comment: str = "", more: str = "") -> bytes:
    """The header of n such rows; the count can be padded to a width, so that another one fits in its place, and `more`
    are lines of elements that follow.
    """
    properties = "".join(f"property {WRITTEN_KINDS[row[name].str[1:]]} {name}\n" for name in row.names or ())
    vertices = f"element vertex {n:{width}d}\n{properties}"
    comment = f"comment {comment}\n" if comment else ""
    return f"ply\nformat binary_little_endian 1.0\n{comment}{vertices}{more}end_header\n".encode()
