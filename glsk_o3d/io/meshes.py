"""Triangle meshes from files, as scans of their vertices, and to files."""

import json
import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import unquote

import numpy as np

from ..errors import FileFormatError
from ..interop.atomic import write_atomically
from ..interop.packages import import_open3d
from .formats import gltf, ply
from .formats.graphs import line, text
from .paths import check_budget, check_promised, number_rows, text_lines, unknown_ending
from .scan import Scan

WRITTEN_MESH_ENDINGS = (".ply", ".obj")
_NAMES_MATERIALS = re.compile(rb"((?:^|[\r\n\f\0\\])[ \t]*)m")  # ``mtllib``, also where a line goes on


def read_vertices(path: Path) -> Scan:
    """The vertices of an OFF, OBJ, STL, glTF or GLB file, and the triangles between them."""
    ending = path.suffix.lower()
    if ending == ".off":
        return _read_off(path)
    if ending in (".gltf", ".glb"):
        _check_rows(path)
    if ending != ".obj":
        return _read_open3d(path)
    with TemporaryDirectory() as folder:  # Open3D would read all textures that it names
        alone = Path(folder, "mesh.obj")
        alone.write_bytes(_NAMES_MATERIALS.sub(rb"\1#", path.read_bytes()))
        return _read_open3d(alone)


def _read_open3d(path: Path) -> Scan:
    o3d = import_open3d()
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        mesh = o3d.io.read_triangle_mesh(str(path))
    colors = np.asarray(mesh.vertex_colors) if mesh.has_vertex_colors() else None
    normals = np.asarray(mesh.vertex_normals) if mesh.has_vertex_normals() else None
    return Scan(np.asarray(mesh.vertices), colors, normals, {}, np.asarray(mesh.triangles))


def _check_rows(path: Path) -> None:
    """ValueError where glTF promises more rows than its files could hold: Open3D makes room for all of them first."""
    with path.open("rb") as stream:
        head = stream.read(20)
        binary = head[:4] == gltf.MAGIC.to_bytes(4, "little")
        tree = json.loads(stream.read(int.from_bytes(head[12:16], "little")) if binary else head + stream.read())
    named = (str(buffer.get("uri", "data:")) for buffer in tree.get("buffers", ()))
    others = (path.parent / unquote(uri) for uri in named if not uri.startswith("data:"))
    held = sum(file.stat().st_size for file in (path, *others) if file.is_file())
    check_budget(sum(int(accessor["count"]) for accessor in tree.get("accessors", ())), held)


def _read_off(path: Path) -> Scan:
    """An OFF file: Open3D returns uninitialised memory for one that breaks off."""
    with path.open("rb") as stream:
        lines = (line for line in text_lines(stream) if not line.lstrip().startswith("#"))
        words: list[str] = []
        while len(words) < 4 and (line := next(lines, None)):
            words += line.split()
        if not words or not words[0].endswith("OFF"):
            raise ValueError("it does not start with 'OFF'")
        n, m = (int(word) for word in words[1:3])
        positions = number_rows(lines, n, 3)
        check_promised(n, len(positions))
        faces = ply.text_table(lines, ply.Element("face", m, [ply.Column("vertex_indices", "i4", "i4")]))
    return Scan(positions, triangles=ply.triangles(faces, n))


def save_mesh(mesh: Any, path: str | os.PathLike) -> None:
    """Write a triangle mesh with the normals and colours of its vertices; the ending chooses the format.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Normals are computed if it has none.
    path : path-like
        PLY or OBJ; it appears complete or not at all. Coordinates are kept to the last bit.

    Raises
    ------
    FileFormatError
        The ending is unknown, or the mesh is empty.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from glsk_o3d import skeletonize, to_tubes
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_mesh(to_tubes(skeletonize(torus(1000).points)), f"{folder}/ring.obj")
    """
    ending, mesh = Path(path).suffix.lower(), import_open3d().geometry.TriangleMesh(mesh)
    if ending not in WRITTEN_MESH_ENDINGS:
        raise unknown_ending(f"{os.fspath(path)}: tubes are a mesh", WRITTEN_MESH_ENDINGS)
    if not mesh.has_vertices():
        raise FileFormatError(f"{os.fspath(path)}: the mesh is empty: there is nothing to write")
    if not mesh.has_vertex_normals():
        mesh.compute_vertex_normals()
    points, normals = np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals)
    colors, triangles = np.asarray(mesh.vertex_colors), np.asarray(mesh.triangles)
    if ending == ".obj":
        data = _obj(points, normals, colors, triangles)
    else:
        held = {"positions": points, "normals": normals} | ({"colors": colors} if len(colors) else {})
        data = ply.content(ply.columns_of(held), triangles)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))


def _obj(points: np.ndarray, normals: np.ndarray, colors: np.ndarray, triangles: np.ndarray) -> bytes:
    """Open3D would write six digits."""
    rows = np.hstack([points, colors]) if len(colors) else points
    vertices = [line("v", *row) for row in rows.tolist()]
    directions = [line("vn", *row) for row in normals.tolist()]
    faces = [line("f", *(f"{corner}//{corner}" for corner in face)) for face in (triangles + 1).tolist()]
    return text([*vertices, *directions, *faces])
