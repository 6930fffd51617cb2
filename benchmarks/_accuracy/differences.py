"""Two results, cloud by cloud."""

from __future__ import annotations

import typer
from _common.tables import Tables, number
from glsk_bench.table import mean_with_interval, told

from .known_axes import random_shapes, with_all
from .measuring import by_pipeline, by_variant

CLOUD = ("pipeline", "variant", "shape", "draw")  # what one row of a result is of
DIGITS = dict(topology=2, perfect=2, error=3)  # of what is compared


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
    for variant, group in with_all(by_variant(random_shapes(pairs))).items():
        for label, here in by_pipeline(group).items():
            changes = [cell for name in DIGITS for cell in _change(here, name)]
            names = [_changed(here, now) for now in (True, False)]
            words = [str(len(each)) if variant == "all" else ", ".join(each) for each in names]
            lines.append([variant, f"`{label}`", str(len(here)), *changes, *words])
    header = ["cloud", "pipeline", "clouds", *(word for name in DIGITS for word in (name, "change"))]
    return [("differences, and 95 % intervals", [*header, "now right", "now wrong"], lines)]


def _change(pairs, name):
    """The means of a measure before and after, and of the difference; an error only where there are two."""
    values = [[row.get(name, None if name == "error" else False) for row in pair["rows"]] for pair in pairs]
    known = [(pair["shape"], *both) for pair, both in zip(pairs, values, strict=True) if None not in both]
    if not known:
        return "-", "-"
    shapes, before, after = zip(*known, strict=True)
    means = [sum(each) / len(known) for each in (before, after)]
    change = mean_with_interval(shapes, [new - old for old, new in zip(before, after, strict=True)])
    digits = DIGITS[name]
    return " → ".join(number(mean, digits) for mean in means), told(*change, digits, sign="+")


def _changed(pairs, now):
    """The shapes whose topology was not `now` and is."""
    right = ([bool(row.get("topology")) for row in pair["rows"]] for pair in pairs)
    return [pair["shape"] for pair, was_and_is in zip(pairs, right, strict=True) if was_and_is == [not now, now]]
