"""Trees: skeletons of sparse ones beside those of other tools, volumes and diameters, and what large ones cost.

The README beside this file says what each command shows.
"""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import _trees
import numpy as np
import typer
from _peers import installed, one_thread, versions
from _runs import Folder, Jobs, Markdown, Output, application, run
from _tables import machine, page_with, publish

from glsk_o3d import samples

app = application(__doc__)
Trees = Annotated[int, typer.Option("--trees", min=1, help="How many built-in trees.")]
Page = partial(typer.Option, "--page", metavar="MD", help="Put the first table into this page.")


@app.command()
def curves(
    folder: Folder = None,
    up: Annotated[str, typer.Option("--up", help="Axis of a folder's trees that points up: x, y or z.")] = "z",
    trees: Trees = 5,
    tool: Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all installed.")] = "",
    limit: Annotated[float, typer.Option("--limit", help="Seconds for a skeleton, imports included.")] = 120.0,
    jobs: Jobs = 2,
    page: Annotated[Path | None, Page(callback=page_with("trees", "trees of a folder"))] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Skeletons of sparse trees against their axes: built-in trees, or those of a folder."""
    if up not in "xyz":
        raise typer.BadParameter(f"--up {up}: there are x, y and z")
    tools = installed(_trees.TOOLS, tool)
    found = _trees.sparse_trees(folder, up, trees)
    if not found:
        raise typer.BadParameter(f"there is no NAME.npz in {folder}")
    where = f"{machine()} {versions(tools.values())}."
    one_thread()
    work = [(dict(tool=name, **it.facts), (it, made)) for name, made in tools.items() for it in found]
    rows = run(_trees.measure_curve, work, jobs, fresh=True, limit=limit)
    part = "trees of a folder" if folder else "trees"
    publish(rows, _trees.curve_tables, output, markdown, where, page, part, shown=1)


@app.command()
def measures(
    trees: Trees = 20,
    jobs: Jobs = 2,
    page: Annotated[Path | None, Page(callback=page_with("measures"))] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Volume, diameter and height of trees with a surface, whole and scanned by a lidar."""
    where = machine()
    work = [(dict(condition=it, tree=seed), (seed, it)) for it in ("clean", "lidar") for seed in range(trees)]
    rows = run(_trees.measure_tree, work, jobs)
    publish(rows, _trees.measure_tables, output, markdown, where, page, "measures")


@app.command()
def stems(
    trees: Trees = 36,
    jobs: Jobs = 2,
    page: Annotated[Path | None, Page(callback=page_with("stems"))] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Stem diameters and volumes of trees that one to three scanners see.

    On the seeds from 0 the numbers were chosen, those from 100 show what they are worth.
    """
    where = machine()
    work = [
        (dict(seeds=name, tree=seed), (seed,))
        for name, first in (("chosen", 0), ("other", 100))
        for seed in range(first, first + trees)
    ]
    rows = run(_trees.measure_stem, work, jobs)
    publish(rows, _trees.stem_tables, output, markdown, where, page, "stems", shown=1)


@app.command()
def models(
    paths: Annotated[list[Path], typer.Argument(metavar="CLOUD MODEL...", exists=True, dir_okay=False)],
    unit: Annotated[float, typer.Option("--unit", help="Of the clouds, in metres, as models are.")] = 1,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Scanned trees beside the cylinder models that TreeQSM, SimpleForest or aRchi made of them: pairs of files.

    A model is a .mat of TreeQSM or a table of any of the three; z points up.
    """
    if len(paths) % 2:
        raise typer.BadParameter("give pairs: each cloud, and then its model")
    where = machine()
    work = [(dict(tree=cloud.stem), (cloud, model, unit)) for cloud, model in zip(paths[::2], paths[1::2], strict=True)]
    rows = run(_trees.measure_model, work, 1)
    publish(rows, _trees.model_tables, output, markdown, where)


@app.command()
def large(
    sizes: Annotated[str, typer.Option("--sizes", metavar="N,N", help="Points.")] = "100000,1000000",
    forks: Annotated[int, typer.Option("--forks", min=1, max=8, help="Of the tree, from foot to tip.")] = 4,
    page: Annotated[Path | None, Page(callback=page_with("large"))] = None,
    output: Output = None,
    markdown: Markdown = False,
) -> None:
    """Time and memory of lidar scans of one tree, with and without tracing."""
    where = machine()
    rows = []
    for n in map(int, sizes.split(",")):
        with TemporaryDirectory() as folder:
            path = Path(folder, "scan.npy")
            np.save(path, samples.tree(n, forks=forks, seed=1, noise=_trees.NOISE, cameras=_trees.CAMERAS).points)
            work = [(dict(n=n, pipeline=name), (path, name)) for name in _trees.PIPELINES]
            rows += run(_trees.once, work, 1, fresh=True)
    publish(rows, _trees.large_tables, output, markdown, where, page, "large")


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
