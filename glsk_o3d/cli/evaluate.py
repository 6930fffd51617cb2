"""``glsk evaluate``: how good a skeleton is."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ..errors import FileFormatError, InvalidParameterError, SkeletonWarning
from .console import flags, print_table, progress, value_in_words
from .options import Numbers, SkeletonFile, argument, option
from .outputs import PICTURE_FILE, REPORT_FILE, check_outputs, tell
from .reporting import WrongUsage, load_open3d

if TYPE_CHECKING:
    import numpy as np

    from ..analysis import Assessment, Comparison, Truth
    from ..skeleton import Skeleton

_BLACK_MEANS = "around a junction, not measured"
_MEASURES = {  # measure: (best, what it is), as the table shows them
    "centredness": ("1", "1 - offset from the section's middle, in radii"),
    "boundedness": ("1", "share of the length inside the cloud"),
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
    skeleton: SkeletonFile,
    cloud: Annotated[
        Path | None, argument("[CLOUD]", "The cloud it was made from, in its units; by default the one in its file.")
    ] = None,
    truth: Annotated[
        Path | None, option("FILE", "Also compare with a known axis: npz with nodes, edges and radii, or a skeleton.")
    ] = None,
    output: Numbers = None,
    preview: Annotated[Path | None, option("PNG", "Draw the skeleton coloured by error or centredness.")] = None,
) -> None:
    """Measure how good a skeleton is.

    From the cloud alone: is it centred, inside, in as many parts, and without false loops. With a truth also: how far
    is it from the true axis.
    """
    from .. import read_cloud, read_skeleton, read_truth, save_assessment
    from ..interop.atomic import write_json
    from ..interop.clouds import cloud_points

    check_outputs([(output, *REPORT_FILE), (preview, *PICTURE_FILE)], skeleton, cloud, truth)
    with progress(not flags.quiet and not flags.verbose) as update:
        update(f"reading {skeleton.name}")
        curve = read_skeleton(skeleton)
        axis = read_truth(truth) if truth is not None else None
        points = curve.points
        if cloud is not None:
            update(f"reading {cloud.name}")
            load_open3d()
            points = cloud_points(read_cloud(cloud))
        elif not len(points):
            raise WrongUsage(f"{skeleton}: holds no cloud, as json and npz files of a run do: give the CLOUD, too")
        update("measuring")
        assessment, comparison = _measured(skeleton, curve, points, axis)
        if assessment is not None and _elsewhere(assessment, curve.vertices, points):
            message = "the skeleton does not lie in it: is this the cloud it was made from, in its units?"
            warnings.warn(f"{cloud or skeleton}: {message}", SkeletonWarning, stacklevel=1)
        facts = {
            "skeleton": str(skeleton),
            "cloud": None if cloud is None else str(cloud),
            "truth": None if truth is None else str(truth),
            "assessment": None if assessment is None else assessment.as_dict(),
            "comparison": None if comparison is None else comparison.as_dict(),
        }
        if output is not None:
            write_json(output, facts)
        if preview is not None:
            update(f"drawing {preview.name}")
            shown: dict[str, Any] = {}
            if comparison is not None:
                shown = dict(values=comparison.edge_error, label="error in true radii", best=0)
            elif assessment is not None:
                shown = dict(values=assessment.edge_centredness, label="centredness", best=1)
            save_assessment(curve, points, path=preview, unknown=_BLACK_MEANS, title=skeleton.name, **shown)
    files = [path for path in (output, preview) if path is not None]
    heads = ("measure", "value", "best", "what it is")
    whole = {**facts, "files": list(map(str, files))}
    tell(whole, lambda: print_table(_rows(assessment, comparison), heads, left=(0, 3), wrap=True), files)


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


def _elsewhere(assessment: Assessment, vertices: np.ndarray, points: np.ndarray) -> bool:
    """Whether a skeleton can hardly be that of the points: it is not inside, longer than they, or very much shorter."""
    import numpy as np

    points = points[np.isfinite(points).all(axis=1)]
    cloud, curve = (np.linalg.norm(np.ptp(places, axis=0)) for places in (points, vertices))
    return min(assessment.boundedness, assessment.centredness) < 0.1 or not 0.8 * curve < cloud < 20 * curve


def _rows(assessment: Assessment | None, comparison: Comparison | None) -> Iterator[tuple[str, str, str, str]]:
    """The table: the measures that need only the cloud, and then those against the truth."""
    if assessment is not None:
        yield from _numbers(assessment)
        parts = f"{assessment.components}", f"{assessment.clusters}"
        yield "parts", *parts, "components; the cloud has as many as best"
        wide = f"{assessment.wide_loops} open wider than their tube; missing ones show with --truth"
        yield "loops", f"{assessment.loops}", "", wide
    if comparison is not None:
        yield "", "", "", ""
        yield from _numbers(comparison)
        for name in ("components", "loops", "leaves", "junctions"):
            difference = getattr(comparison, name)
            yield name, f"{difference:+d}" if difference else "0", "0", "more, or fewer, than in the axis"
        yield "true topology", value_in_words(comparison.topology), "yes", "components and loops as in the axis"
        yield "perfect", value_in_words(comparison.perfect), "yes", "so are the leaves, each near one of it"


def _numbers(measures: Assessment | Comparison) -> Iterator[tuple[str, str, str, str]]:
    for name, value in measures.as_dict().items():
        if isinstance(value, float) and name in _MEASURES:
            yield name.replace("_", " "), f"{value:.4f}", *_MEASURES[name]
