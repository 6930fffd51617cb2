"""How fast skeletons are, where the time goes, and how both grow with the cloud.

python benchmarks/speed.py all --builtin

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Annotated

import typer

from .clouds import BUILTIN
from .contraction import draw_figures, figure_tables, measure_figures, objects
from .large import huge_tables, large_tables, measure_huge, measure_large
from .rates import measure_rate, measure_stream, rate_tables, stream_tables
from .runs import FirstPage, Folder, Jobs, Output, Own, Pipelines, Shapes, Sizes, application, named, numbers, publish
from .scans import measure_scans, scan_tables
from .stages import draw_stages, measure_stages, stage_tables
from .tables import fill, machine, present, save

app = application(__doc__)


def _folder(path: Path | None) -> Path | None:
    if path is not None:
        path.mkdir(parents=True, exist_ok=True)
    return path


PublishedTo = Annotated[int, typer.Option("--published-to", help="wen2024 and cao2010 only up to so many points.")]
Repeat = Annotated[int, typer.Option("--repeat", min=1, help="Runs of which medians are taken, at least.")]
Pictures = Annotated[
    Path | None, typer.Option("--pictures", metavar="DIR", help="Also draw them, as PNG.", callback=_folder)
]
ALL_SIZES, FIGURE_SIZES, ALL_PIPELINES = "1024,4096,16384,65536", "1024,4096,16384", "default,wen2024,cao2010"


@app.command()
def stages(
    sizes: Sizes = ALL_SIZES,
    pipeline: Pipelines = ALL_PIPELINES,
    published_to: PublishedTo = 65536,
    shapes: Shapes = "sauropod",
    kind: Annotated[str, typer.Option("--kind", metavar="KIND", help="clean, noise1, ...; see the README.")] = "clean",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
) -> None:
    """What every stage and the whole cost over the size of the cloud, and how they grow."""
    rows = measure_stages(numbers(sizes), named(pipeline), shapes, kind, published_to, repeat, jobs)
    publish(rows, stage_tables, output)
    if pictures is not None:
        draw_stages(rows, pictures)


@app.command()
def figures(
    folder: Folder = None,
    own: Own = False,
    sizes: Sizes = FIGURE_SIZES,
    shapes: Shapes = "",
    solves: Annotated[int, typer.Option("--solves", min=1, max=10, help="Where their number is fixed.")] = 4,
    repeat: Repeat = 1,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
) -> None:
    """The contraction against the baseline (figures 4 to 6 of Wen et al. 2024), and what the difference is made of."""
    rows = measure_figures(objects(folder, own, shapes, numbers(sizes)), solves, repeat, jobs)
    publish(rows, figure_tables, output)
    if pictures is not None:
        draw_figures(rows, pictures)


@app.command()
def rate(
    sizes: Sizes = FIGURE_SIZES,
    pipeline: Pipelines = "default",
    shape: Annotated[str, typer.Option("--shape", metavar="NAME", help="A built-in shape.")] = "sauropod",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Skeletons per second, in a fresh process and after."""
    if shape not in BUILTIN:
        raise typer.BadParameter(f"no shape {shape}: there are {', '.join(BUILTIN)}")
    publish(measure_rate(numbers(sizes), pipeline.split(","), shape, repeat, jobs), rate_tables, output)


@app.command()
def stream(
    page: FirstPage = None,
    sizes: Sizes = "1024,4096",
    scenes: Annotated[
        str, typer.Option("--scenes", metavar="NAMES", help="Families of random shapes.")
    ] = "figures,handles",
    repeat: Repeat = 3,
    output: Output = None,
) -> None:
    """Thirty frames of a depth camera that turns around a scene, by one process and by one for each core."""
    publish(measure_stream(numbers(sizes), scenes.split(","), repeat), stream_tables, output, page, "stream")


@app.command()
def scans(
    page: FirstPage = None,
    folder: Annotated[
        list[Path] | None, typer.Option("--folder", metavar="DIR", help="Scans of shapes: depth2, misreg and lidar.")
    ] = None,
    sizes: Sizes = ALL_SIZES,
    pipeline: Annotated[str, typer.Option("--pipeline", metavar="NAME")] = "default",
    repeat: Repeat = 3,
    jobs: Jobs = 1,
    output: Output = None,
) -> None:
    """Clouds as scanners give them: noisy bodies, scans of the shapes in folders, scanned objects."""
    rows = measure_scans(folder or [], numbers(sizes), pipeline, repeat, jobs)
    publish(rows, scan_tables, output, page, "scans")


@app.command()
def large(
    page: FirstPage = None,
    sizes: Sizes = "65536,1048576",
    shapes: Shapes = "",
    file: Annotated[bool, typer.Option("--file", help="Also the whole command, from a PLY file to one.")] = False,
    jobs: Jobs = 1,
    output: Output = None,
) -> None:
    """Large clouds: what they cost, and how far their skeletons are from that of the smallest size."""
    publish(measure_large(numbers(sizes), shapes, file, jobs), large_tables, output, page, "large")


@app.command()
def huge(
    page: FirstPage = None,
    points: Annotated[int, typer.Option("--points", help="Of each file.")] = 100_000_000,
    against: Annotated[int, typer.Option("--against", help="Points to skeletonise in memory.")] = 1_000_000,
    endings: Annotated[str, typer.Option("--endings", help="Of the files: .ply, .las, .laz.")] = ".ply,.laz",
    labelled: Annotated[str, typer.Option("--labelled", help="Of those whose points are labelled, too.")] = "",
    folder: Annotated[Path | None, typer.Option("--folder", help="Where the files are, or are made and stay.")] = None,
    output: Output = None,
) -> None:
    """Clouds larger than memory: the whole command, and whether its skeleton is that of a small cloud."""
    rows = measure_huge(endings.split(","), labelled.split(","), points, against, folder)
    publish(rows, huge_tables, output, page, "huge")


@app.command("all")
def everything(
    page: FirstPage = None,
    own: Own = False,
    sizes: Sizes = ALL_SIZES,
    figure_sizes: Annotated[
        str, typer.Option("--figure-sizes", metavar="NUMBERS", help="Of `figures` and `rate`.")
    ] = FIGURE_SIZES,
    pipeline: Pipelines = ALL_PIPELINES,
    published_to: PublishedTo = 65536,
    shapes: Annotated[str, typer.Option("--shapes", metavar="NAMES", help="Of `figures`.")] = "",
    repeat: Repeat = 3,
    jobs: Jobs = 2,
    pictures: Pictures = None,
    output: Output = None,
) -> None:
    """The first three together, with their pictures."""
    chosen, clouds = named(pipeline), objects(None, own, shapes, numbers(figure_sizes))
    by_stage = measure_stages(numbers(sizes), chosen, "sauropod", "clean", published_to, repeat, jobs)
    compared = measure_figures(clouds, 4, 1, jobs)
    rates = measure_rate(numbers(figure_sizes), ["default"], "sauropod", repeat, jobs)
    save(output, [*by_stage, *compared, *rates])
    parts = {"stages": stage_tables(by_stage), "figures": figure_tables(compared), "rate": rate_tables(rates)}
    typer.echo(f"{machine()}\n")
    present([*chain(*parts.values())])
    if pictures is None and page is not None and (page.parent / "images").is_dir():
        pictures = page.parent / "images"
    if pictures is not None:
        draw_figures(compared, pictures)
        draw_stages(by_stage, pictures)
    if page is not None:
        fill(page, {"machine": f"{machine()}\n", **parts})
