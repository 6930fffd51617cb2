"""How far skeletons are from known axes, and what every idea of the method contributes.

python benchmarks/accuracy.py truth --builtin

The README beside this file says what each command shows.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import _accuracy
import _stability
import typer
from _clouds import cases
from _runs import (
    PUBLISHED,
    Folders,
    Jobs,
    Markdown,
    Output,
    Own,
    Pipelines,
    Shapes,
    Variants,
    application,
    named,
    run,
    with_solves,
)
from _tables import ROOT, Tables, fill, markdown_table, present, publish, read, write_packed

from glsk_o3d import Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.pipelines import default

EVERY = "clean_1024,clean_4096,density_4096,holes_4096,scan2_4096,noise1_4096,noise2_4096,outliers_4096"
SOLVES = range(7)
WORTH_KEPT = ROOT / "benchmarks" / "v1" / "ablation.json.gz"
Changed = Annotated[
    list[str] | None, typer.Option("--set", metavar="FILTER.PARAMETER=VALUE", help="Change it; may be repeated.")
]

app = application(__doc__)


def altered(pipeline: Pipeline, settings: list[str] | None) -> Pipeline:
    """The pipeline with these settings, each as ``Filter.parameter=value``."""
    try:
        return override(pipeline, settings or [])
    except InvalidParameterError as error:
        raise typer.BadParameter(str(error)) from None


@app.command()
def truth(
    folders: Folders = None,
    own: Own = False,
    pipeline: Pipelines = "default,cao2010,wen2024",
    changed: Changed = None,
    variant: Variants = f"clean_16384,{EVERY}",
    shapes: Shapes = "",
    draws: Annotated[int, typer.Option(min=1, help="Clouds of each built-in shape and variant.")] = 1,
    repeat: Annotated[int, typer.Option(min=1, help="Runs, of whose CPU seconds the median counts.")] = 1,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Pipelines on shapes with known axes: by kind of cloud, by family of shapes, and what is bad."""
    chosen = {name: altered(it, changed) for name, it in named(pipeline).items()}
    rows = _accuracy.measured(cases(folders, own, variant, shapes, draws), chosen, jobs, repeat)
    publish(rows, lambda rows: _accuracy.overview(rows) + _accuracy.details(rows), output, markdown)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", exists=True, dir_okay=False)],
    after: Annotated[Path, typer.Argument(metavar="AFTER", exists=True, dir_okay=False)],
    markdown: Markdown = False,
) -> None:
    """What has changed from one result of truth to another, cloud by cloud."""
    earlier, later = (read(path)["rows"] for path in (before, after))
    pairs = _accuracy.paired(earlier, later)
    if not pairs:
        raise typer.BadParameter(f"{before} and {after} have no cloud and pipeline in common")
    present(_accuracy.difference_tables(pairs), markdown)


@app.command()
def ablation(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    idea: Annotated[str, typer.Option(metavar="NAMES", help="With commas; else all.")] = ",".join(_accuracy.IDEAS),
    page: Annotated[
        Path | None,
        typer.Option(
            "--page", metavar="PAGE", help="Markdown page that names settings: put their effects behind them."
        ),
    ] = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """The default pipeline with each idea switched off, one at a time: mean error / shapes with right topology."""
    if unknown := set(idea.split(",")) - set(_accuracy.IDEAS):
        raise typer.BadParameter(f"no idea {', '.join(unknown)}: there are {', '.join(_accuracy.IDEAS)}")
    if page is not None and not page.is_file():
        raise typer.BadParameter(f"there is no page {page}")
    chosen = {"default": default()}
    chosen |= {name: override(default(), _accuracy.IDEAS[name].split()) for name in idea.split(",")}
    chosen |= named(",".join(PUBLISHED))
    rows = _accuracy.measured(cases(folders, own, variant, shapes), chosen, jobs)
    publish(rows, _accuracy.ablation_tables, output, markdown)
    if page is not None:
        _accuracy.write_effects(page, rows)


@app.command()
def stop(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise2_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Where the stop rule stops, and what more or fewer solves would give."""
    chosen = {str(n): with_solves(default(), n) for n in SOLVES} | {"rule": default()}
    rows = _accuracy.measured(cases(folders, own, variant, shapes), chosen, jobs)
    publish(rows, _stability.stop_tables, output, markdown)


@app.command()
def mass(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """How well the reduced contraction tracks the full one, with the mass of merged points and without."""
    found = cases(folders, own, variant, shapes)
    rows = run(_stability.tracking, [(case.facts, (case,)) for case in found], jobs)
    publish(rows, _stability.mass_tables, output, markdown)


@app.command()
def rotations(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096",
    shapes: Shapes = "6",
    count: Annotated[int, typer.Option(min=1, help="Turns per shape.")] = 20,
    changed: Changed = None,
    jobs: Jobs = 2,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Whether the skeleton depends on how the cloud is turned and in which order its points come."""
    found = cases(folders, own, variant, shapes)
    pipeline = altered(default(), changed)
    rows = run(_stability.turned, [(case.facts, (case, count, pipeline)) for case in found], jobs)
    publish(rows, _stability.turn_tables, output, markdown)


PAGE: dict[str, tuple[Callable[[list[dict]], Tables], Callable[[list[dict], Path], None]]] = {
    "truth": (_accuracy.overview, _accuracy.draw_truth),
    "ablation": (_accuracy.ablation_tables, _accuracy.draw_ablation),
    "stop": (_stability.stop_tables, _stability.draw_stop),
}
"""What a page shows of the results of each command."""


@app.command()
def page(
    file: Annotated[Path, typer.Argument(metavar="PAGE", exists=True, dir_okay=False)],
    results: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True, dir_okay=False)],
) -> None:
    """Put the tables of saved results into a Markdown page, and their pictures into the folder images beside it."""
    told: dict[str, list[dict]] = {}
    for path in results:
        found = read(path)
        command = found["command"][0]
        if command not in PAGE:
            raise typer.BadParameter(f"{path} holds results of {command}: a page shows those of {', '.join(PAGE)}")
        told.setdefault(command, []).extend(found["rows"])
    fill(file, {command: PAGE[command][0](rows) for command, rows in told.items()})
    folder = file.parent / "images"
    folder.mkdir(exist_ok=True)
    for command, rows in told.items():
        PAGE[command][1](rows, folder)


@app.command()
def worth(
    file: Annotated[Path, typer.Argument(metavar="PAGE", exists=True, dir_okay=False)],
    results: Annotated[Path | None, typer.Argument(metavar="JSON", exists=True, dir_okay=False)] = None,
) -> None:
    """Put what each idea is worth, cloud by cloud, into a page: of results of ablation, which are kept, or of those."""
    if results is not None:
        found = read(results)
        write_packed(WORTH_KEPT, {"commit": found["commit"], "rows": _accuracy.of_worth(found["rows"])})
    fill(file, {"worth": worth_text()})


def worth_text() -> str:
    """The table of what is kept, and the commit that it is of."""
    found = read(WORTH_KEPT)
    tables = "\n".join(markdown_table(*table) for table in _accuracy.worth_tables(found["rows"]))
    return f"Measured with commit {found['commit']}.\n\n{tables}"


if __name__ == "__main__":
    app()
