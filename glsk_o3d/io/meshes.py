"""Triangle meshes from files, as scans of their vertices, to files, and from Open3D."""

from __future__ import annotations

import json
import math
import os
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError, InvalidParameterError
from ..interop.atomic import write_atomically
from ..interop.packages import import_open3d
from .formats.graphs import line, text
from .paths import breaks_off, unknown_ending
from .scan import Scan

WRITTEN_MESH_ENDINGS = (".ply", ".obj", ".off", ".stl", ".glb", ".gltf")
SINGLE_PRECISION = (".stl", ".glb", ".gltf")
LOST_SHARE = 0.01  # derived: of an edge; an error of so much turns a triangle by less than a degree
PLY_VERTEX_BYTES, PLY_COLOR_BYTES, PLY_TRIANGLE_BYTES, STL_TRIANGLE_BYTES = 48, 3, 13, 50
"""Published: formats, as Open3D fills them."""


def read_vertices(path: Path) -> Scan:
    """The vertices of an OFF, OBJ, STL, glTF or GLB file, and the triangles between them, as Open3D reads them."""
    with path.open("rb") as stream:  # where it may not be read, this says so
        head = stream.read(16)
    if path.suffix.lower() == ".off":
        _check_off(path)
    length, size = int.from_bytes(head[12:], "little"), path.stat().st_size
    if path.suffix.lower() == ".glb" and length > size:  # Open3D would take memory for all of it, and look behind it
        raise ValueError(f"its header promises {length} bytes, and the file has {size}")
    o3d = import_open3d()
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        mesh = o3d.io.read_triangle_mesh(str(path))
    colors = np.asarray(mesh.vertex_colors) if mesh.has_vertex_colors() else None
    normals = np.asarray(mesh.vertex_normals) if mesh.has_vertex_normals() else None
    return Scan(np.asarray(mesh.vertices), colors, normals, {}, np.asarray(mesh.triangles))


def _check_off(path: Path) -> None:
    """Raise ValueError where an OFF file breaks off or a vertex lacks numbers: Open3D would return uninitialised memory
    for the rest; or where a face has a corner that is no vertex: Open3D would look for it in memory, and may crash.
    """
    with path.open("rb") as stream:
        rows = (line.split() for line in stream if line.strip() and not line.lstrip().startswith(b"#"))
        words: list[bytes] = []
        while len(words) < 4 and (row := next(rows, None)):
            words += row
        if not words or not words[0].endswith(b"OFF"):
            raise ValueError("it does not start with 'OFF'")
        n, m = (int(word) for word in words[1:3])
        if n < 0 or m < 0:
            raise ValueError("its numbers of vertices and faces are negative")
        columns = 3 + 3 * (b"N" in words[0]) + 4 * (b"C" in words[0])  # with a normal, with a colour and its alpha
        found = 0
        for row in islice(rows, n):
            numbers = [float(word) for word in row[:columns]]
            if not all(map(math.isfinite, numbers)) or b"_" in b"".join(row[:columns]):
                raise ValueError(f"vertex {found} has what Open3D takes for no number")
            if len(numbers) < columns:
                break
            found += 1
        for row in islice(rows, m):
            if len(row) < 3:
                break
            corners = [int(word) for word in row[1 : 1 + int(row[0])]]
            if len(corners) != int(row[0]) or not all(0 <= corner < n for corner in corners):
                raise ValueError(f"a face has {row[0].decode(errors='replace')[:20]} corners, not all of them vertices")
            found += 1
    if found < n + m:
        raise breaks_off(n + m, found, "vertices and faces")


def save_mesh(mesh: Any, path: str | os.PathLike) -> None:
    """Write a triangle mesh with the normals and colours of its vertices; the ending chooses the format.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Normals are computed if it has none.
    path : path-like
        PLY, OBJ or OFF, which hold coordinates to the last bit; STL, GLB or glTF, which hold them as float32, STL
        without colours. It appears complete or not at all.

    Raises
    ------
    FileFormatError
        The ending is unknown, or the format has too few digits for coordinates as large as these.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import open3d
    >>> from glsk_o3d import skeletonize, to_tubes
    >>> from glsk_o3d.samples import torus
    >>> tubes = to_tubes(skeletonize(torus(1000).points))
    >>> with TemporaryDirectory() as folder:
    ...     save_mesh(tubes, f"{folder}/ring.obj")
    ...     len(open3d.io.read_triangle_mesh(f"{folder}/ring.obj").triangles) == len(tubes.triangles)
    True
    """
    ending, mesh = Path(path).suffix.lower(), import_open3d().geometry.TriangleMesh(mesh)
    if ending not in WRITTEN_MESH_ENDINGS:
        raise unknown_ending(f"{os.fspath(path)}: tubes are a mesh", WRITTEN_MESH_ENDINGS)
    if not mesh.has_vertices():
        raise FileFormatError(f"{os.fspath(path)}: the mesh is empty: there is nothing to write")
    if not mesh.has_vertex_normals():
        mesh.compute_vertex_normals()
    if not mesh.has_triangle_normals():
        mesh.compute_triangle_normals()  # which STL has
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    if ending in SINGLE_PRECISION and len(triangles):
        side = np.median(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1))
        largest = np.abs(points).max()
        step = largest * np.finfo(np.float32).eps
        if step > LOST_SHARE * side:
            raise FileFormatError(
                f"{os.fspath(path)}: {ending} has too few digits for coordinates as large as {largest:.3g}, "
                f"they would be up to {step:.2g} off: write ply, obj or off"
            )
    if ending in (".obj", ".off"):  # Open3D writes six digits
        data = (_obj if ending == ".obj" else _off)(points, triangles, mesh)
        write_atomically(path, lambda temporary: temporary.write_bytes(data))
    else:
        write_atomically(path, lambda temporary: _write_open3d(mesh, temporary))


def _write_open3d(mesh: Any, path: Path) -> None:
    o3d, ending = import_open3d(), path.suffix.lower()
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        if ending == ".glb":  # that of the other writer it cannot read again
            done = o3d.t.io.write_triangle_mesh(str(path), o3d.t.geometry.TriangleMesh.from_legacy(mesh))
        else:
            done = o3d.io.write_triangle_mesh(str(path), mesh)
    n, m = len(mesh.vertices), len(mesh.triangles)
    vertex = PLY_VERTEX_BYTES + PLY_COLOR_BYTES * mesh.has_vertex_colors()
    least = {".ply": vertex * n + PLY_TRIANGLE_BYTES * m, ".stl": STL_TRIANGLE_BYTES * m}.get(ending, 1)
    try:  # Open3D says of a file that breaks off on a full disk that all went well
        whole = path.stat().st_size >= least and (ending != ".gltf" or json.loads(path.read_bytes()))
    except ValueError:
        whole = False
    if not done or not whole:
        raise OSError("Open3D could not write all of it: is the disk full?")


def _obj(points: np.ndarray, triangles: np.ndarray, mesh: Any) -> bytes:
    vertices = [line("v", *row) for row in np.hstack([points, *_colors(mesh)]).tolist()]
    normals = [line("vn", *normal) for normal in np.asarray(mesh.vertex_normals).tolist()]
    faces = [line("f", *(f"{corner}//{corner}" for corner in face)) for face in (triangles + 1).tolist()]
    return text([*vertices, *normals, *faces])


def _off(points: np.ndarray, triangles: np.ndarray, mesh: Any) -> bytes:
    colors = np.hstack([*_colors(mesh), np.empty((len(points), 0))])
    shades = [(*row, 255) if row else () for row in np.rint(255 * colors).astype(int).tolist()]
    vertices = [line(*point, *shade) for point, shade in zip(points.tolist(), shades, strict=True)]
    faces = [line(3, *face) for face in triangles.tolist()]
    return text(
        ["COFF" if mesh.has_vertex_colors() else "OFF", line(len(points), len(triangles), 0), *vertices, *faces]
    )


def _colors(mesh: Any) -> list[np.ndarray]:
    """The colours of the vertices, if there are any."""
    return [np.asarray(mesh.vertex_colors)] if mesh.has_vertex_colors() else []


def mesh_arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, (V, 3) float64, and triangles, (F, 3) int64, of a mesh of Open3D or a pair of arrays.

    InvalidParameterError if it is none, has no triangles, or coordinates or indices are of no use.
    """
    try:
        if hasattr(mesh, "triangle"):
            parts = mesh.vertex.positions.cpu().numpy(), mesh.triangle.indices.cpu().numpy()
        else:
            parts = (mesh.vertices, mesh.triangles) if hasattr(mesh, "triangles") else mesh
        vertices, faces = (np.asarray(part) for part in parts)
    except Exception as error:  # whatever a foreign object raises
        raise InvalidParameterError(f"a {type(mesh).__name__} is no triangle mesh: {error}") from error
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,) or len(faces) == 0:
        shapes = f"{vertices.shape} and {faces.shape}"
        raise InvalidParameterError(f"a mesh needs (V, 3) vertices and (F, 3) triangles, not {shapes}")
    if vertices.dtype.kind not in "iuf" or not np.isfinite(vertices).all():
        raise InvalidParameterError("the mesh has vertices that are not finite numbers")
    if faces.dtype.kind not in "iu" or faces.min() < 0 or faces.max() >= len(vertices):
        raise InvalidParameterError("a triangle of the mesh names a vertex that is not there")
    return vertices.astype(float), faces.astype(np.int64)
