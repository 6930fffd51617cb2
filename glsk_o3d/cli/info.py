"""``glsk info``: what is in a file, and which files can be read."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import print_iterations, print_json, print_rows
from .options import Json, Quiet, Verbose, Where
from .reporting import holding_interrupts, reporting

if TYPE_CHECKING:
    from ..io.clouds.scanned import Scan
    from ..skeleton import Skeleton

FEW_VALUES = 12  # fitted: that an attribute may have for all of them to be listed
EXTENT_DIGITS = 6  # fitted: of coordinates, counted from the size of the cloud and not from the origin


def info(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FILE]",
            help="A cloud, a mesh or a skeleton. Without one: the formats that are read and written.",
        ),
    ] = None,
    where: Where = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Say what is in a cloud or skeleton file."""
    with reporting(quiet=quiet, verbose=verbose):
        from ..io.clouds.blocks import promised_points, read_blocks
        from ..io.scans import read_scan
        from ..io.skeletons import holds_skeleton, read_skeleton
        from ..io.streaming import LARGE_CLOUD

        if file is None:
            _formats(as_json)
            return
        if holds_skeleton(file):
            skeleton = read_skeleton(file)
            told = skeleton_facts(skeleton)
            records = skeleton.report.iterations
        else:
            if (promised_points(file) or 0) > LARGE_CLOUD:
                told = large_facts(read_blocks(file, where=where))
            else:
                with holding_interrupts():
                    scan = read_scan(file, where)
                told = cloud_facts(scan)
            records = ()
        if as_json:
            iterations = {"iterations": skeleton.report.to_dict()["iterations"]} if records else {}
            print_json({"file": str(file), **told, **iterations})
            return
        if quiet:
            return
        if told.get("repeatable"):
            told["stages"] = _in_short(told["stages"], skeleton.report.recipe)
        print_rows({name: _words(value, name) for name, value in _in_words(told).items()}, title=str(file))
        if records:
            print_iterations(records)


def _formats(as_json: bool) -> None:
    """Print the endings that are read and written, and what is missing for some."""
    from ..errors import MissingPackageError
    from ..interop.packages import require_for
    from ..io.paths import CLOUD_ENDINGS, MESH_ENDINGS
    from ..io.skeletons import FORMATS, READABLE

    kinds = {"clouds": CLOUD_ENDINGS, "meshes": MESH_ENDINGS, "skeletons": READABLE}
    lacking = {}
    for ending in (ending for endings in kinds.values() for ending in endings):
        try:
            require_for(ending)
        except MissingPackageError as error:
            lacking[ending] = str(error)
    written = [ending for ending in FORMATS if ending not in READABLE]
    if as_json:
        print_json({**kinds, "only_written": written, "lacking": lacking})
        return
    rows: dict[str, Any] = {f"{kind} read": " ".join(endings) for kind, endings in kinds.items()}
    rows |= {"only written": " ".join(written), "lacking": "\n".join(map(": ".join, lacking.items())) or None}
    print_rows(rows)


def cloud_facts(scan: Scan) -> dict[str, Any]:
    """What there is to know about a cloud, or the vertices of a mesh, before skeletonising it.

    Lengths are in the cloud's units; the spacing is the median distance of a point to the nearest other one.
    """
    import numpy as np
    from scipy.spatial import KDTree

    points = scan.positions
    finite = points[np.isfinite(points).all(axis=1)]
    distinct = np.unique(finite, axis=0)
    low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (np.full(3, np.nan),) * 2
    spacing = np.nan
    if len(distinct) > 1:
        spacing = np.median(KDTree(distinct).query(distinct, k=2)[0][:, 1])
    return {
        "kind": "cloud",
        "points": len(points),
        "triangles": len(scan.triangles) or None,
        "not_finite": len(points) - len(finite),
        "duplicates": len(finite) - len(distinct),
        "lowest": low.tolist(),
        "highest": high.tolist(),
        "diagonal": float(np.linalg.norm(high - low)),
        "median_spacing": float(spacing),
        "colours": scan.colors is not None,
        "normals": scan.normals is not None,
        "attributes": {name: _attribute(values) for name, values in scan.given.items()} or None,
    }


def large_facts(blocks: Iterable[Scan]) -> dict[str, Any]:
    """The same for a cloud in blocks, but for what only all of its points together say: duplicates, and spacing."""
    import numpy as np

    n, lost, ends, known = 0, 0, [], dict[str, dict[str, Any]]()
    unset: set[str] = set()
    for i, block in enumerate(blocks):
        finite = block.positions[np.isfinite(block.positions).all(axis=1)]
        n, lost = n + len(block), lost + len(block) - len(finite)
        ends += [finite.min(axis=0), finite.max(axis=0)] if len(finite) else []
        unset = unset & block.unset if i else set(block.unset)
        for name, values in block.attributes.items():
            told = _attribute(values)
            known[name] = _together(known[name], told) if name in known else told
    low, high = (np.min(ends, axis=0), np.max(ends, axis=0)) if ends else (np.full(3, np.nan),) * 2
    return {
        "kind": "cloud",
        "points": n,
        "not_finite": lost,
        "lowest": low.tolist(),
        "highest": high.tolist(),
        "diagonal": float(np.linalg.norm(high - low)),
        "colours": block.colors is not None,
        "normals": block.normals is not None,
        "attributes": {name: facts for name, facts in known.items() if name not in unset} or None,
    }


def _together(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """What two blocks say of an attribute: how many points have each value only while these are few."""
    some = [each for each in (one, other) if "lowest" in each]
    told: dict[str, Any] = {}
    if some:
        told = {"lowest": min(each["lowest"] for each in some), "highest": max(each["highest"] for each in some)}
    if "counts" in one and "counts" in other:
        both = one["counts"] | other["counts"]
        counts = {name: one["counts"].get(name, 0) + other["counts"].get(name, 0) for name in both}
        if len(counts) <= FEW_VALUES:
            told |= {"distinct": len(counts), "counts": {name: counts[name] for name in sorted(counts, key=float)}}
    return told


def _attribute(values: Any) -> dict[str, Any]:
    """The range of an attribute, and how many points have each of its values if these are few."""
    import numpy as np

    known = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    distinct, counts = np.unique(known, return_counts=True)
    told: dict[str, Any] = {"distinct": len(distinct)}
    if len(distinct):
        told |= {"lowest": distinct[0].item(), "highest": distinct[-1].item()}
    if len(distinct) <= FEW_VALUES:
        told["counts"] = {f"{value:.10g}": n for value, n in zip(distinct.tolist(), counts.tolist(), strict=True)}
    return told


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
        "unsupported": list(map(str, report.unsupported)),
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


def _in_short(stages: list[str], recipe: dict[str, Any]) -> list[str]:
    """The filters of a run with those options alone that are not the default of the filter."""
    from ..recipes import from_recipe

    short = {repr(stage): _call(stage) for stage in from_recipe(recipe).stages}
    return [short.get(stage, stage) for stage in stages]


def _call(made: Any) -> str:
    """A filter or stopping rule as its name, and its options that are not the default."""
    from dataclasses import fields, is_dataclass

    if not is_dataclass(made):
        return repr(made)
    given = {field.name: getattr(made, field.name) for field in fields(made) if field.init}
    chosen = [
        f"{field.name}={_call(given[field.name])}"
        for field in fields(made)
        if given.get(field.name, field.default) != field.default
    ]
    return type(made).__name__ + f"({', '.join(chosen)})" * bool(chosen)


def _in_words(told: dict[str, Any]) -> dict[str, Any]:
    """Facts as the table shows them: coordinates with as many digits as the size of the cloud asks for."""
    told = dict(told)
    if told.get("radii"):
        told["radii"] = " to ".join(f"{radius:.6g}" for radius in told["radii"])
    if told["kind"] == "cloud":
        diagonal = told["diagonal"]
        fine = math.isfinite(diagonal) and diagonal > 0
        decimals = max(EXTENT_DIGITS - math.ceil(math.log10(diagonal)), 0) if fine else EXTENT_DIGITS
        for name in ("lowest", "highest"):
            told[name] = "  ".join(f"{item:.{decimals}f}" for item in told[name])
        told["attributes"] = {name: _range(facts) for name, facts in (told["attributes"] or {}).items()} or None
    return told


def _range(facts: dict[str, Any]) -> str:
    if "counts" in facts:
        return ", ".join(f"{value} ({n} points)" for value, n in facts["counts"].items()) or "unknown"
    values = f", {facts['distinct']} values" if "distinct" in facts else ""
    return f"{facts['lowest']:.10g} to {facts['highest']:.10g}{values}"


def _words(value: Any, name: str) -> Any:
    """A value as the table shows it."""
    if isinstance(value, dict):
        apart = "\n" if name == "attributes" else ", "
        return apart.join(f"{name} {text}" for name, text in value.items())
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        strings = all(isinstance(item, str) for item in value)
        return "\n".join(value) or None if strings else "  ".join(f"{item:.6g}" for item in value)
    return value
