"""Rows of results: summed up, saved with where they come from, as tables on the console and in pages, and drawn."""

from __future__ import annotations

import gzip
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import typer
from rich import table as rich_table
from rich.box import SIMPLE_HEAD
from rich.console import Console

from glsk_o3d.data.report import Report
from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.viewing.figures import INK, save_figure

ROOT = Path(__file__).resolve().parents[3]
Table = tuple[str, list[str], list[list[str]]]  # title, header, lines
Tables = list[Table]
# columns that are not numbers, besides the first
TEXT = {"pipeline", "setting", "takes", "worst", "wrong", "note", "now right", "now wrong"}
TEXT |= {"measure", "to", "why", "which", "failed", "most in", "packages", "commit"}
GREY, ORANGE, BLUE = "#777777", "#d95f02", "#1f4e9c"  # distinct without red and green, and in print
LOOKS = {"default": dict(color=BLUE, marker="o"), "wen2024": dict(color=ORANGE, marker="^")}
LOOKS |= {"cao2010": dict(color=GREY, marker="s")}
WIDTH = 5.0  # inches: narrow enough for a telephone


def pick(rows: list[dict], **facts) -> list[dict]:
    """The rows with these facts."""
    return [row for row in rows if all(row[name] == value for name, value in facts.items())]


def grouped(rows: list[dict], fact: str) -> dict[str, list[dict]]:
    """The rows by a fact, in their order."""
    return {name: pick(rows, **{fact: name}) for name in dict.fromkeys(row[fact] for row in rows)}


def good(rows: list[dict]) -> list[dict]:
    """The rows that are no failures."""
    return [row for row in rows if "failure" not in row]


def summary(rows: list[dict]) -> dict:
    """Means over the shapes that gave a skeleton, and how many have the right topology; a failure has not."""
    names = ("error", "inside", "completeness", "length", "ends", "radius_error", "tips_f1", "junctions_f1", "cpu")
    values = {name: [row[name] for row in good(rows) if row[name] is not None] for name in names}
    counts = dict(n=len(rows), right=sum(bool(row["topology"]) for row in good(rows)))
    return counts | {name: fmean(known) if known else float("nan") for name, known in values.items()}


def save(path: Path | None, rows: list[dict]) -> None:
    """Write all rows, with where they come from, as JSON."""
    if path is not None:
        content = {"command": sys.argv[1:], **surroundings(), "rows": rows}
        path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(path: Path) -> dict[str, Any]:
    """What `save` or `write_packed` has written."""
    data = path.read_bytes()
    return json.loads(gzip.decompress(data) if path.suffix == ".gz" else data)


def write_packed(path: Path, content: dict[str, Any]) -> None:
    """Write packed JSON: the same bytes for the same content."""
    packed = gzip.compress(json.dumps(content, ensure_ascii=False).encode(), mtime=0)
    write_atomically(path, lambda temporary: Path(temporary).write_bytes(packed))


def surroundings() -> dict[str, Any]:
    """The commit, the machine and the versions that results are of."""
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    facts = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").is_file() else ""
    model = re.search(r"model name\s*: (.*)", facts)
    return {
        "commit": commit.stdout.strip() or None,
        "machine": {
            "system": platform.platform(),
            "processor": model[1] if model else platform.processor(),
            "cores": os.cpu_count(),
            "memory_gb": round(memory, 1),
            "load": round(os.getloadavg()[0], 1),
        },
        "versions": {"python": platform.python_version(), **Report().versions},
    }


def machine() -> str:
    """A line that says where and what was measured."""
    facts = surroundings()
    it, versions = facts["machine"], ", ".join(f"{name} {version}" for name, version in facts["versions"].items())
    return (
        f"Measured on {it['processor']}, {it['cores']} cores, {it['memory_gb']} GB, load {it['load']}, {it['system']}; "
        f"{versions}; commit {facts['commit']}; one thread."
    )


def number(value: float | None, digits: int = 3) -> str:
    """A number as tables show it; a dash for None and NaN."""
    return "-" if value is None or np.isnan(value) else f"{value:.{digits}f}"


def short(value: float) -> str:
    """Three digits, but not more than two decimals."""
    return f"{value:.{0 if value >= 100 else 1 if value >= 10 else 2}f}"


def cells_of(rows: list[dict], names: list[str], cells: Callable[[dict], list[str]], count: int) -> list[list[str]]:
    """A line for each row: its `names`, so many cells, and a note; of a failure dashes, and its reason."""
    lines = []
    for row in rows:
        found = ["-"] * count if "failure" in row else cells(row)
        lines.append([*(str(row[name]) for name in names), *found, row.get("failure", "")])
    return lines


def present(tables: Tables, markdown: bool, where: str = "") -> None:
    """Print tables, and before them where they were measured; `TEXT` and first columns lean left, numbers right."""
    if where:
        typer.echo(f"{where}\n")
    console = Console(width=None if sys.stdout.isatty() else 180, markup=False, highlight=False, emoji=False)
    for title, header, rows in tables:
        if markdown:
            typer.echo(markdown_table(title, header, rows))
            continue
        table = rich_table.Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, header_style="")
        for place, name in enumerate(header):
            table.add_column(name, justify="right" if _is_number(place, name) else "left", no_wrap=name not in TEXT)
        for cells in rows:
            table.add_row(*cells)
        with console.capture() as captured:
            console.print(table)
        typer.echo("\n".join(line.rstrip() for line in captured.get().splitlines()))


def markdown_table(title: str, header: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    line = ["--:" if _is_number(place, name) else "---" for place, name in enumerate(header)]
    lines = ["| " + " | ".join(cells) + " |" for cells in (header, line, *rows)]
    return "\n".join([f"**{title}**", "", *lines, ""])


def _is_number(place, name):
    return place > 0 and name not in TEXT


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
    if not check:
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


def look(name: str) -> dict:
    """Colour and mark of a pipeline."""
    return LOOKS.get(name, dict(color=INK, marker="D"))


def sheet(height: float, rows: int = 1, columns: int = 1, width: float = WIDTH, **options):
    """A figure and its axes, without frames; sizes in inches, options as for ``Figure.subplots``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure((width, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, **options)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure, axes


def plain_log(axis) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, in plain numbers."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def keep(figure, folder: Path, name: str) -> None:
    """Write NAME.png into the folder."""
    save_figure(figure, folder / f"{name}.png")
