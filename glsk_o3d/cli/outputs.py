"""The files that commands write: whether they can be written, before computing; and what was, after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import GlskError
from ..interop.packages import require_for
from .console import echo, flags, print_json
from .options import SKELETON_ENDINGS
from .reporting import WrongUsage

if TYPE_CHECKING:
    from ..refinement.rooted import RootPlace
    from ..skeleton import Skeleton
    from ..viewing.page import ContractionRecorder

REPORT_FILE, PICTURE_FILE = (".json", "report is JSON"), (".png", "picture is a PNG")
PAGE_FILE = ((".html", ".htm"), "report is a page")
SKELETON_FILE = (tuple(f".{ending}" for ending in SKELETON_ENDINGS), "file is a skeleton")
"""Endings of files, and what the files are, as `check_outputs` takes them."""

Writers = dict[Path, Callable[[Path], object]]


def check_outputs(
    files: Iterable[tuple[Path | None, str | tuple[str, ...], str]], *inputs: Path | None, needed: str | None = None
) -> None:
    """Find out before computing whether files can be written.

    Each comes with its ending, or all that it may have, and what it is. WrongUsage for a wrong ending, one file twice,
    an input, or no file where it is `needed`, which says how to give one; MissingPackageError where the package that
    writes one is not installed; OSError where a folder is missing, or a file cannot be written.
    """
    given = [(path, ending, what) for path, ending, what in files if path is not None]
    if needed and not given:
        raise WrongUsage(f"nothing to write: give {needed}")
    taken = {os.path.realpath(path): "is an input" for path in inputs if path is not None}
    for path, ending, what in given:
        if not path.name.lower().endswith(ending):
            known = ending if isinstance(ending, str) else " or ".join(ending)
            raise WrongUsage(f"{path}: the {what} and its name ends in {known}")
        real = os.path.realpath(path)
        if real in taken:
            raise WrongUsage(f"{path}: {taken[real]}: choose another name")
        taken[real] = "is named twice"
    for path, _, _ in given:
        require_for(path.suffix)
        folder = Path(os.path.realpath(path)).parent
        if not folder.is_dir():
            raise FileNotFoundError(f"{path.parent}: no such folder: make it before writing {path.name}")
        if path.exists() and not path.is_file():
            raise OSError(f"{path}: is a folder or a device, not a file to write to")
        try:
            tempfile.TemporaryFile(dir=folder).close()
        except OSError as error:
            raise OSError(f"{path}: no file can be made in this folder: {error.strerror}") from error


def skeleton_files(
    outputs: Sequence[Path] | None, preview: Path | None = None, page: Path | None = None
) -> list[tuple[Path | None, str | tuple[str, ...], str]]:
    """What `check_outputs` takes, of a skeleton, its picture and its page."""
    skeletons = [(path, *SKELETON_FILE) for path in outputs or []]
    return [*skeletons, (preview, *PICTURE_FILE), (page, *PAGE_FILE)]


def skeleton_writers(
    skeleton: Skeleton,
    outputs: Sequence[Path] | None,
    preview: Path | None = None,
    page: Path | None = None,
    *,
    title: str = "",
    cut_loops: bool = False,
    root: RootPlace | None = None,
    recorder: ContractionRecorder | None = None,
) -> Writers:
    """What writes a skeleton, its picture and its page; the recorder watched the run, for the page."""
    from .. import save_preview, save_report, save_skeleton

    writers: Writers = {
        path: partial(save_skeleton, skeleton, cut_loops=cut_loops, root=root) for path in outputs or []
    }
    if preview is not None:
        writers[preview] = partial(save_preview, skeleton, title=title)
    if page is not None:
        writers[page] = partial(save_report, skeleton, recorder=recorder, title=title)
    return writers


def write_each(writers: Writers, update: Callable[[str], object] = lambda text: None) -> tuple[list[Path], list[str]]:
    """Write all files that can be written, each with its function; one that cannot does not keep the others from it.

    Gives the files that were written, and what was wrong with the others. `update` is that of `console.progress`.
    """
    written, problems = [], []
    for path, save in writers.items():
        update(f"writing {path.name}")
        try:
            save(path)
            written.append(path)
        except OSError as error:
            problems.append(f"{path}: {error.strerror or f'cannot be written: {error}'}")
        except GlskError as error:
            problems.append(str(error) if str(error).startswith(f"{path}:") else f"{path}: {error}")
        except Exception as error:  # a mistake in one writer: what was computed goes into the other files all the same
            problems.append(f"{path}: cannot be written: {type(error).__name__}: {error}")
    return written, problems


def tell(facts: Any, words: Callable[[], object], files: Iterable[object] = (), problems: Sequence[str] = ()) -> None:
    """Print what a command found, as JSON if that is asked for, else in words and with the files that it wrote.

    Then OSError where files could not be written.
    """
    if flags.as_json:
        print_json(facts)
    elif not flags.quiet:
        words()
        for path in files:
            echo(f"wrote {path}")
    if problems:
        raise OSError("; ".join(problems))
