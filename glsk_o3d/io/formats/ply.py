"""PLY: keeps vertices and edges to the last bit, and the radii as ``radius`` and ``quality``; loses all else.

Open3D's ``read_line_set`` and MeshLab open it; by quality MeshLab colours. Scans are PLY files, too: a skeleton is one
that has edges.
"""

from __future__ import annotations

import io
import os
from contextlib import suppress
from typing import BinaryIO, NamedTuple

import numpy as np

from ...skeleton import Skeleton
from .graphs import NoEdges, graph_skeleton

_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}


class Element(NamedTuple):
    """What the header of a PLY file says of a table of its data.

    Attributes
    ----------
    name : str
        Such as ``"vertex"``.
    rows : int
    properties : list of (str, str or None)
        The columns: name and NumPy's type, without byte order; None for a list.
    """

    name: str
    rows: int
    properties: list[tuple[str, str | None]]

    @property
    def columns(self) -> list[str]:
        """The names of the properties."""
        return [name for name, _ in self.properties]

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in length, so that where the table ends cannot be told."""
        return any(kind is None for _, kind in self.properties)

    def dtype(self, order: str) -> np.dtype:
        """A row of binary data in a byte order."""
        return np.dtype([(name, f"{order}{kind}") for name, kind in self.properties])


def read_header(stream: BinaryIO) -> tuple[str, list[Element]]:
    """Read the header of a PLY file; what the stream gives next are the data.

    Gives NumPy's byte order, empty for text, and the elements. ValueError if it is no PLY file, or damaged.
    """
    if stream.readline(16).strip() != b"ply":
        raise ValueError("it does not start with 'ply'")
    order: str | None = None
    elements: list[Element] = []
    for line in stream:
        match line.decode("ascii", "replace").split():
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count), []))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, None))
            case ["property", kind, name] if elements and kind in _KINDS:
                elements[-1].properties.append((name, _KINDS[kind]))
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
        _, elements = read_header(stream)
    return {element.name: element.columns for element in elements if element.rows}


def holds_lines(stream: BinaryIO) -> bool:
    """Whether a PLY file is a drawing of lines and no scan: it has edges and no faces."""
    with suppress(ValueError):
        rows = {element.name: element.rows for element in read_header(stream)[1]}
        return "edge" in rows and not rows.get("face")
    return False


def write(skeleton: Skeleton) -> bytes:
    """The content of a PLY file."""
    vertices = np.column_stack([skeleton.vertices, skeleton.radii, skeleton.radii]).astype("<f8")
    header = f"""ply
format binary_little_endian 1.0
comment curve skeleton written by glsk-o3d
element vertex {len(vertices)}
property double x
property double y
property double z
property double radius
property double quality
element edge {len(skeleton.edges)}
property int vertex1
property int vertex2
end_header
"""
    return header.encode() + vertices.tobytes() + skeleton.edges.astype("<i4").tobytes()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a PLY file."""
    stream = io.BytesIO(data)
    order, elements = read_header(stream)
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise ValueError("it has no element 'vertex'")
    if "edge" not in names:
        raise NoEdges
    tables: dict[str, dict[str, np.ndarray]] = {}
    start = stream.tell()
    words = data[start:].split() if order == "" else []
    for element in elements:
        name, rows, columns = element.name, element.rows, element.columns
        if element.has_lists:
            if rows and not {"vertex", "edge"} <= tables.keys():
                raise ValueError(f"element {name!r} has lists")
            continue
        if order == "":
            size = rows * len(columns)
            table = np.array(words[:size], dtype="S").astype(float).reshape(rows, len(columns))
            tables[name], words = dict(zip(columns, table.T, strict=True)), words[size:]
        else:
            dtype = element.dtype(order)
            size = rows * dtype.itemsize
            table = np.frombuffer(data[start : start + size], dtype)
            if len(table) < rows:
                raise ValueError(f"it breaks off in element {name!r}")
            tables[name], start = {column: table[column] for column in columns}, start + size
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii)
