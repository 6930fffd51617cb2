"""``glsk skeletonize`` and ``glsk demo``: from a cloud to a skeleton."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from . import options
from .console import echo, flags, print_rows, progress
from .options import option, output_option
from .outputs import Output, check_outputs, print_result, skeleton_outputs, write_outputs

if TYPE_CHECKING:
    from ..data.skeleton import Skeleton


def skeletonize(
    scan: options.ScanFile,
    output: options.SkeletonOutput = None,
    preview: options.Preview = None,
    report: options.ReportPage = None,
    pipeline: options.PipelineName = "default",
    settings: options.Settings = None,
    where: options.Where = None,
    tubes: Annotated[Path | None, option("MESH", "Also write tubes as thick as the object: ply.")] = None,
    labelled: Annotated[
        Path | None, option("CLOUD", "Also write the scan with branch, radius, ... of every point, as ply.")
    ] = None,
    support: Annotated[
        int | None, option("SAMPLES", "Also skeletonise so many samples, and say what they share; 8 are enough.", min=2)
    ] = None,
    sample: options.Sample = None,
    drop_invalid: options.DropInvalid = False,
    cut_loops: options.CutLoops = False,
) -> None:
    """Compute the curve skeleton of a scan.

    Everything that can be checked is checked before the computation starts. Files appear complete or not at all. Of
    files with more than ten million points only a sample is read.
    """
    from .. import annotate_file
    from ..analysis.summary import summary
    from ..analysis.support import with_support
    from ..interop.packages import require
    from ..io.streaming import LABELLED_ENDING, points_for
    from .overrides import choose

    chosen = choose(pipeline, settings, drop_invalid, sample)

    def label(skeleton: Skeleton, path: Path) -> None:
        annotate_file(skeleton, scan, path, where=where)

    results = [
        *skeleton_outputs(output, preview, report, title=scan.name, cut_loops=cut_loops),
        Output(tubes, (".ply",), "mesh of tubes is PLY", _save_tubes),
        Output(labelled, (LABELLED_ENDING,), "cloud with labels is PLY", label),
    ]
    check_outputs(results, scan, Path(pipeline), needed="-o, --tubes or --labelled, a --preview or a --report")
    if tubes is not None or labelled is not None:
        require("matplotlib")  # for the colours of branches
    with progress() as update:
        update(f"reading {scan.name}")
        cloud, start = points_for(chosen, scan, where), time.perf_counter()
        solve = "solve {0.iteration}: {1} points remain"
        skeleton = chosen(
            cloud,
            on_iteration=lambda record: update(solve.format(record, record.n_points - record.n_merged)),
            on_stage=lambda stage: update(type(stage).__name__),
        )
        seconds = time.perf_counter() - start
        if support is not None:
            comparing = "comparing with the skeleton of sample {} of {}"
            skeleton = with_support(skeleton, chosen, support, on_draw=lambda *n: update(comparing.format(*n), *n))
        files = write_outputs(results, skeleton, update)
    facts, doubts = summary(skeleton, seconds), skeleton.report
    supported = {"unsupported": list(map(asdict, doubts.unsupported))} if doubts.n_draws else {}
    whole = {**facts, **supported, "warnings": list(doubts.warnings)}
    print_result(whole, lambda: print_rows(_shown(facts, skeleton)), files)


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
    from .. import samples
    from ..io.formats import ply

    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    ply.save(folder / "cloud.ply", {"positions": samples.sample_object(points).points})
    if not (flags.quiet or flags.as_json):
        echo(f"wrote {folder / 'cloud.ply'}")
    outputs = [folder / "skeleton.ply", folder / "skeleton.json"]
    skeletonize(folder / "cloud.ply", outputs, preview=folder / "skeleton.png")


def _shown(facts: Mapping[str, Any], skeleton: Skeleton) -> dict[str, Any]:
    """The facts that say something of this run, in words."""
    from ..analysis.summary import ENDING_FACTS, ending, structure

    report, graph = skeleton.report, structure(skeleton)
    hidden = {*ENDING_FACTS, "seconds", "agreeing", "loops_closed"}  # hardly ever true loops
    hidden |= {"sampled"} if not report.is_sampled else set()
    hidden |= {"contracted"} if facts["contracted"] == facts["distinct"] else set()
    shown = {name: value for name, value in facts.items() if name not in hidden and (name in graph or value)}
    codes = ", ".join(reason.code for reason in skeleton.reasons)
    shown["verdict"] = f"{facts['verdict']}: {codes}" if codes else facts["verdict"]
    shown["reasons"] = [text for text in facts["reasons"] if text not in report.warnings]  # those are on stderr
    shown["uncertain"] = [f"{call}; if that is wrong: --set {call.otherwise}" for call in report.uncertain]
    if report.n_draws:
        agreeing = f"{report.n_agreeing} of {report.n_draws} have the same graph"
        shown["samples"] = [agreeing, *map(str, report.unsupported)]
    return {**shown, "contraction": ending(facts), "seconds": f"{facts['seconds']:.2f}"}
