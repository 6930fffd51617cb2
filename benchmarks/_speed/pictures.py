"""The pictures of stages and of figures."""

from __future__ import annotations

import re
from pathlib import Path
from statistics import median

import numpy as np
from _common.plots import INK, keep, look, plain_log, sheet
from _common.results import pick
from _common.tables import Tables, short

from .figures import BASELINE, shown, take
from .stages import GROWTH
from .table_of_stages import SHARES


def draw_stages(tables: Tables, folder: Path) -> None:
    """Both pictures, as far as there is something to show."""
    whole, parts = tables[0], {title.partition(":")[0]: (header, lines) for title, header, lines in tables[1:]}
    if parts:
        draw_growth(whole, parts, folder)
    if "default" in parts:
        draw_shares(*parts["default"], folder)


def draw_growth(whole, parts: dict, folder: Path) -> Path:
    """The whole of every pipeline over the size: CPU time, and in the yardstick, with the exponents that are fitted."""
    _, header, lines = whole
    columns = [header.index(name) for name in ("points", "1 kNN ms", "CPU ms", "in kNN")]
    figure, (above, below) = sheet(6, rows=2, sharex=True)
    yardstick: dict[float, float] = {}
    for name, (head, stages) in parts.items():
        good = [[line[i] for i in columns] for line in lines if line[0] == name and line[columns[2]] != "-"]
        n, knn, cpu, ratio = np.array(good, float).T
        yardstick |= zip(n, knn, strict=True)
        knn_slope, slope = (stages[place][head.index(GROWTH)] for place in (0, -1))
        above.plot(n, cpu, markersize=5, label=f"{name}, exponent {slope}", **look(name))
        below.plot(n, ratio, markersize=5, **look(name))
    style, sizes = dict(color=INK, linestyle=":", zorder=0), sorted(yardstick)
    above.plot(sizes, [yardstick[n] for n in sizes], label=f"1 kNN, exponent {knn_slope}", **style)
    below.axhline(1, **style)
    above.set(ylabel="CPU ms", xscale="log", yscale="log")
    above.yaxis.set_major_formatter("{x:g}")
    below.set(ylabel="in kNN", xlabel="points", yscale="log")
    below.set_xticks(sizes, [thousands(n) for n in sizes])
    below.set_xticks([], minor=True)
    plain_log(below.yaxis)
    above.legend(frameon=False, fontsize=9)
    return keep(figure, folder, "speed_growth")


def draw_shares(header: list[str], lines: list[list[str]], folder: Path) -> Path:
    """What share of the time of `default` each part of it takes over the size, with the whole above."""
    sizes = [int(name) for name in header if name.isdecimal()]
    cost = {line[0]: np.array([cell.split()[0] for cell in line[1 : 1 + len(sizes)]], float) for line in lines}
    spent = {
        name: sum(cost.get(stage, np.zeros(len(sizes))) for stage in stages) for name, (stages, _) in SHARES.items()
    }
    figure, axes = sheet(4.2)
    base, total = np.zeros(len(sizes)), sum(spent.values())
    for name, (_, color) in SHARES.items():
        share, style = 100 * spent[name] / total, dict(color=color, edgecolor="white", linewidth=0.7)
        axes.bar(range(len(sizes)), share, bottom=base, label=name, **style)
        base = base + share
    for place, whole in enumerate(cost["whole"]):
        axes.annotate(short(whole), (place, 100), (0, 3), textcoords="offset points", ha="center", fontsize=9)
    axes.set_title("CPU ms", fontsize=9, pad=18)
    axes.set_xticks(range(len(sizes)), [thousands(n) for n in sizes])
    axes.set(xlabel="points", ylabel="share of the CPU time of default, %", ylim=(0, 100))
    axes.tick_params(axis="x", length=0)
    handles, labels = (each[::-1] for each in axes.get_legend_handles_labels())
    figure.legend(handles, labels, loc="outside right center", frameon=False, fontsize=9)
    return keep(figure, folder, "speed_shares")


def thousands(n: float) -> str:
    """A number of points in short: 256, 4k, 1M; k is 1024."""
    for unit, letter in ((2**20, "M"), (2**10, "k")):
        if n >= unit:
            return f"{n / unit:g}{letter}"
    return f"{n:g}"


def draw_figures(rows: list[dict], folder: Path) -> list[Path]:
    """A picture for each size: cost and remaining points of every cloud, in the order of what the baseline costs."""
    good = [row for row in rows if "failure" not in row]
    paths = []
    for n in sorted({row["n"] for row in good}):
        here = sorted(pick(good, n=n), key=lambda row: take(row, BASELINE)["cpu"])
        figure, (above, below) = sheet(5.5, rows=2, width=max(6, 2.5 + 0.16 * len(here)), sharex=True)
        for name, key in shown().items():
            runs, style = [take(row, key) for row in here], look(name)
            for axes, values in ((above, [it["cpu"] for it in runs]), (below, [it["left"] for it in runs])):
                axes.plot(values, linestyle="", markersize=4, label=name, **style)
                axes.axhline(median(values), color=style["color"], linewidth=0.8, zorder=0)
        above.set(ylabel="contraction, CPU s", ylim=(0, None), title=f"{n} points; lines are medians")
        below.set(ylabel="points left", ylim=(0, None))
        below.set_xticks(range(len(here)), [row["shape"] for row in here], rotation=90, fontsize=7)
        above.legend(frameon=False, ncols=3, fontsize=8)
        paths.append(keep(figure, folder, f"contraction_{n}"))
    return paths


def tables_of(page: Path, part: str) -> Tables:
    """The tables that `fill` has put into a page."""
    (body,) = re.findall(rf"<!-- {part} -->\n(.*?)<!-- end -->", page.read_text(encoding="utf-8"), re.S)
    tables = []
    for title, block in re.findall(r"\*\*(.*?)\*\*\n\n((?:\|.*\n)+)", body):
        header, _, *lines = ([cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines())
        tables.append((title, header, lines))
    return tables
