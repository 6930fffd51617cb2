"""Which clouds a batch takes, and what their results are called."""

import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from ...errors import InvalidParameterError
from ...interop.atomic import check_ends
from ...io.formats.text_tables import holds_points
from ...io.paths import SCAN_ENDINGS

LISTS = (".txt", ".csv")  # what they are, their endings do not say
RESERVED_STEMS = ("ledger", "recipe")
"""Names of files that a batch itself writes into the output folder."""


def find_inputs(
    inputs: Iterable[str | os.PathLike[str]], out_dir: str | os.PathLike[str], *, recursive: bool = False
) -> tuple[dict[Path, str], dict[str, str]]:
    """The clouds that are meant by folders, lists and files: absolute paths with their names, sorted by these.

    A name is the path from the folder that was given, or from the folder of a list (the whole path for what is not
    below it); of a file that was given, its own name. It has no ending, but where names would be equal without. A file
    that is meant twice has the first of its names. Nothing in the output folder counts, where that lies below a folder.
    Single files of a list need not be there. Also gives what folders have beside clouds, with the reasons why it is
    left out.
    """
    out = Path(os.path.abspath(out_dir))
    roots: dict[Path, Path] = {}
    left_out: dict[str, str] = {}
    for given in map(Path, inputs):
        path = Path(os.path.abspath(given))
        root, files = path.parent, [path]
        if path.is_dir():
            root, files = path, _clouds(path, out, recursive, left_out)
        elif not os.path.lexists(path):
            raise FileNotFoundError(f"{given}: no such file or folder")
        elif path.suffix.lower() == ".txt" and not holds_points(path):
            files = _listed(given)
        for file in files:
            roots.setdefault(file, root)
    if not roots:
        raise InvalidParameterError("there is no input: give a folder, a list (.txt) or clouds")
    return _named(roots), left_out


def _clouds(folder: Path, out: Path, recursive: bool, left_out: dict[str, str]) -> list[Path]:
    """The files in a folder that may be clouds; of others it is said why not, but not of hidden and written ones."""
    if out == folder:
        raise InvalidParameterError(f"{out}: the clouds are in this folder: give the results one of their own")
    clouds = []
    for path in folder.rglob("*") if recursive else folder.iterdir():
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if hidden or not path.is_file() or (out.is_relative_to(folder) and path.is_relative_to(out)):
            continue
        if not path.name.lower().endswith(SCAN_ENDINGS):
            left_out[str(path)] = f"no cloud by its ending, {path.suffix or 'none'}"
        elif path.name.lower().endswith(LISTS) and not holds_points(path):
            left_out[str(path)] = "no cloud by its first lines"
        else:
            clouds.append(path)
    if not clouds:
        deeper = "" if recursive else " (sub-folders are taken with recursive)"
        raise FileNotFoundError(f"{folder}: no cloud in it{deeper}; known endings are {', '.join(SCAN_ENDINGS)}")
    return clouds


def _listed(path: Path) -> list[Path]:
    """The files that a list names, one a line, from the working folder; blank lines and comments are skipped."""
    check_ends(path)
    text = path.read_text(encoding="utf-8-sig", errors="surrogateescape")
    lines = [line for line in map(str.strip, text.splitlines()) if line and not line.startswith("#")]
    if not any(map(os.path.lexists, lines)):
        what = f"none of {len(lines)} names one that is there" if lines else "it has none"
        raise FileNotFoundError(
            f"{path}: no point cloud, since no line has three numbers, and no list of files, a path per line: {what}"
        )
    return [Path(os.path.abspath(line)) for line in lines]


def _named(roots: dict[Path, Path]) -> dict[Path, str]:
    """The names of the results of files, from the folders from which these count."""
    whole = {path: path.relative_to(root if path.is_relative_to(root) else path.anchor) for path, root in roots.items()}
    # of the folder itself, which a list may name by mistake, nothing is left
    whole = {path: name if name.name else Path(path.name or "folder") for path, name in whole.items()}
    short = {path: name.with_suffix("").as_posix() for path, name in whole.items()}
    taken = Counter([*short.values(), *RESERVED_STEMS])
    named = {path: short[path] if taken[short[path]] == 1 else name.as_posix() for path, name in whole.items()}
    return dict(sorted(named.items(), key=lambda item: item[1]))
