"""How fast skeletons are, where the time goes, and how both grow with the cloud.

python benchmarks/speed.py all --builtin

The README beside this file says what each command shows.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer
from _common import (
    BUILTIN,
    Case,
    Folder,
    Jobs,
    Markdown,
    Output,
    Own,
    Pipelines,
    Shapes,
    Tables,
    builtin,
    cases,
    fill,
    folder_or,
    machine,
    markdown_table,
    named,
    number,
    page_with,
    pick,
    run,
    save,
    show,
    with_solves,
)
from _plots import INK, keep, look, plain_log, sheet
from _stopwatch import MB, REST, Stage, Stopwatch, find, peak, reset_peak, resident
from scipy.spatial import cKDTree

from glsk_o3d import Contractor, Pipeline, Skeleton, read_cloud, read_skeleton
from glsk_o3d.analysis.curves import distances
from glsk_o3d.cli.overrides import override
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.interop.packages import import_open3d
from glsk_o3d.numerics.cores import cores
from glsk_o3d.pipelines import default, wen2024
from glsk_o3d.report import REFUSED

STAGES = {
    "order": Stage(("numerics.morton:morton_order",)),
    "kNN": Stage(("numerics.neighbourhoods:nearest_neighbours", "numerics.neighbourhoods:nearest_left")),
    "outliers, noise": Stage(
        (
            "preparation.outliers:without_outliers",
            "preparation.denoising:noise_share",
            "preparation.thinning:average_noisy",
            "preparation.denoising:to_ridges",
        )
    ),
    "planes": Stage(("numerics.neighbourhoods:principal",)),
    "thinning": Stage(
        ("preparation.thinning:thin", "preparation.thinning:thin_smooth", "preparation.sampling:thin_to_grid")
    ),
    "rings": Stage(("numerics.rings:star_rings",)),
    "rest of the rings": Stage(("ring_builder:RingBuilder._run",), open=True),
    "Laplacian": Stage(("numerics.cotangent:cotangent_laplacian",)),
    "lines": Stage(("contractor:linearity",)),
    "normal matrix": Stage(("numerics.solver:solve_contraction",), open=True),
    "factorisation": Stage(("numerics.solver:factorised",)),
    "refinement of the solve": Stage((), open=True, after=("normal matrix", "factorisation")),
    "LPR": Stage(("lpr_reducer:LPRReducer._run",)),
    "rest of the contraction": Stage(("contractor:Contractor._run",), open=True),
    "sampling": Stage(("connector:local_thickness", "numerics.farthest_point:farthest_point_sampling")),
    "connection": Stage(("connector:Connector._run",), open=True),
    "refinement of the graph": Stage(("refiner:Refiner._run",)),
}
"""The stages in the order of the tables, and the functions that do their work; to be mended as the package changes."""

SHARES = {
    "neighbours": (("order", "kNN"), "#1f4e9c"),
    "thinning": (("thinning",), "#5b8bd0"),
    "rings, rest": (("outliers, noise", "planes", "rings", "rest of the rings"), "#b3cdee"),
    "solves": (("normal matrix", "factorisation", "refinement of the solve"), "#d95f02"),
    "contraction, rest": (("Laplacian", "lines", "rest of the contraction"), "#fbb676"),
    "point reduction": (("LPR",), "#fde4c8"),
    "connection": (("sampling", "connection"), "#bbbbbb"),
    "refinement": (("refinement of the graph",), "#777777"),
    "rest": ((REST,), "#333333"),
}
"""The stages in groups that a picture can show, in the order of the work, and their colours: one for each filter."""
PUBLISHED = ("wen2024", "cao2010")
NEIGHBOURS = 30  # of the yardstick
STEP = 0.001  # between the places of a curve at which `large` measures it, as a share of the diagonal
LEAST, MOST = 2.0, 50  # seconds that runs in turns go on for, however few were asked for, and turns at most
MIDDLE = (4096, 65536)  # sizes of the second growth exponent
GROWTH = f"growth {MIDDLE[0]} to {MIDDLE[1]}"
BASES: dict[str, Callable[[], Pipeline]] = {"wen2024": wen2024, "default": default}
WHOLE = ("cao2010", "wen2024", "default")
BASELINE = ("wen2024", False, "rings")  # the contraction of cao2010
RULES: dict[str, list[str]] = {
    "own": [],
    "rings": ["Contractor.stop=RingSizeRatio", "Contractor.max_iterations=20"],
}
"""Stop rules by the settings that give them, besides a fixed number of solves: the pipeline's own, that of cao2010."""
CLAIMS = {1024: "about 1", 4096: "about 0.5", 16384: "less still"}
"""What Wen et al. 2024 find for the cost of their contraction over that of the baseline, figures 4 to 6."""

app = typer.Typer(
    help=__doc__, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False
)
PARTS = ("machine", "stages", "figures", "rate")  # of the page that `all` fills


def numbers(text: str) -> list[int]:
    """Numbers with commas."""
    if not re.fullmatch(r"\d+(,\d+)*", text):
        raise typer.BadParameter(f"{text}: give numbers with commas, such as 1024,4096")
    return [int(word) for word in text.split(",")]


def points_of(case: Case) -> int:
    """The size that its variant names."""
    return int(case.variant.partition("_")[2])


# ----------------------------------------------------------------------------------------------------------- in turns


def in_turns(tasks: dict, repeat: int, stages: Mapping[str, Stage] | None = None) -> dict[Any, tuple[Any, dict]]:
    """Run tasks one after the other, again and again, so that what disturbs the machine disturbs them all.

    Parameters
    ----------
    tasks : dict of callables
    repeat : int
        Runs of each, at least; it goes on for `LEAST` seconds of CPU time.
    stages : mapping of str to Stage, optional

    Returns
    -------
    dict of (object, dict)
        For each task what its last run gave, and medians over the runs: ``cpu`` and ``wall`` seconds, and the same for
        every stage in ``stages``.
    """
    watches, results = {name: [] for name in tasks}, {}
    end = time.process_time() + LEAST
    turns = 0
    while turns < repeat or (turns < MOST and time.process_time() < end):
        for name, task in tasks.items():
            with Stopwatch(stages or {}) as watch:
                results[name] = task()
            watches[name].append(watch)
        turns += 1
    found = {}
    for name, taken in watches.items():
        facts = {clock: median(getattr(watch, clock) for watch in taken) for clock in ("cpu", "wall")}
        parts = {
            stage: {clock: median(getattr(watch.shares[stage], clock) for watch in taken) for clock in ("cpu", "wall")}
            for stage in taken[0].shares
        }
        found[name] = results[name], dict(facts, runs=turns, stages=parts)
    return found


def yardstick(points) -> None:
    """1 kNN."""
    cKDTree(points).query(points, NEIGHBOURS)


# ------------------------------------------------------------------------------------------------------------- stages


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
            n = points_of(case)
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


COUNTS = ("iterations", "contracted", "vertices")


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


def short(value: float) -> str:
    """Three digits, but not more than two decimals."""
    return f"{value:.{0 if value >= 100 else 1 if value >= 10 else 2}f}"


# ------------------------------------------------------------------------------------------------------------ figures


@dataclass(frozen=True)
class Scan:
    """A cloud in a file, or so many of its points drawn at random."""

    shape: str
    path: Path
    n: int

    def load(self) -> tuple[np.ndarray, None]:
        """The points, and no axis."""
        points = cloud_points(read_cloud(self.path))
        return np.random.default_rng(1).choice(points, self.n, replace=False), None


def objects(folder: Path | None, own: bool, shapes: str, sizes: list[int]) -> list[tuple[int, Case | Scan]]:
    """The shapes with known axes in all sizes, built-in ones in sizes that the folder does not have; and, where there
    is a folder of scans and nothing narrower is asked for, those that are large enough.
    """
    clean = ",".join(f"clean_{n}" for n in sizes)
    found: list[tuple[int, Case | Scan]] = [(points_of(case), case) for case in cases(folder, own, clean, shapes)]
    if own or shapes:
        return found
    if missing := [n for n in sizes if n not in dict(found)]:
        typer.echo(f"the built-in shapes instead for {', '.join(map(str, missing))} points", err=True)
        found += objects(None, True, "", missing)
    try:
        folder = folder_or(None, "GLSK_DATA", "shared/data")
    except typer.BadParameter as problem:
        typer.echo(f"left out: scans, {problem}", err=True)
        return found
    listed = json.loads((folder / "manifest.json").read_text())
    for n in sizes:
        large = [it for it in listed if it["n_points"] >= n]
        if len(large) < len(listed):
            typer.echo(f"left out: {len(listed) - len(large)} clouds of less than {n} points", err=True)
        found += [(n, Scan(it["name"], folder / it["path"], n)) for it in large]
    return found


def contractors(solves: int) -> dict[tuple[str, bool, str], tuple[Pipeline, Contractor]]:
    """Contractions to compare: by (pipeline, whether it reduces, stop rule) the stages ahead, and the contractor."""
    found = {}
    for base, make in BASES.items():
        for reduces in (True, False):
            pipeline = make() if reduces else override(make(), ["Contractor.reducer=none"])
            stops = {rule: override(pipeline, settings) for rule, settings in RULES.items()}
            stops["fixed"] = with_solves(pipeline, solves)
            for rule, changed in stops.items():
                ahead = [isinstance(stage, Contractor) for stage in changed.stages].index(True)
                found[base, reduces, rule] = Pipeline(*changed.stages[:ahead]), changed.stages[ahead]
    return found


def contraction(cloud: Case | Scan, solves: int, repeat: int) -> dict:
    """What all the contractions of a cloud cost, and leave of it; and the whole of the pipelines, in kNN."""
    points, _ = cloud.load()
    tasks, states = {}, {}
    for key, (rings, contractor) in contractors(solves).items():
        if key[0] not in states:
            states[key[0]] = rings(points)
        tasks[key] = partial(contractor, states[key[0]])
    tasks |= {name: partial(pipeline, points) for name, pipeline in named(",".join(WHOLE)).items()}
    tasks["1 kNN"] = partial(yardstick, points)
    found = in_turns(tasks, repeat)
    _, knn = found.pop("1 kNN")
    whole = {name: found.pop(name)[1]["cpu"] / knn["cpu"] for name in WHOLE}
    runs = []
    for key, (state, facts) in found.items():
        report = state.report
        counts = dict(left=len(state), contracted=report.n_contracted, solves=len(report.iterations))
        refused = REFUSED in report.stop_reason
        runs.append(dict(key=list(key), cpu=facts["cpu"], wall=facts["wall"], refused=refused) | counts)
    return dict(runs=runs, whole=whole)


def measure_figures(found: list[tuple[int, Case | Scan]], solves: int, repeat: int, jobs: int) -> list[dict]:
    """A row for each cloud and size, the larger sizes first."""
    found = sorted(found, key=lambda item: -item[0])
    work = [
        (dict(measure="figures", n=n, shape=cloud.shape, fixed=solves), (cloud, solves, repeat)) for n, cloud in found
    ]
    return run(contraction, work, jobs)


def take(row: dict, key: tuple) -> dict:
    """The run of a row that has this key."""
    return pick(row["runs"], key=list(key))[0]


def ratios(rows: list[dict], over: tuple, under: tuple) -> np.ndarray:
    """CPU of one contraction over that of another, paired; with a fixed number of solves where both reached it."""
    pairs = [(take(row, over), take(row, under), row["fixed"]) for row in rows]
    if "fixed" in over:
        pairs = [
            (a, b, n) for a, b, n in pairs if a["solves"] == b["solves"] == n and not (a["refused"] or b["refused"])
        ]
    return np.array([a["cpu"] / b["cpu"] for a, b, _ in pairs])


def quartiles(values: np.ndarray, digits: int = 2) -> str:
    """Median and quartiles in words."""
    if len(values) == 0:
        return "-"
    low, middle, high = (f"{value:.{digits}f}" for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return f"{middle} ({low} to {high})"


def figure_tables(rows: list[dict]) -> Tables:
    """For each pipeline the ratio to the baseline and what it is made of; then what is left of the clouds."""
    good = [row for row in rows if "failure" not in row]
    at = {n: pick(good, n=n) for n in sorted({row["n"] for row in good})}
    solves = rows[0]["fixed"]
    header = ["points", "clouds", "against cao2010", "paper", f"LPR, {solves} solves", "of these"]
    header += ["LPR, own rule", "LPR, ring sizes", "own rule, no LPR", "own rule, LPR"]
    tables: Tables = []
    for base in BASES:
        lines = []
        for n, here in at.items():
            fixed = ratios(here, (base, True, "fixed"), (base, False, "fixed"))
            lpr = [quartiles(ratios(here, (base, True, rule), (base, False, rule))) for rule in RULES]
            rule = [quartiles(ratios(here, (base, lpr, "own"), (base, lpr, "rings"))) for lpr in (False, True)]
            whole = quartiles(ratios(here, (base, True, "own"), BASELINE))
            claim = CLAIMS.get(n, "-") if base == "wen2024" else ""
            lines.append([str(n), str(len(here)), whole, claim, quartiles(fixed), str(len(fixed)), *lpr, *rule])
        tables.append((f"{base}: CPU ratios of the contraction, median (quartiles)", header, lines))
    lines = []
    for n, here in at.items():
        for name, key in shown().items():
            runs = [take(row, key) for row in here]
            left, spent, made = (np.array([it[what] for it in runs], float) for what in ("left", "cpu", "solves"))
            refused = str(sum(it["refused"] for it in runs))
            cells = [quartiles(left / n), quartiles(1000 * spent, 0), quartiles(made, 0), refused]
            lines.append([name, str(n), *cells])
    header = ["", "points", "share left", "CPU ms", "solves", "refused"]
    tables.append(("the contraction, median (quartiles)", header, lines))
    lines = []
    for n, here in at.items():
        for name in WHOLE:
            values = np.array([row["whole"][name] for row in here])
            lines.append([name, str(n), quartiles(values, 1), f"{values.mean():.1f}", f"{values.max():.1f}"])
    tables.append(("end to end, in kNN", ["", "points", "median (quartiles)", "mean", "most"], lines))
    if failed := [row for row in rows if "failure" in row]:
        words = [[str(row["n"]), row["shape"], row["failure"]] for row in failed]
        tables.append(("failures", ["points", "cloud", "note"], words))
    return tables


def shown() -> dict[str, tuple[str, bool, str]]:
    """The named pipelines among the contractions."""
    return {"cao2010": BASELINE} | {base: (base, True, "own") for base in BASES}


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


# --------------------------------------------------------------------------------------------------------------- rate

COLD = """
import json, sys, time
start = time.perf_counter(), time.process_time()
from glsk_o3d import skeletonize
imported = time.perf_counter(), time.process_time()
import numpy
points = numpy.load(sys.argv[1])
begun = time.perf_counter(), time.process_time()
skeletonize(points, sys.argv[2])
done = time.perf_counter(), time.process_time()
spent = dict(import_wall=imported[0] - start[0], import_cpu=imported[1] - start[1])
print(json.dumps(dict(spent, first_wall=done[0] - begun[0], first_cpu=done[1] - begun[1])))
"""
"""A fresh process: what the import and the first call take."""


def cold(path: Path, pipeline: str, repeat: int) -> dict[str, float]:
    """Medians over fresh processes."""
    found = []
    for _ in range(repeat):
        start = time.perf_counter()
        words = [sys.executable, "-W", "ignore", "-c", COLD, str(path), pipeline]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr.strip().splitlines()[-1])
        found.append(json.loads(done.stdout) | dict(process_wall=time.perf_counter() - start))
    return {name: median(each[name] for each in found) for name in found[0]}


def first_and_next(path: Path, pipeline: str, repeat: int, threads: int) -> dict:
    """Cold and warm, one after the other."""
    with patch.dict(os.environ, OMP_NUM_THREADS=str(threads)):  # the package asks at every call
        return cold(path, pipeline, repeat) | timed(path, named(pipeline), repeat)[pipeline]


def measure_rate(sizes: list[int], pipelines: list[str], shape: str, repeat: int, jobs: int) -> list[dict]:
    """A row for each size and pipeline, in one thread and in one for each core."""
    named(",".join(pipelines))
    with tempfile.TemporaryDirectory() as folder:
        work = []
        for n in sizes:
            path = Path(folder, f"{n}.npy")
            np.save(path, builtin(shape, f"clean_{n}")[0])
            facts = dict(measure="rate", n=n, shape=shape)
            for name, threads in product(pipelines, sorted({1, cores()})):
                work.append((facts | dict(pipeline=name, threads=threads), (path, name, repeat, threads)))
        return run(first_and_next, work, min(jobs, 1))


def rate_tables(rows: list[dict]) -> Tables:
    """Cold and warm."""
    header = ["", "points", "threads", "1 kNN ms", "import ms", "first call ms", "process ms"]
    header += ["next call ms", "CPU ms", "per second", "first process per second", "note"]
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["pipeline"], str(row["n"]), str(row["threads"]), *"-" * 8, row["failure"]])
            continue
        keys = ("knn_wall", "import_wall", "first_wall", "process_wall", "wall", "cpu")
        rates = [number(1 / row[key], 1) for key in ("wall", "process_wall")]
        times = (short(1000 * row[key]) for key in keys)
        lines.append([row["pipeline"], str(row["n"]), str(row["threads"]), *times, *rates, ""])
    return [("skeletons per second, wall time", header, lines)]


# -------------------------------------------------------------------------------------------------------------- large

COMMAND = """
import json, resource, sys
told, benchmarks, *words = sys.argv[1:]
sys.path.insert(0, benchmarks)
from _stopwatch import MB, peak
from glsk_o3d.cli.main import app
app(words, standalone_mode=False)
used = resource.getrusage(resource.RUSAGE_SELF)
with open(told, "w") as file:
    json.dump(dict(file_cpu=used.ru_utime + used.ru_stime, file_peak=peak() / MB), file)
"""
"""The whole command ``glsk``, imports and all, and what it took."""


def from_file_to_file(cloud: Path) -> dict[str, float]:
    """CPU and wall seconds of ``glsk skeletonize``, and the most memory in MB, all of the process."""
    told, skeleton = cloud.with_name("told.json"), cloud.with_name("skeleton.ply")
    words = [sys.executable, "-W", "ignore", "-c", COMMAND, told, Path(__file__).parent, "skeletonize", cloud]
    start = time.perf_counter()
    done = subprocess.run([*map(str, words), "-o", str(skeleton)], capture_output=True, text=True)
    wall = time.perf_counter() - start
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return json.loads(told.read_text()) | dict(file_wall=wall)


def once(path: Path, file: bool) -> dict:
    """One run of `default` on a saved cloud, to be made in a fresh process; its curve is saved beside the cloud."""
    reset_peak()
    before = resident()
    points = np.load(path)
    start = time.process_time(), time.perf_counter()
    skeleton = default()(points)
    spent = dict(cpu=time.process_time() - start[0], wall=time.perf_counter() - start[1])
    facts = spent | dict(peak=(peak() - before) / MB, sampled=skeleton.report.n_sampled) | told(skeleton)
    facts["diagonal"] = float(np.linalg.norm(np.ptp(points, axis=0)))
    curve = Skeleton(skeleton.vertices, skeleton.edges, skeleton.radii, (), (), ())
    curve.save(path.with_suffix(".json"))
    return facts | (from_file_to_file(path.with_suffix(".ply")) if file else {})


def apart(curve: Skeleton, other: Skeleton, diagonal: float) -> tuple[float, float]:
    """Mean, over both ways, and largest distance of two curves, in percent of the diagonal."""
    ways = [distances(*pair, STEP * diagonal)[0] for pair in ((curve, other), (other, curve))]
    mean, most = np.mean([way.mean() for way in ways]), max(way.max() for way in ways)
    return float(100 * mean / diagonal), float(100 * most / diagonal)


def measure_large(sizes: list[int], shapes: str, file: bool, jobs: int) -> list[dict]:
    """A row for each shape and size, and how far its skeleton is from that of the smallest size."""
    sizes, rows = sorted(sizes), []
    found = cases(None, True, ",".join(f"clean_{n}" for n in sizes), shapes)
    for shape in dict.fromkeys(case.shape for case in found):
        with tempfile.TemporaryDirectory() as folder:
            paths = {n: Path(folder, f"{n}.npy") for n in sizes}
            for n, path in paths.items():
                save_cloud(path, builtin(shape, f"clean_{n}")[0], file)
            work = [(dict(measure="large", n=n, shape=shape), (path, file)) for n, path in paths.items()]
            here = run(once, work, min(jobs, 1), fresh=True)
            base = here[0]
            for row in here[1:]:
                if "failure" not in row and "failure" not in base:
                    curve, other = (read_skeleton(paths[it["n"]].with_suffix(".json")) for it in (row, base))
                    mean, most = apart(curve, other, base["diagonal"])
                    row |= dict(base=base["n"], mean=mean, most=most, same_loops=row["loops"] == base["loops"])
        rows += here
    return rows


def save_cloud(path: Path, points: np.ndarray, file: bool) -> None:
    """As an array, and where asked for as PLY beside it."""
    np.save(path, points)
    if file:
        o3d = import_open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        if not o3d.io.write_point_cloud(str(path.with_suffix(".ply")), cloud):
            raise OSError(f"{path.with_suffix('.ply')} could not be written: is the disk full?")


def large_tables(rows: list[dict]) -> Tables:
    """A line for each shape and size."""
    files = any("file_cpu" in row for row in rows)
    header = ["", "points", "CPU s", "MB", "sampled", "contracted", "vertices", "mean %", "largest %", "loops", "same"]
    header += ["file CPU s", "file wall s", "file MB"] if files else []
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["shape"], str(row["n"]), *"-" * (len(header) - 2), row["failure"]])
            continue
        counts = [str(row[key]) for key in ("sampled", "contracted", "vertices")]
        away = [number(row.get(key), 2) for key in ("mean", "most")]
        same = {True: "yes", False: "no", None: "-"}[row.get("same_loops")]
        cells = [short(row["cpu"]), number(row["peak"], 0), *counts, *away, str(row["loops"]), same]
        if files:
            cells += [short(row["file_cpu"]), short(row["file_wall"]), number(row["file_peak"], 0)]
        lines.append([row["shape"], str(row["n"]), *cells, ""])
    return [(f"default, against {min(row['n'] for row in rows)} points", [*header, "note"], lines)]


# ----------------------------------------------------------------------------------------------------------- commands


def present(where: str, parts: dict[str, Tables], markdown: bool) -> None:
    """Print where it was measured, and the tables of the parts."""
    typer.echo(f"{where}\n")
    for table in (table for tables in parts.values() for table in tables):
        show(*table, markdown)


def _folder(path: Path | None) -> Path | None:
    if path is not None:
        path.mkdir(parents=True, exist_ok=True)
    return path


Sizes = Annotated[str, typer.Option("--sizes", metavar="NUMBERS", help="Points, with commas.")]
Kind = Annotated[str, typer.Option("--kind", metavar="KIND", help="clean, noise1, ...; see the README.")]
PublishedTo = Annotated[int, typer.Option("--published-to", help="wen2024 and cao2010 only up to so many points.")]
Repeat = Annotated[int, typer.Option("--repeat", min=1, help="Runs of which medians are taken, at least.")]
Solves = Annotated[int, typer.Option("--solves", min=1, max=10, help="Where the number of solves is fixed.")]
Pictures = Annotated[
    Path | None, typer.Option("--pictures", metavar="DIR", help="Also draw them, as PNG.", callback=_folder)
]
ALL_SIZES, FIGURE_SIZES, ALL_PIPELINES = "1024,4096,16384,65536", "1024,4096,16384", "default,wen2024,cao2010"


@app.command()
def stages(
    sizes: Sizes = ALL_SIZES,
    pipeline: Pipelines = ALL_PIPELINES,
    published_to: PublishedTo = 65536,
    shapes: Shapes = "sauropod",
    kind: Kind = "clean",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """What every stage and the whole cost over the size of the cloud, and how they grow."""
    rows = measure_stages(numbers(sizes), named(pipeline), shapes, kind, published_to, repeat, jobs)
    save(output, rows)
    tables = stage_tables(rows)
    if pictures is not None:
        draw_stages(tables, pictures)
    present(machine(), {"stages": tables}, markdown)


@app.command()
def figures(
    folder: Folder = None,
    own: Own = False,
    sizes: Sizes = FIGURE_SIZES,
    shapes: Shapes = "",
    solves: Solves = 4,
    repeat: Repeat = 1,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """The contraction against the baseline (figures 4 to 6 of Wen et al. 2024), and what the difference is made of."""
    rows = measure_figures(objects(folder, own, shapes, numbers(sizes)), solves, repeat, jobs)
    save(output, rows)
    if pictures is not None:
        draw_figures(rows, pictures)
    present(machine(), {"figures": figure_tables(rows)}, markdown)


@app.command()
def rate(
    sizes: Sizes = FIGURE_SIZES,
    pipeline: Pipelines = "default",
    shape: Annotated[str, typer.Option("--shape", metavar="NAME", help="A built-in shape.")] = "sauropod",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Skeletons per second, in a fresh process and after."""
    if shape not in BUILTIN:
        raise typer.BadParameter(f"no shape {shape}: there are {', '.join(BUILTIN)}")
    rows = measure_rate(numbers(sizes), pipeline.split(","), shape, repeat, jobs)
    save(output, rows)
    present(machine(), {"rate": rate_tables(rows)}, markdown)


@app.command()
def large(
    page: Annotated[
        Path | None,
        typer.Argument(metavar="PAGE", help="Markdown page to put the table into.", callback=page_with("large")),
    ] = None,
    sizes: Sizes = "65536,1048576",
    shapes: Shapes = "",
    file: Annotated[bool, typer.Option("--file", help="Also the whole command, from a PLY file to one.")] = False,
    jobs: Jobs = 1,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Large clouds: what they cost, and how far their skeletons are from that of the smallest size."""
    where = machine()
    rows = measure_large(numbers(sizes), shapes, file, jobs)
    save(output, rows)
    tables = large_tables(rows)
    if page is not None:
        fill(page, {"large": "\n".join([where, "", *(markdown_table(*table) for table in tables)])})
    present(where, {"large": tables}, markdown)


@app.command("all")
def everything(
    page: Annotated[
        Path | None,
        typer.Argument(
            metavar="PAGE", help="Markdown page to put the tables into; pictures beside it.", callback=page_with(*PARTS)
        ),
    ] = None,
    own: Own = False,
    sizes: Sizes = ALL_SIZES,
    figure_sizes: Annotated[
        str, typer.Option("--figure-sizes", metavar="NUMBERS", help="Of `figures` and `rate`.")
    ] = FIGURE_SIZES,
    pipeline: Pipelines = ALL_PIPELINES,
    published_to: PublishedTo = 65536,
    shapes: Annotated[str, typer.Option("--shapes", metavar="NAMES", help="Of `figures`.")] = "",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """The three together, with their pictures."""
    chosen, found = named(pipeline), objects(None, own, shapes, numbers(figure_sizes))
    start, where = time.perf_counter(), machine()  # now, since writing the page changes the working tree

    def said(what, rows):
        typer.echo(f"{what} done, {time.perf_counter() - start:.0f} s so far", err=True)
        return rows

    by_stage = said("stages", measure_stages(numbers(sizes), chosen, "sauropod", "clean", published_to, repeat, jobs))
    compared = said("figures", measure_figures(found, 4, 1, jobs))
    fast = said("rate", measure_rate(numbers(figure_sizes), ["default"], "sauropod", repeat, jobs))
    save(output, [*by_stage, *compared, *fast])
    parts = {"stages": stage_tables(by_stage), "figures": figure_tables(compared), "rate": rate_tables(fast)}
    if pictures is None and page is not None and (page.parent / "images").is_dir():
        pictures = page.parent / "images"
    if pictures is not None:
        draw_figures(compared, pictures)
        draw_stages(parts["stages"], pictures)
    if page is not None:
        fill(page, {"machine": f"{where}\n", **parts})
    present(where, parts, markdown)


@app.command()
def redraw(
    page: Annotated[
        Path, typer.Argument(metavar="PAGE", help="Markdown page with the tables.", callback=page_with("stages"))
    ],
    pictures: Annotated[Path, typer.Argument(metavar="DIR", help="For the pictures.", callback=_folder)],
) -> None:
    """The pictures of `stages` once more, from the tables that `all` has put into a page; nothing is measured."""
    draw_stages(tables_of(page, "stages"), pictures)


def tables_of(page: Path, part: str) -> Tables:
    """The tables that `fill` has put into a page."""
    (body,) = re.findall(rf"<!-- {part} -->\n(.*?)<!-- end -->", page.read_text(encoding="utf-8"), re.S)
    tables = []
    for title, block in re.findall(r"\*\*(.*?)\*\*\n\n((?:\|.*\n)+)", body):
        header, _, *lines = ([cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines())
        tables.append((title, header, lines))
    return tables


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
