"""What the commands say, and where: results on stdout; errors, warnings, logs and progress on stderr."""

from __future__ import annotations

import json
import logging
import math
import shutil
import signal
import sys
import textwrap
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from ..errors import GlskError, InvalidCloudError, InvalidParameterError, PluginWarning, SkeletonWarning

FAILED, WRONG_USAGE, INTERRUPTED = 1, 2, 130

# The library speaks Python; these are the same cures on the command line.
_SAID_HERE = {
    "drop them with RingBuilder(drop_invalid=True), or remove them first": "drop them with --drop-invalid",
    "raise max_points": "raise --max-points",
    "max_points = ": "--max-points ",
    "must be None or a whole number": "must be 0 (no limit) or a whole number",
    "make one with glsk_o3d.skeletonize": "run 'glsk skeletonize' first",
    "pass cut_loops=True to drop": "add --cut-loops to drop",
    "taken with recursive": "taken with --recursive",
    "save_report and save_preview make files": "--report PAGE.html and --preview PICTURE.png make files",
}


class WrongUsage(Exception):
    """The command line asks for something impossible, whatever the scan holds."""


def console(*, stderr: bool = False) -> Any:
    """A rich console that prints text as it is, without markup or highlighting.

    Parameters
    ----------
    stderr : bool

    Returns
    -------
    rich.console.Console
    """
    from rich.console import Console

    return Console(stderr=stderr, markup=False, highlight=False, emoji=False)


def print_table(table: Any, *, stderr: bool = False, whole: bool = False) -> None:
    """Print a rich table without the spaces that fill its lines.

    Parameters
    ----------
    table : rich.table.Table
    stderr : bool
    whole : bool
        Leave the columns as wide as they are, however narrow the terminal is.
    """
    out = console(stderr=stderr)
    if whole:
        out.width = 10**4
    with out.capture() as captured:
        out.print(table)
    typer.echo("\n".join(line.rstrip() for line in captured.get().splitlines()), err=stderr)


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
            problem, code = error, WRONG_USAGE
        except InvalidCloudError as error:
            problem, code = error, FAILED
            if cloud is not None:
                error.args = (f"{cloud}: {error}",)
        except (GlskError, OSError, MemoryError) as error:
            problem, code = error, FAILED
        except KeyboardInterrupt as error:
            problem, code = error, INTERRUPTED
        finally:
            if not quiet:
                for line in lines:
                    say("warning", said_here(line))
    if problem is not None:
        if verbose:
            traceback.print_exception(problem)
        say("error", _message(problem))
        raise typer.Exit(code)


@contextmanager
def holding_interrupts() -> Iterator[None]:
    """Let Ctrl-C wait until the block is done, for code that cannot bear it.

    Open3D, for one: interrupted while it is imported, it spills pages of text.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if held:
        raise KeyboardInterrupt


def say(kind: str, message: str) -> None:
    """Print one line to stderr, yellow for a warning and red for an error.

    Parameters
    ----------
    kind : {"error", "warning", "info", "debug"}
    message : str
    """
    from rich.text import Text

    style = {"error": "red", "warning": "yellow"}.get(kind, "dim")
    prefix = f"glsk: {kind}: " if kind in ("error", "warning") else "glsk: "
    console(stderr=True).print(Text(prefix + " ".join(message.split()), style=style), soft_wrap=True)


@contextmanager
def progress(shown: bool, *, remaining: bool = False) -> Iterator[Callable[..., None]]:
    """A line with a bar on stderr that goes away in the end, if stderr is a terminal.

    Parameters
    ----------
    shown : bool
    remaining : bool
        Also say how many are done of how many, and how long the others will take.

    Yields
    ------
    callable
        ``update(text, done=None, total=None)``; without numbers the bar only moves.
    """
    if not (shown and sys.stderr is not None and sys.stderr.isatty()):
        yield lambda text, done=None, total=None: None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = [SpinnerColumn(), TextColumn("{task.description}"), BarColumn(20), TimeElapsedColumn()]
    if remaining:
        columns += [MofNCompleteColumn(), TextColumn("left:"), TimeRemainingColumn()]
    with Progress(*columns, console=console(stderr=True), transient=True) as bars:
        task = bars.add_task("starting", total=None)

        def update(text, done=None, total=None):
            bars.update(task, description=text, completed=done or 0, total=total)

        yield update


def print_rows(rows: Mapping[str, Any], *, title: str = "") -> None:
    """Print names and values in two columns on stdout, broken to the width of a terminal but not in a file or a pipe.

    Parameters
    ----------
    rows : mapping of str to object
        Those that are None are left out; floats are printed with six digits.
    title : str
    """
    if title:
        console().print(title, style="bold", soft_wrap=True)
    shown = {name.replace("_", " "): value for name, value in rows.items() if value is not None}
    indent = max(map(len, shown)) + 2
    room = (
        max(shutil.get_terminal_size().columns - indent, 20)
        if sys.stdout is not None and sys.stdout.isatty()
        else 10**6
    )
    for name, value in shown.items():
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        lines = [part for line in text.splitlines() for part in textwrap.wrap(line, room, drop_whitespace=False)]
        typer.echo(f"{name:<{indent}}" + f"\n{'':<{indent}}".join(lines))


def print_iterations(records, *, stderr: bool = False) -> None:
    """Print a contraction's iterations as a table.

    Parameters
    ----------
    records : sequence of IterationRecord
    stderr : bool
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    if not records:
        return
    columns = {
        "solve": ("iteration", "d"),
        "points": ("n_points", "d"),
        "merged": ("n_merged", "d"),
        "e": ("explained", ".4f"),
        "De": ("explained_change", ".4f"),
        "rings": ("ring_ratio", ".4f"),
        "w_L": ("contraction_weight", ".4g"),
        "error": ("solve_error", ".1e"),
        "seconds": ("seconds", ".3f"),
    }
    table = Table(box=SIMPLE_HEAD, pad_edge=False, header_style="")
    for head in columns:
        table.add_column(head, justify="right")
    for record in records:
        table.add_row(*(format(getattr(record, name), form) for name, form in columns.values()))
    print_table(table, stderr=stderr)


def print_json(data: Any) -> None:
    """Print JSON on stdout; numbers that are not finite become null.

    Parameters
    ----------
    data : dict, list, str, int, float, bool or None
    """
    typer.echo(json.dumps(_finite(data), indent=2, ensure_ascii=False, allow_nan=False))


def _finite(data):
    if isinstance(data, Mapping):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _message(problem: BaseException) -> str:
    if isinstance(problem, KeyboardInterrupt):
        return "interrupted; no file is half-written"
    if isinstance(problem, MemoryError):
        return f"out of memory ({problem}): thin the cloud first, for example with voxel_down_sample"
    if isinstance(problem, OSError) and problem.strerror and problem.filename is not None:
        return f"{problem.filename}: {problem.strerror}"
    return said_here(str(problem) or type(problem).__name__)


def said_here(message: str) -> str:
    """What the library says, with the cures of the command line.

    Parameters
    ----------
    message : str

    Returns
    -------
    str
    """
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
