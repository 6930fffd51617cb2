"""What went wrong, said in a line and an exit code."""

from __future__ import annotations

import logging
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from ..errors import GlskError, InvalidCloudError, InvalidParameterError, PluginWarning, SkeletonWarning
from ..interop.interrupts import counted_interrupts
from .console import echo, say

FAILURE_CODE, USAGE_CODE, INTERRUPTED_CODE = 1, 2, 130

# The library speaks Python; these are the same cures on the command line.
_SAID_HERE = {
    "drop them with drop_invalid=True, or remove them first": "drop them with --drop-invalid",
    "raise max_points": "raise --max-points",
    "max_points = ": "--max-points ",
    "must be None or a whole number": "must be 0 (no limit) or a whole number",
    "make one with glsk_o3d.skeletonize": "run 'glsk skeletonize' first",
    "pass cut_loops=True to drop": "add --cut-loops to drop",
    "cylinders are of trees; see pipelines.tree()": "cylinders are of trees; cut them with 'glsk edit --cut-loops', or "
    "make one with 'glsk skeletonize --pipeline tree'",
    "see pipelines.tree() and editing.largest_component()": "keep one with 'glsk edit --largest', or join them with "
    "'glsk skeletonize --pipeline tree'",
    "only trees have a root; see cut_loops()": "only trees have a root: add --cut-loops",
    "branches have an order in a tree; see cut_loops()": "branches have an order in a tree: add --cut-loops",
    "keep one with editing.largest_component()": "keep one with 'glsk edit --largest'",
    "pass unit=, such as 'mm'": "say --unit, such as --unit mm",
    "is wrong, set ": "is wrong, add --set ",
    "give min_confidence=0": "add --min-confidence 0",
    "give cloud=points, or cloud=() to check nothing": "give the scan with --cloud",
    "max_opening = ": "--opening ",
    "remove it first, with Open3D's segment_plane or read_cloud(..., where='z > ...')": "remove it first, with "
    "--where 'z > ...' or Open3D's segment_plane",
    "unless any_filter=True says": "unless --any-meshlab-filter says",
    "taken with recursive": "taken with --recursive",
    "save_report and save_preview make files": "--report PAGE.html and --preview PICTURE.png make files",
}


class WrongUsage(Exception):
    """The command line asks for something impossible, whatever the scan holds."""


@contextmanager
def reporting(cloud: Path | None = None, *, quiet: bool = False, verbose: bool = False) -> Iterator[None]:
    """Run a command: errors become one line and an exit code, warnings one line each.

    Parameters
    ----------
    cloud : Path, optional
        The file that the points are from: what is wrong with them is said with its name.
    quiet : bool
        Hide the warnings.
    verbose : bool
        Show the log, and the traceback of an error before its line.

    Raises
    ------
    typer.Exit
        With code 1, 2 or 130. What is no mistake of the user's passes through with its traceback.
    """
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a file name that the terminal cannot show is no reason to fail
    lines: dict[str, None] = {}

    def keep(message, category, filename, lineno, file=None, line=None):
        if issubclass(category, SkeletonWarning | PluginWarning):
            lines[str(message)] = None
        else:
            show(message, category, filename, lineno, file, line)

    with warnings.catch_warnings(), _logging(quiet, verbose):
        show, warnings.showwarning = warnings.showwarning, keep
        for category in (SkeletonWarning, PluginWarning):
            warnings.simplefilter("always", category)
        problem: BaseException | None = None
        code = 0
        try:
            yield
        except BrokenPipeError:
            raise  # the reader of our output has gone; typer ends quietly
        except (WrongUsage, InvalidParameterError) as error:
            problem, code = error, USAGE_CODE
        except InvalidCloudError as error:
            problem, code = error, FAILURE_CODE
            if cloud is not None:
                error.args = (f"{cloud}: {error}",)
        except (GlskError, OSError, MemoryError) as error:
            problem, code = error, FAILURE_CODE
        except KeyboardInterrupt as error:
            problem, code = error, INTERRUPTED_CODE
        finally:
            if not quiet:
                for line in lines:
                    say("warning", said_here(line))
    if problem is not None:
        if verbose:
            echo("".join(traceback.format_exception(problem)).rstrip("\n"), err=True)
        say("error", _message(problem))
        raise typer.Exit(code)


@contextmanager
def holding_interrupts() -> Iterator[None]:
    """Let Ctrl-C wait until the block is done, for code that cannot bear it.

    Open3D, for one: interrupted while it is imported, it spills pages of text.
    """
    with counted_interrupts() as held:
        yield
    if held:
        raise KeyboardInterrupt


def _message(problem: BaseException) -> str:
    if isinstance(problem, KeyboardInterrupt):
        return "interrupted; no file is half-written"
    if isinstance(problem, MemoryError):
        return f"out of memory ({problem}): thin the cloud first, for example with voxel_down_sample"
    if isinstance(problem, OSError) and problem.strerror and problem.filename is not None:
        return f"{problem.filename}: {problem.strerror}"
    return said_here(str(problem) or type(problem).__name__)


def said_here(message: str) -> str:
    """What the library says, with the cures of the command line."""
    for there, here in _SAID_HERE.items():
        message = message.replace(there, here)
    return message


class _Lines(logging.Handler):
    def emit(self, record):
        say(record.levelname.lower(), record.getMessage())


@contextmanager
def _logging(quiet: bool, verbose: bool) -> Iterator[None]:
    """What the library logs, on stderr: all of it, or its warnings, or only its errors."""
    log, handler = logging.getLogger("glsk_o3d"), _Lines()
    before = log.level
    log.setLevel(logging.DEBUG if verbose else logging.ERROR if quiet else logging.WARNING)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(before)
