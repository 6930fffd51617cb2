"""``glsk rerun``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

from .console import progress
from .options import CutLoops, Json, Output, Preview, Quiet, ReportPage, Verbose, argument
from .outputs import check_outputs, skeleton_files, skeleton_writers, write_each
from .reporting import load_open3d
from .running import print_results, run


def rerun(
    result: Annotated[Path, argument("RESULT", "A skeleton that 'glsk skeletonize' wrote as json or npz.")],
    scan: Annotated[Path | None, argument("SCAN", "Another cloud to run it on, instead of its points.")] = None,
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
    from .. import ContractionRecorder, RecipeError, from_recipe, read_cloud, read_skeleton
    from .. import rerun as run_again
    from ..io.streaming import sample_for
    from ..recipes.rerun import identical, is_of_sample

    check_outputs(skeleton_files(output, preview, report), scan, result)
    recorder = ContractionRecorder() if report is not None else None
    with progress(not quiet and not verbose) as update:
        update(f"reading {result.name}")
        load_open3d()
        made, cloud = read_skeleton(result), None
        try:
            if scan is not None and is_of_sample(made):
                cloud = sample_for(from_recipe(made.report.recipe), scan, stream=True)
            elif scan is not None:
                cloud = read_cloud(scan)
            skeleton, seconds = run(partial(run_again, made), cloud, update, recorder)
        except RecipeError as error:
            raise RecipeError(f"{result}: cannot be repeated: {error}") from error
        title = (scan or result).name
        writers = skeleton_writers(
            skeleton, output, preview, report, title=title, cut_loops=cut_loops, recorder=recorder
        )
        written, problems = write_each(writers, update)
    same = {"identical": identical(skeleton, made)}
    print_results(skeleton, seconds, written, problems, same, quiet=quiet, verbose=verbose, as_json=as_json)
