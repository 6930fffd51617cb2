"""``glsk branches``: the branches of a skeleton, measured one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from .console import echo, print_json, print_table
from .options import Json, Quiet, Root, SkeletonFile, Verbose, output_option
from .outputs import check_outputs


def branches(
    skeleton: SkeletonFile,
    output: Annotated[list[Path] | None, output_option("CSV", "Write the whole table; may be repeated.")] = None,
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
    from .. import FileFormatError, read_skeleton

    files = output or []
    check_outputs([(path, ".csv", "table is CSV") for path in files], skeleton)
    curve = read_skeleton(skeleton)
    if len(curve.vertices) == 0:
        raise FileFormatError(f"{skeleton}: the skeleton is empty: it has no branches to measure")
    table = curve.branch_table(root)
    for path in files:
        table.to_csv(path)
    if as_json:
        print_json({"skeleton": str(skeleton), "branches": list(table)})
    elif files and not quiet:
        echo(f"{len(table)} branches, {table.order.max() + 1} orders, length {table.length.sum():.4g}")
        for path in files:
            echo(f"wrote {path}, in the units of {skeleton.name}")
    elif not quiet:
        columns = table.printed()
        names = [name.replace("_", " ") for name in columns]
        print_table(list(zip(*columns.values(), strict=True)), names, left=[names.index("kind")])
