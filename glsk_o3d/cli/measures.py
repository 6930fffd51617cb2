"""``glsk branches`` and ``glsk tree``: what can be measured of a skeleton."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from .console import echo, print_table
from .options import Root, SkeletonFile, argument, option, output_option
from .outputs import check_outputs, tell

if TYPE_CHECKING:
    from ..analysis import TreeMeasures

UNITS = {
    "height": "m",
    "stem_diameter": "m",
    "crown_base": "m",
    "crown_width": "m",
    "crown_area": "m2",
    "volume": "m3",
    "traced": "of the length",
}
"""Fields of `TreeMeasures` that are printed, and what they are in."""


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
    from .. import FileFormatError, read_skeleton
    from ..analysis import branch_table

    files = output or []
    check_outputs([(path, ".csv", "table is CSV") for path in files], skeleton)
    curve = read_skeleton(skeleton)
    if len(curve.vertices) == 0:
        raise FileFormatError(f"{skeleton}: the skeleton is empty: it has no branches to measure")
    table = branch_table(curve, root)
    for path in files:
        table.to_csv(path)

    def words() -> None:
        if files:
            echo(f"{len(table)} branches, {table.order.max() + 1} orders, length {table.length.sum():.4g}")
            return
        columns = table.printed()
        names = [name.replace("_", " ") for name in columns]
        print_table(list(zip(*columns.values(), strict=True)), names, left=[names.index("kind")])

    facts = {"skeleton": str(skeleton), "branches": list(table)}
    tell(facts, words, [f"{path}, in the units of {skeleton.name}" for path in files])


def tree(
    skeleton: Annotated[Path, argument("SKELETON", "Of a tree, with radii: 'glsk skeletonize --pipeline tree'.")],
    output: Annotated[
        list[Path] | None,
        output_option("FILE", "Write cylinders, as csv."),
    ] = None,
    root: Root = None,
    up: Annotated[str | None, option("AXIS", "What points up, x to -z; else as it was grown, or z.")] = None,
    unit: Annotated[str, option("UNIT", "One unit of the file: m, cm, mm, in or ft, or its metres.")] = "m",
) -> None:
    """Measure a tree: height, stem, crown, volume by order.

    Length and surface, too. Orders count from the stem, 0. Volume is that of parts with a surface: where there was
    none, radii are the scatter of the points. What is hardly as it should be is said on stderr, and in JSON as doubts.
    JSON and npz files say where the tree grows from, and keep the points that the stem's diameter is measured on. All
    is in metres if --unit says what a unit of the file is; only a csv file of cylinders is in the units of the file.
    """
    from .. import read_skeleton
    from ..analysis import cylinders, tree_measures

    check_outputs([(path, (".csv",), "file is a table of cylinders") for path in output or []], skeleton)
    curve = read_skeleton(skeleton)
    measures = tree_measures(curve, root, up=up, unit=unit)
    written = []
    for path in output or []:
        cylinders(curve, root).to_csv(path)
        written.append(f"{path}, in the units of {skeleton.name}")
    tell({"skeleton": str(skeleton), **asdict(measures)}, lambda: _print(measures), written)


def _print(measures: TreeMeasures) -> None:
    interval = "95 %: {:.4g} to {:.4g}"
    more = {
        "stem_diameter": interval.format(*measures.stem_interval)
        + f"; {measures.stem_points} points on {measures.stem_arc:.0f} degrees, rms {measures.stem_rms:.2g} m",
        "volume": interval.format(*measures.volume_interval),
        "traced": f"{measures.traced_volume:.3g} m3 by the scatter of its points, not counted",
    }
    for name, unit in UNITS.items():
        value = sum(measures.volume) if name == "volume" else getattr(measures, name)
        known = f"{value:.4g} {unit}" + (f" ({more[name]})" if name in more else "")
        echo(f"{name.replace('_', ' ')}: {known if math.isfinite(value) else f'not known: {_why_not(name, measures)}'}")
    columns = measures.length, measures.area, measures.volume
    names = [*map(str, range(len(measures.length))), "all"]
    numbers = [[f"{value:.4g}" for value in (*column, sum(column))] for column in columns]
    print_table(list(zip(names, *numbers, strict=True)), ("order", "length m", "area m2", "volume m3"))


def _why_not(name: str, measures: TreeMeasures) -> str:
    """Why a measure is not known."""
    from ..analysis.forestry import BREAST_HEIGHT
    from ..decisions import coordinates

    if name == "crown_base":
        return "no branch leaves the stem"
    if name == "traced":
        return "the file has no confidence: JSON and npz files of a run do"
    if measures.height < BREAST_HEIGHT:
        return f"the tree is lower than {BREAST_HEIGHT} m, if a unit of the file is {measures.unit:g} m (--unit)"
    return (
        f"see the warning; {measures.up} was taken to point up (--up), and {coordinates(measures.root)} for the root "
        "(--root)"
    )
