"""The benchmark's scores of several tools: kept beside the code, as tables of docs/comparison.md, and drawn."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

import numpy as np
import typer
from glsk_bench import BenchmarkFolder, Repeat, Results, leaderboard, read_results
from glsk_bench.repeating import PLACES
from glsk_bench.scoring import OF_THINGS, answer_files
from glsk_bench.table import mean_with_interval, told

from glsk_o3d import plot_skeleton, read_cloud, read_skeleton
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.recipes.catalogue import named_pipeline

from .peers import PEERS, peers_of, skeleton_of
from .tables import BLUE, ORANGE, ROOT, Table, grouped, keep, number, read, save_figure, sheet, write_packed

KEPT = ROOT / "benchmarks"  # a folder of it for each version of the benchmark
KINDS = {"things": "v3", "tubes": "v1"}  # of shapes, and the version of which answers are kept
DECIMALS = 4  # of what is kept, far more than intervals are wide
GOLDEN = ROOT / "tests" / "golden"
KNOWN = {"y_unequal": (1, 0, 3), "torus": (1, 1, 0), "quadruped": (1, 0, 6)}  # components, loops, leaves

OURS = "default"
FIRST = ("perfect", "topology", "tips_f1", "junctions_f1", "error")
LEAST_SHAPES = 3  # of which a difference is told
MEASURES = {  # what may be lost, its digits, and whether more of it is better; of what has a sign, its size counts
    "perfect": ("perfect", 2, True),
    "topology": ("topology", 2, True),
    "tips_f1": ("tips F1", 2, True),
    "junctions_f1": ("junctions F1", 2, True),
    "error": ("error", 3, False),
    "inside": ("inside", 3, True),
    "completeness": ("completeness", 3, True),
    "ends": ("ends", 2, False),
    "hooks": ("hooks", 2, False),
    "reach": ("reach", 2, False),
    "wiggle": ("wiggle", 3, False),
    "mirror": ("mirror", 3, False),
    "junction_offset": ("junction offset", 2, False),
}
NUMBER = re.compile(r"(?<!code )(?<!signal )\d+(?:\.\d+)?")  # of a reason; those of codes and signals are names
VIEW = (14, -60)  # elevation and azimuth, in degrees
SPREAD = ("moved", "agree", "loops", "ends")  # of several clouds of an object, with intervals

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
    path = kept_file(results.benchmark, f"{results.name}.json.gz")
    path.parent.mkdir(exist_ok=True)
    write_packed(path, {**told, "made": {**made, "hours": hours}})
    return path


def kept_file(version: str, name: str) -> Path:
    """The path of what is kept of a version of the benchmark."""
    return KEPT / version / name


def read_kept(version: str, name: str) -> dict[str, Any]:
    """What is kept there, or nothing."""
    path = kept_file(version, name)
    return read(path) if path.is_file() else {}


def kept(version: str) -> list[Entry]:
    """All scores that are kept, in the order of the tools."""
    paths = [kept_file(version, f"{name}.json.gz") for name in PEERS]
    return [Entry(read_results(path), read(path)["made"]) for path in paths if path.is_file()]


def keep_ten(version: str, found: Mapping[str, Any]) -> Path:
    """Write some answers and their scores, packed; gives the path."""
    path = kept_file(version, "ten.json.gz")
    write_packed(path, dict(found))
    return path


def keep_seconds(version: str, found: Seconds) -> None:
    """Keep the median CPU seconds `cpu` of some tools, their memory `mb`, and `where` that was, with what is there."""
    path = kept_file(version, "seconds.json")
    path.parent.mkdir(exist_ok=True)
    write_json(path, seconds(version) | found)


def seconds(version: str) -> Seconds:
    """What `keep_seconds` has kept."""
    return read_kept(version, "seconds.json")


def keep_repeat(version: str, objects: str, found: Repeat, made: Mapping[str, Any]) -> Path:
    """Keep how far a tool's answers to several clouds of each object are apart, beside those of others."""
    name = f"repeat_{objects}.json.gz"
    path, before = kept_file(version, name), read_kept(version, name)
    if any(each["benchmark"] != found.benchmark for tool, each in before.items() if tool != found.name):
        raise typer.BadParameter(f"{path} has other clouds: remove it, and run all tools anew")
    path.parent.mkdir(exist_ok=True)
    write_packed(path, before | {found.name: {**found.as_dict(), "made": dict(made)}})
    return path


def repeats(version: str, objects: str) -> list[Repeat]:
    """What `keep_repeat` has kept, in the order of the tools."""
    found = read_kept(version, f"repeat_{objects}.json.gz")
    return [Repeat(found[name]["benchmark"], name, found[name]["objects"]) for name in PEERS if name in found]


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


def ranked(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """The entries of a `Leaderboard`, of which some may have a part of the clouds; the best first."""
    rows = [leaderboard([entry.results]).entries[0] for entry in entries]
    return sorted(rows, key=lambda row: [-row["all"][measure][0] for measure in ("perfect", "topology")])


def overview(board: Sequence[dict[str, Any]], cpu: Seconds, kind: str) -> Table:
    """All tools over all clouds, the best first: what `ranked` gives."""
    lines, more = [], [name for name in OF_THINGS if name in MEASURES and any(entry["all"][name] for entry in board)]
    for entry in board:
        name, mean = entry["name"], entry["all"]
        shares = [told(*mean[measure]) for measure in ("perfect", "topology")]
        plain = [number(mean[measure][0], 2) for measure in ("tips_f1", "junctions_f1")]
        error = told(*mean["error"], 3) if mean["error"] else "-"
        rest = [number(mean[measure] and mean[measure][0], 3) for measure in ("inside", "completeness")]
        rest += [told(*mean[it], MEASURES[it][1]) if mean[it] else "-" for it in more]
        counts = [str(mean["clouds"]), str(mean["failures"])]
        lines.append([*_label(name, kind), *shares, *plain, error, *rest, *counts, _fact(cpu, name, "cpu", 2)])
    heads = ["tips F1", "junctions F1", "error", "inside", "complete"]
    heads += [*(MEASURES[it][0] for it in more), "clouds", "failures", "CPU s"]
    return _size(board), ["", "takes", "perfect", "topology", *heads], lines


def both(things: Sequence[dict[str, Any]], tubes: Sequence[dict[str, Any]], cpu: Seconds) -> Table:
    """The same in few columns, of things and of tubes."""
    of_things, of_tubes = ({entry["name"]: entry for entry in board} for board in (things, tubes))
    lines = []
    for name in {**of_things, **of_tubes}:
        cells = ["-"] * 4
        if entry := of_things.get(name):
            mean = entry["all"]
            shares = [told(*mean["perfect"]), told(*mean["topology"])]
            cells = [*shares, *(number(mean[measure] and mean[measure][0], 2) for measure in ("tips_f1", "error"))]
            cells[0] += _part(things, mean)
        here = [board[name]["all"] for board in (of_things, of_tubes) if name in board]
        there = of_tubes[name]["all"] if name in of_tubes else {}
        cells += [number((there.get(it) or [None])[0], 2) for it in ("perfect", "topology", "error")]
        cells += [str(sum(mean["failures"] for mean in here)), _fact(cpu, name, "cpu", 2), _fact(cpu, name, "mb", 0)]
        label, takes = _label(name, "things")
        on_tubes = _label(name, "tubes")[1]
        lines.append([label, takes if takes == on_tubes else f"{takes}; tubes: {on_tubes}", *cells])
    heads = ["things: perfect", "topology", "tips F1", "error", "tubes: perfect", "topology", "error"]
    title = f"things: {_size(things)}; tubes: {_size(tubes)}"
    return title, ["", "takes", *heads, "failures", "CPU s", "MB"], lines


def short(things: Sequence[dict[str, Any]], tubes: Sequence[dict[str, Any]], cpu: Seconds) -> Table:
    """In fewer columns, with the best way to run each tool alone."""
    cells: dict[str, list[str]] = {}
    spent: dict[str, str] = {}
    for board in (things, tubes):
        best: dict[str, list[str]] = {}
        for entry in board:
            mean = entry["all"]
            shares = [number(mean[it] and mean[it][0], 2) for it in ("topology", "perfect", "error")]
            best.setdefault(_tool(entry["name"]), [shares[0] + _part(board, mean), *shares[1:]])
            spent.setdefault(_tool(entry["name"]), _fact(cpu, entry["name"], "cpu", 2))
        for tool in {**cells, **best}:
            done = cells.setdefault(tool, ["-"] * 3 if board is tubes else [])
            done += best.get(tool, ["-"] * 3)
    heads = [head for kind in ("things", "tubes") for head in (f"{kind}: topology", "perfect", "error")]
    lines = [[tool, *row, spent[tool]] for tool, row in cells.items()]
    return f"things: {_size(things)}; tubes: {_size(tubes)}", ["", *heads, "CPU s"], lines


def _part(board: Sequence[dict[str, Any]], mean: Mapping[str, Any]) -> str:
    """How many clouds a mean is of, if others of the board are of more."""
    return f" of {mean['clouds']}" if mean["clouds"] < max(entry["all"]["clouds"] for entry in board) else ""


def _size(board: Sequence[dict[str, Any]]) -> str:
    """How many clouds and shapes, of the tool that has most."""
    first = max((entry["all"] for entry in board), key=lambda mean: mean["clouds"])
    return f"{first['clouds']} clouds of {first['shapes']} random shapes"


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
    """All of these, by clouds, tool and measure; fewer than three shapes have no interval to speak of.

    Of one family as one kind of cloud there are those of the first measures, with an interval without 0.
    """
    by_name = {entry.tool: {(row["shape"], row["variant"]): row for row in entry.results.rows} for entry in entries}
    ours, found = by_name.pop(OURS, {}), []
    groups: dict[str, list] = {"all": [*ours]}
    for part in ("variant", "family"):
        for key, row in ours.items():
            groups.setdefault(row[part], []).append(key)
    parts = {*groups}
    for key, row in ours.items():
        groups.setdefault(f"{row['family']} {row['variant']}", []).append(key)
    for (group, here), (name, theirs), measure in product(groups.items(), by_name.items(), MEASURES):
        if group not in parts and measure not in FIRST:
            continue
        pairs = [(key[0], (theirs[key][measure], ours[key][measure])) for key in here if key in theirs]
        known = [(shape, (abs(a), abs(b))) for shape, (a, b) in pairs if a is not None and b is not None]
        if len({shape for shape, _ in known}) >= LEAST_SHAPES:
            shapes, both = zip(*known, strict=True)
            difference = mean_with_interval(shapes, [other - mine for other, mine in both])
            _, digits, more = MEASURES[measure]
            if round(difference[0] if more else -difference[0], digits) > 0:
                means = [sum(side) / len(both) for side in zip(*both, strict=True)]
                it = Worse(group, name, measure, len({*shapes}), means, difference)
                found += [it] if group in parts or it.clear else []
    return found


def losses(found: Mapping[str, Sequence[Worse]]) -> Table:
    """Where `default` is worse whatever shapes are drawn, intervals without 0: by kind, to the best other alone.

    Of a family as several kinds of clouds that with the largest difference stands for all.
    """
    lines = []
    for kind, here in found.items():
        groups: dict[tuple[str, str, bool], list[Worse]] = {}
        for it in here:
            if it.clear:
                where = it.clouds.partition(" ")[0]
                groups.setdefault((where, it.measure, " " in it.clouds), []).append(it)
        for (_, measure, _), those in groups.items():
            words, digits, _ = MEASURES[measure]
            best = max(those, key=lambda it: abs(it.difference[0]))
            means = [number(mean, digits) for mean in best.means]
            _, *interval = (f"{end:+.{digits}f}" for end in best.difference)
            tools, clouds = ({getattr(it, fact) for it in those} for fact in ("tool", "clouds"))
            more = str(len(tools) - 1) if len(tools) > 1 else ""
            further = f", {len(clouds) - 1} more" if len(clouds) > 1 else ""
            where = [f"{kind}, {best.clouds}{further}", words, _from(best.tool, kind)]
            lines.append([*where, *means, " to ".join(interval), more])
    header = ["clouds", "measure", "to", "theirs", "`default`", "difference", "others"]
    return "where `default` is worse", header, lines


def all_losses(found: Sequence[Worse], kind: str) -> Table:
    """All of these by tool, and where the mean alone is worse, so that other shapes could turn it."""
    groups: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    for it in found:
        words, digits, _ = MEASURES[it.measure]
        groups.setdefault((_from(it.tool, kind), words), ([], []))[not it.clear].append(
            f"{it.clouds} {it.difference[0]:+.{digits}f}"
        )
    lines = [[*key, *map(", ".join, places)] for key, places in groups.items()]
    return "where the mean of `default` is worse", ["to", "measure", "interval without 0", "with 0"], lines


def interval(rows: Sequence[dict[str, Any]], measure: str, digits: int = 2, of: str = "shape") -> str:
    """The mean of a measure over the rows that have it, with its interval from drawing shapes or objects anew."""
    known = [row for row in rows if row[measure] is not None]
    return told(*mean_with_interval([row[of] for row in known], [row[measure] for row in known]), digits)


def by_group(entries: Sequence[Entry], group: str, kind: str) -> Table:
    """Right topologies, perfect ones and the error of each tool, by variant or by family."""
    most = max(entries, key=lambda entry: len(entry.results.rows)).results.rows
    lines, measures = [], ("topology", "perfect", "error")
    for entry in entries:
        groups, cells = grouped(entry.results.rows, group), []
        for name in dict.fromkeys(row[group] for row in most):
            known = [[row[it] for row in groups.get(name, ()) if row[it] is not None] for it in measures]
            cells.append(" / ".join(number(fmean(it) if it else None, 2) for it in known))
        part = "" if len(entry.results.rows) == len(most) else f", {len(entry.results.rows)} clouds"
        label, takes = _label(entry.tool, kind)
        lines.append([f"{label}{part}", takes, *cells])
    sizes = Counter(row[group] for row in most)
    title = f"topology / perfect / error, by {'kind of cloud' if group == 'variant' else group}"
    return title, ["", "takes", *(f"{name} ({size})" for name, size in sizes.items())], lines


def repeated(found: Sequence[Repeat]) -> Table:
    """How far the answers to several clouds of each object are apart, the nearest first."""
    lines = []
    for it in sorted(found, key=lambda each: _last(each.means()["moved"])):
        means, cells = it.means(), {name: interval(it.rows, name, of="object") for name in SPREAD}
        where = [number((means["where"] or {}).get(place), 2) for place in PLACES]
        moved = [cells["moved"], number(means["median"], 2), *where]
        rest = [*(cells[name] for name in ("agree", "loops", "ends")), number(means["hooks"], 2)]
        double = [number((means["float32"] or {}).get(name), 2) for name in ("moved", "agree")]
        lines.append([*_label(it.name, "things"), *moved, *rest, *double, str(means["failures"])])
    means = found[0].means()
    heads = ["moved", "median", "near ends", "near junctions", "elsewhere", "limbs", "agree", "loops", "ends", "hooks"]
    heads += ["float32: moved", "float32: agree"]
    title = f"{means['draws']} clouds of {means['objects']} objects"
    return title, ["", "takes", *heads, "failures"], lines


def _last(value: float | None) -> float:
    return float("inf") if value is None else value


def failures(entries: Mapping[str, Sequence[Entry]]) -> Table:
    """How many clouds have no answer, by kind, tool and reason, and of which variants."""
    lines = []
    for kind, here in entries.items():
        for entry in here:
            groups: dict[str, list[tuple[str, str]]] = {}  # by the words of the reason, whatever its numbers
            for row in entry.results.rows:
                if row["failure"] is not None:
                    reason = row["failure"].removeprefix("no answer: ").replace("|", "/").split("\n")[0]
                    groups.setdefault(NUMBER.sub("#", reason), []).append((reason, row["variant"]))
            for group in groups.values():
                reasons, variants = zip(*group, strict=True)
                which = ", ".join(f"{name} {n}" for name, n in Counter(variants).most_common())
                label, takes = _label(entry.tool, kind)
                lines.append([f"{kind}: {label}", takes, _span(reasons), which])
    return "failures", ["", "takes", "why", "which"], lines


def runs(entries: Mapping[str, Sequence[Entry]]) -> Table:
    """What the runs took, and what was run."""
    lines, everything = [], [entry for here in entries.values() for entry in here]
    for tool in dict.fromkeys(entry.tool for entry in everything):
        these = {kind: entry.made for kind, here in entries.items() for entry in here if entry.tool == tool}
        packages = {name: version for made in these.values() for name, version in made["packages"].items()}
        words = ", ".join(f"{name} {version}" for name, version in packages.items()) or "glsk-o3d"
        cells = [
            cell
            for kind in entries
            for cell in (
                [these[kind]["commit"] or "-", number(these[kind]["hours"], 2)] if kind in these else ["-"] * 2
            )
        ]
        lines.append([*_label(tool, next(iter(these))), words, *cells])
    heads = [head for kind in entries for head in (f"{kind}: commit", "hours")]
    total = f"runs, {number(sum(entry.made['hours'] for entry in everything), 1)} hours of all"
    return total, ["", "takes", "packages", *heads], lines


def _fact(cpu: Seconds, name: str, fact: str, digits: int) -> str:
    return number(cpu.get(name, {}).get(fact), digits)


def _tool(name: str) -> str:
    return _label(name, "things")[0].partition(",")[0]


def _from(name: str, kind: str) -> str:
    return " of ".join(_label(name, kind))


def _label(name: str, kind: str) -> tuple[str, str]:
    """What tables call a tool, and what it takes of shapes of a kind."""
    peer = peers_of(KINDS[kind])[name]
    return peer.label, peer.takes


def _span(reasons: Sequence[str]) -> str:
    """What all say in the same words, with the least and the most of each number."""
    spans = []
    for column in zip(*map(NUMBER.findall, reasons), strict=True):
        least, most = min(column, key=float), max(column, key=float)
        spans.append(least if least == most else f"{least} to {most}")
    each = iter(spans)
    return NUMBER.sub(lambda _: next(each), reasons[0])


def draw_board(rows: list[dict[str, Any]], folder: Path, name: str) -> None:
    """The entries of a `Leaderboard`, with intervals: right topologies and perfect ones, and errors; as NAME.png."""
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
    keep(figure, folder, name)


def title(name: str) -> str:
    """A tool as pictures name it."""
    peer = PEERS[name]
    return peer.label.strip("`") if peer.takes == "points" else f"{peer.label}, {peer.takes.split()[-1]}"


def draw_answers(bench: BenchmarkFolder, answers: Path, cloud: str, entries: list[Entry], path: Path) -> None:
    """The skeletons of a cloud, three in a row, each with its error and what is wrong with its topology."""
    (where,) = (each.path for each in bench.clouds if each.name == cloud)
    points, lines = cloud_points(read_cloud(where)), -(-len(entries) // 3)
    figure, _ = sheet(2.7 * lines, lines, 3, width=10.2, subplot_kw=dict(projection="3d"))
    for axes, entry in zip(figure.axes, entries, strict=False):
        found = answer_files(answers / entry.tool).get(cloud)
        plot_skeleton(read_skeleton(found[0]) if found else None, axes, cloud=points, view=VIEW)
        axes.set_title(caption(entry, cloud), fontsize=9)
    save_figure(figure, path)


def caption(entry: Entry, cloud: str) -> str:
    """What stands above a skeleton."""
    (row,) = (row for row in entry.results.rows if f"{row['shape']}_{row['variant']}" == cloud)
    label = title(entry.tool)
    if row["failure"] is not None:
        return f"{label}\n{row['failure']}"
    off = ", ".join(f"{name} {row[name]:+d}" for name in ("components", "loops") if row[name])
    return f"{label}\nerror {row['error']:.2f}, {off or 'right topology'}"
