"""What every idea of the method contributes: `default` with each of them switched off."""

from __future__ import annotations

import re
from pathlib import Path

from _common.command_line import PUBLISHED
from _common.results import pick, summary
from _common.tables import Tables, number
from glsk_bench.table import mean_with_interval, told

from glsk_o3d.interop.atomic import write_atomically

from .measuring import by_pipeline, by_variant

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
    "unsupported vertices dropped": "Connector.min_support=0",
    "shortest edge first": "Refiner.collapse=degree",
    "false loops closed": "Refiner.handle=0",
    "air cut": "Refiner.air=0",
    "gaps bridged": "Refiner.bridge=0",
    "spurs cut": "Refiner.limb=0",
    "edges subdivided": "Refiner.spacing=0",
    "fit to the axis": "Refiner.recentre=0",
    "thin parts traced": "Refiner.surface=0",
}
"""What `default` adds to the publications, and the settings that switch it off. All of them together (but for the
reduction and the stop rule, which are published) are `wen2024`."""


WORTH = dict(perfect=2, topology=2, error=3)
"""The digits of what is compared cloud by cloud."""


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


def worth_tables(rows: list[dict]) -> Tables:
    """How `default` changes without each idea, cloud by cloud, with intervals; by the topologies that are lost."""
    groups, lines = by_pipeline(rows), []
    whole = {_cloud(row): row for row in groups["default"]}
    ideas = sorted(IDEAS.keys() & groups.keys(), key=lambda name: (_mean(groups[name], "topology"), name))
    for name in [*ideas, *(name for name in PUBLISHED if name in groups)]:
        pairs = [(whole[_cloud(row)], row) for row in groups[name]]
        changes = [_change(pairs, measure, digits) for measure, digits in WORTH.items()]
        lines.append([f"without {name}" if name in IDEAS else f"`{name}`", *changes, *_most(pairs), _setting(name)])
    first = ["`default`", *(number(_mean(whole.values(), it), digits) for it, digits in WORTH.items()), "", "", ""]
    header = ["", *WORTH, "most in", "topology there", "setting"]
    return [(f"what {len(whole)} clouds lose without each idea", header, [first, *lines])]


def of_worth(rows: list[dict]) -> list[dict]:
    """Of each row no more than `worth_tables` needs."""
    names = ("pipeline", "variant", "shape", "draw", *WORTH, "failure")
    short = [{name: row[name] for name in names if name in row} for row in rows]
    return [row | {"error": round(row["error"], 4)} if "error" in row else row for row in short]


def _value(row, measure):
    """A failure has the wrong topology, and no error."""
    return row.get(measure, None if measure == "error" else False)


def _change(pairs, measure, digits):
    """The mean difference from with to without, with its interval."""
    values = [(old["shape"], _value(old, measure), _value(new, measure)) for old, new in pairs]
    shapes, before, after = zip(*(it for it in values if None not in it), strict=True)
    return told(*mean_with_interval(shapes, [b - a for a, b in zip(before, after, strict=True)]), digits, sign="+")


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


def _mean(rows, measure):
    known = [value for row in rows if (value := _value(row, measure)) is not None]
    return sum(known) / len(known)


def _setting(name):
    return f"`{IDEAS[name]}`" if name in IDEAS else ""


def _cloud(row):
    return row["variant"], row["shape"], row["draw"]


def ablation_tables(rows: list[dict]) -> Tables:
    """`default`, the ideas by how much is lost without them, and the publications."""
    variants, (mean, ideas) = by_variant(rows), losses(rows)
    lines = []
    for name in ["default", *ideas, *(name for name in PUBLISHED if name in mean)]:
        parts = [summary(pick(group, pipeline=name)) for group in variants.values()]
        cells = [cell(part) for part in (*parts, mean[name])]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (name, "")
        lines.append([label, *cells, setting])
    titles = [f"{variant} ({len(pick(group, pipeline='default'))})" for variant, group in variants.items()]
    header = ["", *titles, f"all ({mean['default']['n']})", "setting"]
    return [("one idea off at a time", header, lines)]
