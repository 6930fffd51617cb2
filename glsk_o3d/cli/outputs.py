"""The files that commands write: whether they can be written, before computing; and what was, after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

from ..errors import FileFormatError, GlskError
from ..interop.packages import require, require_for
from ..io.meshes import mesh_ending
from ..io.scans import tensor_cloud_ending
from ..io.skeletons import skeleton_ending
from ..refinement.rooted import RootPlace
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
    *,
    tubes: Path | None = None,
    labelled: Path | None = None,
    **inputs: Path | None,
) -> None:
    """Find out before computing whether the files can be written.

    WrongUsage for an unknown ending (as `check_ending` has it, which raises FileFormatError), one file twice, the scan
    or another input among them, or no file at all; OSError where a folder is missing, or a file cannot be written.
    """
    for path in outputs:
        _check(check_ending, path, _MADE_WITH.get(path.suffix.lower(), ""))
    for check, coloured in ((mesh_ending, tubes), (tensor_cloud_ending, labelled)):
        if coloured is not None:
            _check(check, coloured)
            require("matplotlib")
    if preview is not None and preview.suffix.lower() != ".png":
        raise WrongUsage(f"{preview}: the preview is a picture and its name ends in .png")
    if page is not None and page.suffix.lower() not in (".html", ".htm"):
        raise WrongUsage(f"{page}: the report is a page and its name ends in .html")
    files = [*outputs, *(path for path in (preview, page, tubes, labelled) if path is not None)]
    if not files:
        raise WrongUsage("nothing to write: give an output with -o, --tubes or --labelled, a --preview or a --report")
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


def _check(check_ending: Callable[[Path], object], path: Path, hint: str = "") -> None:
    try:
        check_ending(path)
    except FileFormatError as error:
        raise WrongUsage(f"{error}{hint}") from None


def check_findings(files: Iterable[tuple[Path | None, str | tuple[str, ...], str]], *inputs: Path | None) -> None:
    """Find out before computing whether what is found can be written; `files`, or None, come with their ending, or all
    that they may have, and what they are.

    WrongUsage for a wrong ending, or an input; OSError where a folder is missing, or a file cannot be written.
    """
    taken = [os.path.realpath(path) for path in inputs if path is not None]
    for path, ending, what in files:
        if path is None:
            continue
        if not path.name.lower().endswith(ending):
            known = ending if isinstance(ending, str) else " or ".join(ending)
            raise WrongUsage(f"{path}: the {what} and its name ends in {known}")
        if os.path.realpath(path) in taken:
            raise WrongUsage(f"{path}: is an input: choose another name")
        check_writable(path)


def check_writable(path: Path) -> None:
    """Raise before the work what would keep the file from being made or replaced after it.

    MissingPackageError where files with this ending are written by a package that is not installed, or OSError.
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
    root: RootPlace | None = None,
    update,
    recorder: ContractionRecorder | None = None,
) -> tuple[list[Path], list[str]]:
    """Write all files of a run, and `others`, as `write_each` does.

    `cut_loops` and `root` are as for `save_skeleton`. The title is above the preview and the page; the recorder watched
    the run, for the page.
    """
    writers: dict[Path, Callable[[Path], object]] = {
        path: partial(skeleton.save, cut_loops=cut_loops, root=root) for path in outputs
    }
    if preview is not None:
        writers[preview] = partial(save_preview, skeleton, title=title)
    if page is not None:
        writers[page] = partial(save_report, skeleton, recorder=recorder, title=title)
    return write_each({**writers, **others}, update)


def write_each(writers: Mapping[Path, Callable[[Path], object]], update) -> tuple[list[Path], list[str]]:
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
