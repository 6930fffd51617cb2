"""``glsk skeletonize``, ``glsk rerun`` and ``glsk demo``: from a cloud to a skeleton."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from . import options
from .console import echo, flags, print_rows, print_table, progress, say
from .options import argument, option, output_option
from .outputs import check_outputs, skeleton_files, skeleton_writers, tell, write_each
from .reporting import WrongUsage, load_open3d

if TYPE_CHECKING:
    from ..decisions import Decision
    from ..pipeline import Pipeline
    from ..report import IterationRecord, Report
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
) -> None:
    """Compute the curve skeleton of a scan.

    Everything that can be checked is checked before the computation starts. Files appear complete or not at all.
    """
    from .. import ContractionRecorder, recipes, save_mesh, to_tubes
    from ..interop.packages import require
    from ..io.meshes import WRITTEN_MESH_ENDINGS
    from ..io.scans import WRITTEN_CLOUD_ENDING
    from ..resampling import with_support
    from .overrides import choose, grown_from

    chosen = choose(pipeline, recipe, settings or [], drop_invalid)
    if root is not None:
        chosen = grown_from(root, chosen)
    results = [
        *skeleton_files(output, preview, report),
        (tubes, WRITTEN_MESH_ENDINGS, "tubes are a mesh"),
        (labelled, (WRITTEN_CLOUD_ENDING,), "cloud with labels is PLY"),
    ]
    if all(path is None for path, *_ in results):
        raise WrongUsage("nothing to write: give -o, --tubes or --labelled, a --preview or a --report")
    check_outputs([*results, (save_recipe, (".json", ".toml"), "file is a recipe")], scan, recipe)
    if tubes is not None or labelled is not None:
        require("matplotlib")  # for the colours of branches
    if save_recipe is not None:
        recipes.to_recipe(chosen)  # not all can be written
    recorder = ContractionRecorder() if report is not None else None
    with progress(not flags.quiet and not flags.verbose) as update:
        update(f"reading {scan.name}")
        cloud, write_labelled = _read(scan, where, chosen, stream, labelled)
        skeleton, seconds = _run(chosen, cloud, update, recorder)
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
    _tell(skeleton, seconds, written, problems)


def _read(
    scan: Path, where: str | None, pipeline: Pipeline[Any], stream: bool | None, labelled: Path | None
) -> tuple[Any, Callable[[Skeleton, Path], object]]:
    """The cloud, or the sample of a large one; and what writes all of it with labels."""
    import numpy as np

    from .. import annotate_file, save_tensor_cloud
    from ..io.scans import read_scan
    from ..io.streaming import sample_for

    load_open3d()
    sample = sample_for(pipeline, scan, where, stream)
    if sample is not None:
        if not flags.quiet:
            finite = np.isfinite(sample.point.positions.numpy()).all(axis=1)
            n, total = int(finite.sum()), int(sample.point.sample_count.numpy()[finite].sum(dtype=np.int64))
            taken = f"the skeleton is that of a sample of {n} of {total} points"
            echo(f"{scan}: read in blocks: {taken if n < total else f'all {n} points are taken'}", err=True)
        return sample, lambda skeleton, path: annotate_file(skeleton, scan, path, where=where)
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


def rerun(
    result: Annotated[Path, argument("RESULT", "A skeleton that 'glsk skeletonize' wrote as json or npz.")],
    scan: Annotated[Path | None, argument("SCAN", "Another cloud to run it on, instead of its points.")] = None,
    output: options.Output = None,
    preview: options.Preview = None,
    report: options.ReportPage = None,
    cut_loops: options.CutLoops = False,
) -> None:
    """Repeat the run that made a result.

    It is run with the recipe that the result holds. On the points of the result the skeleton is the same to the last
    bit; where other releases make it differ, there is a warning. Without outputs it only says whether it is the same.
    'glsk skeletonize --recipe' runs recipes from files of their own.
    """
    from .. import ContractionRecorder, RecipeError, from_recipe, read_cloud, read_skeleton
    from .. import rerun as run_again
    from ..io.streaming import sample_for
    from ..recipes.rerun import identical, is_of_sample

    check_outputs(skeleton_files(output, preview, report), scan, result)
    recorder = ContractionRecorder() if report is not None else None
    with progress(not flags.quiet and not flags.verbose) as update:
        update(f"reading {result.name}")
        load_open3d()
        made, cloud = read_skeleton(result), None
        try:
            if scan is not None and is_of_sample(made):
                cloud = sample_for(from_recipe(made.report.recipe), scan, stream=True)
            elif scan is not None:
                cloud = read_cloud(scan)
            skeleton, seconds = _run(partial(run_again, made), cloud, update, recorder)
        except RecipeError as error:
            raise RecipeError(f"{result}: cannot be repeated: {error}") from error
        title = (scan or result).name
        writers = skeleton_writers(
            skeleton, output, preview, report, title=title, cut_loops=cut_loops, recorder=recorder
        )
        written, problems = write_each(writers, update)
    _tell(skeleton, seconds, written, problems, {"identical": identical(skeleton, made)})


def demo(
    folder: Annotated[Path, output_option("FOLDER", "Made if it is not there.")] = Path("demo"),
    points: Annotated[int, option("N", "How many points the scan has.", "--points", "-n", min=8, max=10**9)] = 8192,
    pipeline: options.PipelineName = "default",
) -> None:
    """Skeletonise the built-in sample object.

    It is a toy dinosaur with a carrying handle on its back, scanned from two sides. Writes cloud.ply (the scan),
    skeleton.ply, skeleton.json and skeleton.png (the picture to look at).
    """
    from .. import MissingPackageError, samples, save_tensor_cloud
    from ..interop.packages import import_open3d, require_for
    from .overrides import choose

    chosen = choose(pipeline)
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    cloud, picture = folder / "cloud.ply", folder / "skeleton.png"
    outputs, preview, missing = [folder / "skeleton.ply", folder / "skeleton.json"], picture, ""
    try:
        require_for(picture.suffix)
    except MissingPackageError as error:  # all else can be shown
        preview, missing = None, str(error)
    check_outputs(skeleton_files([*outputs, cloud], preview))
    with progress(not flags.quiet and not flags.verbose) as update:
        update("making the sample")
        load_open3d()
        o3d, sample = import_open3d(), samples.sample_object(points)
        save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(sample.points)), cloud)
        skeleton, seconds = _run(chosen, sample.points, update)
        title = f"{sample.name}: a scan and its curve skeleton"
        written, problems = write_each(skeleton_writers(skeleton, outputs, preview, title=title), update)
    _tell(skeleton, seconds, [cloud, *written], problems)
    if missing and not flags.quiet:
        say("warning", f"no {picture.name}: {missing}")


def _run(pipeline: Callable[..., Skeleton], cloud: Any, update, on_state=None) -> tuple[Skeleton, float]:
    """Run a pipeline and show how far it is; gives the skeleton, and the seconds it took."""
    start = time.perf_counter()
    doing, most = "", None

    def on_stage(stage):
        nonlocal doing, most
        doing, most = type(stage).__name__, getattr(stage, "max_iterations", None)
        update(doing)

    def on_iteration(record):
        left = record.n_points - record.n_merged
        update(f"{doing}: solve {record.iteration} of at most {most}, {left} points", record.iteration, most)

    skeleton = pipeline(cloud, on_iteration=on_iteration, on_state=on_state, on_stage=on_stage)
    return skeleton, time.perf_counter() - start


def print_iterations(records: Sequence[IterationRecord], *, err: bool = False) -> None:
    """Print a contraction's iterations as a table."""
    from ..analysis.summary import ITERATION_COLUMNS, iteration_rows

    if records:
        print_table(iteration_rows(records), list(ITERATION_COLUMNS), err=err)


def _tell(
    skeleton: Skeleton,
    seconds: float,
    written: Sequence[Path],
    problems: Sequence[str],
    more: Mapping[str, Any] | None = None,
) -> None:
    """Print the summary of a run, with `more` facts, and the files written; then OSError if there were problems."""
    from ..analysis.summary import summary

    report = skeleton.report
    if flags.verbose:
        print_iterations(report.iterations, err=True)
    facts = {**summary(skeleton, seconds), **(more or {})}
    supported = {"unsupported": list(map(asdict, report.unsupported))} if report.n_draws else {}
    whole = {**facts, **supported, "warnings": list(report.warnings), "files": list(map(str, written))}
    tell(whole, lambda: print_rows(_shown(facts, report)), written, problems)


def _shown(facts: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """The facts that say something of this run, in words."""
    from ..analysis.summary import ENDING_FACTS, ending

    hidden = {*ENDING_FACTS, "seconds", "agreeing"}
    hidden.add("loops_closed")  # most clouds have some, true ones are hardly ever among them
    noted = ("dropped", "outliers", "cuts", "bridges", "traced", "joined")
    hidden.update(name for name in noted if not facts[name])
    if not report.is_sampled:
        hidden.add("sampled")
    if facts["contracted"] == facts["distinct"]:
        hidden.add("contracted")
    shown = {name: value for name, value in facts.items() if name not in hidden}
    shown["uncertain"] = list(map(_close_call, report.uncertain))
    if report.n_draws:
        agreeing = f"{report.n_agreeing} of {report.n_draws} have the same graph"
        shown["samples"] = [agreeing, *map(str, report.unsupported)]
    return {**shown, "contraction": ending(facts), "seconds": f"{facts['seconds']:.2f}"}


def _close_call(call: Decision) -> str:
    """A close call, and what to do where the answer is wrong."""
    return f"{call}; if that is wrong: --set {call.otherwise}"
