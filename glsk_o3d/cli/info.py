"""``glsk info``: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import print_iterations, print_json, print_rows
from .options import Json, Quiet, Verbose
from .reporting import holding_interrupts, reporting

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def info(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A cloud, a mesh or a skeleton, in any format that is read or written."),
    ],
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Say what is in a cloud or skeleton file."""
    with reporting(quiet=quiet, verbose=verbose):
        from ..io.scans import read_scan
        from ..io.skeletons import holds_skeleton, read_skeleton

        if holds_skeleton(file):
            skeleton = read_skeleton(file)
            told = skeleton_facts(skeleton)
            records = skeleton.report.iterations
        else:
            with holding_interrupts():
                cloud, triangles = read_scan(file)
            told, records = cloud_facts(cloud, len(triangles)), ()
        if as_json:
            iterations = {"iterations": skeleton.report.to_dict()["iterations"]} if records else {}
            print_json({"file": str(file), **told, **iterations})
            return
        if quiet:
            return
        print_rows({name: _words(value) for name, value in told.items()}, title=str(file))
        if records:
            print_iterations(records)


def cloud_facts(cloud: Any, triangles: int = 0) -> dict[str, Any]:
    """What there is to know about a cloud, or the vertices of so many triangles, before skeletonising it.

    Lengths are in the cloud's units; the spacing is the median distance of a point to the nearest other one.
    """
    import numpy as np
    from scipy.spatial import KDTree

    points = np.asarray(cloud.points)
    finite = points[np.isfinite(points).all(axis=1)]
    distinct = np.unique(finite, axis=0)
    low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (np.full(3, np.nan),) * 2
    spacing = np.nan
    if len(distinct) > 1:
        spacing = np.median(KDTree(distinct).query(distinct, k=2)[0][:, 1])
    return {
        "kind": "cloud",
        "points": len(points),
        "triangles": triangles or None,
        "not_finite": len(points) - len(finite),
        "duplicates": len(finite) - len(distinct),
        "lowest": low.tolist(),
        "highest": high.tolist(),
        "diagonal": float(np.linalg.norm(high - low)),
        "median_spacing": float(spacing),
        "colours": cloud.has_colors(),
        "normals": cloud.has_normals(),
    }


def skeleton_facts(skeleton: Skeleton) -> dict[str, Any]:
    """What there is to know about a skeleton and the run that made it; None for what its file lacks."""
    import numpy as np

    from ..analysis.summary import structure

    report = skeleton.report
    radii = skeleton.radii[np.isfinite(skeleton.radii)]
    told = {
        "kind": "skeleton",
        **structure(skeleton),
        "radii": [float(radii.min()), float(radii.max())] if len(radii) else None,
        "points": len(skeleton.points) or None,
    }
    if not report.stages:
        return told
    return {
        **told,
        "stages": [stage for i, stage in enumerate(report.stages) if stage not in report.stages[:i]],
        "converged": report.converged,
        "stop_reason": report.stop_reason,
        "repeatable": _repeatable(report.recipe),
        "uncertain": list(map(str, report.uncertain)),
        "warnings": list(report.warnings),
        "versions": report.versions,
    }


def _repeatable(recipe) -> bool:
    """Whether a recipe can be run here: some cannot be written, and some need a plugin."""
    from ..errors import RecipeError
    from ..recipes import from_recipe

    try:
        return bool(recipe and from_recipe(recipe))
    except RecipeError:
        return False


def _words(value):
    """A value as the table shows it."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {text}" for name, text in value.items())
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        strings = all(isinstance(item, str) for item in value)
        return "\n".join(value) or None if strings else "  ".join(f"{item:.6g}" for item in value)
    return value
