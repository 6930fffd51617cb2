"""Scans from files, clouds and meshes, whole or in blocks."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

from ..errors import FileFormatError, InvalidCloudError
from ..interop.atomic import existing_file
from ..interop.packages import import_open3d
from .formats import lines, pcd, ply, scanners, text_tables
from .paths import MESH_ENDINGS, SCAN_ENDINGS, TEXT_ENDINGS, refused_if_damaged, unknown_ending
from .scan import ALL_ROWS, Scan, parsed
from .skeletons import holds_skeleton

BLOCK_ROWS = 1_000_000  # measured: larger blocks are not read faster, and take more memory

Reader = Callable[[Path, int, bool], tuple[int | None, Iterator[Scan]]]
"""Gives the number of points by the header, None if the file is read whole, and blocks of so many, of positions alone
if they are to be bare. What shows that a file breaks off is looked at before the first block.
"""


def _whole(read: Callable[[Path], Scan]) -> Reader:
    return lambda path, rows, bare: (None, map(read, [path]))  # not read before it is asked for


def _mesh_of_open3d(path: str | os.PathLike[str]) -> Any:
    o3d = import_open3d()
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        return o3d.io.read_triangle_mesh(str(path))


_SCAN_READERS: dict[str, Reader] = {
    **dict.fromkeys(MESH_ENDINGS, _whole(lambda path: Scan.of_mesh(_mesh_of_open3d(path)))),
    ".obj": _whole(lines.read_mesh),
    **dict.fromkeys(TEXT_ENDINGS, _whole(text_tables.read)),
    **dict.fromkeys((".las", ".laz"), scanners.blocks),
    ".e57": _whole(scanners.read_e57),
    ".ply": ply.blocks,
    ".pcd": pcd.blocks,
}


def read_cloud(
    path: str | os.PathLike[str], *, where: str | None = None, sample: int | Literal["auto", "vertices"] = "auto"
) -> Any:
    """Read a point cloud, or points on a mesh: its vertices or, where `Sampler` would take one, a sample by area.

    All coordinates keep their digits.

    Parameters
    ----------
    path : path-like
        PLY, PCD, CSV, TXT, ASC, XYZ; LAS and LAZ (extra ``las``), E57 (extra ``e57``); or a mesh as PLY, OBJ, STL, OFF
        or GLB. In text, lines that hold no point are skipped and logged.
    where : str, optional
        Only points for which this holds, such as ``"classification in (2, 5) and z > 1.5"``: attributes and places,
        compared with numbers.
    sample : int, "auto" or "vertices"
        Points by area of a mesh, as of `Sampler`.

    Returns
    -------
    open3d.geometry.PointCloud
        With the normals and colours of the file; `read_tensor_cloud` reads all attributes. A sample has the normals of
        the triangles, and all else from one of their corners. STL repeats a vertex for every triangle around it.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a skeleton, an unknown ending, or a file that is empty, damaged, broken off, or without points.
    InvalidParameterError
        `where` is no condition, or names a missing attribute; or `sample` is wrong.
    InvalidCloudError
        It holds for no point.
    MissingPackageError

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "scan.csv")
    ...     _ = path.write_text("x,y,z,label\\n0,0,0,1\\n0,0,1,2\\n0,1,1,2\\n")
    ...     len(read_cloud(path, where="label == 2").points)
    2
    """
    return read_scan(path, where).by_area(sample).to_legacy()


def read_tensor_cloud(
    path: str | os.PathLike[str], *, where: str | None = None, sample: int | Literal["auto", "vertices"] = "auto"
) -> Any:
    """Read a cloud with all attributes of its points.

    Parameters
    ----------
    path, where, sample
        As for `read_cloud`, which has the same errors.

    Returns
    -------
    open3d.t.geometry.PointCloud
        Positions are float64. Attributes have the names of the file, with an underscore for characters that expressions
        do not allow.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "scan.csv").write_text("x,y,z,label\\n0,0,0,1\\n0,0,1,2\\n")
    ...     read_tensor_cloud(f"{folder}/scan.csv").point.label.flatten().numpy()
    array([1, 2], dtype=int32)
    """
    return read_scan(path, where).by_area(sample).to_tensor()


def read_scan(path: str | os.PathLike[str], where: str | None = None) -> Scan:
    """Read a cloud, or the vertices of a mesh and the triangles between them."""
    return next(read_blocks(path, rows=ALL_ROWS, where=where))


def read_mesh(path: str | os.PathLike[str]) -> Any:
    """Read an Open3D triangle mesh from PLY, OBJ, STL, OFF or GLB; errors as from `read_cloud`, and
    FileFormatError for a file without triangles.
    """
    endings = (".ply", *MESH_ENDINGS)
    if not str(path).lower().endswith(endings):
        raise FileFormatError(f"{path}: unknown ending of a mesh; known are {', '.join(endings)}")
    scan = read_scan(path)
    if not len(scan.triangles):
        raise FileFormatError(f"{path}: no triangles could be read: it is a cloud, or damaged")
    return scan.to_mesh()


def read_textured_mesh(path: str | os.PathLike[str]) -> Any:
    """Read a mesh as `read_mesh` does, or from OBJ and GLB with its texture, if it has one."""
    mesh, textured = read_mesh(path), _mesh_of_open3d(path)
    return textured if textured.has_triangle_uvs() else mesh


def read_blocks(
    path: str | os.PathLike[str], *, rows: int = BLOCK_ROWS, where: str | None = None, bare: bool = False
) -> Iterator[Scan]:
    """Read a scan a few points at a time, in the order of the file, or positions alone if they are to be `bare`.

    Joined the blocks are the scan, to the last bit. LAS, LAZ, PCD (text and binary) and binary PLY without faces are
    read in blocks; everything else is one block. With `where` blocks have fewer points, and there is none without.
    Errors are those of `read_cloud`, before the first block where the size of the file shows that it is truncated.
    """
    if where is not None:
        parsed(where)
    path = _scan_file(path)
    return _chosen(path, _opened(path, rows, bare and where is None)[1], where)


def promised_points(path: str | os.PathLike[str]) -> int | None:
    """How many points a file holds by its header; None for one that is not read in blocks. Errors as `read_blocks`."""
    return _opened(_scan_file(path), BLOCK_ROWS, True)[0]


def _scan_file(path: str | os.PathLike[str]) -> Path:
    path = existing_file(path)
    if path.suffix.lower() not in SCAN_ENDINGS:
        raise unknown_ending(path, SCAN_ENDINGS)
    if holds_skeleton(path):
        raise FileFormatError(f"{path}: is a skeleton, not a scan")
    return path


def _opened(path: Path, rows: int, bare: bool) -> tuple[int | None, Iterator[Scan]]:
    with refused_if_damaged(path, "file"):
        return _SCAN_READERS[path.suffix.lower()](path, rows, bare)


def _chosen(path: Path, blocks: Iterator[Scan], where: str | None) -> Iterator[Scan]:
    """Of each block the points for which a condition holds, if there are any; errors as those of files."""
    read = chosen = 0
    while True:
        with refused_if_damaged(path, "file"):
            block = next(blocks, None)
        if block is None:
            break
        read += len(block)
        if where is not None:
            block = block[block.chosen(where)]
        chosen += len(block)
        if len(block):
            yield block
    if not read:
        ending = path.suffix.lower()
        raise FileFormatError(f"{path}: no points could be read: it is empty, damaged, or not a {ending} file")
    if not chosen:
        raise InvalidCloudError(f"there is no point with {where}")
