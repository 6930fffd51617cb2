"""``glsk skeletonize`` and ``glsk demo``: from a cloud to a skeleton."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from . import options
from .console import echo, flags, print_rows, progress, say
from .options import option, output_option
from .outputs import Output, check_outputs, skeleton_outputs, tell, write_each
from .reporting import WrongUsage

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def skeletonize(
    scan: options.ScanFile,
    output: options.SkeletonOutput = None,
    preview: options.Preview = None,
    report: options.ReportPage = None,
    pipeline: options.PipelineName = "default",
    settings: options.Settings = None,
    where: options.Where = None,
    root: Annotated[
        str | None, option("ROOT", "Grow one tree from there: x to -z, lowest along an axis, thickest, or x,y,z.")
    ] = None,
    tubes: Annotated[Path | None, option("MESH", "Also write tubes as thick as the object: ply.")] = None,
    labelled: Annotated[
        Path | None, option("CLOUD", "Also write the scan with branch, radius, ... of every point, as ply.")
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
    from .. import ContractionRecorder, annotate_file, read_cloud, recipes
    from ..interop.packages import require
    from ..io.streaming import LABELLED_ENDING, sample_for
    from ..resampling import with_support
    from .overrides import choose, grown_from

    chosen = choose(pipeline, settings, drop_invalid)
    if root is not None:
        chosen = grown_from(root, chosen)
    recorder = ContractionRecorder() if report is not None else None

    def label(skeleton: Skeleton, path: Path) -> None:
        annotate_file(skeleton, scan, path, where=where)

    results = [
        *skeleton_outputs(output, preview, report, title=scan.name, cut_loops=cut_loops, recorder=recorder),
        Output(tubes, (".ply",), "mesh of tubes is PLY", _save_tubes),
        Output(labelled, (LABELLED_ENDING,), "cloud with labels is PLY", label),
    ]
    if all(result.path is None for result in results):
        raise WrongUsage("nothing to write: give -o, --tubes or --labelled, a --preview or a --report")
    saved = Output(
        save_recipe, (".json", ".toml"), "file is a recipe", lambda _, path: recipes.save_recipe(chosen, path)
    )
    check_outputs([*results, saved], scan, Path(pipeline))
    if tubes is not None or labelled is not None:
        require("matplotlib")  # for the colours of branches
    if save_recipe is not None:
        recipes.to_recipe(chosen)  # not all can be written
    with progress() as update:
        update(f"reading {scan.name}")
        cloud = sample_for(chosen, scan, where, stream)
        if cloud is None:
            cloud = read_cloud(scan, where=where)
        skeleton, seconds = _run(chosen, cloud, update, recorder)
        if support is not None:
            comparing = "comparing with the skeleton of sample {} of {}"
            skeleton = with_support(skeleton, chosen, support, on_draw=lambda *n: update(comparing.format(*n), *n))
        files = write_each([*results, saved], skeleton, update)
    _tell(skeleton, seconds, files)


def _save_tubes(skeleton: Skeleton, path: Path) -> None:
    from .. import to_tubes
    from ..io.formats import ply

    tubes = to_tubes(skeleton)
    held = {"positions": tubes.vertices, "normals": tubes.vertex_normals, "colors": tubes.vertex_colors}
    ply.save(path, held, tubes.triangles)


def demo(
    folder: Annotated[Path, output_option("FOLDER", "Made if it is not there.")] = Path("demo"),
    points: Annotated[int, option("N", "How many points the scan has.", "--points", "-n", min=8, max=10**9)] = 8192,
) -> None:
    """Skeletonise the built-in sample object.

    It is a toy dinosaur with a carrying handle on its back, scanned from two sides. Writes cloud.ply (the scan),
    skeleton.ply, skeleton.json and skeleton.png (the picture to look at).
    """
    from .. import MissingPackageError, samples
    from ..interop.packages import require_for
    from ..io.formats import ply

    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    picture, missing = folder / "skeleton.png", ""
    try:
        require_for(picture.suffix)
    except MissingPackageError as error:  # all else can be shown
        missing = f"no {picture.name}: {error}"
    ply.save(folder / "cloud.ply", {"positions": samples.sample_object(points).points})
    if not (flags.quiet or flags.as_json):
        echo(f"wrote {folder / 'cloud.ply'}")
    outputs = [folder / "skeleton.ply", folder / "skeleton.json"]
    skeletonize(folder / "cloud.ply", outputs, None if missing else picture)
    if missing and not flags.quiet:
        say("warning", missing)


def _run(pipeline: Callable[..., Skeleton], cloud: Any, update, on_state=None) -> tuple[Skeleton, float]:
    """Run a pipeline and show how far it is; gives the skeleton, and the seconds it took."""

    def on_iteration(record):
        update(f"solve {record.iteration}: {record.n_points - record.n_merged} points are left")

    start = time.perf_counter()
    skeleton = pipeline(
        cloud, on_iteration=on_iteration, on_state=on_state, on_stage=lambda stage: update(type(stage).__name__)
    )
    return skeleton, time.perf_counter() - start


def _tell(skeleton: Skeleton, seconds: float, files: Mapping[Path, str]) -> None:
    """Print the summary of a run, and the files written; then OSError if there were problems."""
    from ..analysis.summary import summary

    report = skeleton.report
    facts = summary(skeleton, seconds)
    supported = {"unsupported": list(map(asdict, report.unsupported))} if report.n_draws else {}
    whole = {**facts, **supported, "warnings": list(report.warnings)}
    tell(whole, lambda: print_rows(_shown(facts, skeleton)), files)


def _shown(facts: Mapping[str, Any], skeleton: Skeleton) -> dict[str, Any]:
    """The facts that say something of this run, in words."""
    from ..analysis.summary import ENDING_FACTS, ending, structure

    report, graph = skeleton.report, structure(skeleton)
    hidden = {
        *ENDING_FACTS,
        "seconds",
        "agreeing",
        "loops_closed",
    }  # most clouds have such loops, which are hardly ever true ones
    hidden |= {"sampled"} if not report.is_sampled else set()
    hidden |= {"contracted"} if facts["contracted"] == facts["distinct"] else set()
    told = {name: facts[name] for name in facts if name in graph or facts[name] or facts[name] is False}
    shown = {name: value for name, value in told.items() if name not in hidden}
    shown["uncertain"] = [f"{call}; if that is wrong: --set {call.otherwise}" for call in report.uncertain]
    if report.n_draws:
        agreeing = f"{report.n_agreeing} of {report.n_draws} have the same graph"
        shown["samples"] = [agreeing, *map(str, report.unsupported)]
    return {**shown, "contraction": ending(facts), "seconds": f"{facts['seconds']:.2f}"}
