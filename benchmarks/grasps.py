"""Grasps: how many of the best put a finger through the object, without and with a look at its points.

The README beside this file says what each command shows.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from _common.command_line import Jobs, Markdown, Output, application
from _common.results import machine, pick, save
from _common.runs import run
from _common.tables import Tables, fill, markdown_table, page_with, present
from _grasps.judging import BEST, measure
from _grasps.objects import CONDITIONS, NAMES

app = application(__doc__)


@app.command()
def pierced(
    shapes: Annotated[str, typer.Option("--shapes", metavar="NAMES", help="With commas; else all.")] = ",".join(NAMES),
    points: Annotated[int, typer.Option("--points", min=100)] = 8192,
    draws: Annotated[int, typer.Option("--draws", min=1, help="Clouds of each object and condition.")] = 1,
    jobs: Jobs = 2,
    page: Annotated[
        Path | None, typer.Option("--page", metavar="MD", help="Put the table here.", callback=page_with("pierced"))
    ] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """The best grasps against what is inside the object: without and with a look at its points."""
    where = machine()
    facts = [
        dict(shape=it, condition=how, seed=seed)
        for it in shapes.split(",")
        for how in CONDITIONS
        for seed in range(draws)
    ]
    rows = run(measure, [(it, (it["shape"], it["condition"], points, it["seed"])) for it in facts], jobs)
    save(output, rows)
    found = tables(rows)
    present(found, markdown, where)
    if page is not None:
        fill(page, {"pierced": "\n".join([where, "", markdown_table(*found[0])])})


COLUMNS = [(condition, key) for condition in CONDITIONS for key in ("alone", "checked")] + [(CONDITIONS[-1], "seen")]
WORDS = {"alone": "axis alone", "checked": "checked", "seen": "all sides seen"}


def tables(rows: list[dict]) -> Tables:
    """A line for each object; without and with the check in each condition."""
    lines = []
    for shape in dict.fromkeys(row["shape"] for row in rows):
        cells = []
        for condition, key in COLUMNS:
            here = [row for row in pick(rows, shape=shape, condition=condition) if "failure" not in row]
            bad, best, found = (sum(row[key][name] for row in here) for name in ("coming", "best", "found"))
            cells.append(f"{bad} of {best}" + ("" if key == "alone" else f" ({found})"))
        lines.append([shape, *cells])
    header = ["object", *(f"{condition}, {WORDS[key]}" for condition, key in COLUMNS)]
    return [(f"Of the best {BEST}, with a finger or the palm in the object (of all found)", header, lines)]


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
