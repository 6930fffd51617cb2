"""Triangle meshes from files and from Open3D."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ..errors import FileFormatError, InvalidParameterError
from ..interop.packages import import_open3d
from .paths import MESH_ENDINGS
from .scans import check_scan


def read_mesh(path: str | os.PathLike) -> Any:
    """Read a triangle mesh with Open3D.

    Parameters
    ----------
    path : path-like
        PLY, OFF, OBJ, STL, glTF or GLB.

    Returns
    -------
    open3d.geometry.TriangleMesh

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, an unknown ending, a damaged file, or one without triangles.
    MissingPackageError
    """
    endings = (".ply", *MESH_ENDINGS)
    if not str(path).lower().endswith(endings):
        raise FileFormatError(f"{path}: unknown ending of a mesh; known are {', '.join(endings)}")
    path = check_scan(path)
    o3d = import_open3d()
    try:
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            mesh = o3d.io.read_triangle_mesh(str(path))
    except Exception as error:  # std::bad_alloc, undecodable text
        raise FileFormatError(f"{path}: Open3D cannot read it: {error}") from error
    if not mesh.has_triangles():
        raise FileFormatError(f"{path}: no triangles could be read: it is a cloud, or damaged")
    return mesh


def mesh_arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a mesh.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh, open3d.t.geometry.TriangleMesh, or a pair of arrays (V, 3) and (F, 3)

    Returns
    -------
    vertices : (V, 3) float64 array
    faces : (F, 3) int64 array

    Raises
    ------
    InvalidParameterError
        It is none of these, has no triangles, or coordinates or indices are of no use.
    """
    try:
        if hasattr(mesh, "triangles"):
            parts = mesh.vertices, mesh.triangles
        elif hasattr(mesh, "triangle"):
            parts = mesh.vertex.positions.cpu().numpy(), mesh.triangle.indices.cpu().numpy()
        else:
            parts = mesh
        vertices, faces = (np.asarray(part) for part in parts)
    except Exception as error:  # whatever a foreign object raises
        raise InvalidParameterError(f"a {type(mesh).__name__} is no triangle mesh: {error}") from error
    if vertices.ndim != 2 or faces.ndim != 2 or vertices.shape[1] != 3 or faces.shape[1] != 3 or len(faces) == 0:
        raise InvalidParameterError(
            f"a mesh needs (V, 3) vertices and (F, 3) triangles, not {vertices.shape} and {faces.shape}"
        )
    if vertices.dtype.kind not in "iuf" or not np.isfinite(vertices).all():
        raise InvalidParameterError("the mesh has vertices that are not finite numbers")
    if faces.dtype.kind not in "iu" or faces.min() < 0 or faces.max() >= len(vertices):
        raise InvalidParameterError("a triangle of the mesh names a vertex that is not there")
    return vertices.astype(float), faces.astype(np.int64)
