"""Files that are to be read: their endings, whether they are there, and the errors for those that are not whole."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import FileFormatError

TEXT_ENDINGS = (".xyz", ".xyzn", ".xyzrgb", ".pts", ".csv", ".txt", ".asc")
"""Clouds as text."""
CLOUD_ENDINGS = (".ply", ".pcd", *TEXT_ENDINGS, ".las", ".laz", ".e57")
"""Files that `read_cloud` reads as clouds."""
MESH_ENDINGS = (".off", ".obj", ".stl", ".gltf", ".glb")
"""Files that `read_cloud` reads as meshes, to take their vertices."""
SCAN_ENDINGS = CLOUD_ENDINGS + MESH_ENDINGS


def existing_file(path: str | os.PathLike) -> Path:
    """The path of a file; FileNotFoundError, or FileFormatError for a folder, a pipe or an empty file."""
    path = Path(path)
    if path.is_dir():
        raise FileFormatError(f"{path}: is a folder, not a file")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    check_ends(path)
    if path.stat().st_size == 0:
        raise FileFormatError(f"{path}: the file is empty")
    return path


def check_ends(path: str | os.PathLike) -> None:
    """Raise FileFormatError for a pipe or a device: what it gives may never end."""
    if os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path)):
        raise FileFormatError(f"{path}: is a pipe or a device, not a file: write what it gives to one first")


def unknown_ending(what: object, known: Iterable[str]) -> FileFormatError:
    """The error for a file, or what else, whose ending is that of no format; it lists those that are known."""
    return FileFormatError(f"{what}: unknown ending; known are {', '.join(known)}")


def breaks_off(promised: int, found: int, what: str = "points") -> ValueError:
    """The error for a file that holds less than its header promises."""
    return ValueError(f"it promises {promised} {what} and holds {found}: it breaks off")
