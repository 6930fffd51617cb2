"""Triangle meshes from files, as scans of their vertices, to files, and from Open3D."""

import json
import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..errors import FileFormatError
from ..interop.atomic import write_atomically
from ..interop.packages import import_open3d
from .formats import glb, ply
from .formats.graphs import line, text
from .paths import text_lines, unknown_ending
from .scan import COLOR_CHANNELS, NORMAL_NAMES, Scan

WRITTEN_MESH_ENDINGS = (".ply", ".obj", ".off", ".stl", ".glb", ".gltf")
SINGLE_PRECISION = (".stl", ".glb", ".gltf")
LOST_SHARE = 0.01  # derived: of an edge; an error of so much turns a triangle by less than a degree
PLY_VERTEX_BYTES, PLY_COLOR_BYTES, PLY_TRIANGLE_BYTES, STL_TRIANGLE_BYTES = 48, 3, 13, 50
"""Published: formats, as Open3D fills them."""
_NAMES_MATERIALS = re.compile(rb"((?:^|[\r\n\f\0\\])[ \t]*)m")  # ``mtllib``, also where a line goes on


def read_vertices(path: Path) -> Scan:
    """The vertices of an OFF, OBJ, STL, glTF or GLB file, and the triangles between them."""
    ending = path.suffix.lower()
    if ending == ".off":
        return _read_off(path)
    if ending == ".obj":
        return _read_open3d(path, _NAMES_MATERIALS.sub(rb"\1#", path.read_bytes()))
    if ending == ".stl":
        return _read_open3d(path)
    return _read_open3d(path, glb.alone(path))


def _read_open3d(path: Path, data: bytes | None = None) -> Scan:
    """What Open3D reads of a file, or of other data in its place, which name no more files that it would open."""
    o3d = import_open3d()
    with TemporaryDirectory() as folder, o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        if data is not None:
            path = Path(folder, "mesh.obj" if path.suffix.lower() == ".obj" else "mesh.glb")
            path.write_bytes(data)
        mesh = o3d.io.read_triangle_mesh(str(path))
    if path.suffix == ".glb" and not np.isfinite(mesh.vertices).all():
        raise ValueError("its nodes place vertices beyond finite coordinates")
    colors = np.asarray(mesh.vertex_colors) if mesh.has_vertex_colors() else None
    normals = np.asarray(mesh.vertex_normals) if mesh.has_vertex_normals() else None
    return Scan(np.asarray(mesh.vertices), colors, normals, {}, np.asarray(mesh.triangles))


def _read_off(path: Path) -> Scan:
    """An OFF file, whose rows are those of text in PLY; Open3D returns uninitialised memory for one that breaks off."""
    with path.open("rb") as stream:
        lines = (line for line in text_lines(stream) if not line.lstrip().startswith("#"))
        words: list[str] = []
        while len(words) < 4 and (line := next(lines, None)):
            words += line.split()
        if not words or not words[0].endswith("OFF"):
            raise ValueError("it does not start with 'OFF'")
        n, m = (int(word) for word in words[1:3])
        names = [*"xyz", *NORMAL_NAMES * ("N" in words[0]), *[*COLOR_CHANNELS, "alpha"] * ("C" in words[0])]
        elements = [
            ply.Element("vertex", n, [ply.Column(name, "f8") for name in names]),
            ply.Element("face", m, [ply.Column("vertex_indices", "i4", "i4")]),
        ]
        ply.check_elements(elements, "", path.stat().st_size)
        vertex, face = (ply.text_table(lines, element) for element in elements)
    columns = np.column_stack([vertex[name] for name in names])
    colors, normals = columns[:, -4:-1] / 255 if "alpha" in names else None, columns[:, 3:6] if "nx" in names else None
    return Scan(columns[:, :3], colors, normals, {}, ply.triangles(face, n))


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
