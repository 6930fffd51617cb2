"""Skeletons against known axes: tables by cloud and by family, of two results, and of what every idea is worth."""

from __future__ import annotations

import re
import time
from dataclasses import asdict
from pathlib import Path
from statistics import median

import numpy as np
import typer
from _clouds import Case
from _runs import PUBLISHED, run
from _tables import BLUE, INK, Tables, good, grouped, keep, look, number, pick, sheet, summary
from glsk_bench.table import mean_with_interval, told

from glsk_o3d import Pipeline
from glsk_o3d.analysis import compare
from glsk_o3d.interop.atomic import write_atomically

IDEAS = {
    "neighbours by size": "RingBuilder.k=published",
    "frame that turns along": "Sampler.frame=box",
    "thinning": "Sampler.size=all Thinner.thin_to=all",
    "outliers set aside": "OutlierRemover.outlier_factor=0",
    "denoising": "Denoiser.denoise=0",
    "merges of many points alone": "LPRReducer.least=0",
    "mass of merged points": "LPRReducer.least=0 LPRReducer.conserve_mass=false",
    "mended rings": "LPRReducer.least=0 LPRReducer.mend_rings=false",
    "cheapest merges first": "LPRReducer.least=0 LPRReducer.order=index",
    "stop by score": "Contractor.stop=RingSizeRatio",
    "stop at 3 %": "ExplainedScore.threshold=0.02",
    "last solve kept": "Contractor.keep_last=false",
    "hold on lines": "Contractor.line_hold=1",
    "runaways held": "Contractor.retries=0",
    "sampling by thickness": "Connector.radius=2% Connector.thickness=0",
    "all ring links": "Connector.links=nearest",
    "shortest edge first": "Refiner.collapse=degree",
    "false loops closed": "Refiner.handle=0",
    "air cut": "Refiner.air=0",
    "gaps bridged": "Refiner.bridge=0",
    "spurs cut": "Refiner.limb=0",
    "edges subdivided": "Refiner.spacing=0",
    "fit to the axis": "Refiner.recentre=0",
    "thin parts traced": "Tracer.surface=0",
}
"""What `default` adds to the publications, and the settings that switch it off. All of them together (but for the
stop rule, which is published) are `wen2024`."""
MEASURES = {"tips_f1": "tips F1", "junctions_f1": "junctions F1", "length": "length"}
CLOUD = ("pipeline", "variant", "shape", "draw")  # what one row of a result is of
WORTH = dict(perfect=2, topology=2, error=3)  # the digits of what is compared cloud by cloud


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


# --------------------------------------------------------------------------------------------------------- known axes


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


def details(rows: list[dict]) -> Tables:
    """The other measures, a table per variant, with the names of what is bad."""
    header = ["", "inside", "complete", "ends", "radius", "worst", "wrong"]
    tables = []
    for variant, group in grouped(rows, "variant").items():
        lines = []
        for label, here in grouped(group, "pipeline").items():
            mean = summary(here)
            last = sorted(good(here), key=lambda row: -row["error"])[:3]
            numbers = [number(mean[key]) for key in ("inside", "completeness")]
            numbers += [number(mean[key], 2) for key in ("ends", "radius_error")]
            worst = ", ".join(f"{row['shape']} {row['error']:.2f}" for row in last)
            lines.append([label, *numbers, worst, ", ".join(filter(None, map(wrong, here)))])
        tables.append((variant, header, lines))
    return tables


def wrong(row: dict) -> str:
    """What is wrong with the topology of a row: nothing, loops and components too many or too few, or everything."""
    if "failure" in row:
        return f"{row['shape']} ({row['failure']})"
    off = [f"{row[name]:+d} {name}" for name in ("loops", "components") if row[name]]
    return f"{row['shape']} {' '.join(off)}" if off else ""


# -------------------------------------------------------------------------------------------------------- two results


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
            for name, digits in (("topology", 2), ("perfect", 2), ("error", 3)):
                means, change = _change(rows, name, digits)
                cells += [(means and " → ".join(number(mean, digits) for mean in means)) or "-", change]
            names = []
            for now in (True, False):  # what was not right, and is; and the other way round
                is_so = [[bool(row.get("topology")) for row in both] == [not now, now] for both in rows]
                names.append([pair["shape"] for pair, changed in zip(here, is_so, strict=True) if changed])
            words = [str(len(each)) if variant == "all" else ", ".join(each) for each in names]
            lines.append([variant, f"`{label}`", str(len(here)), *cells, *words])
    header = ["cloud", "pipeline", "clouds", "topology", "change", "perfect", "change", "error", "change"]
    return [("differences, and 95 % intervals", [*header, "now right", "now wrong"], lines)]


def _value(row, name):
    """A failure has the wrong topology, and no error."""
    return row.get(name, None if name == "error" else False)


def _change(pairs, name, digits):
    """Both means of a measure, and the mean difference in words with its interval, of pairs in which both have it."""
    values = [(old["shape"], _value(old, name), _value(new, name)) for old, new in pairs]
    known = [it for it in values if None not in it]
    if not known:
        return None, "-"
    shapes, before, after = zip(*known, strict=True)
    change = mean_with_interval(shapes, [b - a for a, b in zip(before, after, strict=True)])
    return [sum(each) / len(known) for each in (before, after)], told(*change, digits, sign="+")


# --------------------------------------------------------------------------------------------------------------- ideas


def losses(rows: list[dict]) -> tuple[dict[str, dict], list[str]]:
    """Means of every pipeline over all variants, and the ideas in it by how much is lost without them."""
    mean = {name: summary(here) for name, here in grouped(rows, "pipeline").items()}
    ideas = (name for name in mean if name in IDEAS)
    return mean, sorted(ideas, key=lambda name: _lost(mean[name], mean["default"]), reverse=True)


def _lost(mean, whole):
    """The relative rise of the error and the relative fall of the number of shapes with right topology."""
    return mean["error"] / whole["error"] - mean["right"] / max(whole["right"], 1)


def _cell(mean):
    """Error / right topologies."""
    return f"{number(mean['error'])} / {mean['right']}"


def ablation_tables(rows: list[dict]) -> Tables:
    """`default`, the ideas by how much is lost without them, and the publications."""
    variants, (mean, ideas) = grouped(rows, "variant"), losses(rows)
    lines = []
    for name in ["default", *ideas, *(name for name in PUBLISHED if name in mean)]:
        parts = [summary(pick(group, pipeline=name)) for group in variants.values()]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (name, "")
        lines.append([label, *map(_cell, (*parts, mean[name])), setting])
    titles = [f"{variant} ({len(pick(group, pipeline='default'))})" for variant, group in variants.items()]
    header = ["", *titles, f"all ({mean['default']['n']})", "setting"]
    return [("one idea off at a time", header, lines)]


def write_effects(page: Path, rows: list[dict]) -> None:
    """Put what is lost without each idea behind the settings that a page names in cells of its tables.

    That is over all clouds, and in the variant in which it counts most; up to the end of cell or line.
    """
    text, groups = page.read_text(encoding="utf-8"), {"": rows, **grouped(rows, "variant")}
    for name in IDEAS.keys() & {row["pipeline"] for row in rows}:
        pairs = {
            it: [summary(pick(here, pipeline=which)) for which in ("default", name)] for it, here in groups.items()
        }
        whole = pairs.pop("")
        most = max(pairs, key=lambda variant: _lost(pairs[variant][1], pairs[variant][0]))
        words = "{} → {}; {}: {} → {}".format(*map(_cell, whole), most, *map(_cell, pairs[most]))
        text = re.sub(rf"(`{re.escape(IDEAS[name])}`: ).*?(?= \||<br>)", lambda it, words=words: it[1] + words, text)
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


def worth_tables(rows: list[dict]) -> Tables:
    """How `default` changes without each idea, cloud by cloud, with intervals; by the topologies that are lost."""
    groups, lines = grouped(rows, "pipeline"), []
    whole = {tuple(row[name] for name in CLOUD[1:]): row for row in groups["default"]}
    ideas = sorted(IDEAS.keys() & groups.keys(), key=lambda name: (_mean(groups[name], "topology"), name))
    for name in [*ideas, *(name for name in PUBLISHED if name in groups)]:
        pairs = [(whole[tuple(row[it] for it in CLOUD[1:])], row) for row in groups[name]]
        changes = [_change(pairs, it, digits)[1] for it, digits in WORTH.items()]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (f"`{name}`", "")
        lines.append([label, *changes, *_most(pairs), setting])
    first = ["`default`", *(number(_mean(whole.values(), it), digits) for it, digits in WORTH.items()), "", "", ""]
    header = ["", *WORTH, "most in", "topology there", "setting"]
    return [(f"what {len(whole)} clouds lose without each idea", header, [first, *lines])]


def of_worth(rows: list[dict]) -> list[dict]:
    """Of each row no more than `worth_tables` needs."""
    names = (*CLOUD, *WORTH, "failure")
    few = [{name: row[name] for name in names if name in row} for row in rows]
    return [row | {"error": round(row["error"], 4)} if "error" in row else row for row in few]


def _most(pairs):
    """The variant in which most topologies are lost, and the shares there; dashes if none is."""
    groups: dict[str, list] = {}
    for pair in pairs:
        groups.setdefault(pair[0]["variant"], []).append(pair)
    shares = {name: [_mean(side, "topology") for side in zip(*group, strict=True)] for name, group in groups.items()}
    name = min(shares, key=lambda it: shares[it][1] - shares[it][0])
    if shares[name][1] >= shares[name][0]:
        return "-", "-"
    return name, " → ".join(number(share, 2) for share in shares[name])


def _mean(rows, name):
    known = [value for row in rows if (value := _value(row, name)) is not None]
    return sum(known) / len(known)


# ------------------------------------------------------------------------------------------------------------ pictures


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


def draw_ablation(rows: list[dict], folder: Path) -> None:
    """What is lost without each idea: how much more error, how many shapes."""
    mean, ideas = losses(rows)
    whole = mean["default"]
    rise = [100 * (mean[name]["error"] / whole["error"] - 1) for name in ideas]
    lost = [whole["right"] - mean[name]["right"] for name in ideas]
    figure, both = sheet(0.9 + 0.23 * len(ideas), columns=2, sharey=True, width_ratios=(3, 2))
    titles = ("error rises by %", f"right topologies\nlost, of {whole['right']}")
    for axes, title, values in zip(both, titles, (rise, lost), strict=True):
        bars = axes.barh(range(len(ideas)), values, color=BLUE)
        words = [f"{value:.0f}".replace("-0", "0").replace("-", "\N{MINUS SIGN}") for value in values]
        axes.bar_label(bars, words, padding=3, fontsize=8)
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set_title(title, fontsize=10)
        axes.set_xticks([])
        axes.margins(x=0.18, y=0.01)
        axes.spines[["left", "bottom"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
    both[0].set_yticks(range(len(ideas)), ideas, fontsize=9)
    both[0].invert_yaxis()
    keep(figure, folder, "accuracy_ideas")
