"""``glsk branches``: the branches of a skeleton, measured one by one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .console import echo, print_json, print_table
from .options import SKELETON_FILE, Json, Quiet, Root, Verbose, root_place
from .reporting import reporting

if TYPE_CHECKING:
    from ..analysis import BranchTable


def branches(
    skeleton: Annotated[
        Path,
        typer.Argument(metavar="SKELETON", help=SKELETON_FILE),
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="CSV",
            help="Write the whole table, with ends, curvature and torsion, instead of printing it.",
        ),
    ] = None,
    root: Root = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Measure every branch of a skeleton.

    Lengths are in the units of the file. A branch starts where it is nearer to the root. Its tortuosity is its length
    over the distance of its ends, its angle is in degrees to the parent. Branches that continue each other have the
    same axis and order; the level counts branches from the root.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..errors import FileFormatError
        from ..io.skeletons import read_skeleton
        from .outputs import check_findings

        check_findings([(path, ".csv", "table is CSV") for path in output or []], skeleton)
        place = root_place(root)
        curve = read_skeleton(skeleton)
        if len(curve.vertices) == 0:
            raise FileFormatError(f"{skeleton}: the skeleton is empty: it has no branches to measure")
        table = curve.branch_table(place)
        for path in output or []:
            table.to_csv(path)
        if as_json:
            print_json({"skeleton": str(skeleton), "branches": list(table)})
        elif not quiet and not output:
            _print(table)
        elif not quiet:
            echo(f"{len(table)} branches, {table.order.max() + 1} orders, length {table.length.sum():.4g}")
            for path in output or []:
                echo(f"wrote {path}, in the units of {skeleton.name}")


def _print(table: BranchTable) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from ..analysis.branches import cell

    shown = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), header_style="")
    for name, form in table.printed_columns.items():
        shown.add_column(name.replace("_", " "), justify="left" if form == "s" else "right")
    for row in table:
        shown.add_row(*(cell(row, name) for name in table.printed_columns))
    print_table(shown, whole=True)
