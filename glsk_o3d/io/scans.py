"""Scans from files: clouds, and meshes of which the vertices are taken; and clouds with attributes to files."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..interop.atomic import write_atomically
from ..interop.packages import following_open3d, import_open3d
from .clouds import pcd
from .clouds.blocks import read_whole
from .clouds.scanned import Scan
from .clouds.selection import select
from .formats import ply
from .paths import unknown_ending

WRITTEN_CLOUD_ENDINGS = (".ply", ".pcd", ".npz")
"""Files that hold all attributes of a tensor cloud."""
_log = logging.getLogger(__name__)


def read_cloud(path: str | os.PathLike, *, where: str | None = None) -> Any:
    """Read a point cloud, or the vertices of a mesh.

    Open3D returns an empty cloud for a file that it cannot read and uninitialised points for one that breaks off; here
    both are errors. All coordinates keep their full digits.

    Parameters
    ----------
    path : path-like
        PLY, PCD, CSV, TXT, ASC, XYZ, XYZN, XYZRGB, PTS; LAS and LAZ (extra ``las``), E57 (extra ``e57``); or a mesh
        with triangles as OFF, OBJ, STL, glTF or GLB. In text, lines that hold no point are skipped and logged.
    where : str, optional
        Only points for which this holds, such as ``"classification == 5"``; see `glsk_o3d.io.clouds.selection.select`.

    Returns
    -------
    open3d.geometry.PointCloud
        With the normals and colours that the file has; for all else that it says of its points see
        `read_tensor_cloud`. STL repeats a vertex for every triangle around it.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a skeleton, an unknown ending, or a file that is empty, damaged, broken off, or without points.
    InvalidParameterError
        `where` is no condition, or names what the points do not have.
    InvalidCloudError
        It holds for no point.
    MissingPackageError

    Notes
    -----
    Where the triangles of a mesh are large, its vertices say little about the surface: then there is a warning in the
    log.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "scan.csv")
    ...     _ = path.write_text("x,y,z,label\\n0,0,0,1\\n0,0,1,2\\n0,1,1,2\\n")
    ...     len(read_cloud(path).points), len(read_cloud(path, where="label == 2").points)
    (3, 2)
    """
    return read_scan(path, where).to_legacy()


def read_tensor_cloud(path: str | os.PathLike, *, where: str | None = None) -> Any:
    """Read a cloud as `read_cloud` does, with everything that the file says of its points.

    Parameters
    ----------
    path : path-like
    where : str, optional
        As for `read_cloud`.

    Returns
    -------
    open3d.t.geometry.PointCloud
        Positions are float64. Attributes have the names of the file, such as ``intensity`` and ``classification``;
        what cannot stand in an expression is an underscore. `Skeleton.annotate` keeps them.

    Raises
    ------
    FileNotFoundError
    FileFormatError
    InvalidParameterError
    InvalidCloudError
    MissingPackageError
        As from `read_cloud`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "scan.csv")
    ...     _ = path.write_text("x,y,z,label\\n0,0,0,1\\n0,0,1,2\\n0,1,1,2\\n")
    ...     read_tensor_cloud(path).point.label.flatten().numpy()
    array([1, 2, 2], dtype=int32)
    """
    return read_scan(path, where).to_tensor()


def save_tensor_cloud(cloud: Any, path: str | os.PathLike) -> None:
    """Write a tensor cloud with all its attributes and all digits; `read_tensor_cloud` reads PLY and PCD again.

    Parameters
    ----------
    cloud : open3d.t.geometry.PointCloud
    path : path-like
        PLY, PCD or npz; it appears complete or not at all.

    Raises
    ------
    FileFormatError
        The ending is unknown.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> marked = skeletonize(torus(1000).points).annotate()
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(marked, f"{folder}/marked.ply")
    ...     bool((read_tensor_cloud(f"{folder}/marked.ply").point.radius == marked.point.radius).all())
    True
    """
    ending = tensor_cloud_ending(path)
    o3d = import_open3d()

    def write(temporary: Path) -> None:
        if ending == ".npz":  # where the disk is full, Open3D's own writer ends the process
            np.savez(temporary, **{name: cloud.point[name].cpu().numpy() for name in cloud.point})
            return
        written = cloud
        if ending == ".pcd" and "normals" in cloud.point:  # Open3D's header has the type of the positions for both
            written = cloud.clone()
            written.point.normals = cloud.point.normals.to(cloud.point.positions.dtype)
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            done = o3d.t.io.write_point_cloud(str(temporary), written)
        try:  # whether it is whole, which Open3D does not say
            (ply if ending == ".ply" else pcd).promised(temporary)
        except ValueError:
            done = False
        if not done:
            raise OSError("Open3D could not write all of it: is the disk full?")

    write_atomically(path, write)


def tensor_cloud_ending(path: str | os.PathLike) -> str:
    """The ending of a cloud to be written, in lower case; FileFormatError if it is unknown."""
    ending = Path(path).suffix.lower()
    if ending not in WRITTEN_CLOUD_ENDINGS:
        raise unknown_ending(f"{os.fspath(path)}: a cloud with labels", WRITTEN_CLOUD_ENDINGS)
    return ending


def read_scan(path: str | os.PathLike, where: str | None = None) -> Scan:
    """Read all that `read_tensor_cloud` does, and the triangles between the points of a mesh if all are taken."""
    scan = read_whole(path)
    if _coarse(scan.positions, scan.triangles):
        with following_open3d():
            _log.warning(
                "%s: the %d vertices of this mesh are far apart, and only vertices count as points: sample its surface "
                "first, for example with Open3D's sample_points_uniformly",
                *(os.fspath(path), len(scan)),
            )
    return scan if where is None else select(scan, where)


def _coarse(vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether triangles with a side of more than a tenth of the diagonal make up half of the surface."""
    if len(triangles) == 0 or triangles.min() < 0 or triangles.max() >= len(vertices):
        return False
    with np.errstate(all="ignore"):  # vertices may be anything
        sides = vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        large = np.linalg.norm(sides, axis=2).max(axis=1) > np.linalg.norm(np.ptp(vertices, axis=0)) / 10
        return bool(area[large].sum() > area.sum() / 2)
