"""``glsk evaluate``: how good a skeleton is."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import FileFormatError, InvalidParameterError, SkeletonWarning
from .console import echo, print_json, print_table, progress
from .options import SKELETON_FILE, Json, Quiet, Verbose
from .reporting import holding_interrupts, reporting

if TYPE_CHECKING:
    import numpy as np

    from ..analysis import Assessment, Comparison, Truth
    from ..skeleton import Skeleton

_BLACK_MEANS = "around a junction, not measured"
_MEASURES = {  # measure: (best, what it is), as the table shows them
    "centredness": ("1", "1 - offset from the section's middle, in radii"),
    "boundedness": ("1", "share of the length inside the cloud"),
    "smoothness": ("1", "1 - half turns per radius travelled"),
    "topology": ("1", "parts as in the cloud, no false loops"),
    "error": ("0", "distance from the true axis, in true radii"),
    "inside": ("1", "share of it within a radius of the axis"),
    "completeness": ("1", "share of the axis within a radius of it"),
    "length": ("1", "its length over that of the axis"),
    "ends": ("0", "distance of the axis's ends, in true radii"),
    "radius_error": ("0", "difference from the true radii, relative"),
    "tips_f1": ("1", "its leaves against those of the axis, F1"),
    "junctions_f1": ("1", "its junctions against those of the axis, F1"),
}


def evaluate(
    skeleton: Annotated[
        Path,
        typer.Argument(metavar="SKELETON", help=SKELETON_FILE),
    ],
    cloud: Annotated[Path, typer.Argument(metavar="CLOUD", help="The cloud it was made from, in the same units.")],
    truth: Annotated[
        Path | None,
        typer.Option(
            "--truth",
            metavar="FILE",
            help="Also compare with a known axis: npz with nodes, edges and radii, or a skeleton.",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="JSON", help="Write all numbers to a file.")
    ] = None,
    preview: Annotated[
        Path | None,
        typer.Option(
            "--preview", metavar="PNG", help="Draw the skeleton coloured by its error, or by its centredness."
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Measure how good a skeleton is.

    From the cloud alone: is it centred, inside, smooth, in as many parts, and without false loops. With a truth also:
    how far is it from the true axis.
    """
    with reporting(cloud, quiet=quiet, verbose=verbose):
        from ..interop.atomic import write_json
        from ..interop.clouds import cloud_points
        from ..io.scans import read_cloud
        from ..io.skeletons import read_skeleton, read_truth
        from .outputs import PICTURE_FILE, REPORT_FILE, check_findings

        files = [path for path in (output, preview) if path is not None]
        check_findings([(output, *REPORT_FILE), (preview, *PICTURE_FILE)], skeleton, cloud, truth)
        with progress(not quiet and not verbose) as update:
            update(f"reading {skeleton.name}")
            curve = read_skeleton(skeleton)
            axis = read_truth(truth) if truth is not None else None
            update(f"reading {cloud.name}")
            with holding_interrupts():
                points = cloud_points(read_cloud(cloud))
            update("measuring")
            assessment, comparison = _measured(skeleton, curve, points, axis)
            if assessment is not None and _elsewhere(assessment, curve.vertices, points):
                message = "the skeleton does not lie in it: is this the cloud it was made from, in its units?"
                warnings.warn(f"{cloud}: {message}", SkeletonWarning, stacklevel=1)
            told = {
                "skeleton": str(skeleton),
                "cloud": str(cloud),
                "truth": None if truth is None else str(truth),
                "assessment": None if assessment is None else assessment.as_dict(),
                "comparison": None if comparison is None else comparison.as_dict(),
            }
            if output is not None:
                write_json(output, told)
            if preview is not None:
                update(f"drawing {preview.name}")
                _draw(curve, points, assessment, comparison, preview, skeleton.name)
        if as_json:
            print_json({**told, "files": [str(path) for path in files]})
        elif not quiet:
            _print_measures(assessment, comparison)
            for path in files:
                echo(f"wrote {path}")


def _measured(
    path: Path, curve: Skeleton, points: np.ndarray, axis: Truth | None
) -> tuple[Assessment | None, Comparison | None]:
    """The measures that need only the cloud, and those against the truth if there is one."""
    from ..analysis import assess, compare

    try:
        comparison = compare(curve, axis) if axis is not None else None
        # a ball's skeleton is a vertex: it can be compared, but lies along nothing
        assessment = assess(curve, points) if comparison is None or curve.edge_lengths.any() else None
    except InvalidParameterError as error:  # the file's fault, not that of the command line
        raise FileFormatError(f"{path}: {error}") from error
    return assessment, comparison


def _draw(
    curve: Skeleton,
    points: np.ndarray,
    assessment: Assessment | None,
    comparison: Comparison | None,
    picture: Path,
    title: str,
) -> None:
    """The skeleton in its cloud, its edges coloured by the error, or without a truth by the centredness."""
    from ..viewing.assessment_picture import save_assessment

    if comparison is not None:
        values, label, best = comparison.edge_error, "error in true radii", 0
    else:
        assert assessment is not None
        values, label, best = assessment.edge_centredness, "centredness", 1
    save_assessment(curve, points, values, picture, label=label, best=best, unknown=_BLACK_MEANS, title=title)


def _elsewhere(assessment: Assessment, vertices: np.ndarray, points: np.ndarray) -> bool:
    """Whether a skeleton can hardly be that of the points: it is not inside, longer than they, or very much shorter."""
    import numpy as np

    points = points[np.isfinite(points).all(axis=1)]
    cloud, curve = (np.linalg.norm(np.ptp(places, axis=0)) for places in (points, vertices))
    return min(assessment.boundedness, assessment.centredness) < 0.1 or not 0.8 * curve < cloud < 20 * curve


def _print_measures(assessment: Assessment | None, comparison: Comparison | None) -> None:
    """One table: the measures that need only the cloud, and then those against the truth."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, header_style="")
    table.add_column("measure", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("best", justify="right")
    table.add_column("what it is")
    if assessment is not None:
        _add_numbers(table, assessment)
        parts = f"{assessment.components}", f"{assessment.clusters}"
        table.add_row("parts", *parts, "components; the cloud has as many as best")
        told = f"{assessment.wide_loops} open wider than their tube; missing ones show with --truth"
        table.add_row("loops", f"{len(assessment.loops)}", "", told)
        for i, loop in enumerate(assessment.loops, 1):
            ratio = f"{loop.opening / loop.tube_radius:.2f}" if loop.tube_radius > 0 else "inf"
            table.add_row(
                f"  loop {i}", ratio, "> 1", f"opening {loop.opening:.4g}, tube radius {loop.tube_radius:.4g}"
            )
    if comparison is not None:
        table.add_section()
        _add_numbers(table, comparison)
        for name in ("components", "loops", "leaves", "junctions"):
            difference = getattr(comparison, name)
            table.add_row(name, f"{difference:+d}" if difference else "0", "0", "more, or fewer, than in the axis")
        for name, agrees, told in (
            ("true topology", comparison.topology, "components and loops as in the axis"),
            ("perfect", comparison.perfect, "so are the leaves, each near one of it"),
        ):
            table.add_row(name, "yes" if agrees else "no", "yes", told)
    print_table(table)


def _add_numbers(table: Any, measures: Assessment | Comparison) -> None:
    for name, value in measures.as_dict().items():
        if isinstance(value, float) and name in _MEASURES:
            table.add_row(name.replace("_", " "), f"{value:.4f}", *_MEASURES[name])
