"""The tables of docs/comparison.md: all tools over all clouds, losses, variants, families, failures."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

from _common.tables import Table, number
from _peers import PEERS
from glsk_bench.table import mean_with_interval, told

from .kept import Entry

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
SHORT = {"clean": "clean", "scan2": "two cameras", "depth2": "two depth cameras", "lidar": "lidar"}
SHORT |= {"noise1": "1 % noise"}
NUMBER = re.compile(r"(?<!code )(?<!signal )\d+(?:\.\d+)?")  # of a reason; those of codes and signals are names
Row = dict[str, Any]
Seconds = dict[str, dict[str, Any]]


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
    """The same in few columns, with right topologies of some kinds of clouds."""
    lines = []
    for entry in board:
        name, mean, groups = entry["name"], entry["all"], entry["variants"]
        shares = [number(groups[it]["topology"][0], 2) for it in SHORT]
        error = number(mean["error"] and mean["error"][0], 2)
        cells = [*shares, number(mean["topology"][0], 2), number(mean["perfect"][0], 2), error]
        lines.append([*_label(name), *cells, _cpu(cpu, name)])
    heads = ["", "takes", *SHORT.values(), "all 11 kinds", "perfect", "error", "CPU s"]
    return "right parts and loops, share of the clouds", heads, lines


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
    by_name = {entry.tool: _by_cloud(entry) for entry in entries}
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
                reason = _reason(row["failure"])
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


def _by_cloud(entry: Entry) -> dict[tuple[str, str], Row]:
    return {(row["shape"], row["variant"]): row for row in entry.results.rows}


def _from(name: str) -> str:
    return " of ".join(_label(name))


def _label(name: str) -> tuple[str, str]:
    return PEERS[name].label, PEERS[name].takes


def _reason(failure: str) -> str:
    """Its first line, as a table can hold it."""
    return failure.removeprefix("no answer: ").replace("|", "/").split("\n")[0]


def _span(reasons: Sequence[str]) -> str:
    """What all say in the same words, with the least and the most of each number."""
    spans = []
    for column in zip(*map(NUMBER.findall, reasons), strict=True):
        least, most = min(column, key=float), max(column, key=float)
        spans.append(least if least == most else f"{least} to {most}")
    each = iter(spans)
    return NUMBER.sub(lambda _: next(each), reasons[0])
