"""Tables of pipelines on shapes with known axes."""

from __future__ import annotations

from _common.results import summary
from _common.tables import Tables, number

from .measuring import by_pipeline, by_variant


def wrong(row: dict) -> str:
    """What is wrong with the topology of a row: nothing, loops and components too many or too few, or everything."""
    if "failure" in row:
        return f"{row['shape']} ({row['failure']})"
    off = [f"{row[name]:+d} {name}" for name in ("loops", "components") if row[name]]
    return f"{row['shape']} {' '.join(off)}" if off else ""


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
