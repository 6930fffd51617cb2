"""How far skeletons are from known axes, and what every idea of the method contributes.

python benchmarks/accuracy.py truth --builtin

The README beside this file says what each command shows.
"""

from __future__ import annotations

import itertools
import json
import re
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from statistics import fmean, median
from typing import Annotated

import numpy as np
import typer
from _common import (
    Case,
    Folder,
    Jobs,
    Markdown,
    Output,
    Own,
    Pipelines,
    Shapes,
    Tables,
    Variants,
    cases,
    fill,
    folder_or,
    named,
    number,
    pick,
    run,
    save,
    show,
    summary,
    with_solves,
)
from _plots import BLUE, INK, LOOKS, keep, look, plain_log, sheet
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d import Pipeline, read_cloud
from glsk_o3d.analysis import compare
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.interop.writing import write_atomically
from glsk_o3d.pipelines import default

EVERY = "clean_1024,clean_4096,density_4096,holes_4096,scan2_4096,noise1_4096,noise2_4096,outliers_4096"
SOLVES = range(7)
PUBLISHED = ("wen2024", "cao2010")

IDEAS = {
    "neighbours by size": "RingBuilder.k=published",
    "frame that turns along": "RingBuilder.frame=box",
    "thinning": "RingBuilder.thin_to=all",
    "outliers set aside": "RingBuilder.outlier_factor=0",
    "denoising": "RingBuilder.denoise=0",
    "point reduction": "Contractor.reducer=none",
    "mass of merged points": "LPRReducer.conserve_mass=false",
    "cheapest merges first": "LPRReducer.order=index",
    "mended rings": "LPRReducer.mend_rings=false",
    "reduction that stops": "Contractor.reduce_above=0",
    "stop by score": "Contractor.stop=RingSizeRatio",
    "stop at 3 %": "ExplainedScore.threshold=0.02",
    "last solve kept": "Contractor.keep_last=false",
    "floor of attraction": "Contractor.min_attraction=0",
    "hold on lines": "Contractor.line_hold=1",
    "runaways held": "Contractor.retries=0",
    "sampling by thickness": "Connector.radius=2% Connector.thickness=0",
    "all ring links": "Connector.links=nearest",
    "stray vertices dropped": "Connector.stray=0",
    "loops must open": "Refiner.opening=0",
    "threads cut": "Refiner.weak=0",
    "unsure loops cut": "Refiner.sure=0",
    "twigs cut": "Refiner.twig=0",
    "edges subdivided": "Refiner.spacing=0",
    "fit to the axis": "Refiner.recentre=0",
}
"""What `default` adds to the publications, and the settings that switch it off. All of them together (but for the
reduction and the stop rule, which are published) are `wen2024`."""

Changed = Annotated[
    list[str] | None, typer.Option("--set", metavar="FILTER.PARAMETER=VALUE", help="Change it; may be repeated.")
]

app = typer.Typer(
    help=__doc__, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False
)


# -------------------------------------------------------------------------------------------------- against known axes


def measure(case: Case, pipeline: Pipeline, repeat: int = 1) -> dict:
    """One skeleton against its axis; CPU seconds are the median of `repeat` runs."""
    points, truth = case.load()
    seconds = []
    for _ in range(repeat):
        start = time.process_time()
        skeleton = pipeline(points)
        seconds.append(time.process_time() - start)
    facts = dict(cpu=median(seconds), vertices=len(skeleton.vertices), solves=len(skeleton.report.iterations))
    return facts | compare(skeleton, truth).as_dict()


def measured(found: list[Case], pipelines: dict[str, Pipeline], jobs: int, repeat: int = 1) -> list[dict]:
    """`measure` for every case and pipeline."""
    work = [
        (dict(pipeline=name, variant=case.variant, shape=case.shape), (case, pipeline, repeat))
        for case in found
        for name, pipeline in pipelines.items()
    ]
    return run(measure, work, jobs)


def by_pipeline(rows: list[dict]) -> dict[str, list[dict]]:
    """The rows of each pipeline, in their order."""
    return {name: pick(rows, pipeline=name) for name in dict.fromkeys(row["pipeline"] for row in rows)}


def by_variant(rows: list[dict]) -> dict[str, list[dict]]:
    """The rows of each variant, in their order."""
    return {name: pick(rows, variant=name) for name in dict.fromkeys(row["variant"] for row in rows)}


def wrong(row: dict) -> str:
    """What is wrong with the topology of a row: nothing, loops and components too many or too few, or everything."""
    if "failure" in row:
        return f"{row['shape']} ({row['failure']})"
    off = [f"{row[name]:+d} {name}" for name in ("loops", "components") if row[name]]
    return f"{row['shape']} {' '.join(off)}" if off else ""


def altered(pipeline: Pipeline, settings: list[str] | None) -> Pipeline:
    """The pipeline with these settings, each as ``Filter.parameter=value``."""
    try:
        return override(pipeline, settings or [])
    except InvalidParameterError as error:
        raise typer.BadParameter(str(error)) from None


@app.command()
def truth(
    folder: Folder = None,
    own: Own = False,
    pipeline: Pipelines = "default,cao2010,wen2024",
    changed: Changed = None,
    variant: Variants = f"clean_16384,{EVERY}",
    shapes: Shapes = "",
    repeat: Annotated[int, typer.Option(min=1, help="Runs, of whose CPU seconds the median counts.")] = 1,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Pipelines on shapes with known axes, a table per variant."""
    chosen = {name: altered(it, changed) for name, it in named(pipeline).items()}
    rows = measured(cases(folder, own, variant, shapes), chosen, jobs, repeat)
    save(output, rows)
    groups = by_variant(rows)
    for table in truth_tables(groups | ({"all": rows} if len(groups) > 1 else {})):
        show(*table, markdown)


def truth_tables(groups: dict[str, list[dict]]) -> Tables:
    """A table per group; in that of all clouds without what is wrong, as it would be too much."""
    header = ["", "error", "inside", "complete", "topology", "leaves", "ends", "radius", "CPU s", "worst", "wrong"]
    tables = []
    for name, group in groups.items():
        lines = []
        for label, here in by_pipeline(group).items():
            mean = summary(here)
            last = sorted((row for row in here if "failure" not in row), key=lambda row: -row["error"])[:3]
            lines.append(
                [
                    label,
                    *(number(mean[key]) for key in ("error", "inside", "completeness")),
                    *(f"{mean[key]}/{mean['n']}" for key in ("right", "leaves")),
                    *(number(mean[key], 2) for key in ("ends", "radius_error", "cpu")),
                    ", ".join(f"{row['shape']} {row['error']:.2f}" for row in last),
                    ", ".join(filter(None, map(wrong, here))) if name != "all" else "",
                ]
            )
        tables.append((name, header, lines))
    return tables


def overview(rows: list[dict]) -> Tables:
    """The same in one table, without the names of shapes."""
    lines = [
        [name * (place == 0), f"`{line[0]}`", *line[1:5], *line[6:9]]
        for name, _, here in truth_tables(by_variant(rows))
        for place, line in enumerate(here)
    ]
    header = ["cloud", "pipeline", "error", "inside", "completeness", "topology", "ends", "radius error", "CPU s"]
    return [("means over the shapes", header, lines)]


def draw_truth(rows: list[dict], folder: Path) -> Path:
    """Error and right topologies of the pipelines, variant by variant."""
    variants = by_variant(rows)
    names, places = list(by_pipeline(rows)), np.arange(len(variants))
    means = {name: [summary(pick(group, pipeline=name)) for group in variants.values()] for name in names}
    figure, (left, right) = sheet(1.0 + 0.33 * len(variants), columns=2, sharey=True, width_ratios=(3, 2))
    for axes, key in ((left, "error"), (right, "right")):
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color="#e4e4e4", linewidth=0.8, zorder=0)
        for name in names[::-1]:  # the first on top
            axes.plot([mean[key] for mean in means[name]], places, linestyle="", markersize=6, label=name, **look(name))
        axes.set_xlim(0, 1.05 * max(mean[key] for means_of in means.values() for mean in means_of))
        axes.tick_params(axis="y", length=0)
    left.set(xlabel="mean error, local radii", ylim=(len(variants) - 0.5, -0.5))
    left.set_yticks(places, list(variants))
    right.set_xlabel(f"right topology, of {max(mean['n'] for mean in means[names[0]])}")
    right.xaxis.get_major_locator().set_params(integer=True)
    shown, labels = (each[::-1] for each in left.get_legend_handles_labels())
    figure.legend(shown, labels, loc="outside upper center", ncols=len(names), frameon=False)
    return keep(figure, folder, "accuracy_clouds")


@app.command()
def ablation(
    folder: Folder = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    idea: Annotated[str, typer.Option(metavar="NAMES", help="With commas; else all.")] = ",".join(IDEAS),
    page: Annotated[
        Path | None,
        typer.Option(
            "--page", metavar="PAGE", help="Markdown page that names settings: put their effects behind them."
        ),
    ] = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """The default pipeline with each idea switched off, one at a time: mean error / shapes with right topology."""
    if unknown := set(idea.split(",")) - set(IDEAS):
        raise typer.BadParameter(f"no idea {', '.join(unknown)}: there are {', '.join(IDEAS)}")
    if page is not None and not page.is_file():
        raise typer.BadParameter(f"there is no page {page}")
    chosen = {"default": default()}
    chosen |= {name: override(default(), IDEAS[name].split()) for name in idea.split(",")}
    chosen |= named(",".join(PUBLISHED))
    rows = measured(cases(folder, own, variant, shapes), chosen, jobs)
    save(output, rows)
    header, lines = ablation_table(rows)
    show("one idea off at a time", header, lines, markdown)
    if page is not None:
        write_effects(page, rows)


def lost(mean: dict, whole: dict) -> float:
    """The relative rise of the error and the relative fall of the number of shapes with right topology."""
    return mean["error"] / whole["error"] - mean["right"] / max(whole["right"], 1)


def cell(mean: dict) -> str:
    """Error / right topologies."""
    return f"{number(mean['error'])} / {mean['right']}"


def effect(rows: list[dict], idea: str) -> str:
    """What is lost without an idea: over all clouds, and in the variant in which it counts most."""

    def pair(here):
        return [summary(pick(here, pipeline=name)) for name in ("default", idea)]

    pairs = {variant: pair(group) for variant, group in by_variant(rows).items()}
    most = max(pairs, key=lambda variant: lost(pairs[variant][1], pairs[variant][0]))
    whole, there = (" → ".join(map(cell, it)) for it in (pair(rows), pairs[most]))
    return f"{whole}; {most}: {there}"


def write_effects(page: Path, rows: list[dict]) -> None:
    """Put the effects behind the settings that a page names in cells of its tables, up to the end of cell or line."""
    text = page.read_text(encoding="utf-8")
    for name in IDEAS.keys() & {row["pipeline"] for row in rows}:
        words = effect(rows, name)
        text = re.sub(rf"(`{re.escape(IDEAS[name])}`: ).*?(?= \||<br>)", lambda it, words=words: it[1] + words, text)
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


def losses(rows: list[dict]) -> tuple[dict[str, dict], list[str]]:
    """Means of every pipeline over all variants, and the ideas in it by how much is `lost` without them."""
    mean = {name: summary(here) for name, here in by_pipeline(rows).items()}
    ideas = (name for name in mean if name in IDEAS)
    return mean, sorted(ideas, key=lambda name: lost(mean[name], mean["default"]), reverse=True)


def ablation_table(rows: list[dict]) -> tuple[list[str], list[list[str]]]:
    """Header and lines: `default`, the ideas by how much is lost without them, and the publications."""
    variants, (mean, ideas) = by_variant(rows), losses(rows)
    lines = []
    for name in ["default", *ideas, *(name for name in PUBLISHED if name in mean)]:
        parts = [summary(pick(group, pipeline=name)) for group in variants.values()]
        cells = [cell(part) for part in (*parts, mean[name])]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (name, "")
        lines.append([label, *cells, setting])
    titles = [f"{variant} ({len(pick(group, pipeline='default'))})" for variant, group in variants.items()]
    return ["", *titles, f"all ({mean['default']['n']})", "setting"], lines


def draw_ablation(rows: list[dict], folder: Path) -> Path:
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
    return keep(figure, folder, "accuracy_ideas")


# ---------------------------------------------------------------------------------------------------- the contraction


@app.command()
def stop(
    folder: Folder = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise2_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Where the stop rule stops, and what more or fewer solves would give."""
    chosen = {str(n): with_solves(default(), n) for n in SOLVES} | {"rule": default()}
    rows = measured(cases(folder, own, variant, shapes), chosen, jobs)
    save(output, rows)
    for table in stop_tables(rows):
        show(*table, markdown)


def stops(rows: list[dict]) -> Counter:
    """At how many shapes the rule stops after how many solves."""
    return Counter(row.get("solves") for row in pick(rows, pipeline="rule"))


def stop_tables(rows: list[dict]) -> Tables:
    """A table per variant."""
    tables = []
    for name, group in by_variant(rows).items():
        taken, lines = stops(group), []
        for label, here in by_pipeline(group).items():
            mean = summary(here)
            numbers = [number(mean[key]) for key in ("error", "inside", "completeness")]
            count = str(taken[int(label)]) if label != "rule" else ""
            lines.append([label, *numbers, f"{mean['right']}/{mean['n']}", count])
        tables.append((name, ["solves", "error", "inside", "complete", "topology", "rule stops"], lines))
    return tables


def draw_stop(rows: list[dict], folder: Path) -> Path:
    """The error over the number of solves, with rings where the rule stops."""
    figure, axes = sheet(3.2)
    styles = itertools.cycle(LOOKS.values())
    for (name, group), style in zip(by_variant(rows).items(), styles, strict=False):
        means = {int(label): summary(here) for label, here in by_pipeline(group).items() if label != "rule"}
        axes.plot(list(means), [mean["error"] for mean in means.values()], markersize=4, label=name, **style)
        for n, count in stops(group).items():
            if n in means:
                place, words = (n, means[n]["error"]), f"{count} of {means[n]['n']}"
                axes.plot(*place, "o", markersize=11, markerfacecolor="none", color=INK)
                axes.annotate(words, place, (0, 10), textcoords="offset points", ha="center", fontsize=9)
    axes.set(xlabel="solves; rings: the rule stops here", ylabel="mean error, local radii", yscale="log")
    plain_log(axes.yaxis)
    axes.legend(frameon=False)
    return keep(figure, folder, "accuracy_solves")


def tracking(case: Case) -> dict:
    """How far reduced contractions are from the one without reduction after as many solves, in local radii."""
    points, axis = case.load()
    contraction = Pipeline(*default().stages[:2])
    solves = len(contraction(points).report.iterations)
    contraction = with_solves(contraction, solves)
    full = override(contraction, ["Contractor.reducer=none"])(points).contracted
    found: dict[str, float] = dict(solves=solves)
    for name, kept in (("conserved", "true"), ("published", "false")):
        reduced = override(contraction, [f"LPRReducer.conserve_mass={kept}"])(points).contracted
        away = cKDTree(full).query(reduced)[0] / local_radius(axis, reduced)
        missed = cKDTree(reduced).query(full)[0] / local_radius(axis, full)
        found |= {f"{name}_points": len(reduced), f"{name}_mean": float(away.mean())}
        found |= {f"{name}_hausdorff": float(max(away.max(), missed.max()))}
    return found


@app.command()
def mass(
    folder: Folder = None,
    own: Own = False,
    variant: Variants = "clean_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """How well the reduced contraction tracks the full one, with the mass of merged points and without."""
    found = cases(folder, own, variant, shapes)
    rows = run(tracking, [(dict(variant=case.variant, shape=case.shape), (case,)) for case in found], jobs)
    save(output, rows)
    names = ["solves"]
    names += [f"{kind}_{what}" for kind in ("conserved", "published") for what in ("points", "mean", "hausdorff")]
    digits = [0 if name == "solves" or name.endswith("points") else 3 for name in names]
    for name, here in by_variant(rows).items():
        good = [row for row in here if "failure" not in row]
        if good:
            here.append({"shape": "mean"} | {key: fmean(row[key] for row in good) for key in names})
        lines = []
        for row in here:
            cells = [number(row.get(key), n) for key, n in zip(names, digits, strict=True)]
            lines.append([row["shape"], *cells, row.get("failure", "")])
        show(name, ["shape", *(key.replace("_", " ") for key in names), "note"], lines, markdown)


def feet(points, nodes, edges):
    """Distance of each point to a curve of straight edges, the edge it is nearest to, and how far along that edge."""
    start, end = nodes[edges].swapaxes(0, 1)
    span, offset = end - start, points[:, None] - start
    part = (offset * span).sum(axis=2) / np.maximum((span**2).sum(axis=1), np.finfo(float).tiny)
    part = np.clip(part, 0, 1)
    distance = np.linalg.norm(offset - part[:, :, None] * span, axis=2)
    edge = distance.argmin(axis=1)
    row = np.arange(len(points))
    return distance[row, edge], edge, part[row, edge]


def local_radius(axis, points):
    """Radius of the true axis where it is nearest to each point."""
    _, edge, part = feet(points, axis.nodes, axis.edges)
    start, end = axis.radii[axis.edges[edge]].T
    return start + (end - start) * part


# ------------------------------------------------------------------------------------------- turned clouds, real clouds


def turned(case: Case, count: int, pipeline: Pipeline) -> dict:
    """What changes when the cloud is turned at random and its points are shuffled."""
    points, axis = case.load()
    rng = np.random.default_rng(0)
    first = pipeline(points)
    moves, topology, leaves = [], 0, 0
    for _ in range(count):
        rotation = Rotation.from_quat(rng.normal(size=4)).as_matrix()
        other = pipeline((points @ rotation.T)[rng.permutation(len(points))])
        back = other.vertices @ rotation
        there = feet(back, first.vertices, first.edges)[0] / local_radius(axis, back)
        here = feet(first.vertices, back, other.edges)[0] / local_radius(axis, first.vertices)
        moves.append(float(max(there.max(), here.max())))
        topology += (other.n_loops, other.n_components) != (first.n_loops, first.n_components)
        leaves += len(other.leaves) != len(first.leaves)
    return dict(runs=count, topology_changes=topology, leaf_changes=leaves, moves=moves)


@app.command()
def rotations(
    folder: Folder = None,
    own: Own = False,
    variant: Variants = "clean_4096",
    shapes: Shapes = "6",
    count: Annotated[int, typer.Option(min=1, help="Turns per shape.")] = 20,
    changed: Changed = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Whether the skeleton depends on how the cloud is turned and in which order its points come."""
    found = cases(folder, own, variant, shapes)
    pipeline = altered(default(), changed)
    rows = run(
        turned, [(dict(variant=case.variant, shape=case.shape), (case, count, pipeline)) for case in found], jobs
    )
    save(output, rows)
    header = ["shape", "turns", "topology changes", "leaf changes", "median move", "largest move", "note"]
    for name, here in by_variant(rows).items():
        lines = []
        for row in here:
            counts = [str(row.get(key, "-")) for key in ("runs", "topology_changes", "leaf_changes")]
            moves = [number(of(row["moves"])) if "moves" in row else "-" for of in (median, max)]
            lines.append([row["shape"], *counts, *moves, row.get("failure", "")])
        show(name, header, lines, markdown)


def looped(path: Path, pipeline: Pipeline) -> dict:
    """Loops and CPU seconds of a cloud in a file."""
    cloud = read_cloud(path)
    start = time.process_time()
    skeleton = pipeline(cloud)
    seconds = time.process_time() - start
    return dict(cpu=seconds, points=skeleton.report.n_input, components=skeleton.n_components, loops=skeleton.n_loops)


@app.command()
def loops(
    folder: Folder = None,
    pipeline: Pipelines = "default",
    largest: Annotated[int, typer.Option(help="Clouds with more points are left out.")] = 400_000,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Loops of real clouds whose number is known, in a folder with a manifest."""
    folder = folder_or(folder, "GLSK_DATA", "shared/data")
    listed = json.loads((folder / "manifest.json").read_text())
    listed = [it for it in listed if it["meaningful_skeleton"] and it["loops"] is not None]
    listed = [it for it in listed if it["n_points"] <= largest]
    listed.sort(key=lambda it: it["n_points"], reverse=True)  # the long ones first, so that no process is left alone
    chosen = named(pipeline)
    work = [
        (dict(pipeline=name, cloud=it["name"], expected=it["loops"]), (folder / it["path"], pipe))
        for it in listed
        for name, pipe in chosen.items()
    ]
    rows = run(looped, work, jobs)
    save(output, rows)
    header = ["cloud", "points", "CPU s", "per point", "components", "loops", "expected", "right", "note"]
    for name in chosen:
        here = pick(rows, pipeline=name)
        each = [row["cpu"] / row["points"] for row in here if "failure" not in row]
        lines = []
        for row in here:
            if "failure" in row:
                lines.append([row["cloud"], *"-" * 5, str(row["expected"]), "no", row["failure"]])
                continue
            cost = number(row["cpu"] / row["points"] / median(each), 2)
            counts = [str(row[key]) for key in ("components", "loops", "expected")]
            right = "yes" if row["loops"] == row["expected"] else "no"
            lines.append([row["cloud"], str(row["points"]), number(row["cpu"], 2), cost, *counts, right, ""])
        show(f"{name}: {sum(line[7] == 'yes' for line in lines)} of {len(lines)} right", header, lines, markdown)


# ------------------------------------------------------------------------------------------------------------ the page

PAGE: dict[str, tuple[Callable[[list[dict]], Tables], Callable[[list[dict], Path], Path]]] = {
    "truth": (overview, draw_truth),
    "ablation": (lambda rows: [("one idea off at a time", *ablation_table(rows))], draw_ablation),
    "stop": (stop_tables, draw_stop),
}
"""What a page shows of the results of each command."""


@app.command()
def page(
    file: Annotated[Path, typer.Argument(metavar="PAGE", exists=True, dir_okay=False)],
    results: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True, dir_okay=False)],
) -> None:
    """Put the tables of saved results into a Markdown page, and their pictures into the folder images beside it."""
    told = {}
    for path in results:
        found = json.loads(path.read_text(encoding="utf-8"))
        command = found["command"][0]
        if command not in PAGE:
            raise typer.BadParameter(f"{path} holds results of {command}: a page shows those of {', '.join(PAGE)}")
        told[command] = found["rows"]
    fill(file, {command: PAGE[command][0](rows) for command, rows in told.items()})
    folder = file.parent / "images"
    folder.mkdir(exist_ok=True)
    for command, rows in told.items():
        PAGE[command][1](rows, folder)


if __name__ == "__main__":
    app()
