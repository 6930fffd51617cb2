"""``glsk evaluate``, ``branches`` and ``grasps``: what can be measured of a skeleton."""

from __future__ import annotations

import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from .. import analysis
from ..errors import FileFormatError, InvalidParameterError, SkeletonWarning
from .console import echo, print_rows, print_table, progress, value_in_words
from .options import Root, SkeletonFile, argument, option, output_option
from .outputs import Output, check_outputs, print_result, write_outputs
from .reporting import WrongUsage


def evaluate(
    skeleton: SkeletonFile,
    cloud: Annotated[
        Path | None, argument("[CLOUD]", "The cloud it was made from, in its units; by default the one in its file.")
    ] = None,
    truth: Annotated[
        Path | None, option("FILE", "Also compare with a known axis: npz with nodes, edges and radii, or a skeleton.")
    ] = None,
) -> None:
    """Measure how good a skeleton is.

    The assessment is from the cloud alone: is it centred, inside, in as many parts (clusters), and without false loops?
    1 is best. The comparison is with a truth: how far is it from the true axis, in radii? 0 is best of error, ends and
    radius error, 1 of the others; components, loops, leaves and junctions are more, or fewer, than it has.
    """
    import numpy as np

    from .. import read_skeleton, read_truth
    from ..io.scans import read_scan

    with progress() as update:
        update(f"reading {skeleton.name}")
        curve = read_skeleton(skeleton)
        axis = read_truth(truth) if truth is not None else None
        points = curve.whole.points if cloud is None else read_scan(cloud).by_area().positions
        if not len(points):
            raise WrongUsage(f"{skeleton}: holds no cloud, as json and npz files of a run do: give the CLOUD, too")
        update("measuring")
        try:
            comparison = analysis.compare(curve, axis) if axis is not None else None
            # a ball's skeleton is a vertex: it can be compared, but lies along nothing
            on_curve = comparison is None or curve.edge_lengths.any()
            assessment = analysis.assess(curve, points) if on_curve else None
        except InvalidParameterError as error:  # the file's fault, not that of the command line
            raise FileFormatError(f"{skeleton}: {error}") from error
    if assessment is not None:
        finite = points[np.isfinite(points).all(axis=1)]
        whole, long = (np.linalg.norm(np.ptp(places, axis=0)) for places in (finite, curve.vertices))
        # not inside, longer than the points, or very much shorter
        if min(assessment.boundedness, assessment.centredness) < 0.1 or not 0.8 * long < whole < 20 * long:
            message = "the skeleton does not lie in it: is this the cloud it was made from, in its units?"
            warnings.warn(f"{cloud or skeleton}: {message}", SkeletonWarning, stacklevel=1)
    results = {"assessment": assessment, "comparison": comparison}
    judged = {name: None if result is None else asdict(result) for name, result in results.items()}
    facts = {"skeleton": str(skeleton), "cloud": cloud and str(cloud), "truth": truth and str(truth), **judged}

    def words() -> None:
        for name, numbers in judged.items():
            if numbers is not None:
                print_rows(numbers, title=name)

    print_result(facts, words)


def branches(
    skeleton: SkeletonFile,
    output: Annotated[list[Path] | None, output_option("CSV", "Write the whole table; may be repeated.")] = None,
    root: Root = None,
) -> None:
    """Measure every branch of a skeleton.

    Lengths are in the units of the file. A branch starts where it is nearer to the root. Its tortuosity is its length
    over the distance of its ends, its angle is in degrees to the parent. Branches that continue each other have the
    same axis and order; the level counts branches from the root.
    """
    from .. import read_skeleton

    outputs = [Output(path, (".csv",), "table is CSV", analysis.BranchTable.to_csv) for path in output or []]
    check_outputs(outputs, skeleton)
    curve = read_skeleton(skeleton)
    if len(curve.vertices) == 0:
        raise FileFormatError(f"{skeleton}: the skeleton is empty: it has no branches to measure")
    table = analysis.branch_table(curve, root)

    def words() -> None:
        if output:
            echo(f"{len(table)} branches, {table.order.max() + 1} orders, length {table.length.sum():.4g}")
            return
        columns = table.printed()
        print_table(zip(*columns.values(), strict=True), [name.replace("_", " ") for name in columns])

    print_result({"skeleton": str(skeleton), "branches": list(table)}, words, write_outputs(outputs, table))


def grasps(
    skeleton: Annotated[Path, argument("SKELETON", "Of the object; JSON and npz files know its points.")],
    opening: Annotated[float, option("LENGTH", "Of the gripper, at its widest.")],
    cloud: Annotated[Path | None, option("FILE", "Points not to touch; by default those of the skeleton.")] = None,
    plane: Annotated[str | None, option("A,B,C,D", "A table, ax + by + cz + d = 0.")] = None,
    min_confidence: Annotated[float, option("SHARE", "Of the skeleton, from 0 to 1.")] = 0.25,
    accept: Annotated[
        str, option("VERDICT", "Worst of a skeleton that gets grasps: good, doubtful or 'no curve skeleton'.")
    ] = "doubtful",
    max_places: Annotated[int | None, option("N", "Search so many places, the most promising ones.", min=1)] = None,
    seconds: Annotated[float | None, option("SECONDS", "Stop after this time, the best places first.", min=0)] = None,
    count: Annotated[int, option("N", "How many to show and write, of each place its best first.", "-n", min=1)] = 20,
    output: Annotated[list[Path] | None, output_option("FILE", "json or csv; may be repeated.")] = None,
) -> None:
    """Find where a gripper with two jaws can take an object.

    All lengths are in the file's units. The jaws close across the branches of the skeleton. A grasp is left out where a
    finger or the palm, on a straight way in, would meet points, or the far side of a plane. Space that was not scanned
    counts as free.
    """
    from .. import read_cloud, read_skeleton

    def save(best: analysis.GraspCandidates, path: Path) -> None:
        (best.to_csv if path.suffix.lower() == ".csv" else best.to_json)(path)

    outputs = [Output(path, (".json", ".csv"), "grasps are JSON or CSV", save) for path in output or []]
    check_outputs(outputs, skeleton, cloud)
    candidates = analysis.grasp_candidates(
        read_skeleton(skeleton),
        opening,
        cloud=None if cloud is None else read_cloud(cloud),
        plane=None if plane is None else plane.split(","),
        min_confidence=min_confidence,
        accept=accept,
        max_places=max_places,
        seconds=seconds,
    )
    best, n = candidates[:count], len(candidates)
    facts = {"skeleton": str(skeleton), "found": n, **best.as_dict()}
    print_result(facts, lambda: _print_grasps(best, n), write_outputs(outputs, best))


def _print_grasps(best: Any, n: int) -> None:
    """Print the best of `n` grasps, and why others were left out."""
    first = f", the first {len(best)} of them here: -n for more" if len(best) < n else ""
    echo(f"{n} grasps at {best.places} places{first}")
    for reason, times in best.left_out.items():
        limit = " (confidence below --min-confidence)" if reason == "uncertain" else ""
        echo(f"left out: {times} {reason}{limit}")
    columns = [f"{name}_{axis}" for name in ("position", "approach") for axis in "xyz"]
    columns += ["opening", "quality", "seen", "branch"]
    if n:
        heads = [column.removeprefix("position_").replace("_", " ") for column in columns]
        cells = [[value_in_words(round(grasp[name], 9), digits=4) for name in columns] for grasp in best]
        print_table(cells, heads)
