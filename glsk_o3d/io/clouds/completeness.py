"""Whether a scan holds the points that its header promises.

Where a PLY, PCD, PTS or OFF file breaks off, or has text for numbers, Open3D returns uninitialised memory for the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

from ...errors import FileFormatError, brief
from ..formats.ply_tables import read_header
from . import pcd


class Promise(NamedTuple):
    """What a header says of the points after it.

    Attributes
    ----------
    points : int
        How many there are.
    columns : int
        The numbers of each.
    skip : int
        Lines or bytes ahead of them.
    size : int
        Bytes of each; 0 for text.
    what : str
        What they are called.
    """

    points: int
    columns: int
    skip: int
    size: int
    what: str = "points"


def check_complete(path: Path) -> None:
    """Raise FileFormatError unless a file holds the points that it promises; other formats promise nothing.

    It may also be damaged, or OSError where it may not be read.
    """
    with path.open("rb") as stream:  # whatever the format: where it may not be read, this says so
        read_promise = _PROMISES.get(path.suffix.lower())
        if read_promise is None:
            return
        try:
            promise = read_promise(stream)
            if promise is None:
                return
            found = _count_points(stream, promise, path.stat().st_size)
        except (ValueError, KeyError, IndexError) as error:
            raise FileFormatError(f"{path}: not a valid {path.suffix} file: {brief(error)}") from error
    if found < promise.points:
        raise FileFormatError(
            f"{path}: promises {promise.points} {promise.what} and holds {max(found, 0)}: it breaks off"
        )


def _count_points(stream: BinaryIO, promise: Promise, file_size: int) -> int:
    """The points that follow the header, counted no further than promised if they are text."""
    if promise.size:
        return (file_size - stream.tell() - promise.skip) // promise.size
    lines = islice(_meant(stream), promise.skip, promise.skip + promise.points)
    return sum(len([float(word) for word in line.split()[: promise.columns]]) == promise.columns for line in lines)


# Each reads a header; None where only Open3D can tell.


def _ply(stream: BinaryIO) -> Promise | None:
    order, elements = read_header(stream)
    here = [element.name for element in elements].index("vertex")
    *before, vertex = elements[: here + 1]
    if any(column.counts for element in elements[: here + 1] for column in element.columns):
        return None
    skip = sum(element.rows * (element.dtype(order).itemsize if order else 1) for element in before)
    return Promise(vertex.rows, len(vertex.columns), skip, vertex.dtype(order).itemsize if order else 0)


def _pcd(stream: BinaryIO) -> Promise | None:
    row, points, kept = pcd.read_header(stream)
    if kept not in ("ascii", "binary"):
        return None
    columns = sum(row[name].shape[0] for name in row.names or ())
    return Promise(points, columns, 0, row.itemsize if kept == "binary" else 0)


def _pts(stream: BinaryIO) -> Promise:
    line = stream.readline(64)
    if not line.strip().isdigit():
        raise ValueError("its first line is not the number of points")
    return Promise(int(line), 3, 0, 0)


def _off(stream: BinaryIO) -> Promise:
    words: list[bytes] = []
    for line in _meant(stream):
        words += line.split()
        if len(words) >= 4:
            break
    if not words or not words[0].endswith(b"OFF"):
        raise ValueError("it does not start with 'OFF'")
    vertices, faces = (int(word) for word in words[1:3])
    if vertices < 0 or faces < 0:
        raise ValueError("its numbers of vertices and faces are negative")
    _check_faces(stream, vertices, faces)
    return Promise(vertices + faces, 3, 0, 0, "vertices and faces")


def _check_faces(stream: BinaryIO, vertices: int, faces: int) -> None:
    """Raise ValueError where a face has a corner that is no vertex: Open3D looks for it in memory, and may crash."""
    start = stream.tell()
    for line in islice(_meant(stream), vertices, vertices + faces):
        words = line.split()
        corners = [int(word) for word in words[1 : 1 + int(words[0])]]
        if len(corners) != int(words[0]) or not all(0 <= corner < vertices for corner in corners):
            raise ValueError(f"a face has {words[0].decode(errors='replace')[:20]} corners that are not all vertices")
    stream.seek(start)


def _meant(stream: BinaryIO) -> Iterator[bytes]:
    """Lines that are neither blank nor comments."""
    return (line for line in stream if line.strip() and not line.lstrip().startswith(b"#"))


_PROMISES = {".ply": _ply, ".pcd": _pcd, ".pts": _pts, ".off": _off}
