"""Files that are there to be read, and files that appear complete or not at all."""

import json
import os
import re
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import FileFormatError


def existing_file(path: str | os.PathLike[str]) -> Path:
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


def check_ends(path: str | os.PathLike[str]) -> None:
    """Raise FileFormatError for a pipe or a device: what it gives may never end."""
    if os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path)):
        raise FileFormatError(f"{path}: is a pipe or a device, not a file: write its output to a file first")


def write_json(path: str | os.PathLike[str], data: Any) -> None:
    """Write what JSON can hold, indented, as `write_atomically` does."""
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_atomically(path: str | os.PathLike[str], write: Callable[[Path], object]) -> None:
    """Write a file so that it appears complete or not at all.

    `write` makes a temporary file in the same folder, with the same ending, given its path. If it raises, that file is
    removed and the old one stays. Of a symbolic link the target is replaced. Raises as `check_place` does, and OSError,
    which names the path, where it cannot be written.
    """
    check_place(path)
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{uuid.uuid4().hex}{target.suffix}")
    try:
        with writing(path):
            write(temporary)
            if target.exists():
                shutil.copymode(target, temporary)
            os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove the temporary files of `write_atomically` that killed processes left in a folder and those inside."""
    for path in folder.rglob(".*"):
        if re.fullmatch(r"\.[0-9a-f]{32}(\.\w+)?", path.name):
            path.unlink(missing_ok=True)


def check_place(path: str | os.PathLike[str]) -> None:
    """FileNotFoundError if the folder of a file does not exist, OSError if the path is a folder or a device."""
    path, target = Path(path), Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{path.parent}: no such folder: make it before writing {path.name}")
    if target.exists() and not target.is_file():
        raise OSError(f"{path}: is a folder or a device, not a file to write to")


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[None]:
    """An OSError that says which file cannot be written, and why."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, f"cannot be written: {os.strerror(error.errno)}", os.fspath(path)) from error


def check_ending(path: str | os.PathLike[str], what: str, *endings: str) -> None:
    """FileFormatError unless a file's name has one of the endings of `what` it is, such as ``"picture is a PNG"``."""
    if not Path(path).name.lower().endswith(endings):
        raise FileFormatError(f"{os.fspath(path)}: the {what} and its name ends in {' or '.join(endings)}")
