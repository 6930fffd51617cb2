"""Scans from files, whole or a block of points at a time: the table of readers."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileFormatError, InvalidParameterError, MissingPackageError, brief
from ...interop.packages import import_open3d
from ..formats import ply
from ..paths import MESH_ENDINGS, SCAN_ENDINGS, TEXT_ENDINGS, breaks_off, existing_file, unknown_ending
from ..skeletons import holds_skeleton, read_skeleton
from . import e57, las, pcd, text_tables
from .scanned import ALL_ROWS, NoPoints, Scan
from .selection import chosen_points, none_chosen, parsed

BLOCK_ROWS = 1_000_000  # measured: larger blocks are not read faster, and take more memory


def read_whole(path: str | os.PathLike) -> Scan:
    """Read all points of a cloud or mesh, and its triangles. Errors as from `glsk_o3d.read_cloud`."""
    path = scan_file(path)
    reader = _SCAN_READERS[path.suffix.lower()]
    with refused_where_damaged(path):
        blocks = None if reader.blocks is None else reader.blocks(path, ALL_ROWS, False)
        if blocks is not None:
            scan = next(blocks, None)
        else:
            scan = reader.read(path) if reader.read else None
    if not scan:
        raise _holds_no_points(path)
    return scan


def read_blocks(
    path: str | os.PathLike, *, rows: int = BLOCK_ROWS, where: str | None = None, bare: bool = False
) -> Iterator[Scan]:
    """Read a scan a few points at a time, in the order of the file, or positions alone if they are to be `bare`.

    Joined the blocks are what `read_whole` gives, to the last bit; in a block, attributes are unset that are so there.
    LAS, LAZ, PCD (text and binary) and binary PLY without faces are read in blocks; everything else is one block. With
    `where`, as for `glsk_o3d.read_cloud`, blocks have fewer points, and there is none without.

    Errors are those of `glsk_o3d.read_cloud`; what shows only while reading comes then, but where a binary PLY or PCD
    or a LAS file breaks off, that shows before the first block. Where the scale of colours is not that of their type,
    they are looked at first, in LAZ until one is found that needs sixteen bits.
    """
    if isinstance(rows, bool) or not isinstance(rows, int) or rows < 1:
        raise InvalidParameterError(f"rows = {rows!r}: must be an int of at least 1")
    path = scan_file(path)
    if where is not None:
        parsed(where)
    reader = _SCAN_READERS[path.suffix.lower()]
    with refused_where_damaged(path):
        blocks = None if reader.blocks is None else reader.blocks(path, rows, bare and where is None)
    return _chosen(path, iter([read_whole(path)]) if blocks is None else blocks, where)


def promised_points(path: str | os.PathLike) -> int | None:
    """How many points a file holds by its header; None for one that is not read in blocks. Errors as `read_blocks`."""
    path = scan_file(path)
    promised = _SCAN_READERS[path.suffix.lower()].promised
    with refused_where_damaged(path):
        return None if promised is None else promised(path)


def scan_file(path: str | os.PathLike) -> Path:
    """The path of a file that can be a scan; errors as from `glsk_o3d.read_cloud`, but for those of reading it."""
    path = existing_file(path)
    ending = path.suffix.lower()
    if holds_skeleton(path) if ending in SCAN_ENDINGS else _is_skeleton(path):
        raise FileFormatError(f"{path}: is a skeleton, not a scan")
    if ending not in SCAN_ENDINGS:
        raise unknown_ending(path, SCAN_ENDINGS)
    return path


def _is_skeleton(path: Path) -> bool:
    """Whether a file with an ending that scans do not have can be read as a skeleton."""
    try:
        read_skeleton(path)
    except FileFormatError:
        return False
    return True


@contextmanager
def refused_where_damaged(path: Path) -> Iterator[None]:
    """FileFormatError for what goes wrong with the contents of a file."""
    try:
        yield
    except (MissingPackageError, PermissionError):
        raise
    except NoPoints as error:
        raise FileFormatError(f"{path}: no points could be read: {error}") from None
    except Exception as error:  # whatever a parser raises on a hostile file, std::bad_alloc
        raise FileFormatError(f"{path}: not a valid {path.suffix.lower()} file: {brief(error)}") from error


def _holds_no_points(path: Path) -> FileFormatError:
    return FileFormatError(
        f"{path}: no points could be read: it is empty, damaged, or not a {path.suffix.lower()} file"
    )


def _chosen(path: Path, blocks: Iterator[Scan], where: str | None) -> Iterator[Scan]:
    """Of each block the points for which a condition holds, if there are any; errors as those of files."""
    any_read = any_chosen = False
    while True:
        with refused_where_damaged(path):
            block = next(blocks, None)
        if block is None:
            break
        any_read = True
        if where is not None:
            block = block[chosen_points(block, where)]
        if len(block):
            any_chosen = True
            yield block
    if not any_read:
        raise _holds_no_points(path)
    if not any_chosen:
        raise none_chosen(str(where))


def _read_mesh(path: Path) -> Scan:
    if path.suffix.lower() == ".off":
        _check_off(path)
    if path.suffix.lower() == ".glb":
        _check_glb(path)
    with path.open("rb"):  # where it may not be read, this says so
        pass
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


def _check_glb(path: Path) -> None:
    """Raise ValueError where the first part of a GLB file is longer than the file: Open3D takes memory for all of it,
    gigabytes perhaps, and looks for it behind the end.
    """
    with path.open("rb") as stream:
        length = int.from_bytes(stream.read(16)[12:], "little")
    size = path.stat().st_size
    if length > size:
        raise ValueError(f"its header promises {length} bytes, and the file has {size}")


class Reader(NamedTuple):
    """How scans of a format are read: whole; a few points at a time, `blocks(path, rows, bare)`; and how many there are
    by the header. The latter two are None for formats that are always read whole, and give None for such files.
    """

    read: Callable[[Path], Scan] | None
    blocks: Callable[[Path, int, bool], Iterator[Scan] | None] | None = None
    promised: Callable[[Path], int | None] | None = None


_LAS = Reader(None, las.blocks, las.promised)
_SCAN_READERS: dict[str, Reader] = {
    **dict.fromkeys(MESH_ENDINGS, Reader(_read_mesh)),
    **dict.fromkeys(TEXT_ENDINGS, Reader(text_tables.read)),
    ".ply": Reader(ply.read_scan, ply.blocks, ply.promised),
    ".pcd": Reader(pcd.read, pcd.blocks, pcd.promised),
    ".las": _LAS,
    ".laz": _LAS,
    ".e57": Reader(e57.read),
}
