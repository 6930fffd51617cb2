"""The benchmark's scores of several tools: kept beside the code, as tables of docs/comparison.md, and drawn."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from _peers import PEERS, skeleton_of
from _tables import BLUE, ORANGE, ROOT, Table, keep, number, read, sheet, write_packed
from glsk_bench import BenchmarkFolder, Results, read_results
from glsk_bench.scoring import answer_files
from glsk_bench.table import mean_with_interval, told

from glsk_o3d import plot_skeleton, read_cloud, read_skeleton
from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.recipes.catalogue import named_pipeline

KEPT = ROOT / "benchmarks" / "v1"
SECONDS = KEPT / "seconds.json"
DECIMALS = 4  # of what is kept, far more than intervals are wide
GOLDEN = ROOT / "tests" / "golden"
KNOWN = {"y_unequal": (1, 0, 3), "torus": (1, 1, 0), "quadruped": (1, 0, 6)}  # components, loops, leaves

OURS = "default"
MEASURES = {  # what may be lost, its digits, and whether more of it is better
    "perfect": ("perfect", 2, True),
    "topology": ("topology", 2, True),
    "tips_f1": ("tips F1", 2, True),
    "junctions_f1": ("junctions F1", 2, True),
    "error": ("error", 3, False),
    "inside": ("inside", 3, True),
    "completeness": ("completeness", 3, True),
    "ends": ("ends", 2, False),
}
SHORT = {"clean": "clean", "scan2": "two cameras", "noise1": "1 % noise"}
NUMBER = re.compile(r"(?<!code )(?<!signal )\d+(?:\.\d+)?")  # of a reason; those of codes and signals are names
COLUMNS = 3
VIEW = (14, -60)  # elevation and azimuth, in degrees

Seconds = dict[str, dict[str, Any]]


class Entry(NamedTuple):
    """A tool's scores, and how its answers were made: commit, machine, versions, limit in seconds, hours of all."""

    results: Results
    made: dict[str, Any]

    @property
    def tool(self) -> str:
        return self.results.name


def keep_scores(results: Results, made: Mapping[str, Any]) -> Path:
    """Write the scores of a tool, packed; gives the path."""
    rows = [
        {name: round(value, DECIMALS) if isinstance(value, float) else value for name, value in row.items()}
        for row in results.rows
    ]
    hours = round(sum(row["seconds"] or 0 for row in rows) / 3600, 2)
    told = {"benchmark": results.benchmark, "name": results.name, "whole": results.whole, "clouds": rows}
    path = KEPT / f"{results.name}.json.gz"
    write_packed(path, {**told, "made": {**made, "hours": hours}})
    return path


def kept() -> list[Entry]:
    """All that is kept, in the order of the tools."""
    paths = {name: KEPT / f"{name}.json.gz" for name in PEERS}
    return [Entry(read_results(path), read(path)["made"]) for path in paths.values() if path.is_file()]


def seconds() -> dict[str, dict[str, Any]]:
    """The median CPU seconds `cpu` of each tool, and `where` they were measured; of those that were."""
    return read(SECONDS) if SECONDS.is_file() else {}


def recorded() -> Table:
    """Components, loops and leaves of what was recorded of the authors' code, and of ours from the same points."""
    lines = {"right": [" / ".join(map(str, known)) for known in KNOWN.values()]}
    for shape in KNOWN:
        with np.load(GOLDEN / f"{shape}_1024.npz") as file:
            arrays = dict(file)
        theirs = {"published code": "skeleton", "its baseline of 2010": "cao_skeleton"}
        found = {
            name: skeleton_of(arrays[f"{word}_vertices"], arrays[f"{word}_edges"]) for name, word in theirs.items()
        }
        names = ("wen2024", "cao2010", "default")
        found |= {f"`{name}`": named_pipeline(name)(arrays["points"]) for name in names}
        for name, it in found.items():
            lines.setdefault(name, []).append(f"{it.n_components} / {it.n_loops} / {len(it.leaves)}")
    return "components / loops / leaves", ["", *KNOWN], [[name, *cells] for name, cells in lines.items()]


def overview(board: Sequence[dict[str, Any]], cpu: Seconds) -> Table:
    """All tools over all clouds, the best first: the entries of a `Leaderboard`."""
    lines = []
    for entry in board:
        name, mean = entry["name"], entry["all"]
        shares = [told(*mean[measure]) for measure in ("perfect", "topology")]
        plain = [number(mean[measure][0], 2) for measure in ("tips_f1", "junctions_f1")]
        error = told(*mean["error"], 3) if mean["error"] else "-"
        rest = [number(mean[measure] and mean[measure][0], 3) for measure in ("inside", "completeness")]
        lines.append([*_label(name), *shares, *plain, error, *rest, str(mean["failures"]), _cpu(cpu, name)])
    heads = ["tips F1", "junctions F1", "error", "inside", "complete", "failures", "CPU s"]
    first = board[0]["all"]
    title = f"{first['clouds']} clouds of {first['shapes']} random shapes"
    return title, ["", "takes", "perfect", "topology", *heads], lines


def short(board: Sequence[dict[str, Any]], cpu: Seconds) -> Table:
    """The same in few columns, with the best way to run each tool alone."""
    best: dict[str, list[str]] = {}
    for entry in board:
        name, mean, groups = entry["name"], entry["all"], entry["variants"]
        tool = _label(name)[0].partition(",")[0]
        shares = [number(groups[it]["topology"][0], 2) for it in SHORT]
        error = number(mean["error"] and mean["error"][0], 2)
        cells = [*shares, number(mean["topology"][0], 2), number(mean["perfect"][0], 2), error]
        best.setdefault(tool, [tool, *cells, _cpu(cpu, name)])
    heads = ["", *SHORT.values(), "all 11 kinds", "perfect", "error", "CPU s"]
    return "right components and loops, share of the clouds", heads, list(best.values())


class Worse(NamedTuple):
    """Where the mean of `default` is worse than that of another tool."""

    clouds: str  # all, a variant or a family
    tool: str
    measure: str
    shapes: int
    means: list[float]  # theirs, ours
    difference: tuple[float, float, float]  # with its interval

    @property
    def clear(self) -> bool:
        """Whether the interval leaves out 0 as it is told."""
        _, low, high = self.difference
        digits = MEASURES[self.measure][1]
        return round(low, digits) * round(high, digits) > 0


def worse(entries: Sequence[Entry]) -> list[Worse]:
    """All of these, by clouds, tool and measure."""
    by_name = {entry.tool: {(row["shape"], row["variant"]): row for row in entry.results.rows} for entry in entries}
    ours, found = by_name.pop(OURS), []
    groups: dict[str, list] = {"all": [*ours]}
    for part in ("variant", "family"):
        for key, row in ours.items():
            groups.setdefault(row[part], []).append(key)
    for (group, here), (name, theirs), measure in product(groups.items(), by_name.items(), MEASURES):
        pairs = [(theirs[key][measure], ours[key][measure]) for key in here]
        known = [(key[0], pair) for key, pair in zip(here, pairs, strict=True) if None not in pair]
        if known:
            shapes, both = zip(*known, strict=True)
            difference = mean_with_interval(shapes, [other - mine for other, mine in both])
            _, digits, more = MEASURES[measure]
            if round(difference[0] if more else -difference[0], digits) > 0:
                means = [sum(side) / len(both) for side in zip(*both, strict=True)]
                found.append(Worse(group, name, measure, len({*shapes}), means, difference))
    return found


def losses(found: Sequence[Worse]) -> Table:
    """Where `default` is worse than another tool, whatever shapes are drawn: intervals without 0."""
    lines = []
    for it in found:
        if it.clear:
            words, digits, _ = MEASURES[it.measure]
            means = [number(mean, digits) for mean in it.means]
            difference = told(*it.difference, digits, sign="+")
            lines.append([it.clouds, str(it.shapes), words, _from(it.tool), *means, difference])
    header = ["clouds", "shapes", "measure", "to", "theirs", "`default`", "difference"]
    return "where `default` is worse", header, lines


def unclear(found: Sequence[Worse]) -> Table:
    """Where the mean of `default` is worse, and other shapes could turn it: intervals with 0."""
    groups: dict[tuple[str, str], list[str]] = {}
    for it in found:
        if not it.clear:
            words, digits, _ = MEASURES[it.measure]
            groups.setdefault((words, _from(it.tool)), []).append(f"{it.clouds} ({it.difference[0]:+.{digits}f})")
    lines = [[*key, ", ".join(places)] for key, places in groups.items()]
    return "where only the mean of `default` is worse", ["measure", "to", "which"], lines


def by_group(entries: Sequence[Entry], group: str, measure: str, digits: int, title: str) -> Table:
    """The mean of a measure for each tool, by variant or by family, with intervals."""
    rows = entries[0].results.rows
    names = list(dict.fromkeys(row[group] for row in rows))
    sizes = Counter(row[group] for row in rows)
    lines = []
    for entry in entries:
        cells = []
        for name in names:
            known = [row for row in entry.results.rows if row[group] == name and row[measure] is not None]
            found = mean_with_interval([row["shape"] for row in known], [row[measure] for row in known])
            cells.append(told(*found, digits))
        lines.append([*_label(entry.tool), *cells])
    return title, ["", "takes", *(f"{name} ({sizes[name]})" for name in names)], lines


def failures(entries: Sequence[Entry]) -> Table:
    """Which clouds have no answer, by tool and reason."""
    lines = []
    for entry in entries:
        groups: dict[str, list[tuple[str, str]]] = {}  # by the words of the reason, whatever its numbers
        for row in entry.results.rows:
            if row["failure"] is not None:
                reason = row["failure"].removeprefix("no answer: ").replace("|", "/").split("\n")[0]
                groups.setdefault(NUMBER.sub("#", reason), []).append((reason, f"{row['shape']}_{row['variant']}"))
        for group in groups.values():
            reasons, names = zip(*group, strict=True)
            lines.append([*_label(entry.tool), _span(reasons), str(len(names)), ", ".join(names)])
    return "failures", ["", "takes", "why", "clouds", "which"], lines


def runs(entries: Sequence[Entry]) -> Table:
    """What the runs took, and what was run."""
    lines = []
    for entry in entries:
        made = entry.made
        packages = ", ".join(f"{name} {version}" for name, version in made["packages"].items()) or "glsk-o3d"
        lines.append([*_label(entry.tool), packages, str(made["commit"]), number(made["hours"], 2)])
    hours = sum(entry.made["hours"] for entry in entries)
    return "runs", ["", "takes", "packages", "commit", "hours"], [*lines, ["all", "", "", "", number(hours, 1)]]


def _cpu(cpu: Seconds, name: str) -> str:
    return number(cpu[name]["cpu"], 2) if name in cpu else "-"


def _from(name: str) -> str:
    return " of ".join(_label(name))


def _label(name: str) -> tuple[str, str]:
    return PEERS[name].label, PEERS[name].takes


def _span(reasons: Sequence[str]) -> str:
    """What all say in the same words, with the least and the most of each number."""
    spans = []
    for column in zip(*map(NUMBER.findall, reasons), strict=True):
        least, most = min(column, key=float), max(column, key=float)
        spans.append(least if least == most else f"{least} to {most}")
    each = iter(spans)
    return NUMBER.sub(lambda _: next(each), reasons[0])


def draw_board(rows: list[dict[str, Any]], folder: Path) -> None:
    """The entries of a `Leaderboard`, with intervals: right topologies and perfect ones, and errors."""
    places = np.arange(len(rows))
    figure, (left, right) = sheet(1.1 + 0.27 * len(rows), columns=2, sharey=True, width=7.0)
    for axes, measures in ((left, ("topology", "perfect")), (right, ("error",))):
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color="#e4e4e4", linewidth=0.8, zorder=0)
        axes.tick_params(axis="y", length=0)
        for measure in measures:
            means, low, high = np.transpose([row["all"][measure] or [np.nan] * 3 for row in rows])
            style = dict(color=ORANGE if measure == "perfect" else BLUE)
            axes.hlines(places, low, high, linewidth=2, **style)
            axes.plot(means, places, "o", markersize=5, label=measure if axes is left else None, **style)
    left.set(xlabel="share of all clouds", xlim=(-0.02, 1), ylim=(len(rows) - 0.5, -0.5))
    left.set_yticks(places, [title(row["name"]) for row in rows])
    right.set(xlabel="mean error, local radii", xscale="log")
    ticks = [0.1, 0.2, 0.5, 1, 2, 5]
    right.set_xticks(ticks, map(str, ticks))
    right.minorticks_off()
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    keep(figure, folder, "leaderboard")


def title(name: str) -> str:
    """A tool as pictures name it."""
    peer = PEERS[name]
    return peer.label.strip("`") if peer.takes == "points" else f"{peer.label}, {peer.takes.split()[-1]}"


def draw_answers(bench: BenchmarkFolder, answers: Path, cloud: str, entries: list[Entry], path: Path) -> None:
    """The skeletons of a cloud, each with its error and what is wrong with its topology."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    (where,) = (each.path for each in bench.clouds if each.name == cloud)
    points = cloud_points(read_cloud(where))
    lines = -(-len(entries) // COLUMNS)
    figure = Figure((3.4 * COLUMNS, 2.7 * lines), dpi=150, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for i, entry in enumerate(entries):
        axes = figure.add_subplot(lines, COLUMNS, i + 1, projection="3d")
        found = answer_files(answers / entry.tool).get(cloud)
        plot_skeleton(read_skeleton(found[0]) if found else None, axes, cloud=points, view=VIEW)
        axes.set_title(caption(entry, cloud), fontsize=9)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[:, :, :3]
    image = Image.fromarray(pixels).quantize(32)  # a fifth of the size of a figure's
    write_atomically(path, lambda temporary: image.save(temporary, "PNG", optimize=True))


def caption(entry: Entry, cloud: str) -> str:
    """What stands above a skeleton."""
    (row,) = (row for row in entry.results.rows if f"{row['shape']}_{row['variant']}" == cloud)
    label = title(entry.tool)
    if row["failure"] is not None:
        return f"{label}\n{row['failure']}"
    off = ", ".join(f"{name} {row[name]:+d}" for name in ("components", "loops") if row[name])
    return f"{label}\nerror {row['error']:.2f}, {off or 'right topology'}"
