"""The files that commands write: whether they can be written, before computing; and what was, after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

from ..errors import FileFormatError, GlskError
from ..interop.packages import require_for
from ..io.skeletons import skeleton_ending
from ..skeleton import Skeleton
from ..viewing.page import save_report
from ..viewing.preview import save_preview
from ..viewing.recorder import ContractionRecorder
from .reporting import WrongUsage

_MADE_WITH = {".png": "; a picture is made with --preview", ".html": "; a page is made with --report"}

REPORT_FILE, PICTURE_FILE = (".json", "report is JSON"), (".png", "picture is a PNG")


def check_outputs(
    outputs: Sequence[Path],
    preview: Path | None = None,
    scan: Path | None = None,
    page: Path | None = None,
    others: Iterable[Path] = (),
    check_ending: Callable[[Path], object] = skeleton_ending,
    **inputs: Path | None,
) -> None:
    """Find out before computing whether the files can be written.

    Parameters
    ----------
    outputs : sequence of Path
    preview : Path, optional
    scan : Path, optional
        The input, which must not be overwritten.
    page : Path, optional
        The report.
    others : iterable of Path
        Other files to be written.
    check_ending : callable
        Raises FileFormatError for an output whose ending is wrong.
    **inputs : Path or None
        Other inputs, by what they are.

    Raises
    ------
    WrongUsage
        An unknown ending, one file twice, the input among them, or no file at all.
    OSError
        A folder is missing, or a file cannot be written.
    """
    for path in outputs:
        try:
            check_ending(path)
        except FileFormatError as error:
            hint = _MADE_WITH.get(path.suffix.lower(), "")
            raise WrongUsage(f"{error}{hint}") from None
    if preview is not None and preview.suffix.lower() != ".png":
        raise WrongUsage(f"{preview}: the preview is a picture and its name ends in .png")
    if page is not None and page.suffix.lower() not in (".html", ".htm"):
        raise WrongUsage(f"{page}: the report is a page and its name ends in .html")
    files = [*outputs, *(path for path in (preview, page) if path is not None)]
    if not files:
        raise WrongUsage("nothing to write: give an output with -o, a picture with --preview, a page with --report")
    files += others
    sources = {"scan": scan, **inputs}
    seen = {os.path.realpath(path): f"is the {what} itself" for what, path in sources.items() if path is not None}
    for path in files:
        real = os.path.realpath(path)
        if real in seen:
            raise WrongUsage(f"{path}: {seen[real]}: choose another name")
        seen[real] = "is named twice"
    for path in files:
        check_writable(path)


def check_findings(files: Iterable[tuple[Path | None, str, str]], *inputs: Path | None) -> None:
    """Find out before computing whether what is found can be written, and that no input is among the files.

    Parameters
    ----------
    files : iterable of (Path or None, str, str)
        Each with its ending and what it is, such as ``"report is JSON"``.
    *inputs : Path or None

    Raises
    ------
    WrongUsage
        A wrong ending, or an input.
    OSError
        A folder is missing, or a file cannot be written.
    """
    taken = [os.path.realpath(path) for path in inputs if path is not None]
    for path, ending, what in files:
        if path is None:
            continue
        if path.suffix.lower() != ending:
            raise WrongUsage(f"{path}: the {what} and its name ends in {ending}")
        if os.path.realpath(path) in taken:
            raise WrongUsage(f"{path}: is an input: choose another name")
        check_writable(path)


def check_writable(path: Path) -> None:
    """Raise before the work what would keep the file from being made or replaced after it.

    Parameters
    ----------
    path : Path

    Raises
    ------
    MissingPackageError
        A file with this ending is written by a package that is not installed.
    OSError
    """
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


def write(
    skeleton: Skeleton,
    outputs: Sequence[Path],
    preview: Path | None,
    page: Path | None = None,
    others: Mapping[Path, Callable[[Path], object]] = MappingProxyType({}),
    *,
    title: str,
    cut_loops: bool,
    update,
    recorder: ContractionRecorder | None = None,
) -> tuple[list[Path], list[str]]:
    """Write all files that can be written; one that cannot does not keep the others from it.

    Parameters
    ----------
    skeleton : Skeleton
    outputs : sequence of Path
    preview : Path or None
    page : Path, optional
        The report.
    others : mapping of Path to callable
        Other files, and what writes each.
    title : str
        Above the preview and the report.
    cut_loops : bool
        Cut loops where the format holds only trees.
    update : callable
        From `console.progress`.
    recorder : ContractionRecorder, optional
        What watched the run, for the report.

    Returns
    -------
    list of Path, list of str
        The files that were written, and what was wrong with the others.
    """
    writers: dict[Path, Callable[[Path], object]] = {
        path: partial(skeleton.save, cut_loops=cut_loops) for path in outputs
    }
    if preview is not None:
        writers[preview] = partial(save_preview, skeleton, title=title)
    if page is not None:
        writers[page] = partial(save_report, skeleton, recorder=recorder, title=title)
    return write_each({**writers, **others}, update)


def write_each(writers: Mapping[Path, Callable[[Path], object]], update) -> tuple[list[Path], list[str]]:
    """Write all files that can be written; one that cannot does not keep the others from it.

    Parameters
    ----------
    writers : mapping of Path to callable
        The files, and what writes each.
    update : callable
        From `console.progress`.

    Returns
    -------
    list of Path, list of str
        The files that were written, and what was wrong with the others.
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
