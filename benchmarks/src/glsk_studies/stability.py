"""What changes with the number of solves, with the reduction, and when a cloud is turned and shuffled."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path
from statistics import fmean, median

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d import Contractor, LPRReducer, Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.geometry.polylines import nearest_on_edges
from glsk_o3d.pipelines import rings

from .clouds import Case
from .runs import with_solves
from .tables import INK, LOOKS, Tables, fixed, good, grouped, keep, number, pick, plain_log, sheet, summary, table


def feet(points, nodes, edges):
    """Distance of each point to a curve of straight edges, the edge it is nearest to, and how far along that edge."""
    edge, part = nearest_on_edges(nodes, edges, np.tile(np.arange(len(edges)), (len(points), 1)), points)
    start, end = nodes[edges[edge]].swapaxes(0, 1)
    return np.linalg.norm(points - start - part[:, None] * (end - start), axis=1), edge, part


def local_radius(axis, points):
    """Radius of the true axis where it is nearest to each point."""
    _, edge, part = feet(points, axis.nodes, axis.edges)
    start, end = axis.radii[axis.edges[edge]].T
    return start + (end - start) * part


def stops(rows: list[dict]) -> Counter:
    """At how many shapes the rule stops after how many solves."""
    return Counter(row.get("solves") for row in pick(rows, pipeline="rule"))


def stop_tables(rows: list[dict]) -> Tables:
    """A table per variant."""
    tables = []
    for name, group in grouped(rows, "variant").items():
        taken, lines = stops(group), []
        for label, here in grouped(group, "pipeline").items():
            mean = summary(here)
            numbers = [number(mean[key]) for key in ("error", "inside", "completeness")]
            count = str(taken[int(label)]) if label != "rule" else ""
            lines.append([label, *numbers, f"{mean['right']}/{mean['n']}", count])
        tables.append((name, ["solves", "error", "inside", "complete", "topology", "rule stops"], lines))
    return tables


def draw_stop(rows: list[dict], folder: Path) -> None:
    """The error over the number of solves, with rings where the rule stops."""
    figure, axes = sheet(3.2)
    styles = itertools.cycle(LOOKS.values())
    for (name, group), style in zip(grouped(rows, "variant").items(), styles, strict=False):
        means = {int(label): summary(here) for label, here in grouped(group, "pipeline").items() if label != "rule"}
        axes.plot(list(means), [mean["error"] for mean in means.values()], markersize=4, label=name, **style)
        for n, count in stops(group).items():
            if n in means:
                place, words = (n, means[n]["error"]), f"{count} of {means[n]['n']}"
                axes.plot(*place, "o", markersize=11, markerfacecolor="none", color=INK)
                axes.annotate(words, place, (0, 10), textcoords="offset points", ha="center", fontsize=9)
    axes.set(xlabel="solves; rings: the rule stops here", ylabel="mean error, local radii", yscale="log")
    plain_log(axes.yaxis)
    axes.legend(frameon=False)
    keep(figure, folder, "accuracy_solves")


def tracking(case: Case) -> dict:
    """How far reduced contractions are from the one without reduction after as many solves, in local radii."""
    points, axis = case.load()
    contraction = rings() | Contractor(reducer=LPRReducer())
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


def mass_tables(rows: list[dict]) -> Tables:
    """A table per variant, with the mean over its shapes."""
    measures = [f"{kind}_{what}" for kind in ("conserved", "published") for what in ("points", "mean", "hausdorff")]
    digits = {"solves": 0} | {name: 0 if name.endswith("points") else 3 for name in measures}
    columns = {"shape": "shape"} | {name.replace("_", " "): fixed(name, n) for name, n in digits.items()}
    tables = []
    for variant, here in grouped(rows, "variant").items():
        if known := good(here):
            here.append({"shape": "mean"} | {name: fmean(row[name] for row in known) for name in digits})
        tables.append(table(variant, here, columns))
    return tables


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


def turn_tables(rows: list[dict]) -> Tables:
    """A table per variant."""
    columns = {"shape": "shape", "turns": "runs"}
    columns |= {"topology changes": "topology_changes", "leaf changes": "leaf_changes"}
    columns |= {"median move": lambda row: number(median(row["moves"]))}
    columns |= {"largest move": lambda row: number(max(row["moves"]))}
    return [table(name, here, columns) for name, here in grouped(rows, "variant").items()]
