"""What went wrong, said in a line and an exit code."""

from __future__ import annotations

import logging
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path

import typer

from ..errors import GlskError, InvalidCloudError, InvalidParameterError, PluginWarning, SkeletonWarning
from ..interop.interrupts import counted_interrupts
from ..interop.packages import import_open3d
from .console import echo, say

FAILURE_CODE, USAGE_CODE, INTERRUPTED_CODE = 1, 2, 130


class WrongUsage(InvalidParameterError):
    """The command line asks for something impossible, whatever the scan holds."""


def reported(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose errors become lines, as `reporting` does it; points may be those of these arguments."""

    @wraps(command)
    def run(**options):
        clouds = (options.get(name) for name in ("scan", "cloud", "mesh", "result"))
        cloud = next((path for path in clouds if path is not None), None)
        with reporting(cloud, quiet=options.get("quiet", False), verbose=options.get("verbose", False)):
            command(**options)

    return run


@contextmanager
def reporting(cloud: Path | None = None, *, quiet: bool = False, verbose: bool = False) -> Iterator[None]:
    """Run a command: errors become one line and an exit code, warnings one line each unless it is `quiet`.

    What is wrong with points is said with the name of the file `cloud`. `verbose` shows the log, and the traceback of
    an error before its line. What is no mistake of the user's passes through with its traceback.
    """
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a file name that the terminal cannot show is no reason to fail
    problem: BaseException | None = None
    with _logging(quiet, verbose), _warnings(quiet):
        try:
            yield
        except BrokenPipeError:
            raise  # the reader of our output has gone; typer ends quietly
        except (GlskError, OSError, MemoryError, KeyboardInterrupt) as error:
            problem = error
    if problem is None:
        return
    if isinstance(problem, InvalidCloudError) and cloud is not None:
        problem.args = (f"{cloud}: {problem}",)
    if verbose:
        echo("".join(traceback.format_exception(problem)).rstrip("\n"), err=True)
    say("error", _message(problem))
    if isinstance(problem, KeyboardInterrupt):
        raise typer.Exit(INTERRUPTED_CODE)
    raise typer.Exit(USAGE_CODE if isinstance(problem, InvalidParameterError) else FAILURE_CODE)


def _message(problem: BaseException) -> str:
    if isinstance(problem, KeyboardInterrupt):
        return "interrupted; no file is half-written"
    if isinstance(problem, MemoryError):
        return f"out of memory ({problem}): thin the cloud first, for example with voxel_down_sample"
    if isinstance(problem, OSError) and problem.strerror and problem.filename is not None:
        return f"{problem.filename}: {problem.strerror}"
    return str(problem) or type(problem).__name__


@contextmanager
def _warnings(quiet: bool) -> Iterator[None]:
    """Say in the end each of our own warnings once, whatever Python's filters are."""
    lines: dict[str, None] = {}

    def keep(message, category, *place, **more):
        if issubclass(category, SkeletonWarning | PluginWarning):
            lines[str(message)] = None
        else:
            show(message, category, *place, **more)

    with warnings.catch_warnings():
        show, warnings.showwarning = warnings.showwarning, keep
        for category in (SkeletonWarning, PluginWarning):
            warnings.simplefilter("always", category)
        try:
            yield
        finally:
            for line in () if quiet else lines:
                say("warning", line)


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


def load_open3d() -> None:
    """Import Open3D with Ctrl-C held back until it is done: interrupted there, it spills pages of text."""
    with counted_interrupts() as held:
        import_open3d()
    if held:
        raise KeyboardInterrupt
