"""Probabilities of the refiner's decisions: their weights fitted, and whether what they say is so as often.

python benchmarks/calibrate.py check --builtin --variant clean_1024,noise2_1024

The README beside this file says what each command shows.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from _calibration import (
    SEEN,
    UNSEEN,
    by_question,
    draw_reliability,
    fitted,
    measure,
    said,
    table,
    tables,
    weights_of,
    without_family,
)
from _clouds import cases
from _questions import questions
from _runs import Jobs, Markdown, Output, Own, Shapes, Variants, application, run
from _tables import fill, page_with, present, publish, read, save

from glsk_o3d.data.decisions import QUESTIONS
from glsk_o3d.pipelines import default

EVERY = "*_4096"
Sources = Annotated[
    list[Path] | None,
    typer.Argument(metavar="DIR|JSON", exists=True, help="Folders of shapes, or questions that -o has written."),
]

app = application(__doc__)


def rows_of(sources: list[Path] | None, own: bool, variant: str, shapes: str, jobs: int) -> list[dict]:
    """The questions about every cloud, a row each; saved ones are not asked again."""
    saved = [path for path in sources or () if path.is_file()]
    rows = [row for path in saved for row in read(path)["rows"]]
    if folders := [path for path in sources or () if path.is_dir()] or not saved:
        found = cases(folders if sources else None, own, variant, shapes)
        rows += run(questions, [(case.facts, (case, default())) for case in found], jobs)
    for row in rows:
        if "failure" in row:
            typer.echo(f"{row['shape']} {row['variant']}: {row['failure']}", err=True)
    return rows


@app.command()
def fit(
    sources: Sources = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """The weights with which the questions are answered best, as glsk_o3d/decisions.py has them."""
    rows = rows_of(sources, own, variant, shapes, jobs)
    save(output, rows)
    for about, answered in by_question(rows).items():
        lines = [f'    "{name}": {weight:.2f},' for name, weight in fitted(answered).items()]
        typer.echo("\n".join([f"{about} = {{", *lines, "}"]))


@app.command()
def check(
    sources: Sources = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    leave_family_out: Annotated[
        bool,
        typer.Option(
            "--leave-family-out", help="Not the package's weights, but for each family those fitted to the others."
        ),
    ] = False,
    learnt: Annotated[
        Path | None,
        typer.Option("--from", metavar="JSON", exists=True, dir_okay=False, help="Fitted to these, else to the same."),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option("--page", help="Put the tables into this page, a picture beside it.", callback=page_with("check")),
    ] = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Whether what has some probability is so as often."""
    rows = rows_of(sources, own, variant, shapes, jobs)
    save(output, rows)
    found = by_question(rows)
    if leave_family_out:
        others = by_question(read(learnt)["rows"]) if learnt else found
        told = {about: (without_family(it, others[about]), it) for about, it in found.items()}
    else:
        told = {about: (said(QUESTIONS[about].weights, it), it) for about, it in found.items()}
    shown = tables(told)
    present(shown, markdown)
    if page is not None:
        fill(page, {"check": shown})
        draw_reliability(told, page.parent / "images")


@app.command()
def transfer(
    learnt: Annotated[Path, typer.Argument(metavar="JSON", exists=True, dir_okay=False, help="Questions, of -o.")],
    folder: Annotated[Path, typer.Argument(metavar="DIR", exists=True, file_okay=False, help="Other shapes.")],
    variant: Variants = "*",
    shapes: Shapes = "",
    page: Annotated[
        Path | None, typer.Option("--page", help="Put the table into this page.", callback=page_with("transfer"))
    ] = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Right topologies with weights fitted to all families, and for each family with those fitted to the others."""
    answered = by_question(read(learnt)["rows"])
    found = cases(folder, False, variant, shapes)
    seen = weights_of(answered)
    unseen = {family: weights_of(answered, family) for family in {case.facts["family"] for case in found}}
    work = [(dict(weights=SEEN, **case.facts), (case, seen)) for case in found]
    work += [(dict(weights=UNSEEN, **case.facts), (case, unseen[case.facts["family"]])) for case in found]
    publish(run(measure, work, jobs), lambda rows: [table(rows)], output, markdown, page=page, part="transfer")


if __name__ == "__main__":
    app()
