"""``glsk skeletonize``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import echo, progress
from .options import (
    CutLoops,
    DropInvalid,
    Json,
    Output,
    PipelineName,
    Preview,
    Quiet,
    Recipe,
    ReportPage,
    Settings,
    Verbose,
    Where,
)
from .reporting import WrongUsage, holding_interrupts, reporting

if TYPE_CHECKING:
    from ..pipeline import Pipeline
    from ..skeleton import Skeleton


def skeletonize(
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN",
            help="The cloud: ply, pcd, csv, txt, asc, xyz, pts, las, laz, e57; or a mesh: off, obj, stl, gltf, glb.",
        ),
    ],
    output: Output = None,
    preview: Preview = None,
    report: ReportPage = None,
    pipeline: PipelineName = "default",
    recipe: Recipe = None,
    settings: Settings = None,
    where: Where = None,
    root: Annotated[
        str | None,
        typer.Option(
            "--root",
            metavar="ROOT",
            help="Make one tree that grows from there: x to -z for the lowest along an axis, thickest, or a point, "
            "x,y,z. Short for --set Refiner.root=ROOT.",
        ),
    ] = None,
    tubes: Annotated[
        Path | None,
        typer.Option(
            "--tubes",
            metavar="MESH",
            help="Also write the skeleton as tubes as thick as the object: ply, obj, off, stl, glb or gltf.",
        ),
    ] = None,
    labelled: Annotated[
        Path | None,
        typer.Option(
            "--labelled",
            metavar="CLOUD",
            help="Also write the scan with all that it has, coloured by branch, and branch, vertex, order, radius, "
            "confidence and thickness of every point: ply, pcd or npz.",
        ),
    ] = None,
    save_recipe: Annotated[
        Path | None,
        typer.Option("--save-recipe", metavar="FILE", help="Also write the pipeline as run to a json or toml file."),
    ] = None,
    stream: Annotated[
        bool | None,
        typer.Option(
            "--stream/--no-stream",
            help="Read the scan in blocks, and of it the sample that its skeleton is made from: memory does not grow "
            "with the file. By default where it has more than ten million points.",
            show_default=False,
        ),
    ] = None,
    support: Annotated[
        int | None,
        typer.Option(
            "--support",
            metavar="SAMPLES",
            min=2,
            help="Also skeletonise so many samples of the points, and say how many of them show each branch, loop and "
            "end; 8 are enough. A sample takes about as long as the skeleton.",
        ),
    ] = None,
    drop_invalid: DropInvalid = False,
    cut_loops: CutLoops = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compute the curve skeleton of a scan.

    Everything that can be checked is checked before the computation starts. Files appear complete or not at all.
    """
    with reporting(scan, quiet=quiet, verbose=verbose):
        from ..io.meshes import save_mesh
        from ..recipes import save_recipe as write_recipe
        from ..recipes import to_recipe
        from ..recipes.writing import recipe_ending
        from ..resampling import with_support
        from ..viewing.recorder import ContractionRecorder
        from .outputs import check_outputs, write
        from .overrides import choose
        from .running import print_results, run

        rooted = [f"Refiner.root={root}"] if root is not None else []
        chosen = choose(pipeline, recipe, [*(settings or []), *rooted], drop_invalid)
        outputs = output or []
        others: dict[Path, Callable[[Path], object]] = {}
        if save_recipe is not None:
            recipe_ending(save_recipe)
            to_recipe(chosen)
            others[save_recipe] = partial(write_recipe, chosen)
        check_outputs(outputs, preview, scan, report, others, tubes=tubes, labelled=labelled, recipe=recipe)
        recorder = ContractionRecorder() if report is not None else None
        with progress(not quiet and not verbose) as update:
            update(f"reading {scan.name}")
            cloud, write_labelled = _read(scan, where, chosen, stream, labelled, quiet)
            skeleton, seconds = run(chosen, cloud, update, recorder)
            if support is not None:
                told = "comparing with the skeleton of sample {} of {}"
                skeleton = with_support(skeleton, chosen, support, on_draw=lambda *n: update(told.format(*n), *n))
            if tubes is not None:
                others[tubes] = lambda path: save_mesh(skeleton.to_tubes(), path)
            if labelled is not None:
                others[labelled] = lambda path: write_labelled(skeleton, path)
            written, problems = write(
                skeleton,
                outputs,
                preview,
                report,
                others,
                title=scan.name,
                cut_loops=cut_loops,
                update=update,
                recorder=recorder,
            )
        print_results(skeleton, seconds, written, problems, quiet=quiet, verbose=verbose, as_json=as_json)


def _read(
    scan: Path, where: str | None, pipeline: Pipeline[Any], stream: bool | None, labelled: Path | None, quiet: bool
) -> tuple[Any, Callable[[Skeleton, Path], object]]:
    """The cloud, or the sample of a large one; and what writes all of it with labels."""
    import numpy as np

    from ..interop.packages import import_open3d
    from ..io.scans import read_scan, save_tensor_cloud
    from ..io.streaming import STREAMED_ENDING, annotate_file, sample_for

    with holding_interrupts():
        import_open3d()
    if labelled is None or labelled.suffix.lower() == STREAMED_ENDING:
        sample = sample_for(pipeline, scan, where, stream)
        if sample is not None:
            if not quiet:
                finite = np.isfinite(sample.point.positions.numpy()).all(axis=1)
                n, total = int(finite.sum()), int(sample.point.sample_count.numpy()[finite].sum(dtype=np.int64))
                taken = f"the skeleton is that of a sample of {n} of {total} points"
                echo(f"{scan}: read in blocks: {taken if n < total else f'all {n} points are taken'}", err=True)
            return sample, lambda skeleton, path: annotate_file(skeleton, scan, path, where=where)
    elif stream:
        raise WrongUsage(f"{labelled}: --stream writes a cloud with labels as {STREAMED_ENDING} alone")
    with holding_interrupts():
        read = read_scan(scan, where)  # what it is skeletonised from is the same, whether it is labelled or not
    cloud, whole = read.to_legacy(), None if labelled is None else read.to_tensor()
    return cloud, lambda skeleton, path: save_tensor_cloud(_labelled(skeleton, whole), path)


def _labelled(skeleton: Skeleton, cloud: Any) -> Any:
    """A tensor cloud with labels and their colours; its own colours are attributes."""
    labelled = skeleton.annotate(cloud, color="branch")
    if "colors" in cloud.point:
        for column, name in enumerate(("red", "green", "blue")):
            labelled.point[f"scan_{name}"] = cloud.point.colors[:, column : column + 1].to(labelled.point.branch.dtype)
    return labelled
