"""PLY: keeps vertices and edges to the last bit, and the radii as ``radius`` and ``quality``, and the half
axes of the sections; loses all else.

Open3D's ``read_line_set`` and MeshLab open it; by quality MeshLab colours. Scans are PLY files, too: a skeleton is one
that has edges.
"""

from __future__ import annotations

import io
import os
from contextlib import suppress
from typing import BinaryIO

import numpy as np

from ...skeleton import Skeleton
from .graphs import NoEdges, graph_skeleton
from .ply_tables import read_header, read_tables

SECTION = ("half_width", "half_thickness")


def ply_elements(path: str | os.PathLike) -> dict[str, list[str]]:
    """The elements that a PLY file holds at least one of, with the names of their properties."""
    with open(path, "rb") as stream:
        _, elements = read_header(stream)
    return {element.name: element.names for element in elements if element.rows}


def holds_lines(stream: BinaryIO) -> bool:
    """Whether a PLY file is a drawing of lines and no scan: it has edges and no faces."""
    with suppress(ValueError):
        rows = {element.name: element.rows for element in read_header(stream)[1]}
        return "edge" in rows and not rows.get("face")
    return False


def write(skeleton: Skeleton) -> bytes:
    """The content of a PLY file."""
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
    _, elements = read_header(io.BytesIO(data))
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise ValueError("it has no element 'vertex'")
    if "edge" not in names:
        raise NoEdges
    tables = read_tables(io.BytesIO(data), ("vertex", "edge"))
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    known = {name: vertex[name] for name in SECTION if set(SECTION) <= vertex.keys()}
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii, **known)
