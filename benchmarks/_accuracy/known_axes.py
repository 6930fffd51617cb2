"""Tables of pipelines on shapes with known axes."""

from __future__ import annotations

from _common.results import summary
from _common.tables import Table, Tables, number
from glsk_bench.table import mean_with_interval, told

from .measuring import by_family, by_pipeline, by_variant

MEASURES = {"tips_f1": "tips F1", "junctions_f1": "junctions F1", "length": "length"}


def wrong(row: dict) -> str:
    """What is wrong with the topology of a row: nothing, loops and components too many or too few, or everything."""
    if "failure" in row:
        return f"{row['shape']} ({row['failure']})"
    off = [f"{row[name]:+d} {name}" for name in ("loops", "components") if row[name]]
    return f"{row['shape']} {' '.join(off)}" if off else ""


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
    groups = {"cloud": with_all(by_variant(random_shapes(rows))), "family": by_family(rows)}
    return [_measures(kind, each) for kind, each in groups.items() if kind == "cloud" or len(each) > 1]


def _measures(kind: str, groups: dict[str, list[dict]]) -> Table:
    lines = []
    for name, group in groups.items():
        for place, (label, here) in enumerate(by_pipeline(group).items()):
            mean = summary(here)
            shares = [told(*share(here, what)) for what in ("topology", "perfect")]
            measures = [number(mean["error"]), *(number(mean[what], 2) for what in (*MEASURES, "cpu"))]
            lines.append([name * (place == 0), f"`{label}`", str(mean["n"]), *shares, *measures])
    header = [kind, "pipeline", "clouds", "topology", "perfect", "error", *MEASURES.values(), "CPU s"]
    return f"by {kind}: means, and 95 % intervals", header, lines


def details(rows: list[dict]) -> Tables:
    """The other measures, a table per variant, with the names of what is bad."""
    header = ["", "inside", "complete", "ends", "radius", "worst", "wrong"]
    tables = []
    for variant, group in by_variant(rows).items():
        lines = []
        for label, here in by_pipeline(group).items():
            mean = summary(here)
            last = sorted((row for row in here if "failure" not in row), key=lambda row: -row["error"])[:3]
            numbers = [number(mean[key]) for key in ("inside", "completeness")]
            numbers += [number(mean[key], 2) for key in ("ends", "radius_error")]
            worst = ", ".join(f"{row['shape']} {row['error']:.2f}" for row in last)
            lines.append([label, *numbers, worst, ", ".join(filter(None, map(wrong, here)))])
        tables.append((variant, header, lines))
    return tables
