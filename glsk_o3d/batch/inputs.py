"""Which clouds a batch takes, and what their results are called."""

import glob
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..errors import InvalidParameterError
from ..io.formats.text_tables import holds_points
from ..io.paths import SCAN_ENDINGS, check_ends

LISTS = (".txt", ".csv")  # what they are, their endings do not say
RESERVED_STEMS = ("ledger", "recipe")
"""Names of files that a batch itself writes into the output folder."""


def find_inputs(
    inputs: Iterable[str | os.PathLike], out_dir: str | os.PathLike, *, recursive: bool = False
) -> tuple[dict[str, Path], dict[str, str]]:
    """The clouds that are meant by folders, glob patterns, lists and files: absolute paths by their sorted names.

    A name is the path from the folder that was given, from the part of a pattern without wildcards, or from the folder
    of a list (the whole path for what is not below it); of a file that was given, its own name. It has no ending, but
    where names would be equal without. A file that is meant twice has the first of its names. Nothing in the output
    folder counts, where that lies below a folder or pattern. Single files of a list need not be there. Also gives what
    folders and patterns have beside clouds, with the reasons why it is left out.
    """
    out = os.path.abspath(out_dir)
    roots: dict[str, str] = {}
    left_out: dict[str, str] = {}
    for given in inputs:
        for root, path in _meant(os.fspath(given), out, recursive, left_out):
            roots.setdefault(path, root)
    if not roots:
        raise InvalidParameterError("there is no input: give a folder, a glob pattern, a list (.txt) or clouds")
    return _named(roots), left_out


def one_name(first: object, second: object, name: str) -> InvalidParameterError:
    """The error for two inputs whose results would have one name."""
    return InvalidParameterError(
        f"the results of {first} and {second} would both be called {name}: give the folder above them, "
        "a quoted pattern, or each an output folder"
    )


def _meant(given: str, out: str, recursive: bool, left_out: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Absolute paths, each after the folder from which its name counts."""
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
    """The files in a folder, but for hidden ones."""

    def unreadable(error: OSError) -> None:
        left_out[str(error.filename)] = f"cannot be read: {error.strerror}"

    for here, folders, files in os.walk(folder, onerror=unreadable):
        folders[:] = [name for name in folders if recursive and not name.startswith(".")]
        yield from (os.path.join(here, name) for name in files if not name.startswith("."))


def _clouds(paths: Iterable[str], root: str, out: str, none: str, left_out: dict[str, str]) -> list[str]:
    """Those that may be clouds; of the others it is said why not, but not of what a batch wrote."""
    if out == root:
        raise InvalidParameterError(f"{out}: the clouds are in this folder: give the results one of their own")
    written = os.path.join(out, "") if out.startswith(os.path.join(root, "")) else None
    found = []
    for path in paths:
        if os.path.isfile(path) and not (written and path.startswith(written)):
            if not path.lower().endswith(SCAN_ENDINGS):
                left_out[path] = f"no cloud by its ending, {os.path.splitext(path)[1] or 'none'}"
            elif path.lower().endswith(LISTS) and not holds_points(Path(path)):
                left_out[path] = "no cloud by its first lines"
            else:
                found.append(path)
    if not found:
        raise FileNotFoundError(f"{none}; known endings are {', '.join(SCAN_ENDINGS)}")
    return found


def _listed(path: str) -> list[str]:
    """The files that a list names, one a line, from the working folder; blank lines and comments are skipped."""
    check_ends(path)
    lines = [os.fsdecode(line.strip()) for line in Path(path).read_bytes().removeprefix(b"\xef\xbb\xbf").splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    if any("\0" in line for line in lines):
        raise FileNotFoundError(f"{path}: is no list of files: it holds a NUL character")
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
    """Files by the names of their results, from the folders from which these count."""
    whole = {path: Path(os.path.relpath(path, root)).as_posix() for path, root in sorted(roots.items())}
    short = {path: os.path.splitext(name)[0] for path, name in whole.items()}
    often = Counter(short.values())
    named: dict[str, Path] = {}
    for path in whole:
        name = short[path] if often[short[path]] == 1 and short[path] not in RESERVED_STEMS else whole[path]
        if name in named:
            raise one_name(named[name], path, name)
        named[name] = Path(path)
    return dict(sorted(named.items()))
