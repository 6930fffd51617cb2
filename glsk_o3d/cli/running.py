"""From a cloud to files: what the commands that run something share."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import typer

from ..analysis.summary import summary
from ..errors import FileFormatError, GlskError
from ..interop.packages import require_for
from ..io.skeletons import skeleton_ending
from ..skeleton import Skeleton
from ..viewing.page import save_report
from ..viewing.preview import save_preview
from ..viewing.recorder import ContractionRecorder
from .console import WrongUsage, print_iterations, print_json, print_rows

_MADE_WITH = {".png": "; a picture is made with --preview", ".html": "; a page is made with --report"}
_DOING = {
    "RingBuilder": "building rings",
    "Contractor": "contracting",
    "LPRReducer": "merging points",
    "Connector": "connecting",
    "Refiner": "refining",
}


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


def check_findings(report: Path | None, picture: Path | None, *inputs: Path | None) -> None:
    """Find out before computing whether what is found can be written, and that no input is among the files.

    Parameters
    ----------
    report : Path or None
        JSON.
    picture : Path or None
        PNG.
    *inputs : Path or None

    Raises
    ------
    WrongUsage
        A wrong ending, or an input.
    OSError
        A folder is missing, or a file cannot be written.
    """
    taken = [os.path.realpath(path) for path in inputs if path is not None]
    for path, ending, what in ((report, ".json", "report is JSON"), (picture, ".png", "picture is a PNG")):
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


def run(pipeline: Callable[..., Skeleton], cloud: Any, update, on_state=None) -> tuple[Skeleton, float]:
    """Run a pipeline and show how far it is.

    Parameters
    ----------
    pipeline : Pipeline, or callable
        Given the cloud, and ``on_iteration`` and ``on_stage`` as keywords.
    cloud : cloud
    update : callable
        From `console.progress`.
    on_state : callable, optional
        Called with the Contraction after each solve.

    Returns
    -------
    Skeleton, float
        The skeleton, and the seconds it took.
    """
    start = time.perf_counter()
    on_stage, on_iteration = _watch(update)
    skeleton = pipeline(cloud, on_iteration=on_iteration, on_state=on_state, on_stage=on_stage)
    return skeleton, time.perf_counter() - start


def _watch(update):
    doing, most = "", None

    def on_stage(stage):
        nonlocal doing, most
        doing, most = _DOING.get(type(stage).__name__, type(stage).__name__), getattr(stage, "max_iterations", None)
        update(doing)

    def on_iteration(record):
        left = record.n_points - record.n_merged
        update(f"{doing}: solve {record.iteration} of at most {most}, {left} points", record.iteration, most)

    return on_stage, on_iteration


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


def print_results(
    skeleton: Skeleton,
    seconds: float,
    written: Sequence[Path],
    problems: Sequence[str],
    more: Mapping[str, Any] = MappingProxyType({}),
    *,
    quiet,
    verbose,
    as_json=False,
) -> None:
    """Print the summary and the files written; then raise if some were not.

    Parameters
    ----------
    skeleton : Skeleton
    seconds : float
    written : sequence of Path
    problems : sequence of str
    more : mapping of str to object
        Facts beyond the summary.
    quiet, verbose, as_json : bool

    Raises
    ------
    OSError
        If there are problems; the message holds them all.
    """
    if verbose:
        print_iterations(skeleton.report.iterations, stderr=True)
    facts = {**summary(skeleton, seconds), **more}
    if as_json:
        warnings = list(skeleton.report.warnings)
        print_json({**facts, "warnings": warnings, "files": [str(path) for path in written]})
    elif not quiet:
        hidden = {"dropped": facts["dropped"] or None, "converged": None, "seconds": f"{seconds:.2f}"}
        if facts["sampled"] in (0, facts["points"] - facts["dropped"]):
            hidden["sampled"] = None
        hidden["loops_closed"] = None  # most clouds have some, true ones are hardly ever among them
        hidden |= {name: None for name in ("outliers", "loops_cut") if not facts[name]}
        if facts["contracted"] == facts["distinct"]:
            hidden["contracted"] = None
        words = {name: "yes" if value else "no" for name, value in facts.items() if isinstance(value, bool)}
        print_rows({**facts, **words, **hidden})
        for path in written:
            typer.echo(f"wrote {path}")
    if problems:
        raise OSError("; ".join(problems))
