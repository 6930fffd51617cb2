"""``glsk skeletonize``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .console import holding_interrupts, progress, reporting
from .options import Json, Output, PipelineName, Quiet, Verbose


def skeletonize(
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN", help="The cloud: ply, pcd, xyz, xyzn, xyzrgb, pts; or a mesh: off, obj, stl, gltf, glb."
        ),
    ],
    output: Output = None,
    preview: Annotated[
        Path | None, typer.Option("--preview", metavar="PNG", help="Also draw cloud and skeleton.")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", metavar="HTML", help="Also write a page to look at: turn, zoom, watch the contraction, read."
        ),
    ] = None,
    pipeline: PipelineName = "default",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="FILTER.PARAMETER=VALUE",
            help="Change a parameter, such as Connector.radius=2%; may be repeated. See 'glsk filters'.",
        ),
    ] = None,
    drop_invalid: Annotated[
        bool, typer.Option("--drop-invalid", help="Drop points with NaN or infinite coordinates.")
    ] = False,
    cut_loops: Annotated[
        bool, typer.Option("--cut-loops", help="Cut loops open for formats that hold only trees (swc).")
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compute the curve skeleton of a scan.

    Everything that can be checked is checked before the computation starts. Files appear complete or not at all.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..interop.files import read_cloud
        from ..pipelines import named_pipeline
        from ..viewing.recorder import ContractionRecorder
        from .overrides import override
        from .running import check_outputs, print_results, run, write

        drop = ["RingBuilder.drop_invalid=true"] if drop_invalid else []
        chosen = override(named_pipeline(pipeline), [*(settings or []), *drop], name=pipeline)
        outputs = output or []
        check_outputs(outputs, preview, scan, report)
        recorder = ContractionRecorder() if report is not None else None
        with progress(not quiet and not verbose) as update:
            update(f"reading {scan.name}")
            with holding_interrupts():
                cloud = read_cloud(scan)
            skeleton, seconds = run(chosen, cloud, update, recorder)
            written, problems = write(
                skeleton,
                outputs,
                preview,
                report,
                title=scan.name,
                cut_loops=cut_loops,
                update=update,
                recorder=recorder,
            )
        print_results(skeleton, seconds, written, problems, quiet=quiet, verbose=verbose, as_json=as_json)
