"""Files that are read: their endings, rows of numbers, and errors where they do not hold what they promise.

Readers compare what a header promises with the size of the file before they take memory, and with what they read before
they return it. What unpacks or repeats itself has a budget, a multiple of the size.
"""

import errno
import os
from array import array
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import FileFormatError, MissingPackageError, brief

TEXT_ENDINGS = (".xyz", ".csv", ".txt", ".asc")
"""Clouds as text."""
CLOUD_ENDINGS = (".ply", ".pcd", *TEXT_ENDINGS, ".las", ".laz", ".e57")
"""Files that `read_cloud` reads as clouds."""
MESH_ENDINGS = (".obj", ".stl", ".off", ".glb")
"""Files that `read_cloud` reads as meshes."""
SCAN_ENDINGS = CLOUD_ENDINGS + MESH_ENDINGS
MOST_EXPANDED = 200  # fitted: times the size of a file that its content may take; of skeletons and scans it is 1 to 20
ALWAYS_TAKEN = 1 << 26  # derived: bytes that any machine has


class NoPoints(Exception):
    """A file is not damaged, but holds no points; why not."""


def unknown_ending(what: object, known: Iterable[str]) -> FileFormatError:
    """The error for a file, or what else, whose ending is that of no format; it lists those that are known."""
    return FileFormatError(f"{what}: unknown ending; known are {', '.join(known)}")


def check_promised(promised: int, present: int, what: str = "points") -> None:
    """Raise ValueError where a file promises more of something than its size can hold, or than was read from it."""
    if present < promised:
        raise ValueError(f"it promises {promised} {what} and holds {max(present, 0)}: it is truncated")


def check_budget(taken: int, size: int) -> None:
    """Raise ValueError where the content of so many bytes would take too many: it is packed, or repeats itself."""
    if taken > (most := max(MOST_EXPANDED * size, ALWAYS_TAKEN)):
        raise ValueError(f"its {size} bytes would take {taken}, and at most {most} are allowed")


@contextmanager
def refused_if_damaged(path: Path, what: str) -> Iterator[None]:
    """FileFormatError for anything that a parser raises on a damaged file; `what` it should be, such as "file"."""
    try:
        yield
    except (MissingPackageError, PermissionError, FileFormatError):
        raise
    except NoPoints as error:
        raise FileFormatError(f"{path}: no points could be read: {error}") from None
    except OSError as error:
        if error.errno in (None, errno.EINVAL):  # of a parser
            raise _damaged(path, what, error) from error
        raise OSError(error.errno, os.strerror(error.errno), error.filename or os.fspath(path)) from error
    except Exception as error:  # also std::bad_alloc
        raise _damaged(path, what, error) from error


def _damaged(path: Path, what: str, error: Exception) -> FileFormatError:
    return FileFormatError(f"{path}: not a valid {path.suffix.lower()} {what}: {brief(error)}")


def binary_rows(path: Path, start: int, row: np.dtype, n: int, block: int) -> Iterator[np.ndarray]:
    """The n rows of a file from the byte `start` on, in structured arrays of `block` rows; ValueError if some lack."""
    with path.open("rb") as stream:
        stream.seek(start)
        for begin in range(0, n, block):
            size = min(block, n - begin) * row.itemsize
            data = stream.read(size)
            if len(data) < size:
                check_promised(n, begin + len(data) // row.itemsize)
            yield np.frombuffer(data, row)


def text_lines(stream: BinaryIO) -> Iterator[bytes]:
    """Lines that are not blank; ValueError for a last one without an end: a number that was cut is another number."""
    for line in stream:
        if not line.isspace():
            if not line.endswith((b"\n", b"\r")):
                raise ValueError("its last line may be cut inside a number: end it with a line break if it is whole")
            yield line


def numbers(lines: Iterable[bytes]) -> np.ndarray:
    """All numbers of lines of text, (n,) float array."""
    values = array("d")
    for line in lines:
        values.extend(map(float, line.split()))
    return np.array(values)
