"""What every stage and the whole cost over the size of the cloud, and how they grow."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np
import typer

from glsk_o3d import Pipeline

from .clouds import cases
from .runs import PUBLISHED, run
from .stopwatch import MB, REST, SHARES, STAGES, Stopwatch, find, in_turns, peak, resident, yardstick
from .tables import (
    INK,
    Table,
    Tables,
    by_size,
    failures,
    good,
    grouped,
    keep,
    look,
    middle,
    number,
    plain_log,
    sheet,
    short,
)

MIDDLE = (4096, 65536)  # sizes of the second growth exponent
COUNTS = ("iterations", "contracted", "vertices")
GROWTH = f"growth {MIDDLE[0]} to {MIDDLE[1]}"


def timed(path: Path, pipeline: Pipeline, repeat: int) -> dict:
    """The yardstick and a pipeline in turns, on a saved cloud."""
    points = np.load(path)
    tasks = {"1 kNN": partial(yardstick, points), "pipeline": lambda: counts_of(pipeline(points))}
    found = in_turns(tasks, repeat, STAGES)
    counts, facts = found["pipeline"]
    return facts | counts | {f"knn_{clock}": found["1 kNN"][1][clock] for clock in ("cpu", "wall")}


def counts_of(skeleton) -> dict:
    """What a table says of a skeleton besides its costs."""
    report = skeleton.report
    counts = dict(contracted=report.n_contracted, iterations=len(report.iterations))
    return counts | dict(vertices=len(skeleton.vertices), loops=skeleton.n_loops)


def measure_stage(path: Path, pipeline: Pipeline, repeat: int) -> dict:
    """Costs on a saved cloud, and peaks in MB beyond the imports, the cloud included; to be run in a fresh process."""
    before = resident()
    points = np.load(path)
    with Stopwatch(STAGES, memory=True) as watch:
        pipeline(points)
    peaks = {name: (share.peak - before) / MB for name, share in watch.shares.items() if share.peak}
    most = max(peaks.values(), default=(peak() - before) / MB)
    return dict(peak=most, stage_peaks=peaks) | timed(path, pipeline, repeat)


def measure_stages(
    sizes: list[int], pipelines: dict[str, Pipeline], shapes: str, kind: str, published_to: int, repeat: int, jobs: int
) -> list[dict]:
    """Costs of every stage and of the whole: a row for each pipeline, size and shape, measured one after the other."""
    find(STAGES)  # now, not after an hour
    work, left_out = [], []
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(None, True, ",".join(f"{kind}_{n}" for n in sizes), shapes):
            path = Path(folder, f"{case.shape}_{case.size}.npy")
            np.save(path, case.load()[0])
            for name, pipeline in pipelines.items():
                if name in PUBLISHED and case.size > published_to:
                    left_out.append(f"{name} on {case.size} points")
                    continue
                facts = dict(measure="stages", n=case.size, shape=case.shape, kind=kind, pipeline=name)
                work.append((facts, (path, pipeline, repeat)))
        if left_out:
            typer.echo(f"left out: {', '.join(dict.fromkeys(left_out))}; see --published-to", err=True)
        return run(measure_stage, work, min(jobs, 1), fresh=True)


def growth(sizes: Iterable[int], seconds: Iterable[float], low: float = 0, high: float = np.inf) -> float:
    """Exponent b of a n^b, by least squares of the logarithms over the sizes from `low` to `high`; NaN for one size."""
    used = np.array([(n, s) for n, s in zip(sizes, seconds, strict=True) if low <= n <= high and s > 0])
    return float(np.polyfit(*np.log(used).T, 1)[0]) if len(used) > 1 else float("nan")


def stage_tables(rows: list[dict]) -> Tables:
    """The whole of every pipeline, then a table of stages for each."""
    tables = [whole_table(rows)]
    for name, mine in grouped(good(rows), "pipeline").items():
        tables.append((f"{name}: CPU ms (in kNN)", *stage_table(by_size(mine))))
    return tables


def whole_table(rows: list[dict]) -> Table:
    """A line for each pipeline and size: medians over the shapes, and what failed."""
    lines = []
    for name, mine in grouped(rows, "pipeline").items():
        for n, group in by_size(mine).items():
            cells, here = ["-"] * 8, good(group)
            if here:
                knn, cpu, wall = (1000 * middle(here, key) for key in ("knn_cpu", "cpu", "wall"))
                counts = [f"{middle(here, key):.0f}" for key in ("peak", *COUNTS)]
                cells = [short(knn), short(cpu), number(cpu / knn, 1), short(wall), *counts]
            lines.append([name, str(n), *cells, failures(group)])
    header = ["", "points", "1 kNN ms", "CPU ms", "in kNN", "wall ms", "MB", "solves", "contracted", "vertices", "note"]
    return "end to end", header, lines


def stage_table(at: dict[int, list[dict]]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of one pipeline: costs of the stages over the sizes, how they grow, memory at the largest."""
    largest, lines = max(at), []
    for name in ("1 kNN", *STAGES, REST, "whole"):
        seconds = costs(at, name)
        if not any(seconds) and name in STAGES:
            continue  # no such stage in this pipeline
        pairs = zip(seconds, costs(at, "1 kNN"), strict=True)
        cells = [f"{short(1000 * each)} ({number(each / knn, 2)})" for each, knn in pairs]
        slopes = [number(growth(at, seconds), 2), number(growth(at, seconds, *MIDDLE), 2)]
        peaks = [row["peak"] if name == "whole" else row["stage_peaks"].get(name, np.nan) for row in at[largest]]
        lines.append([name, *cells, *slopes, number(float(np.median(peaks)), 0)])
    return ["", *map(str, at), "growth", GROWTH, f"MB at {largest}"], lines


def costs(at: dict[int, list[dict]], name: str) -> list[float]:
    """CPU seconds of the yardstick, of a stage, or of the whole, for each size: the median over the shapes."""
    if name in ("1 kNN", "whole"):
        return [middle(here, "cpu" if name == "whole" else "knn_cpu") for here in at.values()]
    return [middle(here, lambda row: row["stages"][name]["cpu"]) for here in at.values()]


def draw_growth(rows: list[dict], folder: Path) -> None:
    """The whole of every pipeline over the size: CPU time, and in the yardstick, with the exponents that are fitted."""
    figure, (above, below) = sheet(6, rows=2, sharex=True)
    yardstick: dict[int, float] = {}
    for name, mine in grouped(good(rows), "pipeline").items():
        at = by_size(mine)
        knn, whole = np.array(costs(at, "1 kNN")), np.array(costs(at, "whole"))
        yardstick |= zip(at, 1000 * knn, strict=True)
        label = f"{name}, exponent {number(growth(at, whole, *MIDDLE), 2)}"
        above.plot([*at], 1000 * whole, markersize=5, label=label, **look(name))
        below.plot([*at], whole / knn, markersize=5, **look(name))
    style, sizes = dict(color=INK, linestyle=":", zorder=0), sorted(yardstick)
    milliseconds = [yardstick[n] for n in sizes]
    above.plot(sizes, milliseconds, label=f"1 kNN, exponent {number(growth(sizes, milliseconds, *MIDDLE), 2)}", **style)
    below.axhline(1, **style)
    above.set(ylabel="CPU ms", xscale="log", yscale="log")
    above.yaxis.set_major_formatter("{x:g}")
    below.set(ylabel="in kNN", xlabel="points", yscale="log")
    below.set_xticks(sizes, [thousands(n) for n in sizes])
    below.set_xticks([], minor=True)
    plain_log(below.yaxis)
    above.legend(frameon=False, fontsize=9)
    keep(figure, folder, "speed_growth")


def draw_shares(rows: list[dict], folder: Path) -> None:
    """What share of the time of `default` each part of it takes over the size, with the whole above."""
    at = by_size([row for row in good(rows) if row["pipeline"] == "default"])
    places = range(len(at))
    spent = {name: np.sum([costs(at, stage) for stage in stages], axis=0) for name, (stages, _) in SHARES.items()}
    figure, axes = sheet(4.2)
    base, total = np.zeros(len(at)), sum(spent.values())
    for name, (_, color) in SHARES.items():
        share = 100 * spent[name] / total
        axes.bar(places, share, bottom=base, label=name, color=color, edgecolor="white", linewidth=0.7)
        base = base + share
    for place, whole in zip(places, costs(at, "whole"), strict=True):
        words, style = short(1000 * whole), dict(textcoords="offset points", ha="center", fontsize=9)
        axes.annotate(words, (place, 100), (0, 3), **style)
    axes.set_title("CPU ms", fontsize=9, pad=18)
    axes.set_xticks(places, [thousands(n) for n in at])
    axes.set(xlabel="points", ylabel="share of the CPU time of default, %", ylim=(0, 100))
    axes.tick_params(axis="x", length=0)
    handles, labels = (each[::-1] for each in axes.get_legend_handles_labels())
    figure.legend(handles, labels, loc="outside right center", frameon=False, fontsize=9)
    keep(figure, folder, "speed_shares")


def draw_stages(rows: list[dict], folder: Path) -> None:
    """Both pictures; that of the shares where `default` is among the pipelines."""
    draw_growth(rows, folder)
    if any(row["pipeline"] == "default" for row in good(rows)):
        draw_shares(rows, folder)


def thousands(n: float) -> str:
    """A number of points in short: 256, 4k, 1M; k is 1024."""
    for unit, letter in ((2**20, "M"), (2**10, "k")):
        if n >= unit:
            return f"{n / unit:g}{letter}"
    return f"{n:g}"
