"""How far skeletons are from known axes, and what every idea of the method contributes.

python benchmarks/accuracy.py truth --builtin

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glsk_o3d import Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.pipelines import default

from . import ablation as ideas
from . import axes, stability
from .clouds import cases
from .runs import (
    PUBLISHED,
    File,
    Folders,
    Jobs,
    Output,
    Own,
    Pipelines,
    Saved,
    Shapes,
    Variants,
    application,
    named,
    publish,
    run,
    with_solves,
)
from .tables import ROOT, fill, markdown, present, read, write_packed

EVERY = "clean_1024,clean_4096,density_4096,holes_4096,scan2_4096,noise1_4096,noise2_4096,outliers_4096"
SOLVES = range(7)
WORTH_KEPT = ROOT / "benchmarks" / "v1" / "ablation.json.gz"
Changed = Annotated[
    list[str] | None, typer.Option("--set", metavar="FILTER.PARAMETER=VALUE", help="Change it; may be repeated.")
]
SHOWN = {
    "truth": (axes.overview, axes.draw_truth),
    "ablation": (ideas.ablation_tables, ideas.draw_ablation),
    "stop": (stability.stop_tables, stability.draw_stop),
}
"""What a page shows of the results of each command: tables, and a picture."""

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
) -> None:
    """Pipelines on shapes with known axes: by kind of cloud, and by family of shapes."""
    chosen = {name: altered(it, changed) for name, it in named(pipeline).items()}
    publish(axes.measured(cases(folders, own, variant, shapes, draws), chosen, jobs, repeat), axes.overview, output)


@app.command()
def compare(before: Saved, after: Saved) -> None:
    """What has changed from one result of truth to another, cloud by cloud."""
    pairs = axes.paired(*(read(path)["rows"] for path in (before, after)))
    if not pairs:
        raise typer.BadParameter(f"{before} and {after} have no cloud and pipeline in common")
    present(axes.difference_tables(pairs))


@app.command()
def ablation(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = EVERY,
    shapes: Shapes = "",
    idea: Annotated[str, typer.Option(metavar="NAMES", help="With commas; else all.")] = ",".join(ideas.IDEAS),
    page: Annotated[
        Path | None,
        typer.Option("--page", exists=True, dir_okay=False, help="Put effects behind the settings that it names."),
    ] = None,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """The default pipeline with each idea switched off, one at a time: mean error / shapes with right topology."""
    if unknown := set(idea.split(",")) - set(ideas.IDEAS):
        raise typer.BadParameter(f"no idea {', '.join(unknown)}: there are {', '.join(ideas.IDEAS)}")
    chosen = {"default": default()}
    chosen |= {name: override(default(), ideas.IDEAS[name].split()) for name in idea.split(",")}
    chosen |= named(",".join(PUBLISHED))
    rows = axes.measured(cases(folders, own, variant, shapes), chosen, jobs)
    publish(rows, ideas.ablation_tables, output)
    if page is not None:
        ideas.write_effects(page, rows)


@app.command()
def stop(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096,noise2_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Where the stop rule stops, and what more or fewer solves would give."""
    chosen = {str(n): with_solves(default(), n) for n in SOLVES} | {"rule": default()}
    publish(axes.measured(cases(folders, own, variant, shapes), chosen, jobs), stability.stop_tables, output)


@app.command()
def mass(
    folders: Folders = None,
    own: Own = False,
    variant: Variants = "clean_4096",
    shapes: Shapes = "",
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """How well the reduced contraction tracks the full one, with the mass of merged points and without."""
    rows = run(stability.tracking, [(it.facts, (it,)) for it in cases(folders, own, variant, shapes)], jobs)
    publish(rows, stability.mass_tables, output)


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
) -> None:
    """Whether the skeleton depends on how the cloud is turned and in which order its points come."""
    pipeline = altered(default(), changed)
    work = [(it.facts, (it, count, pipeline)) for it in cases(folders, own, variant, shapes)]
    publish(run(stability.turned, work, jobs), stability.turn_tables, output)


@app.command()
def page(
    file: File, results: Annotated[list[Path], typer.Argument(metavar="JSON...", exists=True, dir_okay=False)]
) -> None:
    """Put the tables of saved results into a Markdown page, and their pictures into the folder images beside it."""
    rows_of: dict[str, list[dict]] = {}
    for path in results:
        content = read(path)
        command = content["command"][0]
        if command not in SHOWN:
            raise typer.BadParameter(f"{path} holds results of {command}: a page shows those of {', '.join(SHOWN)}")
        rows_of.setdefault(command, []).extend(content["rows"])
    fill(file, {command: SHOWN[command][0](rows) for command, rows in rows_of.items()})
    folder = file.parent / "images"
    folder.mkdir(exist_ok=True)
    for command, rows in rows_of.items():
        SHOWN[command][1](rows, folder)


@app.command()
def worth(
    file: File, results: Annotated[Path | None, typer.Argument(metavar="JSON", exists=True, dir_okay=False)] = None
) -> None:
    """Put what each idea is worth, cloud by cloud, into a page: of results of ablation, which are kept, or of those."""
    if results is not None:
        content = read(results)
        write_packed(WORTH_KEPT, {"commit": content["commit"], "rows": ideas.of_worth(content["rows"])})
    fill(file, {"worth": worth_text()})


def worth_text() -> str:
    """The table of what is kept, and the commit that it is of."""
    kept = read(WORTH_KEPT)
    return f"Measured with commit {kept['commit']}.\n\n{markdown(ideas.worth_tables(kept['rows']))}"
