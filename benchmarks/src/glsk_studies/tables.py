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
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import typer
from rich.console import Console
from rich.markdown import Markdown

from glsk_o3d.data.report import Report
from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.viewing.figures import INK, save_figure

ROOT = Path(__file__).resolve().parents[3]
Table = tuple[str, list[str], list[list[str]]]  # title, header, lines
Tables = list[Table]
Columns = Mapping[str, str | Callable[[dict], Any]]  # by header: a fact of a row, or what makes a cell of it
# columns that are not numbers, besides the first
TEXT = {"pipeline", "setting", "takes", "note", "now right", "now wrong", "measure", "to", "why", "which", "failed"}
TEXT |= {"most in", "packages", "commit", "where", "interval without 0", "with 0"}
GREY, ORANGE, BLUE = "#777777", "#d95f02", "#1f4e9c"  # distinct without red and green, and in print
LOOKS = {"default": dict(color=BLUE, marker="o"), "wen2024": dict(color=ORANGE, marker="^")}
LOOKS |= {"cao2010": dict(color=GREY, marker="s")}
WIDTH = 5.0  # inches: narrow enough for a telephone


def pick(rows: list[dict], **facts) -> list[dict]:
    """The rows with these facts."""
    return [row for row in rows if all(row[name] == value for name, value in facts.items())]


def grouped(rows: list[dict], fact: str) -> dict[Any, list[dict]]:
    """The rows by a fact, in their order."""
    return {name: pick(rows, **{fact: name}) for name in dict.fromkeys(row[fact] for row in rows)}


def by_size(rows: list[dict]) -> dict[int, list[dict]]:
    """The rows by their number of points, small ones first."""
    return dict(sorted(grouped(rows, "n").items()))


def good(rows: list[dict]) -> list[dict]:
    """The rows that are no failures."""
    return [row for row in rows if "failure" not in row]


def failures(rows: list[dict]) -> str:
    """Which shapes failed, and how."""
    return "; ".join(f"{row['shape']}: {row['failure']}" for row in rows if "failure" in row)


def middle(rows: list[dict], fact: str | Callable[[dict], float]) -> float:
    """Median of a fact, or of a value, over the rows."""
    return float(np.median([row[fact] if isinstance(fact, str) else fact(row) for row in rows]))


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


@cache
def surroundings() -> dict[str, Any]:
    """The commit, the machine and the versions that results are of, as they are when this is first asked."""
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


def quartiles(values: np.ndarray, digits: int = 2) -> str:
    """Median and quartiles in words."""
    if len(values) == 0:
        return "-"
    low, median, high = (f"{value:.{digits}f}" for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return f"{median} ({low} to {high})"


def fixed(fact: str, digits: int = 2) -> Callable[[dict], str]:
    """A column of a fact with so many decimals."""
    return lambda row: number(row[fact], digits)


def brief(fact: str, factor: float = 1) -> Callable[[dict], str]:
    """A column of a fact times a factor, with three digits."""
    return lambda row: short(factor * row[fact])


def table(title: str, rows: list[dict], columns: Columns, note: bool = True) -> Table:
    """A line for each row, by default with the reason of its failure; a dash for what is not known of a row."""
    columns = {**columns, "note": lambda row: row.get("failure", "")} if note else columns

    def cell(row, column):
        try:
            return str(row[column] if isinstance(column, str) else column(row))
        except KeyError:  # a failure has few facts
            return "-"

    return title, [*columns], [[cell(row, column) for column in columns.values()] for row in rows]


def present(tables: Tables) -> None:
    """Print tables: drawn on a terminal, as Markdown into a file or a pipe."""
    text = markdown(tables)
    if sys.stdout.isatty():
        Console().print(Markdown(text))
    else:
        typer.echo(text)


def markdown(tables: Tables) -> str:
    """Tables in Markdown; `TEXT` and first columns lean left, numbers right."""
    parts = []
    for title, header, lines in tables:
        rule = ["--:" if place and name not in TEXT else "---" for place, name in enumerate(header)]
        parts += [f"**{title}**", "", *("| " + " | ".join(cells) + " |" for cells in (header, rule, *lines)), ""]
    return "\n".join(parts)


def fill(page: Path, parts: Mapping[str, Tables | str]) -> None:
    """Put tables, or texts, into a page between the lines ``<!-- NAME -->`` and ``<!-- end -->``."""
    text = page.read_text(encoding="utf-8")
    for name, body in parts.items():
        body = body if isinstance(body, str) else markdown(body)
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        text, found = re.subn(pattern, lambda match, body=body: f"{match[1]}\n{body}\n{match[2]}", text, flags=re.S)
        if found != 1:
            raise typer.BadParameter(f"{page} has no lines <!-- {name} --> and <!-- end -->")
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


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
