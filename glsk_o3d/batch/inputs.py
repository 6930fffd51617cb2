"""Which clouds a batch takes, and what their results are called."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from ..errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ..io.clouds.text_tables import holds_points
from ..io.paths import SCAN_ENDINGS, check_ends
from .grid import TooManyParts
from .splitting import Split, Splitter

LISTS = (".txt", ".csv")  # what they are, their endings do not say
RESERVED_STEMS = ("ledger", "recipe")
"""Names of files that a batch itself writes into the output folder."""
TILES_FOLDER = ".tiles/"
"""What follows the name of a scene in those of its tiles."""


class Source(NamedTuple):
    """A cloud: a file, or some of the points in it.

    Attributes
    ----------
    path : Path
    part : str
        Which points, such as ``"where treeID == 17"`` or ``"tile 0-2-0"``; empty for all.
    file : Path or None
        Where these points are by themselves, as soon as a batch runs.
    tiles : tuple of str
        The names of the tiles from whose skeletons that of this cloud is joined.
    split : Split or None
        How the file was taken apart.
    """

    path: Path
    part: str = ""
    file: Path | None = None
    tiles: tuple[str, ...] = ()
    split: Split | None = None

    def __str__(self) -> str:
        return f"{self.path} {self.part}" if self.part else str(self.path)


@dataclass
class Inputs:
    """What a batch takes, by the names that the results are to have, and what it leaves out.

    Attributes
    ----------
    named : dict of str to Source
    left_out : dict of str to str
        Files that were looked at and are not taken, with the reason.
    """

    named: dict[str, Source] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)


def find_inputs(
    inputs: Iterable[str | os.PathLike],
    out_dir: str | os.PathLike,
    *,
    recursive: bool = False,
    splitter: Splitter | None = None,
) -> Inputs:
    """The clouds that are meant, by the names that their results are to have.

    Parameters
    ----------
    inputs : iterable of path-like
        Folders, glob patterns, lists of files (``.txt``) and files.
    out_dir : path-like
        The output folder. Nothing in it counts as an input, where it lies below a folder or pattern.
    recursive : bool
        Take also the clouds in the sub-folders of folders.
    splitter : Splitter, optional
        Takes every file apart: a source for each label, or for each tile and one that is joined from them.

    Returns
    -------
    Inputs
        Absolute paths in the order of their names. A name is the path from the folder that was given, from the part
        of a pattern without wildcards, or from the folder of a list (the whole path, where a list names what is not
        below); of a file that was given, its own name. It has no ending and ``/`` between folders; the ending stays
        where names would be equal without it. A file that is meant twice has the first of its names. Whether single
        files of a list are there shows when they are read. A hyphen and the value follow for a label; tiles are in a
        folder with the ending ``.tiles``.

    Raises
    ------
    FileFormatError
        A list is a pipe or a device.
    FileNotFoundError
        A file is not there, a folder or pattern has no cloud, or nothing that a list names is there.
    InvalidParameterError
        There is no input, a folder of clouds is the output folder, or two results would have one name.
    """
    out = os.path.abspath(out_dir)
    roots: dict[str, str] = {}
    found = Inputs()
    for given in inputs:
        for root, path in _meant(os.fspath(given), out, recursive, found.left_out):
            roots.setdefault(path, root)
    if not roots:
        raise InvalidParameterError("there is no input: give a folder, a glob pattern, a list (.txt) or clouds")
    for name, path in _named(roots).items():
        new = {name: Source(path)} if splitter is None else _apart(name, path, splitter, found.left_out)
        for each in new.keys() & found.named.keys():
            raise _one_name(found.named[each], new[each], each)
        found.named |= new
    if not found.named:
        path, reason = next(iter(found.left_out.items()))
        apart = "" if splitter is None else f"{splitter.cut}: "
        raise InvalidParameterError(f"{apart}no input can be taken apart; {path}: {reason}")
    return found


def _one_name(first: object, second: object, name: str) -> InvalidParameterError:
    return InvalidParameterError(
        f"the results of {first} and {second} would both be called {name}: give the folder above them, "
        "a quoted pattern, or each an output folder"
    )


def _apart(name: str, path: Path, splitter: Splitter, left_out: dict[str, str]) -> dict[str, Source]:
    """A source for every label, or for every tile and the whole."""
    try:
        split = splitter.split(name, path)
    except (FileFormatError, InvalidCloudError, OSError):
        return {name: Source(path)}  # the worker will say what is wrong
    except TooManyParts:
        raise
    except InvalidParameterError as error:
        left_out[str(path)] = str(error)
        return {}
    between = "-" if split.grid is None else TILES_FOLDER
    new = {
        f"{name}{between}{label}": Source(path, part, splitter.file(name, label), split=split)
        for label, part in split.parts.items()
    }
    return new if split.grid is None else {**new, name: Source(path, tiles=tuple(new), split=split)}


def _meant(given: str, out: str, recursive: bool, left_out: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Absolute paths, each with the folder from which its name counts."""
    absolute = os.path.abspath(given)
    if os.path.isdir(given):
        found = _walk(absolute, recursive, left_out)
        none = f"{given}: no cloud in this folder" + " (sub-folders are taken with recursive)" * (not recursive)
        yield from ((absolute, path) for path in _clouds(found, absolute, out, none, left_out))
    elif os.path.lexists(given) and given.lower().endswith(".txt") and not holds_points(Path(given)):
        here = os.path.dirname(absolute)
        for path in _listed(given):
            yield here if path.startswith(os.path.join(here, "")) else Path(path).anchor, path
    elif os.path.lexists(given):
        yield os.path.dirname(absolute), absolute
    elif glob.has_magic(given):
        root = absolute
        while glob.has_magic(root):
            root = os.path.dirname(root)
        found = map(os.path.abspath, glob.iglob(given, recursive=True))
        yield from ((root, path) for path in _clouds(found, root, out, f"{given}: no cloud matches", left_out))
    else:
        raise FileNotFoundError(f"{given}: no such file or folder")


def _walk(folder: str, recursive: bool, left_out: dict[str, str]) -> Iterator[str]:
    def unreadable(error: OSError) -> None:
        left_out[str(error.filename)] = f"cannot be read: {error.strerror}"

    for here, folders, files in os.walk(folder, onerror=unreadable):
        folders[:] = [name for name in folders if recursive and not name.startswith(".")]
        yield from (os.path.join(here, name) for name in files if not name.startswith("."))


def _clouds(paths: Iterable[str], root: str, out: str, none: str, left_out: dict[str, str]) -> list[str]:
    """Those with an ending that is read; of the others it is said why not, but not of what a batch wrote."""
    if out == root:
        raise InvalidParameterError(f"{out}: the clouds are in this folder: give the results one of their own")
    inside = out.startswith(os.path.join(root, ""))
    files = [path for path in paths if os.path.isfile(path) and not (inside and path.startswith(os.path.join(out, "")))]
    why = {path: _why_not(path) for path in files}
    left_out.update({path: reason for path, reason in why.items() if reason})
    found = [path for path in files if not why[path]]
    if not found:
        raise FileNotFoundError(f"{none}; known endings are {', '.join(SCAN_ENDINGS)}")
    return found


def _why_not(path: str) -> str:
    """Why a file is no cloud, empty if it may be one."""
    if not path.lower().endswith(SCAN_ENDINGS):
        return f"no cloud by its ending, {os.path.splitext(path)[1] or 'none'}"
    return "no cloud by its first lines" if path.lower().endswith(LISTS) and not holds_points(Path(path)) else ""


def _listed(path: str) -> list[str]:
    """The files that a list names, one a line, from the working folder; blank lines and comments are skipped."""
    check_ends(path)
    lines = [os.fsdecode(line.strip()) for line in Path(path).read_bytes().removeprefix(b"\xef\xbb\xbf").splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    if any("\0" in line for line in lines):
        raise FileNotFoundError(f"{path}: is no list of files: it holds a NUL, which no name does")
    if not any(map(os.path.lexists, lines)):
        what = (
            f"none of {len(lines)} lines names one that is there, not {lines[0][:60]!r}" if lines else "it names none"
        )
        raise FileNotFoundError(
            f"{path}: read as a list of files, a path per line from the working folder, and {what}; "
            "it is no point cloud, either: none of its first lines has three numbers"
        )
    return list(map(os.path.abspath, lines))


def _named(roots: dict[str, str]) -> dict[str, Path]:
    whole = {path: Path(os.path.relpath(path, root)).as_posix() for path, root in sorted(roots.items())}
    short = {path: os.path.splitext(name)[0] for path, name in whole.items()}
    often = Counter(short.values())
    named: dict[str, Path] = {}
    for path in whole:
        name = short[path] if often[short[path]] == 1 and short[path] not in RESERVED_STEMS else whole[path]
        if name in named:
            raise _one_name(named[name], path, name)
        named[name] = Path(path)
    return dict(sorted(named.items()))
