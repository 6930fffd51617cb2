"""PLY: skeletons, of which it keeps vertices, edges, radii and half axes to the last bit, and clouds and meshes.

Skeletons have the radii as ``radius`` and ``quality``, by which MeshLab colours, and lose all else; Open3D's
``read_line_set`` opens them. Scans keep every scalar property of a vertex, and faces as triangles. A skeleton is a
file that has edges and no faces.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...errors import FileFormatError
from ...skeleton import Skeleton
from ..clouds.scanned import (
    COLOR_CHANNELS,
    NO_TRIANGLES,
    NORMAL_NAMES,
    Scan,
    brightest,
    named_attributes,
    unit_colors,
)
from .graphs import NoEdges, graph_skeleton
from .ply_tables import Lists, Table, find_rows, read_header, read_tables

SECTION = ("half_width", "half_thickness")


def ply_elements(path: str | os.PathLike) -> dict[str, list[str]]:
    """The elements that a PLY file holds at least one of, with the names of their properties."""
    with open(path, "rb") as stream:
        try:
            _, elements = read_header(stream)
        except ValueError as error:
            raise FileFormatError(f"{os.fspath(path)}: not a valid .ply file: {error}") from None
    return {element.name: element.names for element in elements if element.rows}


# ----------------------------------------------------------------------------------------------------------- skeletons


def holds_lines(stream: BinaryIO) -> bool:
    """Whether a PLY file is a drawing of lines and no scan: it has edges and no faces."""
    with suppress(ValueError):
        rows = {element.name: element.rows for element in read_header(stream)[1]}
        return "edge" in rows and not rows.get("face")
    return False


def write(skeleton: Skeleton) -> bytes:
    """The content of a PLY file of a skeleton."""
    section = [getattr(skeleton, name) for name in SECTION]
    vertices = np.column_stack([skeleton.vertices, skeleton.radii, skeleton.radii, *section]).astype("<f8")
    header = f"""ply
format binary_little_endian 1.0
comment curve skeleton written by glsk-o3d
element vertex {len(vertices)}
property double x
property double y
property double z
property double radius
property double quality
property double half_width
property double half_thickness
element edge {len(skeleton.edges)}
property int vertex1
property int vertex2
end_header
"""
    return header.encode() + vertices.tobytes() + skeleton.edges.astype("<i4").tobytes()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a PLY file."""
    tables = read_tables(io.BytesIO(data), ("vertex", "edge"))
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    if "edge" not in tables:
        raise NoEdges
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    known = {name: vertex[name] for name in SECTION if set(SECTION) <= vertex.keys()}
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii, **known)


# --------------------------------------------------------------------------------------------------------------- scans


def read_scan(path: Path) -> Scan:
    """The vertices of a PLY file that `blocks` does not read, and the triangles between them."""
    with path.open("rb") as stream:
        tables = read_tables(stream, ("vertex", "face"))
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    scan = _scan(tables["vertex"])
    return replace(scan, triangles=_triangles(tables.get("face", {}), len(scan)))


def blocks(path: Path, rows: int, bare: bool = False) -> Iterator[Scan] | None:
    """The vertices of a PLY file, so many at a time, or positions alone if `bare`; None where it has to be read whole:
    text, lists and meshes. ValueError, before the first block, where it is damaged or breaks off.
    """
    found = _found(path)
    return None if found is None else _blocks(path, *found, rows, bare)


def promised(path: Path) -> int | None:
    """The points that the header promises; None where they have to be read whole. ValueError where it breaks off."""
    found = _found(path)
    return None if found is None else found[2]


def types(path: Path) -> dict[str, np.dtype]:
    """Of what type a file has each column that it gives, by name; empty where the points have to be read whole."""
    found = _found(path)
    if found is None:
        return {}
    columns = {name: np.empty(0, found[1][name].newbyteorder("=")) for name in found[1].names or ()}
    scan = _scan(dict(columns))
    together = [*"xyz", *(scan.normals is not None) * NORMAL_NAMES, *(scan.colors is not None) * COLOR_CHANNELS]
    own = {name: columns[name].dtype for name in together}
    return own | {name: values.dtype for name, values in scan.attributes.items()}


def _found(path: Path) -> tuple[int, np.dtype, int] | None:
    """Where vertices begin, what a row of them is, and how many there are."""
    with path.open("rb") as stream:
        found = find_rows(stream, "vertex", without=("face",))
        return None if found is None else (stream.tell(), *found)


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

    def together(names: list[str]) -> np.ndarray | None:
        return np.column_stack([known.pop(name) for name in names]) if set(names) <= known.keys() else None

    positions, colors, normals = (together(names) for names in ([*"xyz"], COLOR_CHANNELS, NORMAL_NAMES))
    native = ((name, values.astype(values.dtype.newbyteorder("="))) for name, values in known.items())
    return Scan(
        np.ascontiguousarray(positions, float),
        None if colors is None else unit_colors(colors, top),
        None if normals is None else np.ascontiguousarray(normals, float),
        named_attributes(native),
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
