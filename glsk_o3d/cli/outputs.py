"""The files that commands write: whether they can be written, before computing; and what was, after it."""

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import FileFormatError, GlskError
from ..interop.atomic import check_ending, check_place
from ..interop.packages import require_for
from .console import echo, flags, print_json
from .options import SKELETON_ENDINGS
from .reporting import WrongUsage


class Output(NamedTuple):
    """A file, or None where it is not asked for, its endings, what it is, and what saves the command's result to it."""

    path: Path | None
    endings: tuple[str, ...]
    what: str
    save: Callable[[Any, Path], object]


PICTURE, PAGE = ((".png",), "picture is a PNG"), ((".html", ".htm"), "report is a page")
"""What two kinds of outputs are."""


def skeleton_outputs(
    skeletons: Iterable[Path] | None,
    preview: Path | None = None,
    page: Path | None = None,
    title: str = "",
    cut_loops: bool = False,
) -> list[Output]:
    """The files of a skeleton, its picture and its page."""
    from .. import save_preview, save_report, save_skeleton

    endings = tuple(f".{ending}" for ending in SKELETON_ENDINGS)
    save = partial(save_skeleton, cut_loops=cut_loops)
    return [
        *(Output(path, endings, "file is a skeleton", save) for path in skeletons or []),
        Output(preview, *PICTURE, partial(save_preview, title=title)),
        Output(page, *PAGE, partial(save_report, title=title)),
    ]


def check_outputs(outputs: Iterable[Output], *inputs: Path | None, needed: str | None = None) -> None:
    """Find out before computing whether files can be written.

    WrongUsage for a wrong ending, one file twice, an input, or no file where it is `needed`, which says how to give
    one; MissingPackageError where the package that writes one is not installed; OSError where a folder is missing, or
    a file cannot be written.
    """
    given = [(path, endings, what) for path, endings, what, _ in outputs if path is not None]
    if needed and not given:
        raise WrongUsage(f"nothing to write: give {needed}")
    taken = {os.path.realpath(path): "is an input" for path in inputs if path is not None}
    for path, endings, what in given:
        try:
            check_ending(path, what, *endings)
        except FileFormatError as error:
            raise WrongUsage(str(error)) from None
        real = os.path.realpath(path)
        if real in taken:
            raise WrongUsage(f"{path}: {taken[real]}: choose another name")
        taken[real] = "is named twice"
    for path, _, _ in given:
        require_for(path.suffix)
        check_place(path)
        try:
            tempfile.TemporaryFile(dir=Path(os.path.realpath(path)).parent).close()
        except OSError as error:
            raise OSError(f"{path}: no file can be made in this folder: {error.strerror}") from error


def write_outputs(
    outputs: Iterable[Output], result: Any, update: Callable[[str], object] = lambda text: None
) -> dict[Path, str]:
    """Write all files that can be written; one that cannot does not keep the others from it.

    Gives what was wrong with each file, "" where it was written. `update` is that of `console.progress`.
    """
    problems: dict[Path, str] = {}
    for path, _, _, save in outputs:
        if path is None:
            continue
        update(f"writing {path.name}")
        problems[path] = ""
        try:
            save(result, path)
        except OSError as error:
            problems[path] = f"{path}: {error.strerror or f'cannot be written: {error}'}"
        except GlskError as error:
            problems[path] = str(error) if str(error).startswith(f"{path}:") else f"{path}: {error}"
        except Exception as error:  # a mistake in one writer: what was computed goes into the other files all the same
            problems[path] = f"{path}: cannot be written: {type(error).__name__}: {error}"
    return problems


def print_result(facts: Any, words: Callable[[], object], files: Mapping[Path, str] | None = None) -> None:
    """Print what a command found, as JSON if that is asked for, else in words and with the files that it wrote.

    Then OSError if there were problems with the `files`, as `write_outputs` gives them.
    """
    written = [str(path) for path, problem in (files or {}).items() if not problem]
    if flags.as_json:
        print_json(facts if files is None else {**facts, "files": written})
    elif not flags.quiet:
        words()
        for path in written:
            echo(f"wrote {path}")
    if problems := list(filter(None, (files or {}).values())):
        raise OSError("; ".join(problems))
