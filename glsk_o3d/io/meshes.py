"""Triangle meshes from files, as scans of their vertices."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..interop.packages import import_open3d
from .formats import ply
from .paths import check_promised, number_rows, text_lines
from .scan import Scan

_NAMES_MATERIALS = re.compile(rb"((?:^|[\r\n\f\0\\])[ \t]*)m")  # ``mtllib``, also where a line goes on


def read_vertices(path: Path) -> Scan:
    """The vertices of an OFF, OBJ or STL file, and the triangles between them."""
    ending = path.suffix.lower()
    if ending == ".off":
        return _read_off(path)
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
