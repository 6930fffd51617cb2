"""``glsk info`` and ``glsk view``: what is in a file, in numbers and to look at."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from .console import print_rows, print_table
from .options import Where, argument, option
from .outputs import check_outputs, print_result, skeleton_outputs, write_outputs

if TYPE_CHECKING:
    from ..data.skeleton import Skeleton

FEW_VALUES = 12  # fitted: that an attribute may have for all of them to be listed
SPACING_POINTS = 100_000  # precision: points whose nearest others say the spacing to half a percent


def info(file: Annotated[Path, argument("FILE", "A cloud, mesh or skeleton.")], where: Where = None) -> None:
    """Say what is in a cloud or skeleton file."""
    from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
    from ..io.paths import SCAN_ENDINGS, unknown_ending
    from ..io.skeletons import FORMATS, holds_skeleton, read_skeleton

    if file.is_file() and file.suffix.lower() not in (known := dict.fromkeys((*SCAN_ENDINGS, *FORMATS))):
        raise unknown_ending(file, known)
    if holds_skeleton(file):
        skeleton = read_skeleton(file)
        facts, records = _skeleton_facts(skeleton), skeleton.report.iterations
    else:
        facts, records = _cloud_facts(file, where), ()

    def words() -> None:
        print_rows(_in_words(facts), title=str(file))
        if records:
            print_table(iteration_rows(records), list(ITERATION_COLUMNS))

    steps = {"iterations": list(map(asdict, records))} if records else {}
    print_result({"file": str(file), **facts, **steps}, words)


def _cloud_facts(file: Path, where: str | None) -> dict[str, Any]:
    """What there is to know about a cloud, or the vertices of a mesh, before skeletonising it.

    Lengths are in the cloud's units. A large cloud is read in blocks, which say nothing of duplicates and the spacing.
    """
    import numpy as np

    from ..geometry.groups import first_in_their_place
    from ..geometry.neighbourhoods import nearest_neighbours
    from ..io.scans import promised_points, read_blocks, read_scan
    from ..io.streaming import LARGE_CLOUD

    large = (promised_points(file) or 0) > LARGE_CLOUD
    n, n_finite, corners = 0, 0, [np.full(3, np.nan)]
    attributes: dict[str, dict[str, Any]] = {}
    for block in read_blocks(file, where=where) if large else [read_scan(file, where)]:
        finite = block.positions[np.isfinite(block.positions).all(axis=1)]
        n, n_finite = n + len(block), n_finite + len(finite)
        corners += [finite.min(axis=0), finite.max(axis=0)] if len(finite) else []
        for name, values in block.attributes.items():
            attributes[name] = _attribute_facts(attributes.get(name, {}), values)
    whole: dict[str, Any] = {}
    if not large:
        distinct, spacing = finite[first_in_their_place(finite)], np.nan
        if len(distinct) > 1:
            asked = distinct[:: len(distinct) // SPACING_POINTS + 1]
            spacing = np.median(nearest_neighbours(distinct, 2, of=asked)[0][:, 1])
        whole = {"triangles": len(block.triangles) or None, "duplicates": len(finite) - len(distinct)}
        whole["median_spacing"] = float(spacing)  # to the nearest other point
    low, high = np.fmin.reduce(corners), np.fmax.reduce(corners)
    return {
        **{"kind": "mesh" if whole.get("triangles") else "cloud", "points": n, "not_finite": n - n_finite},
        **whole,
        **{"lowest": low.tolist(), "highest": high.tolist(), "diagonal": float(np.linalg.norm(high - low))},
        **{"colours": block.colors is not None, "normals": block.normals is not None},
        "attributes": attributes or None,
    }


def _attribute_facts(before: dict[str, Any], values: Any) -> dict[str, Any]:
    """The range of an attribute, and how many points have each value if these are few, with those of earlier points."""
    import numpy as np

    known = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    if len(known) == 0:
        return before
    distinct, numbers = np.unique(known, return_counts=True)
    counts = Counter(before.get("counts", {}))
    counts += Counter({f"{value:.10g}": n for value, n in zip(distinct.tolist(), numbers.tolist(), strict=True)})
    low, high = distinct[0].item(), distinct[-1].item()
    facts = {"lowest": min(before.get("lowest", low), low), "highest": max(before.get("highest", high), high)}
    if len(counts) <= FEW_VALUES and (not before or "counts" in before):
        facts["counts"] = {name: counts[name] for name in sorted(counts, key=float)}
    return facts


def _skeleton_facts(skeleton: Skeleton) -> dict[str, Any]:
    """What there is to know about a skeleton and the run that made it; None for what its file lacks."""
    import numpy as np

    from ..analysis.summary import structure

    report, radii = skeleton.report, skeleton.radii[np.isfinite(skeleton.radii)]
    facts = {
        "kind": "skeleton",
        **structure(skeleton),
        "radii": (float(radii.min()), float(radii.max())) if len(radii) else None,
        "points": len(skeleton.points) or None,
    }
    run = {name: getattr(report, name) for name in ("stages", "on_medial_axis", "converged", "stop_reason", "versions")}
    run |= {name: list(getattr(report, name)) for name in ("uncertain", "unsupported", "warnings")}
    return {**facts, **run} if report.stages else facts


def _in_words(facts: dict[str, Any]) -> dict[str, Any]:
    """The facts with coordinates of as many digits as a map needs, and attributes as ranges."""
    if facts["kind"] == "skeleton":
        return {**facts, "stages": tuple(stage.partition("(")[0] for stage in facts.get("stages", ()))}
    corners = {name: "  ".join(f"{item:.10g}" for item in facts[name]) for name in ("lowest", "highest")}
    ranges = [f"{name} {_range(attribute)}" for name, attribute in (facts["attributes"] or {}).items()]
    return {**facts, **corners, "attributes": ranges}


def _range(attribute: dict[str, Any]) -> str:
    if "counts" in attribute:
        return ", ".join(f"{value} ({n} points)" for value, n in attribute["counts"].items())
    return f"{attribute['lowest']:.10g} to {attribute['highest']:.10g}" if attribute else "unknown"


def view(
    file: Annotated[Path, argument("SKELETON|SCAN", "In any format that is read.")],
    preview: Annotated[Path | None, option("PNG", "Open no window: draw a picture.")] = None,
    report: Annotated[Path | None, option("HTML", "Open no window: write a page for the browser.")] = None,
) -> None:
    """Look at a skeleton or a scan in a window.

    That needs a display; --preview and --report make files instead. In the window, C, S and T show and hide the cloud,
    the skeleton, and its tubes of true radius; H helps, Q closes. A scan has its colours there, and is grey in
    files.
    """
    import numpy as np

    from .. import Skeleton, read_skeleton
    from ..io.scans import read_scan
    from ..io.skeletons import holds_skeleton
    from ..viewing.window import show

    outputs = skeleton_outputs([], preview, report, title=file.name)
    check_outputs(outputs, file)
    cloud = None
    if holds_skeleton(file):
        skeleton = read_skeleton(file)
    else:
        scan = read_scan(file)
        cloud, none, n = scan.to_legacy(), np.empty(0), len(scan.positions)
        skeleton = Skeleton(none, none, none, np.full(n, -1), scan.positions, np.full((n, 3), np.nan))
    if preview is None and report is None:
        show(skeleton, cloud, title=file.name)
    else:
        print_result({}, lambda: None, write_outputs(outputs, skeleton))
