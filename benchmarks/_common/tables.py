"""Tables: printed, as Markdown, and put into a page."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import typer
from rich import table as rich_table
from rich.box import SIMPLE_HEAD
from rich.console import Console

from glsk_o3d.interop.atomic import write_atomically

Table = tuple[str, list[str], list[list[str]]]  # title, header, lines
Tables = list[Table]
# columns that are not numbers, besides the first
TEXT = {"pipeline", "setting", "takes", "worst", "wrong", "note", "now right", "now wrong"}
TEXT |= {"measure", "to", "why", "which", "failed", "most in", "packages", "commit"}


def number(value: float | None, digits: int = 3) -> str:
    """A number as tables show it; a dash for None and NaN."""
    return "-" if value is None or np.isnan(value) else f"{value:.{digits}f}"


def short(value: float) -> str:
    """Three digits, but not more than two decimals."""
    return f"{value:.{0 if value >= 100 else 1 if value >= 10 else 2}f}"


def present(tables: Tables, markdown: bool, where: str = "") -> None:
    """Print tables, and before them where they were measured."""
    if where:
        typer.echo(f"{where}\n")
    for table in tables:
        show(*table, markdown)


def show(title: str, header: list[str], rows: list[list[str]], markdown: bool) -> None:
    """Print a table of words; the columns in `TEXT` and the first lean left, the numbers right."""
    if markdown:
        typer.echo(markdown_table(title, header, rows))
        return
    table = rich_table.Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, header_style="")
    for name, numbers in zip(header, _numbers(header), strict=True):
        table.add_column(name, justify="right" if numbers else "left", no_wrap=name not in TEXT)
    for cells in rows:
        table.add_row(*cells)
    console = Console(width=None if sys.stdout.isatty() else 180, markup=False, highlight=False, emoji=False)
    with console.capture() as captured:
        console.print(table)
    typer.echo("\n".join(line.rstrip() for line in captured.get().splitlines()))


def markdown_table(title: str, header: list[str], rows: list[list[str]]) -> str:
    """The same in Markdown."""
    line = ["--:" if numbers else "---" for numbers in _numbers(header)]
    lines = ["| " + " | ".join(cells) + " |" for cells in (header, line, *rows)]
    return "\n".join([f"**{title}**", "", *lines, ""])


def _numbers(header):
    return [i > 0 and name not in TEXT for i, name in enumerate(header)]


def fill(page: Path, parts: Mapping[str, Tables | str], check: bool = False) -> None:
    """Put tables, or texts, into a page between the lines ``<!-- NAME -->`` and ``<!-- end -->``; or only look."""
    text = page.read_text(encoding="utf-8")
    for name, body in parts.items():
        if not isinstance(body, str):
            body = "\n".join(markdown_table(*table) for table in body)
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        text, found = re.subn(pattern, lambda match, body=body: f"{match[1]}\n{body}\n{match[2]}", text, flags=re.S)
        if found != 1:
            raise typer.BadParameter(f"{page} has no lines <!-- {name} --> and <!-- end -->")
    if check:
        return
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


def page_with(*parts: str) -> Callable[[Path | None], Path | None]:
    """A check that a page is there and has the lines between which `fill` puts these parts."""

    def checked(path: Path | None) -> Path | None:
        if path is not None:
            if not path.is_file():
                raise typer.BadParameter(f"there is no page {path}")
            fill(path, dict.fromkeys(parts, ""), check=True)
        return path

    return checked
