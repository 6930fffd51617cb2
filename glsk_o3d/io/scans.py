"""Scans from files: clouds, and meshes of which the vertices are taken."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError
from ..interop.packages import import_open3d
from ..interop.verbosity import following_open3d
from .completeness import check_complete
from .paths import CLOUD_ENDINGS, MESH_ENDINGS, existing_file, unknown_ending
from .ply import ply_elements
from .skeletons import holds_skeleton, read_skeleton

_log = logging.getLogger(__name__)


def read_cloud(path: str | os.PathLike) -> Any:
    """Read a point cloud, or the vertices of a mesh, with Open3D.

    Open3D returns an empty cloud for a file that it cannot read and uninitialised points for one that breaks off; here
    both are errors.

    Parameters
    ----------
    path : path-like
        PLY, PCD, XYZ, XYZN, XYZRGB or PTS (with the line that says how many points follow); or a mesh with triangles as
        OFF, OBJ, STL, glTF or GLB. In the XYZ family, lines that hold no point are skipped and logged.

    Returns
    -------
    open3d.geometry.PointCloud
        With the normals and colours that the file has. STL repeats a vertex for every triangle around it.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a skeleton, an unknown ending, or a file that is empty, damaged, broken off, or without points.
    MissingPackageError

    Notes
    -----
    Where the triangles of a mesh are large, its vertices say little about the surface: then there is a warning in the
    log.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "scan.xyz")
    ...     _ = path.write_text("0 0 0\\n0 0 1\\n0 1 1\\n")
    ...     len(read_cloud(path).points)
    3
    """
    cloud, _ = read_scan(path)
    return cloud


def read_scan(path: str | os.PathLike) -> tuple[Any, np.ndarray]:
    """Read a cloud as `read_cloud` does, and the triangles between its points, (T, 3) int array, if it is a mesh."""
    path = check_scan(path)
    ending = path.suffix.lower()
    if _is_skeleton(path):
        raise FileFormatError(f"{path}: is a skeleton, not a scan")
    if ending not in CLOUD_ENDINGS + MESH_ENDINGS:
        raise unknown_ending(path, CLOUD_ENDINGS + MESH_ENDINGS)
    lines = _count_lines(path) if ending.startswith(".xyz") else 0
    cloud, mesh = _read_with_open3d(path, ending)
    if not cloud.has_points():
        raise FileFormatError(f"{path}: no points could be read: it is damaged, empty, or not a {ending} file")
    if lines > len(cloud.points):
        with following_open3d():
            _log.warning("%s: %d of %d lines hold no point and were skipped", path, lines - len(cloud.points), lines)
    triangles = np.asarray(mesh.triangles)
    if _coarse(np.asarray(mesh.vertices), triangles):
        with following_open3d():
            _log.warning(
                "%s: the %d vertices of this mesh are far apart, and only vertices count as points: sample its surface "
                "first, for example with Open3D's sample_points_uniformly",
                *(path, len(cloud.points)),
            )
    return cloud, triangles


def check_scan(path: str | os.PathLike) -> Path:
    """Find out before reading a scan whether it is there and complete.

    FileNotFoundError, or FileFormatError for a folder, or a file that is empty or breaks off.
    """
    path = existing_file(path)
    check_complete(path)
    return path


def _is_skeleton(path: Path) -> bool:
    """Whether a file is a skeleton: for endings that scans do not have, whether it can be read as one."""
    if path.suffix.lower() in CLOUD_ENDINGS + MESH_ENDINGS:
        return holds_skeleton(path)
    try:
        read_skeleton(path)
    except FileFormatError:
        return False
    return True


def _count_lines(path: Path) -> int:
    """The lines of a text file that are neither empty nor comments."""
    with path.open("rb") as stream:
        return sum(1 for line in stream if line.strip() and not line.lstrip().startswith(b"#"))


def _read_with_open3d(path: Path, ending: str) -> tuple[Any, Any]:
    """The points that a file holds as a cloud, and its mesh, empty if it has no triangles."""
    o3d = import_open3d()
    try:
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            mesh = o3d.geometry.TriangleMesh()
            if ending in MESH_ENDINGS or (ending == ".ply" and "face" in ply_elements(path)):
                mesh = o3d.io.read_triangle_mesh(str(path))
            if ending in CLOUD_ENDINGS and not mesh.has_triangles():
                return o3d.io.read_point_cloud(str(path), format=ending[1:]), mesh
            cloud = o3d.geometry.PointCloud(mesh.vertices)
            cloud.normals, cloud.colors = mesh.vertex_normals, mesh.vertex_colors
            return cloud, mesh
    except Exception as error:  # std::bad_alloc, undecodable text
        raise FileFormatError(f"{path}: Open3D cannot read it: {error}") from error


def _coarse(vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether triangles with a side of more than a tenth of the diagonal make up half of the surface."""
    if len(triangles) == 0 or triangles.min() < 0 or triangles.max() >= len(vertices):
        return False
    with np.errstate(all="ignore"):  # vertices may be anything
        sides = vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        large = np.linalg.norm(sides, axis=2).max(axis=1) > np.linalg.norm(np.ptp(vertices, axis=0)) / 10
        return bool(area[large].sum() > area.sum() / 2)
