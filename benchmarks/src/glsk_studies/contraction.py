"""The contraction against the baseline: figures 4 to 6 of Wen et al. 2024, and the whole pipelines."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
import typer

from glsk_o3d import Contractor, Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.data.report import REFUSED
from glsk_o3d.pipelines import default, wen2024

from .clouds import Case, cases
from .runs import named, run, with_solves
from .scans import Scan, scanned
from .stages import by_size
from .stopwatch import in_turns, yardstick
from .tables import Table, Tables, good, keep, look, pick, quartiles, sheet

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


def objects(folder: Path | None, own: bool, shapes: str, sizes: list[int]) -> list[tuple[int, Case | Scan]]:
    """The shapes with known axes in all sizes, built-in ones in sizes that the folder does not have; and, where there
    is a folder of scans and nothing narrower is asked for, those that are large enough.
    """
    clean = ",".join(f"clean_{n}" for n in sizes)
    found: list[tuple[int, Case | Scan]] = [(case.size, case) for case in cases(folder, own, clean, shapes)]
    if own or shapes:
        return found
    if missing := [n for n in sizes if n not in dict(found)]:
        typer.echo(f"the built-in shapes instead for {', '.join(map(str, missing))} points", err=True)
        found += objects(None, True, "", missing)
    return found + [(scan.n, scan) for scan in scanned(sizes)]


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


def figure_tables(rows: list[dict]) -> Tables:
    """For each pipeline the ratio to the baseline and what it is made of; what is left of the clouds; the whole."""
    at = by_size(good(rows))
    tables = [ratio_table(base, at, rows[0]["fixed"]) for base in BASES]
    tables += [contraction_table(at), whole_table(at)]
    if failed := [row for row in rows if "failure" in row]:
        words = [[str(row["n"]), row["shape"], row["failure"]] for row in failed]
        tables.append(("failures", ["points", "cloud", "note"], words))
    return tables


def ratio_table(base: str, at: dict[int, list[dict]], solves: int) -> Table:
    """What a pipeline's contraction costs over the baseline, and what reduction and stop rule have to do with it."""
    header = ["points", "clouds", "against cao2010", "paper", f"LPR, {solves} solves", "of these"]
    header += ["LPR, own rule", "LPR, ring sizes", "own rule, no LPR", "own rule, LPR"]
    lines = []
    for n, here in at.items():
        fixed = ratios(here, (base, True, "fixed"), (base, False, "fixed"))
        lpr = [quartiles(ratios(here, (base, True, rule), (base, False, rule))) for rule in RULES]
        rule = [quartiles(ratios(here, (base, lpr, "own"), (base, lpr, "rings"))) for lpr in (False, True)]
        whole = quartiles(ratios(here, (base, True, "own"), BASELINE))
        claim = CLAIMS.get(n, "-") if base == "wen2024" else ""
        lines.append([str(n), str(len(here)), whole, claim, quartiles(fixed), str(len(fixed)), *lpr, *rule])
    return f"{base}: CPU ratios of the contraction, median (quartiles)", header, lines


def contraction_table(at: dict[int, list[dict]]) -> Table:
    """What the contractions of the named pipelines leave, and take."""
    lines = []
    for n, here in at.items():
        for name, key in shown().items():
            runs = [take(row, key) for row in here]
            left, spent, made = (np.array([it[what] for it in runs], float) for what in ("left", "cpu", "solves"))
            refused = str(sum(it["refused"] for it in runs))
            cells = [quartiles(left / n), quartiles(1000 * spent, 0), quartiles(made, 0), refused]
            lines.append([name, str(n), *cells])
    header = ["", "points", "share left", "CPU ms", "solves", "refused"]
    return "the contraction, median (quartiles)", header, lines


def whole_table(at: dict[int, list[dict]]) -> Table:
    """What the pipelines take from end to end, in the yardstick."""
    lines = []
    for n, here in at.items():
        for name in WHOLE:
            values = np.array([row["whole"][name] for row in here])
            lines.append([name, str(n), quartiles(values, 1), f"{values.mean():.1f}", f"{values.max():.1f}"])
    return "end to end, in kNN", ["", "points", "median (quartiles)", "mean", "most"], lines


def shown() -> dict[str, tuple[str, bool, str]]:
    """The named pipelines among the contractions."""
    return {"cao2010": BASELINE} | {base: (base, True, "own") for base in BASES}


def draw_figures(rows: list[dict], folder: Path) -> None:
    """A picture for each size: cost and remaining points of every cloud, in the order of what the baseline costs."""
    for n, group in by_size(good(rows)).items():
        here = sorted(group, key=lambda row: take(row, BASELINE)["cpu"])
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
        keep(figure, folder, f"contraction_{n}")
