"""Which clouds a batch takes, and what their results are called."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..errors import InvalidParameterError
from ..io.paths import CLOUD_ENDINGS, MESH_ENDINGS

INPUT_ENDINGS = CLOUD_ENDINGS + MESH_ENDINGS
RESERVED_STEMS = ("ledger", "recipe")
"""Names of files that a batch itself writes into the output folder."""


def find_inputs(
    inputs: Iterable[str | os.PathLike], out_dir: str | os.PathLike, *, recursive: bool = False
) -> dict[str, Path]:
    """The clouds that are meant, by the names that their results are to have.

    Parameters
    ----------
    inputs : iterable of path-like
        Folders, glob patterns, lists of files (``.txt``) and files.
    out_dir : path-like
        The output folder. Nothing in it counts as an input, where it lies below a folder or pattern.
    recursive : bool
        Take also the clouds in the sub-folders of folders.

    Returns
    -------
    dict of str to Path
        Absolute paths in the order of their names. A name is the path from the folder that was given, from the part
        of a pattern without wildcards, or from the folder of a list (the whole path, where a list names what is not
        below); of a file that was given, its own name. It has no ending and ``/`` between folders; the ending stays
        where names would be equal without it. A file that is meant twice has the first of its names. Whether single
        files of a list are there shows when they are read.

    Raises
    ------
    FileNotFoundError
        A file is not there, a folder or pattern has no cloud, or nothing that a list names is there.
    InvalidParameterError
        There is no input, a folder of clouds is the output folder, or two results would have one name.
    """
    out = os.path.abspath(out_dir)
    roots: dict[str, str] = {}
    for given in inputs:
        for root, path in _meant(os.fspath(given), out, recursive):
            roots.setdefault(path, root)
    if not roots:
        raise InvalidParameterError("there is no input: give a folder, a glob pattern, a list (.txt) or clouds")
    return _named(roots)


def _meant(given: str, out: str, recursive: bool) -> Iterator[tuple[str, str]]:
    """Absolute paths, each with the folder from which its name counts."""
    absolute = os.path.abspath(given)
    if os.path.isdir(given):
        found = _walk(absolute, recursive)
        none = f"{given}: no cloud in this folder" + " (sub-folders are taken with recursive)" * (not recursive)
        yield from ((absolute, path) for path in _clouds(found, absolute, out, none))
    elif os.path.lexists(given) and given.lower().endswith(".txt"):
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
        yield from ((root, path) for path in _clouds(found, root, out, f"{given}: no cloud matches"))
    else:
        raise FileNotFoundError(f"{given}: no such file or folder")


def _walk(folder: str, recursive: bool) -> Iterator[str]:
    for here, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if recursive and not name.startswith(".")]
        yield from (os.path.join(here, name) for name in files if not name.startswith("."))


def _clouds(paths: Iterable[str], root: str, out: str, none: str) -> list[str]:
    """Those with an ending that is read; what a batch wrote is left out."""
    if out == root:
        raise InvalidParameterError(f"{out}: the clouds are in this folder: give the results one of their own")
    inside = out.startswith(os.path.join(root, ""))
    found = [
        path
        for path in paths
        if path.lower().endswith(INPUT_ENDINGS)
        and os.path.isfile(path)
        and not (inside and path.startswith(os.path.join(out, "")))
    ]
    if not found:
        raise FileNotFoundError(f"{none}; known endings are {', '.join(INPUT_ENDINGS)}")
    return found


def _listed(path: str) -> list[str]:
    """The files that a list names, one a line, from the working folder; blank lines and comments are skipped."""
    lines = [os.fsdecode(line.strip()) for line in Path(path).read_bytes().removeprefix(b"\xef\xbb\xbf").splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    if not any(map(os.path.lexists, lines)):
        what = (
            f"none of {len(lines)} lines names one that is there, not {lines[0][:60]!r}" if lines else "it names none"
        )
        raise FileNotFoundError(
            f"{path}: read as a list of files, a path per line from the working folder, and {what}; "
            "if it is a point cloud, rename it to .xyz"
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
            raise InvalidParameterError(
                f"the results of {named[name]} and {path} would both be called {name}: give the folder above them, "
                "a quoted pattern, or each an output folder"
            )
        named[name] = Path(path)
    return dict(sorted(named.items()))
