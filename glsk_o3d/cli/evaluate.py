"""``glsk evaluate``: how good a skeleton is."""

import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from ..errors import FileFormatError, InvalidParameterError, SkeletonWarning
from .console import print_rows, progress
from .options import SkeletonFile, argument, option
from .outputs import tell
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
    from ..analysis import assess, compare
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
            comparison = compare(curve, axis) if axis is not None else None
            # a ball's skeleton is a vertex: it can be compared, but lies along nothing
            assessment = assess(curve, points) if comparison is None or curve.edge_lengths.any() else None
        except InvalidParameterError as error:  # the file's fault, not that of the command line
            raise FileFormatError(f"{skeleton}: {error}") from error
    if assessment is not None:
        finite = points[np.isfinite(points).all(axis=1)]
        whole, long = (np.linalg.norm(np.ptp(places, axis=0)) for places in (finite, curve.vertices))
        # not inside, longer than the points, or very much shorter
        if min(assessment.boundedness, assessment.centredness) < 0.1 or not 0.8 * long < whole < 20 * long:
            message = "the skeleton does not lie in it: is this the cloud it was made from, in its units?"
            warnings.warn(f"{cloud or skeleton}: {message}", SkeletonWarning, stacklevel=1)
    facts: dict[str, Any] = {
        **{"skeleton": str(skeleton), "cloud": cloud and str(cloud), "truth": truth and str(truth)},
        "assessment": assessment and asdict(assessment),
        "comparison": comparison and asdict(comparison),
    }

    def words() -> None:
        for name in ("assessment", "comparison"):
            if facts[name] is not None:
                print_rows(facts[name], title=name)

    tell(facts, words)
