"""``glsk skeletonize``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import progress
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
from .reporting import holding_interrupts, reporting

if TYPE_CHECKING:
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
        from ..io.scans import read_cloud, read_tensor_cloud, save_tensor_cloud
        from ..recipes import save_recipe as write_recipe
        from ..recipes import to_recipe
        from ..recipes.writing import recipe_ending
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
            with holding_interrupts():
                read = read_cloud if labelled is None else read_tensor_cloud
                cloud = read(scan, where=where)
            skeleton, seconds = run(chosen, cloud, update, recorder)
            if tubes is not None:
                others[tubes] = lambda path: save_mesh(skeleton.to_tubes(), path)
            if labelled is not None:
                others[labelled] = lambda path: save_tensor_cloud(_labelled(skeleton, cloud), path)
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


def _labelled(skeleton: Skeleton, cloud: Any) -> Any:
    """A tensor cloud with labels and their colours; its own colours are attributes."""
    labelled = skeleton.annotate(cloud, color="branch")
    if "colors" in cloud.point:
        for column, name in enumerate(("red", "green", "blue")):
            labelled.point[f"scan_{name}"] = cloud.point.colors[:, column : column + 1].to(labelled.point.branch.dtype)
    return labelled
