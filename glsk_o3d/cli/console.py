"""What the commands print: results on stdout, lines and progress on stderr."""

import json
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import SimpleNamespace
from typing import Any

import typer

from ..interop.atomic import writing

UNBROKEN = 10**5  # more characters than a line of a table has


flags = SimpleNamespace(quiet=False, verbose=False, as_json=False)
"""What the command that runs was asked for, about its output."""


def visible(text: str) -> str:
    """Text in which what terminals obey, but line ends and tabs, stands as Python writes it."""
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]", lambda match: repr(match[0])[1:-1], text)


def echo(text: str = "", **style: Any) -> None:
    """Print lines on stdout, in a style of `typer.style`; OSError where nobody takes them."""
    with writing("standard output"):
        typer.secho(visible(text), **style)


def say(kind: str, message: str) -> None:
    """Print one line to stderr, yellow for a "warning" and red for an "error"; other kinds are "info" and "debug"."""
    color = {"error": "red", "warning": "yellow"}.get(kind)
    prefix = f"glsk: {kind}: " if color else "glsk: "
    plain = False if os.environ.get("NO_COLOR") else None
    with suppress(OSError):  # where nobody takes even this, the exit code is left
        typer.secho(prefix + visible(" ".join(message.split())), err=True, color=plain, fg=color, dim=not color)


def console(*, stderr: bool = False) -> Any:
    """A rich console that prints text as it is, without markup or highlighting."""
    from rich.console import Console

    return Console(stderr=stderr, markup=False, highlight=False, emoji=False)


@contextmanager
def progress(*, remaining: bool = False) -> Iterator[Callable[..., None]]:
    """A line with a bar on stderr that goes away in the end, if stderr is a terminal and nothing asked for quiet.

    Gives ``update(text, done=None, total=None)``; without numbers the bar only moves. With `remaining` it also says how
    many are done of how many, and how long the others will take; else the log, where it is shown, is enough.
    """
    out = console(stderr=True)
    if flags.quiet or (flags.verbose and not remaining) or not out.file.isatty():
        yield lambda text, done=None, total=None: None
        return
    from rich import progress as bar

    columns: list[Any] = ["{task.description}", bar.BarColumn(20), bar.TimeElapsedColumn()]
    if remaining:
        columns += [bar.MofNCompleteColumn(), "left:", bar.TimeRemainingColumn()]
    with bar.Progress(bar.SpinnerColumn(), *columns, console=out, transient=True) as bars:
        task = bars.add_task("starting", total=None)

        def update(text: str, done: int | None = None, total: int | None = None) -> None:
            bars.update(task, description=visible(text), completed=done or 0, total=total)

        yield update


def print_table(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), *, wrap: bool = False) -> None:
    """Print rows of words below each other, to the left, or to the right below `heads`.

    The last column is broken to the width of the terminal, or of 80 where there is none, if `wrap` says so.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    rows = list(rows)
    named = heads or [""] * len(next(iter(rows), ()))
    style: Any = dict(box=SIMPLE_HEAD if heads else None, show_header=bool(heads), pad_edge=False, header_style="")
    table = Table(**style, padding=(0, 1 if heads else 2, 0, 0))
    for i, head in enumerate(named):
        table.add_column(head, justify="right" if heads else "left", no_wrap=i < len(named) - 1)
    for row in rows:
        table.add_row(*row)
    out = console()
    if not wrap:
        out.width = UNBROKEN
    with writing("standard output"), out.capture() as captured:  # rich flushes it
        out.print(table)
    echo("\n".join(line.rstrip() for line in captured.get().removesuffix("\n").split("\n")))


def print_rows(rows: Mapping[str, Any], *, title: str = "") -> None:
    """Print names and values in two columns on stdout, broken to the width of a terminal but not in a file or a pipe.

    Values that are None or empty are left out; each item of a list has a line.
    """
    if title:
        echo(title, bold=True)
    words = {name.replace("_", " "): value_in_words(value) for name, value in rows.items()}
    print_table(((name, text) for name, text in words.items() if text), wrap=console().file.isatty())


def value_in_words(value: Any, digits: int = 6) -> str:
    """A value as people read it: each item of a list on a line, those of a tuple behind each other.

    Of numbers there are so many digits; of large ones, such as coordinates on a map, all ahead of the point, and three.
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        digits = len(f"{abs(value):.0f}") + 3 if 1000 <= abs(value) < 1e12 else digits
        return "not known" if math.isnan(value) else f"{value:.{digits}g}"
    if isinstance(value, dict):
        known = ((name.replace("_", " "), item) for name, item in value.items() if item is not None)
        return ", ".join(f"{name} {value_in_words(item)}" for name, item in known)
    if isinstance(value, list | tuple):
        return ("\n" if isinstance(value, list) else " ").join(map(value_in_words, value))
    return str(value)


def print_json(data: Any) -> None:
    """Print JSON on stdout; numbers that are not finite become null."""
    echo(json.dumps(_finite(data), indent=2, allow_nan=False, default=str))


def _finite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
