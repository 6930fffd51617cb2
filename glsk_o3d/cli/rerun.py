"""``glsk rerun``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .console import progress
from .options import CutLoops, Json, Output, Preview, Quiet, ReportPage, Verbose
from .reporting import holding_interrupts, reporting


def rerun(
    result: Annotated[
        Path, typer.Argument(metavar="RESULT", help="A skeleton that 'glsk skeletonize' wrote as json or npz.")
    ],
    scan: Annotated[
        Path | None,
        typer.Argument(metavar="SCAN", help="Another cloud to run it on; by default the points in the result."),
    ] = None,
    output: Output = None,
    preview: Preview = None,
    report: ReportPage = None,
    cut_loops: CutLoops = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Repeat the run that made a result.

    It is run with the recipe that the result holds. On the points of the result the skeleton is the same to the last
    bit; where other releases make it differ, there is a warning. Without outputs it only says whether it is the same.
    'glsk skeletonize --recipe' runs recipes from files of their own.
    """
    with reporting(scan or result, quiet=quiet, verbose=verbose):
        from ..errors import RecipeError
        from ..io.scans import read_cloud
        from ..io.skeletons import read_skeleton
        from ..io.streaming import sample_for
        from ..recipes import from_recipe, identical
        from ..recipes import rerun as run_again
        from ..recipes.rerun import is_of_sample
        from ..viewing.recorder import ContractionRecorder
        from .outputs import check_outputs, write
        from .running import print_results, run

        outputs = output or []
        if outputs or preview is not None or report is not None:
            check_outputs(outputs, preview, scan, report, result=result)
        recorder = ContractionRecorder() if report is not None else None
        with progress(not quiet and not verbose) as update:
            update(f"reading {result.name}")
            made = read_skeleton(result)
            try:
                if scan is None or not is_of_sample(made):
                    with holding_interrupts():
                        cloud = read_cloud(scan) if scan is not None else None
                else:
                    cloud = sample_for(from_recipe(made.report.recipe), scan, stream=True)
                skeleton, seconds = run(partial(run_again, made), cloud, update, recorder)
            except RecipeError as error:
                raise RecipeError(f"{result}: cannot be repeated: {error}") from error
            written, problems = write(
                skeleton,
                outputs,
                preview,
                report,
                title=(scan or result).name,
                cut_loops=cut_loops,
                update=update,
                recorder=recorder,
            )
        print_results(
            skeleton,
            seconds,
            written,
            problems,
            {"identical": identical(skeleton, made)},
            quiet=quiet,
            verbose=verbose,
            as_json=as_json,
        )
