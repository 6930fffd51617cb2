"""``glsk skeletonize``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from . import options
from .console import echo, progress
from .options import option
from .outputs import check_outputs, skeleton_files, skeleton_writers, write_each
from .reporting import WrongUsage, load_open3d
from .running import print_results, run

if TYPE_CHECKING:
    from ..pipeline import Pipeline
    from ..skeleton import Skeleton


def skeletonize(
    scan: options.ScanFile,
    output: options.Output = None,
    preview: options.Preview = None,
    report: options.ReportPage = None,
    pipeline: options.PipelineName = "default",
    recipe: options.Recipe = None,
    settings: options.Settings = None,
    where: options.Where = None,
    root: Annotated[
        str | None, option("ROOT", "Grow one tree from there: x to -z, lowest along an axis, thickest, or x,y,z.")
    ] = None,
    tubes: Annotated[
        Path | None, option("MESH", "Also write tubes as thick as the object: ply, obj, off, stl, glb or gltf.")
    ] = None,
    labelled: Annotated[
        Path | None, option("CLOUD", "Also write the scan with branch, radius, ... of every point: ply, pcd or npz.")
    ] = None,
    save_recipe: Annotated[Path | None, option("FILE", "Also write the pipeline to a json or toml file.")] = None,
    stream: Annotated[
        bool | None, Option("--stream/--no-stream", help="Read only a sample; by default if over ten million points.")
    ] = None,
    support: Annotated[
        int | None, option("SAMPLES", "Also skeletonise so many samples, and say what they share; 8 are enough.", min=2)
    ] = None,
    drop_invalid: options.DropInvalid = False,
    cut_loops: options.CutLoops = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """Compute the curve skeleton of a scan.

    Everything that can be checked is checked before the computation starts. Files appear complete or not at all.
    """
    from .. import ContractionRecorder, recipes, save_mesh, to_tubes
    from ..interop.packages import require
    from ..io.meshes import WRITTEN_MESH_ENDINGS
    from ..io.scans import WRITTEN_CLOUD_ENDINGS
    from ..resampling import with_support
    from .overrides import choose

    rooted = [f"Tracer.root={root}"] if root is not None else []
    chosen = choose(pipeline, recipe, [*(settings or []), *rooted], drop_invalid)
    results = [
        *skeleton_files(output, preview, report),
        (tubes, WRITTEN_MESH_ENDINGS, "tubes are a mesh"),
        (labelled, WRITTEN_CLOUD_ENDINGS, "file is a cloud with labels"),
    ]
    if all(path is None for path, *_ in results):
        raise WrongUsage("nothing to write: give -o, --tubes or --labelled, a --preview or a --report")
    check_outputs([*results, (save_recipe, (".json", ".toml"), "file is a recipe")], scan, recipe)
    if tubes is not None or labelled is not None:
        require("matplotlib")  # for the colours of branches
    if save_recipe is not None:
        recipes.to_recipe(chosen)  # not all can be written
    recorder = ContractionRecorder() if report is not None else None
    with progress(not quiet and not verbose) as update:
        update(f"reading {scan.name}")
        cloud, write_labelled = _read(scan, where, chosen, stream, labelled, quiet)
        skeleton, seconds = run(chosen, cloud, update, recorder)
        if support is not None:
            comparing = "comparing with the skeleton of sample {} of {}"
            skeleton = with_support(skeleton, chosen, support, on_draw=lambda *n: update(comparing.format(*n), *n))
        writers = skeleton_writers(
            skeleton, output, preview, report, title=scan.name, cut_loops=cut_loops, recorder=recorder
        )
        if save_recipe is not None:
            writers[save_recipe] = partial(recipes.save_recipe, chosen)
        if tubes is not None:
            writers[tubes] = lambda path: save_mesh(to_tubes(skeleton), path)
        if labelled is not None:
            writers[labelled] = partial(write_labelled, skeleton)
        written, problems = write_each(writers, update)
    print_results(skeleton, seconds, written, problems, quiet=quiet, verbose=verbose, as_json=as_json)


def _read(
    scan: Path, where: str | None, pipeline: Pipeline[Any], stream: bool | None, labelled: Path | None, quiet: bool
) -> tuple[Any, Callable[[Skeleton, Path], object]]:
    """The cloud, or the sample of a large one; and what writes all of it with labels."""
    import numpy as np

    from .. import annotate_file, save_tensor_cloud
    from ..io.scans import read_scan
    from ..io.streaming import STREAMED_ENDING, sample_for

    load_open3d()
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
    read = read_scan(scan, where)  # what it is skeletonised from is the same, whether it is labelled or not
    cloud, whole = read.to_legacy(), None if labelled is None else read.to_tensor()
    return cloud, lambda skeleton, path: save_tensor_cloud(_labelled(skeleton, whole), path)


def _labelled(skeleton: Skeleton, cloud: Any) -> Any:
    """A tensor cloud with labels and their colours; its own colours are attributes."""
    from .. import annotate

    labelled = annotate(skeleton, cloud, color="branch")
    if "colors" in cloud.point:
        for column, name in enumerate(("red", "green", "blue")):
            labelled.point[f"scan_{name}"] = cloud.point.colors[:, column : column + 1].to(labelled.point.branch.dtype)
    return labelled
