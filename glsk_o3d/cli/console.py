"""What the commands print: results on stdout, lines and progress on stderr."""

from __future__ import annotations

import json
import math
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any

import typer
from typer.core import TyperGroup

# A terminal obeys these wherever they come from, the name of a file or a label in one; or shows text in another order.
_CONTROLS = [*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
_SHOWN = {code: repr(chr(code))[1:-1] for code in _CONTROLS if chr(code) not in "\n\t"}
_IN_JSON = {code: f"\\u{code:04x}" for code in _SHOWN if code > 0x20}  # the others json writes so itself


def visible(text: str) -> str:
    """Text with its control characters, but line ends and tabs, written as Python writes them.

    Examples
    --------
    >>> print(visible("a\x1b[2Jb"))
    a\\x1b[2Jb
    """
    return text.translate(_SHOWN)


def echo(text: str = "", *, err: bool = False) -> None:
    """Print lines on stdout, or stderr, with control characters visible: all text goes out here or by `console`."""
    typer.echo(visible(text), err=err)


def console(*, stderr: bool = False) -> Any:
    """A rich console that prints text as it is, without markup or highlighting, and with control characters visible."""
    return _console_class()(stderr=stderr, markup=False, highlight=False, emoji=False)


@cache
def _console_class() -> type:
    from rich.console import Console
    from rich.segment import Segment

    class VisibleConsole(Console):
        def render(self, renderable: Any, options: Any = None) -> Iterator[Any]:
            for text, style, control in super().render(renderable, options):
                yield Segment(text if control else visible(text), style, control)

    return VisibleConsole


class VisibleGroup(TyperGroup):
    """Commands of which the mistakes that typer itself finds on the command line are told with `visible` words.

    A file that may not be read is no mistake in the command line: it is said as other errors are, in one line.
    """

    def make_context(self, *args: Any, **options: Any) -> Any:
        with _visible_mistakes():
            return super().make_context(*args, **options)

    def invoke(self, ctx: Any) -> Any:
        with _visible_mistakes():
            return super().invoke(ctx)


@contextmanager
def _visible_mistakes() -> Iterator[None]:
    try:
        yield
    except Exception as error:  # typer's own have no public base
        if isinstance(message := getattr(error, "message", None), str):
            if message.endswith("is not readable."):
                say("error", message.removesuffix("."))
                raise typer.Exit(1) from None
            told = visible(message)
            if message.startswith("Got unexpected extra argument") and _takes_outputs(getattr(error, "ctx", None)):
                told = f"{told.rstrip('.')}: a file to write comes after -o"
            error.message = told  # type: ignore[attr-defined]
        raise


def _takes_outputs(context: Any) -> bool:
    return context is not None and any("-o" in parameter.opts for parameter in context.command.params)


def print_table(table: Any, *, stderr: bool = False, whole: bool = False) -> None:
    """Print a rich table without the spaces that fill its lines; a `whole` one is as wide as it is, whatever the
    terminal.
    """
    out = console(stderr=stderr)
    if whole:
        out.width = 10**4
    with out.capture() as captured:
        out.print(table)
    # not by `echo`: where there are colours, the console has put control characters in, and no others are left
    typer.echo("\n".join(line.rstrip() for line in captured.get().removesuffix("\n").split("\n")), err=stderr)


def say(kind: str, message: str) -> None:
    """Print one line to stderr, yellow for a "warning" and red for an "error"; other kinds are "info" and "debug"."""
    from rich.text import Text

    style = {"error": "red", "warning": "yellow"}.get(kind, "dim")
    prefix = f"glsk: {kind}: " if kind in ("error", "warning") else "glsk: "
    console(stderr=True).print(Text(prefix + " ".join(message.split()), style=style), soft_wrap=True)


@contextmanager
def progress(shown: bool, *, remaining: bool = False) -> Iterator[Callable[..., None]]:
    """A line with a bar on stderr that goes away in the end, if stderr is a terminal.

    Gives ``update(text, done=None, total=None)``; without numbers the bar only moves. With `remaining` it also says how
    many are done of how many, and how long the others will take.
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

    Those that are None are left out; floats are printed with six digits.
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
        echo(f"{name:<{indent}}" + f"\n{'':<{indent}}".join(lines))


def print_iterations(records, *, stderr: bool = False) -> None:
    """Print a contraction's iterations as a table."""
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
    """Print JSON on stdout; numbers that are not finite become null."""
    typer.echo(json.dumps(_finite(data), indent=2, ensure_ascii=False, allow_nan=False).translate(_IN_JSON))


def _finite(data):
    if isinstance(data, Mapping):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
