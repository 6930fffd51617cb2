"""``glsk tree``: what foresters read of the skeleton of a tree."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .console import echo, print_json, print_table
from .options import Json, Quiet, Root, Verbose, root_place
from .reporting import reporting

if TYPE_CHECKING:
    from ..analysis import TreeMeasures

UNITS = {
    "height": "m",
    "stem_diameter": "m",
    "crown_base": "m",
    "crown_width": "m",
    "crown_area": "m2",
    "traced": "of the volume",
}
"""Fields of `TreeMeasures` that are printed, and what they are in."""


def tree(
    skeleton: Annotated[
        Path, typer.Argument(metavar="SKELETON", help="Of a tree, with radii: 'glsk skeletonize --pipeline tree'.")
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write the cylinders: csv in the file's units; in metres qsm.csv for rTwig, mat for TreeQSM, txt for "
            "treetools; may be repeated.",
        ),
    ] = None,
    root: Root = None,
    up: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="What points up: x, y, z, -x, -y or -z. By default the axis that the tree was made to grow along, "
            "or z.",
        ),
    ] = None,
    unit: Annotated[
        str, typer.Option(metavar="UNIT", help="One unit of the file: m, cm, mm, in or ft, or its metres.")
    ] = "m",
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Measure a tree: height, stem, crown, volume by order.

    Length and surface, too. Orders count from the stem, 0. Where there was no surface, radii are the scatter of the
    points, and volumes no more than a guess. JSON and npz files say where the tree grows from. All is in metres if
    --unit says what a unit of the file is; only a csv file of cylinders is in the units of the file.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..analysis import cylinders, tree_measures
        from ..analysis.forestry import metres
        from ..io.cylinders import CYLINDER_ENDINGS, cylinders_ending, save_cylinders
        from ..io.skeletons import read_skeleton
        from .outputs import check_findings

        check_findings([(path, CYLINDER_ENDINGS, "file is a table of cylinders") for path in output or []], skeleton)
        metres(unit)
        place, curve = root_place(root), read_skeleton(skeleton)
        measures = tree_measures(curve, place, up=up, unit=unit)
        for path in output or []:
            save_cylinders(cylinders(curve, place), path, unit)
        if as_json:
            print_json({"skeleton": str(skeleton), **asdict(measures)})
        elif not quiet:
            _print(measures)
            for path in output or []:
                told = f"the units of {skeleton.name}" if cylinders_ending(path) == ".csv" else "metres"
                echo(f"wrote {path}, in {told}")


def _why_not(name: str, measures: TreeMeasures) -> str:
    """Why a measure is not known."""
    from ..analysis.forestry import BREAST_HEIGHT
    from ..judgements import coordinates

    if name == "crown_base":
        return "no branch leaves the stem"
    if name == "traced":
        return "the file has no confidence: JSON and npz files of a run do"
    if measures.height < BREAST_HEIGHT:
        return f"the tree is lower than {BREAST_HEIGHT} m, if a unit of the file is {measures.unit:g} m (--unit)"
    return (
        f"the stem does not pass {BREAST_HEIGHT} m above the root, "
        f"if {measures.up} points up (--up), and {coordinates(measures.root)} is the root (--root)"
    )


def _print(measures: TreeMeasures) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    for name, unit in UNITS.items():
        value = getattr(measures, name)
        told = f"{value:.4g} {unit}" if math.isfinite(value) else f"not known: {_why_not(name, measures)}"
        echo(f"{name.replace('_', ' ')}: {told}")
    shown = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), header_style="")
    for name in ("order", "length m", "area m2", "volume m3"):
        shown.add_column(name, justify="right")
    for order, values in enumerate(zip(measures.length, measures.area, measures.volume, strict=True)):
        shown.add_row(str(order), *(f"{value:.4g}" for value in values))
    sums = (sum(values) for values in (measures.length, measures.area, measures.volume))
    shown.add_row("all", *(f"{value:.4g}" for value in sums))
    print_table(shown, whole=True)
