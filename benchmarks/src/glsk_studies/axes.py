"""Skeletons against known axes: tables by cloud and by family, and of two results."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from statistics import median

import numpy as np
import typer
from glsk_bench.table import mean_with_interval, told

from glsk_o3d import Pipeline
from glsk_o3d.analysis import compare

from .clouds import Case
from .runs import run
from .tables import Tables, grouped, keep, look, number, pick, sheet, summary

MEASURES = {"tips_f1": "tips F1", "junctions_f1": "junctions F1", "length": "length"}
CLOUD = ("pipeline", "variant", "shape", "draw")  # what one row of a result is of
COMPARED = dict(topology=2, perfect=2, error=3)  # cloud by cloud, and their digits


def measure(case: Case, pipeline: Pipeline, repeat: int = 1) -> dict:
    """One skeleton against its axis; CPU seconds are the median of `repeat` runs."""
    points, truth = case.load()
    seconds = []
    for _ in range(repeat):
        start = time.process_time()
        skeleton = pipeline(points)
        seconds.append(time.process_time() - start)
    facts = dict(cpu=median(seconds), vertices=len(skeleton.vertices), solves=len(skeleton.report.iterations))
    return facts | asdict(compare(skeleton, truth))


def measured(found: list[Case], pipelines: dict[str, Pipeline], jobs: int, repeat: int = 1) -> list[dict]:
    """`measure` for every case and pipeline."""
    pairs = [(case, name) for case in found for name in pipelines]
    work = [(dict(pipeline=name, **case.facts), (case, pipelines[name], repeat)) for case, name in pairs]
    return run(measure, work, jobs)


def random_shapes(rows: list[dict]) -> list[dict]:
    """The rows of shapes drawn at random; all, where there is none."""
    return [row for row in rows if row["seed"] is not None] or rows


def share(rows: list[dict], name: str) -> tuple[float, float, float]:
    """The share of rows of which something holds, with its interval; a failure is a no."""
    return mean_with_interval([row["shape"] for row in rows], [bool(row.get(name)) for row in rows])


def with_all(groups: dict[str, list[dict]]) -> dict[str, list[dict]]:
    """The groups, and if there are several all of them together."""
    return groups | ({"all": [row for group in groups.values() for row in group]} if len(groups) > 1 else {})


def overview(rows: list[dict]) -> Tables:
    """The pipelines by variant, and by family if there are several.

    By variant only shapes drawn at random count, if there are any; the others have their lines by family.
    """
    tables, families = [], grouped(rows, "family")
    groups = {"cloud": with_all(grouped(random_shapes(rows), "variant"))}
    for kind, parts in (groups | ({"family": families} if len(families) > 1 else {})).items():
        lines = []
        for name, group in parts.items():
            for place, (label, here) in enumerate(grouped(group, "pipeline").items()):
                mean = summary(here)
                shares = [told(*share(here, what)) for what in ("topology", "perfect")]
                measures = [number(mean["error"]), *(number(mean[what], 2) for what in (*MEASURES, "cpu"))]
                lines.append([name * (place == 0), f"`{label}`", str(mean["n"]), *shares, *measures])
        header = [kind, "pipeline", "clouds", "topology", "perfect", "error", *MEASURES.values(), "CPU s"]
        tables.append((f"by {kind}: means, and 95 % intervals", header, lines))
    return tables


def paired(before: list[dict], after: list[dict]) -> list[dict]:
    """The clouds that both results have, with both rows; how many only one has is said."""
    earlier, later = ({tuple(row[name] for name in CLOUD): row for row in rows} for rows in (before, after))
    if alone := len(earlier.keys() ^ later.keys()):
        typer.echo(f"left out: {alone} clouds that only one file has", err=True)
    both = ((earlier[key], row) for key, row in later.items() if key in earlier)
    return [{name: row[name] for name in (*CLOUD, "seed")} | dict(rows=(old, row)) for old, row in both]


def difference_tables(pairs: list[dict]) -> Tables:
    """By variant: both means of each measure, and how much it has changed, with an interval."""
    lines = []
    for variant, group in with_all(grouped(random_shapes(pairs), "variant")).items():
        for label, here in grouped(group, "pipeline").items():
            rows, cells = [pair["rows"] for pair in here], []
            for name, digits in COMPARED.items():
                means, difference = change(rows, name, digits)
                cells += [(means and " → ".join(number(mean, digits) for mean in means)) or "-", difference]
            names = []
            for now in (True, False):  # what was not right, and is; and the other way round
                is_so = [[bool(row.get("topology")) for row in both] == [not now, now] for both in rows]
                names.append([pair["shape"] for pair, switched in zip(here, is_so, strict=True) if switched])
            words = [str(len(each)) if variant == "all" else ", ".join(each) for each in names]
            lines.append([variant, f"`{label}`", str(len(here)), *cells, *words])
    header = ["cloud", "pipeline", "clouds", "topology", "change", "perfect", "change", "error", "change"]
    return [("differences, and 95 % intervals", [*header, "now right", "now wrong"], lines)]


def value_of(row, name):
    """A failure has the wrong topology, and no error."""
    return row.get(name, None if name == "error" else False)


def change(pairs, name, digits):
    """Both means of a measure, and the mean difference in words with its interval, of pairs in which both have it."""
    values = [(old["shape"], value_of(old, name), value_of(new, name)) for old, new in pairs]
    known = [it for it in values if None not in it]
    if not known:
        return None, "-"
    shapes, before, after = zip(*known, strict=True)
    difference = mean_with_interval(shapes, [b - a for a, b in zip(before, after, strict=True)])
    return [sum(each) / len(known) for each in (before, after)], told(*difference, digits, sign="+")


def draw_truth(rows: list[dict], folder: Path) -> None:
    """Error and right topologies of the pipelines, variant by variant, with the intervals of these."""
    rows = random_shapes(rows)
    variants, names = grouped(rows, "variant"), list(grouped(rows, "pipeline"))
    places = np.arange(len(variants))
    groups = {name: [pick(group, pipeline=name) for group in variants.values()] for name in names}
    figure, (left, right) = sheet(1.0 + 0.33 * len(variants), columns=2, sharey=True, width_ratios=(3, 2))
    for axes in (left, right):
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color="#e4e4e4", linewidth=0.8, zorder=0)
        axes.tick_params(axis="y", length=0)
    for i, name in reversed(list(enumerate(names))):  # the first on top
        style = dict(linestyle="", markersize=6, label=name, **look(name))
        beside = places + 0.16 * (i - (len(names) - 1) / 2)  # so that no interval hides another
        left.plot([summary(group)["error"] for group in groups[name]], places, **style)
        means, low, high = np.transpose([share(group, "topology") for group in groups[name]])
        right.hlines(beside, low, high, color=style["color"], linewidth=1.5)
        right.plot(means, beside, **style | dict(markersize=4))
    left.set(xlabel="mean error, local radii", xlim=(0, None), ylim=(len(variants) - 0.5, -0.5))
    left.set_yticks(places, list(variants))
    right.set(xlabel="right topologies", xlim=(0, 1.05))
    shown, labels = (each[::-1] for each in left.get_legend_handles_labels())
    figure.legend(shown, labels, loc="outside upper center", ncols=len(names), frameon=False)
    keep(figure, folder, "accuracy_clouds")
