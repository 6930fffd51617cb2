"""Trees: skeletons of sparse ones beside those of other tools, volumes and diameters, and what large ones cost.

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal

import numpy as np
import typer

from glsk_o3d import samples

from . import forest
from .peers import installed, one_thread
from .runs import Folder, Jobs, Output, Page, application, numbers, publish, run

app = application(__doc__)
Trees = Annotated[int, typer.Option("--trees", min=1, help="How many built-in trees.")]


@app.command()
def curves(
    folder: Folder = None,
    up: Annotated[Literal["x", "y", "z"], typer.Option("--up", help="Axis of a folder's trees that points up.")] = "z",
    trees: Trees = 5,
    tool: Annotated[str, typer.Option("--tool", metavar="NAMES", help="With commas; else all installed.")] = "",
    limit: Annotated[float, typer.Option("--limit", help="Seconds for a skeleton, imports included.")] = 120.0,
    jobs: Jobs = 2,
    output: Output = None,
    page: Page = None,
) -> None:
    """Skeletons of sparse trees against their axes: built-in trees, or those of a folder."""
    tools = installed(forest.TOOLS, tool)
    found = forest.sparse_trees(folder, up, trees)
    if not found:
        raise typer.BadParameter(f"there is no NAME.npz in {folder}")
    one_thread()
    pairs = product(tools.items(), found)
    work = [(dict(tool=name, condition=it[1], tree=it[0]), (it, peer)) for (name, peer), it in pairs]
    rows = run(forest.measure_curve, work, jobs, fresh=True, limit=limit)
    publish(rows, forest.curve_tables, output, page, "trees of a folder" if folder else "trees")


@app.command()
def measures(trees: Trees = 20, jobs: Jobs = 2, output: Output = None, page: Page = None) -> None:
    """Volume, diameter and height of trees with a surface, whole and scanned by a lidar."""
    work = [(dict(condition=it, tree=seed), (seed, it)) for it in ("clean", "lidar") for seed in range(trees)]
    publish(run(forest.measure_tree, work, jobs), forest.measure_tables, output, page, "measures")


@app.command()
def stems(trees: Trees = 36, jobs: Jobs = 2, output: Output = None, page: Page = None) -> None:
    """Stem diameters and volumes of trees that one to three scanners see.

    On the seeds from 0 the numbers were chosen, those from 100 show what they are worth.
    """
    sets = {"chosen": range(trees), "other": range(100, 100 + trees)}
    work = [(dict(seeds=name, tree=seed), (seed,)) for name, seeds in sets.items() for seed in seeds]
    publish(run(forest.measure_stem, work, jobs), forest.stem_tables, output, page, "stems")


@app.command()
def leaves(trees: Trees = 60, jobs: Jobs = 2, output: Output = None) -> None:
    """Doubts of trees that have leaves, or none."""
    work = [(dict(tree=seed), (seed,)) for seed in range(trees)]
    publish(run(forest.measure_leaves, work, jobs), forest.leaf_tables, output)


@app.command()
def models(
    paths: Annotated[list[Path], typer.Argument(metavar="CLOUD MODEL...", exists=True, dir_okay=False)],
    unit: Annotated[float, typer.Option("--unit", help="Of the clouds, in metres, as models are.")] = 1,
    columns: Annotated[
        str, typer.Option("--columns", metavar="NAMES", help="Of tables without names, with commas; else TreeQSM's.")
    ] = "",
    output: Output = None,
) -> None:
    """Scanned trees beside the cylinder models that TreeQSM, SimpleForest or aRchi made of them: pairs of files.

    A model is a .mat of TreeQSM or a table of any of the three, as downloaded, also without a line of names; z points
    up. Length and volume are with traced parts, as in models, and without.
    """
    if len(paths) % 2:
        raise typer.BadParameter("give pairs: each cloud, and then its model")
    names = tuple(columns.split(",")) if columns else ()
    work = [
        (dict(tree=cloud.stem), (cloud, model, unit, names))
        for cloud, model in zip(paths[::2], paths[1::2], strict=True)
    ]
    publish(run(forest.measure_model, work, 1), forest.model_tables, output)


@app.command()
def large(
    sizes: Annotated[str, typer.Option("--sizes", metavar="N,N", help="Points.")] = "100000,1000000",
    forks: Annotated[int, typer.Option("--forks", min=1, max=8, help="Of the tree, from foot to tip.")] = 4,
    output: Output = None,
    page: Page = None,
) -> None:
    """Time and memory of lidar scans of one tree, with and without tracing."""
    rows = []
    for n in numbers(sizes):
        with TemporaryDirectory() as folder:
            path = Path(folder, "scan.npy")
            np.save(path, samples.tree(n, forks=forks, seed=1, noise=forest.NOISE, cameras=forest.CAMERAS).points)
            work = [(dict(n=n, pipeline=name), (path, name)) for name in forest.PIPELINES]
            rows += run(forest.measure_scan, work, 1, fresh=True)
    publish(rows, forest.large_tables, output, page, "large")
