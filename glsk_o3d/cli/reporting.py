"""What all commands have: options about their output, and errors as a line and an exit code."""

import inspect
import logging
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import typer

from ..errors import GlskError, InvalidCloudError, InvalidParameterError, PluginWarning, SkeletonWarning, in_words
from .console import echo, flags, say
from .options import Json, Quiet, Verbose

FAILURE_CODE, USAGE_CODE, INTERRUPTED_CODE = 1, 2, 130


class WrongUsage(InvalidParameterError):
    """The command line asks for something impossible, whatever the scan holds."""


def as_command(function: Callable[..., None]) -> Callable[..., None]:
    """A function as a command: with --json, --quiet and --verbose, and with errors as lines."""

    @wraps(function)
    def command(as_json: bool = False, quiet: bool = False, verbose: bool = False, **options: Any) -> None:
        clouds = (options.get(name) for name in ("scan", "cloud", "mesh"))
        cloud = next((path for path in clouds if path is not None), None)
        flags.as_json = as_json
        with reporting(cloud, quiet=quiet, verbose=verbose):
            function(**options)

    signature = inspect.signature(function, eval_str=True)  # what Typer makes the options from
    added, keyword = {"as_json": Json, "quiet": Quiet, "verbose": Verbose}, inspect.Parameter.KEYWORD_ONLY
    more = [inspect.Parameter(name, keyword, default=False, annotation=kind) for name, kind in added.items()]
    parameters = [*signature.parameters.values(), *more]
    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return command


@contextmanager
def reporting(cloud: Path | None = None, *, quiet: bool = False, verbose: bool = False) -> Iterator[None]:
    """Run a command: errors become one line and an exit code, warnings one line each unless it is `quiet`.

    What is wrong with points is said with the name of the file `cloud`. `verbose` shows the log, and the traceback of
    an error before its line. What is no mistake of the user's passes through with its traceback.
    """
    flags.quiet, flags.verbose = quiet, verbose
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="replace")  # a file name that the terminal cannot show is no reason to fail
    problem: BaseException | None = None
    with _as_lines():
        try:
            yield
        except (GlskError, OSError, MemoryError, KeyboardInterrupt) as error:
            problem = error
    if problem is None:
        return
    if verbose:
        echo("".join(traceback.format_exception(problem)).rstrip("\n"), err=True)
    message, code = in_words(problem), FAILURE_CODE
    if isinstance(problem, KeyboardInterrupt):
        message, code = "interrupted; no file is half-written", INTERRUPTED_CODE
    elif isinstance(problem, MemoryError):
        message = f"out of memory ({problem}): thin the cloud first, for example with voxel_down_sample"
    elif isinstance(problem, InvalidParameterError):
        code = USAGE_CODE
    elif isinstance(problem, InvalidCloudError) and cloud is not None:
        message = f"{cloud}: {message}"
    if not isinstance(problem, BrokenPipeError):  # who closed the pipe knows
        say("error", message)
    raise typer.Exit(code)


@contextmanager
def _as_lines() -> Iterator[None]:
    """Say what the library logs: all, or its warnings, or its errors alone; in the end our own Python warnings.

    Each of these is said once, whatever Python's filters are.
    """
    ours = SkeletonWarning, PluginWarning
    log, handler = logging.getLogger("glsk_o3d"), logging.Handler()
    handler.emit = lambda record: say(record.levelname.lower(), record.getMessage())  # type: ignore[method-assign]
    before = log.level
    log.setLevel(logging.DEBUG if flags.verbose else logging.ERROR if flags.quiet else logging.WARNING)
    log.addHandler(handler)
    with warnings.catch_warnings(record=True) as caught:
        for category in ours:
            warnings.simplefilter("always", category)
        try:
            yield
        finally:
            log.removeHandler(handler)
            log.setLevel(before)
            messages = dict.fromkeys(str(warning.message) for warning in caught if issubclass(warning.category, ours))
            for line in () if flags.quiet else messages:
                say("warning", line)
    for warning in caught:
        if not issubclass(warning.category, ours):
            warnings.showwarning(warning.message, warning.category, warning.filename, warning.lineno)
