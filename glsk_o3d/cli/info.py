"""``glsk info``: what is in a file, and which files can be read."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from .console import flags, print_rows
from .options import Where, argument
from .outputs import tell
from .reporting import load_open3d
from .skeletonize import print_iterations

if TYPE_CHECKING:
    from ..skeleton import Skeleton

FEW_VALUES = 12  # fitted: that an attribute may have for all of them to be listed
EXTENT_DIGITS = 6  # fitted: of coordinates, counted from the size of the cloud and not from the origin


def info(
    file: Annotated[Path | None, argument("[FILE]", "A cloud, mesh or skeleton; or none, for the formats.")] = None,
    where: Where = None,
) -> None:
    """Say what is in a cloud or skeleton file."""
    from ..io.skeletons import holds_skeleton, read_skeleton

    if file is None:
        flags.quiet = False
        formats = _formats()
        tell(formats, lambda: print_rows(formats))
        return
    iterations: Any = ()
    if holds_skeleton(file):
        skeleton = read_skeleton(file)
        facts, iterations = _skeleton_facts(skeleton), skeleton.report.iterations
    else:
        facts = _cloud_facts(file, where)

    def words() -> None:
        print_rows(_skeleton_in_words(facts, skeleton) if "edges" in facts else _cloud_in_words(facts), title=str(file))
        print_iterations(iterations)

    steps = {"iterations": list(map(asdict, iterations))} if iterations else {}
    tell({"file": str(file), **facts, **steps}, words)


def _formats() -> dict[str, Any]:
    """The endings that are read and written, and what is missing for some."""
    from ..errors import MissingPackageError
    from ..interop.packages import require_for
    from ..io.paths import CLOUD_ENDINGS, MESH_ENDINGS
    from ..io.skeletons import FORMATS, READABLE

    lacking = {}
    for ending in (*CLOUD_ENDINGS, *MESH_ENDINGS, *READABLE):
        try:
            require_for(ending)
        except MissingPackageError as error:
            lacking[ending] = str(error)
    written = tuple(ending for ending in FORMATS if ending not in READABLE)
    kinds = {"clouds": CLOUD_ENDINGS, "meshes": MESH_ENDINGS, "skeletons": READABLE}
    return {**kinds, "only_written": written, "lacking": lacking}


def _cloud_facts(file: Path, where: str | None) -> dict[str, Any]:
    """What there is to know about a cloud, or the vertices of a mesh, before skeletonising it.

    Lengths are in the cloud's units. A large cloud is read in blocks, which say nothing of duplicates and the spacing.
    """
    import numpy as np
    from scipy.spatial import KDTree

    from ..io.scans import promised_points, read_blocks, read_scan
    from ..io.streaming import LARGE_CLOUD

    load_open3d()
    large = (promised_points(file) or 0) > LARGE_CLOUD
    n, lost, ends, unset = 0, 0, [], []
    known: dict[str, dict[str, Any]] = {}
    for block in read_blocks(file, where=where) if large else [read_scan(file, where)]:
        finite = block.positions[np.isfinite(block.positions).all(axis=1)]
        n, lost = n + len(block), lost + len(block) - len(finite)
        ends += [finite.min(axis=0), finite.max(axis=0)] if len(finite) else []
        unset.append(block.unset)
        for name, values in block.attributes.items():
            facts = _attribute(values)
            known[name] = _together(known[name], facts) if name in known else facts
    whole: dict[str, Any] = {}
    if not large:
        distinct = np.unique(finite, axis=0)
        spacing = np.median(KDTree(distinct).query(distinct, k=2)[0][:, 1]) if len(distinct) > 1 else np.nan
        whole = {"triangles": len(block.triangles) or None, "duplicates": len(finite) - len(distinct)}
        whole["median_spacing"] = float(spacing)  # to the nearest other point
    low, high = (np.min(ends, axis=0), np.max(ends, axis=0)) if ends else (np.full(3, np.nan),) * 2
    never_set = frozenset.intersection(*unset)
    return {
        **{"kind": "cloud", "points": n, "not_finite": lost},
        **whole,
        **{"lowest": low.tolist(), "highest": high.tolist(), "diagonal": float(np.linalg.norm(high - low))},
        **{"colours": block.colors is not None, "normals": block.normals is not None},
        "attributes": {name: facts for name, facts in known.items() if name not in never_set} or None,
    }


def _attribute(values: Any) -> dict[str, Any]:
    """The range of an attribute, and how many points have each of its values if these are few."""
    import numpy as np

    known = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    distinct, counts = np.unique(known, return_counts=True)
    facts: dict[str, Any] = {"distinct": len(distinct)}
    if len(distinct):
        facts |= {"lowest": distinct[0].item(), "highest": distinct[-1].item()}
    if len(distinct) <= FEW_VALUES:
        facts["counts"] = {f"{value:.10g}": n for value, n in zip(distinct.tolist(), counts.tolist(), strict=True)}
    return facts


def _together(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """What two blocks say of an attribute: how many points have each value only while these are few."""
    facts: dict[str, Any] = {}
    known = [each for each in (one, other) if "lowest" in each]
    if known:
        facts = {"lowest": min(each["lowest"] for each in known), "highest": max(each["highest"] for each in known)}
    if "counts" in one and "counts" in other:
        counts = Counter(one["counts"]) + Counter(other["counts"])
        if len(counts) <= FEW_VALUES:
            facts |= {"distinct": len(counts), "counts": {name: counts[name] for name in sorted(counts, key=float)}}
    return facts


def _cloud_in_words(facts: dict[str, Any]) -> dict[str, Any]:
    """The facts with coordinates of as many digits as the size of the cloud asks for, and attributes as ranges."""
    diagonal, decimals = facts["diagonal"], EXTENT_DIGITS
    if math.isfinite(diagonal) and diagonal > 0:
        decimals = max(EXTENT_DIGITS - math.ceil(math.log10(diagonal)), 0)
    corners = {name: "  ".join(f"{item:.{decimals}f}" for item in facts[name]) for name in ("lowest", "highest")}
    ranges = [f"{name} {_range(attribute)}" for name, attribute in (facts["attributes"] or {}).items()]
    return {**facts, **corners, "attributes": ranges}


def _range(attribute: dict[str, Any]) -> str:
    if "counts" in attribute:
        return ", ".join(f"{value} ({n} points)" for value, n in attribute["counts"].items()) or "unknown"
    values = f", {attribute['distinct']} values" if "distinct" in attribute else ""
    return f"{attribute['lowest']:.10g} to {attribute['highest']:.10g}{values}"


def _skeleton_facts(skeleton: Skeleton) -> dict[str, Any]:
    """What there is to know about a skeleton and the run that made it; None for what its file lacks."""
    import numpy as np

    from ..analysis.summary import structure

    report = skeleton.report
    radii = skeleton.radii[np.isfinite(skeleton.radii)]
    facts = {
        "kind": "skeleton",
        **structure(skeleton),
        "radii": (float(radii.min()), float(radii.max())) if len(radii) else None,
        "points": len(skeleton.points) or None,
    }
    if not report.stages:
        return facts
    return {
        **facts,
        "stages": list(dict.fromkeys(report.stages)),
        "converged": report.converged,
        "stop_reason": report.stop_reason,
        "repeatable": _pipeline_of(skeleton) is not None,
        "uncertain": list(map(str, report.uncertain)),
        "unsupported": list(map(str, report.unsupported)),
        "warnings": list(report.warnings),
        "versions": report.versions,
    }


def _pipeline_of(skeleton: Skeleton) -> Any:
    """The pipeline that made a skeleton; None where it cannot be run here: some need a plugin, some are no recipe."""
    from ..errors import RecipeError
    from ..recipes import from_recipe

    try:
        return from_recipe(skeleton.report.recipe) if skeleton.report.recipe else None
    except RecipeError:
        return None


def _skeleton_in_words(facts: dict[str, Any], skeleton: Skeleton) -> dict[str, Any]:
    """The facts, where the filters of the run can be made here with those options alone that are no default."""
    shown = {**facts, "radii": " to ".join(f"{radius:.6g}" for radius in facts["radii"] or [])}
    if facts.get("repeatable"):
        short = {repr(stage): _call(stage) for stage in _pipeline_of(skeleton).stages}
        shown["stages"] = [short.get(stage, stage) for stage in facts["stages"]]
    return shown


def _call(made: Any) -> str:
    """A filter or stopping rule as its name, and its options that are not the default."""
    if not is_dataclass(made):
        return repr(made)
    options = {field: getattr(made, field.name) for field in fields(made) if field.init}
    chosen = [f"{field.name}={_call(value)}" for field, value in options.items() if value != field.default]
    return type(made).__name__ + f"({', '.join(chosen)})" * bool(chosen)
