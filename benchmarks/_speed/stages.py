"""What every stage and the whole cost over the size of the cloud, and how they grow."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
import typer
from _common.clouds import cases
from _common.command_line import PUBLISHED
from _common.results import pick
from _common.runs import run
from _common.tables import Tables, number, short

from glsk_o3d import Pipeline

from .stopwatch import MB, REST, Stopwatch, find, peak, resident
from .table_of_stages import STAGES
from .timing import in_turns, yardstick

MIDDLE = (4096, 65536)  # sizes of the second growth exponent
COUNTS = ("iterations", "contracted", "vertices")
GROWTH = f"growth {MIDDLE[0]} to {MIDDLE[1]}"


def timed(path: Path, pipelines: dict[str, Pipeline], repeat: int) -> dict:
    """The yardstick and the pipelines in turns, on a saved cloud."""
    points = np.load(path)
    tasks = {"1 kNN": partial(yardstick, points)}
    tasks |= {name: lambda pipeline=pipeline: told(pipeline(points)) for name, pipeline in pipelines.items()}
    found = in_turns(tasks, repeat, STAGES)
    _, knn = found.pop("1 kNN")
    knn = {f"knn_{clock}": knn[clock] for clock in ("cpu", "wall")}
    return {name: facts | result | knn for name, (result, facts) in found.items()}


def told(skeleton) -> dict:
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
        places = []
        for case in found:
            points, _ = case.load()
            n = case.size
            places.append((dict(n=n, shape=case.shape, kind=kind), Path(folder, f"{case.shape}_{n}.npy")))
            np.save(places[-1][1], points)
        # Timings alone, one after the other; how much memory is used does not depend on what else runs.
        each = [(facts, (path, wanted(facts["n"]), repeat)) for facts, path in places if wanted(facts["n"])]
        timings = run(timed, each, min(jobs, 1), fresh=True)
        each = [
            (facts | dict(pipeline=name), (path, it))
            for facts, path in places
            for name, it in wanted(facts["n"]).items()
        ]
        peaks = run(most_memory, each, jobs, fresh=True)
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
        good = [row for row in mine if "failure" not in row]
        sizes = sorted({row["n"] for row in good})
        at = {n: pick(good, n=n) for n in sizes}
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
