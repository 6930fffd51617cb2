"""What every stage and the whole cost over the size of the cloud, and how they grow."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
import typer

from glsk_o3d import Pipeline

from .clouds import cases
from .runs import PUBLISHED, run
from .stopwatch import MB, REST, SHARES, STAGES, Stopwatch, find, in_turns, peak, resident, yardstick
from .tables import INK, Tables, good, keep, look, number, pick, plain_log, sheet, short

MIDDLE = (4096, 65536)  # sizes of the second growth exponent
COUNTS = ("iterations", "contracted", "vertices")
GROWTH = f"growth {MIDDLE[0]} to {MIDDLE[1]}"


def timed(path: Path, pipelines: dict[str, Pipeline], repeat: int) -> dict:
    """The yardstick and the pipelines in turns, on a saved cloud."""
    points = np.load(path)
    tasks = {"1 kNN": partial(yardstick, points)}
    tasks |= {name: lambda pipeline=pipeline: counts_of(pipeline(points)) for name, pipeline in pipelines.items()}
    found = in_turns(tasks, repeat, STAGES)
    _, knn = found.pop("1 kNN")
    knn = {f"knn_{clock}": knn[clock] for clock in ("cpu", "wall")}
    return {name: facts | result | knn for name, (result, facts) in found.items()}


def counts_of(skeleton) -> dict:
    """What a table says of a skeleton besides its costs."""
    report = skeleton.report
    counts = dict(contracted=report.n_contracted, iterations=len(report.iterations))
    return counts | dict(vertices=len(skeleton.vertices), loops=skeleton.n_loops)


def most_memory(path: Path, pipeline: Pipeline) -> dict:
    """Peaks in MB beyond the imports, the cloud included; to be run in a fresh process."""
    before = resident()
    points = np.load(path)
    with Stopwatch(STAGES, memory=True) as watch:
        pipeline(points)
    peaks = {name: (share.peak - before) / MB for name, share in watch.shares.items() if share.peak}
    return dict(peak=max(peaks.values(), default=(peak() - before) / MB), stage_peaks=peaks)


def measure_stages(
    sizes: list[int], pipelines: dict[str, Pipeline], shapes: str, kind: str, published_to: int, repeat: int, jobs: int
) -> list[dict]:
    """Costs of every stage and of the whole: a row for each size, shape and pipeline."""
    find(STAGES)  # now, not after an hour

    def wanted(n):
        return {name: it for name, it in pipelines.items() if name not in PUBLISHED or n <= published_to}

    for n in sizes:
        if left := ", ".join(name for name in pipelines if name not in wanted(n)):
            typer.echo(f"left out: {left} on {n} points; see --published-to", err=True)
    found = cases(None, True, ",".join(f"{kind}_{n}" for n in sizes), shapes)
    with tempfile.TemporaryDirectory() as folder:
        alone, peaks = [], []
        for case in found:
            facts, path = dict(n=case.size, shape=case.shape, kind=kind), Path(folder, f"{case.shape}_{case.size}.npy")
            np.save(path, case.load()[0])
            chosen = wanted(case.size)
            alone += [(facts, (path, chosen, repeat))] if chosen else []
            peaks += [(facts | dict(pipeline=name), (path, it)) for name, it in chosen.items()]
        # Timings alone, one after the other; how much memory is used does not depend on what else runs.
        timings = run(timed, alone, min(jobs, 1), fresh=True)
        peaks = run(most_memory, peaks, jobs, fresh=True)
    rows = []
    for row in peaks:
        timing = pick(timings, n=row["n"], shape=row["shape"])[0]
        failed = {name: text for name, text in timing.items() if name == "failure"}
        rows.append(dict(measure="stages") | row | (failed or timing[row["pipeline"]]))
    return rows


def growth(sizes: Iterable[int], seconds: Iterable[float], low: float = 0, high: float = np.inf) -> float:
    """Exponent b of a n^b, by least squares of the logarithms over the sizes from `low` to `high`; NaN for one size."""
    used = np.array([(n, s) for n, s in zip(sizes, seconds, strict=True) if low <= n <= high and s > 0])
    return float(np.polyfit(*np.log(used).T, 1)[0]) if len(used) > 1 else float("nan")


def over(rows: list[dict], value: Callable[[dict], float]) -> float:
    """Median of a value over the rows, that is the shapes."""
    return float(np.median([value(row) for row in rows]))


def stage_tables(rows: list[dict]) -> Tables:
    """The whole of every pipeline, then a table of stages for each."""
    header = ["", "points", "1 kNN ms", "CPU ms", "in kNN", "wall ms", "MB", "solves", "contracted", "vertices", "note"]
    names = list(dict.fromkeys(row["pipeline"] for row in rows))
    lines, tables = [], []
    for name in names:
        mine = pick(rows, pipeline=name)
        sizes = sorted({row["n"] for row in good(mine)})
        at = {n: pick(good(mine), n=n) for n in sizes}
        for n in sorted({row["n"] for row in mine}):
            note = "; ".join(f"{row['shape']}: {row['failure']}" for row in pick(mine, n=n) if "failure" in row)
            if n not in at:
                lines.append([name, str(n), *"-" * 8, note])
                continue
            knn, cpu, wall = (1000 * over(at[n], lambda row, key=key: row[key]) for key in ("knn_cpu", "cpu", "wall"))
            counts = [f"{over(at[n], lambda row, key=key: row[key]):.0f}" for key in ("peak", *COUNTS)]
            cells = [short(knn), short(cpu), number(cpu / knn, 1), short(wall)]
            lines.append([name, str(n), *cells, *counts, note])
        if sizes:
            tables.append((f"{name}: CPU ms (in kNN)", *stage_table(at)))
    return [("end to end", header, lines), *tables]


def stage_table(at: dict[int, list[dict]]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of one pipeline: costs of the stages over the sizes, how they grow, memory at the largest."""
    largest = max(at)
    costs: dict[str, Callable[[dict], float]] = {"1 kNN": lambda row: row["knn_cpu"]}
    costs |= {name: lambda row, name=name: row["stages"][name]["cpu"] for name in (*STAGES, REST)}
    costs["whole"] = lambda row: row["cpu"]
    lines = []
    for name, cost in costs.items():
        seconds = [over(here, cost) for here in at.values()]
        if name in STAGES and not any(seconds):
            continue  # no such stage in this pipeline
        cells = [
            f"{short(1000 * spent)} ({number(spent / over(here, costs['1 kNN']), 2)})"
            for spent, here in zip(seconds, at.values(), strict=True)
        ]
        slopes = [number(growth(at, seconds), 2), number(growth(at, seconds, *MIDDLE), 2)]
        peaks = [row["peak"] if name == "whole" else row["stage_peaks"].get(name, np.nan) for row in at[largest]]
        lines.append([name, *cells, *slopes, number(float(np.median(peaks)), 0)])
    return ["", *map(str, at), "growth", GROWTH, f"MB at {largest}"], lines


def draw_growth(tables: Tables, folder: Path) -> None:
    """The whole of every pipeline over the size: CPU time, and in the yardstick, with the exponents that are fitted."""
    (_, header, lines), parts = tables[0], {title.partition(":")[0]: rest for title, *rest in tables[1:]}
    if not parts:
        return
    columns = [header.index(name) for name in ("points", "1 kNN ms", "CPU ms", "in kNN")]
    figure, (above, below) = sheet(6, rows=2, sharex=True)
    yardstick: dict[float, float] = {}
    for name, (head, stages) in parts.items():
        known = [[line[i] for i in columns] for line in lines if line[0] == name and line[columns[2]] != "-"]
        n, knn, cpu, ratio = np.array(known, float).T
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
    keep(figure, folder, "speed_growth")


def draw_shares(tables: Tables, folder: Path) -> None:
    """What share of the time of `default` each part of it takes over the size, with the whole above."""
    parts = [rest for title, *rest in tables if title.startswith("default:")]
    if not parts:
        return
    header, lines = parts[0]
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
    keep(figure, folder, "speed_shares")


def thousands(n: float) -> str:
    """A number of points in short: 256, 4k, 1M; k is 1024."""
    for unit, letter in ((2**20, "M"), (2**10, "k")):
        if n >= unit:
            return f"{n / unit:g}{letter}"
    return f"{n:g}"
