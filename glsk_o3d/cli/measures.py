"""``glsk branches`` and ``glsk tree``: what can be measured of a skeleton."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from .console import echo, print_rows, print_table
from .options import Root, SkeletonFile, argument, option, output_option
from .outputs import Output, check_outputs, tell, write_each


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
    from ..analysis import BranchTable, branch_table

    outputs = [Output(path, (".csv",), "table is CSV", BranchTable.to_csv) for path in output or []]
    check_outputs(outputs, skeleton)
    curve = read_skeleton(skeleton)
    if len(curve.vertices) == 0:
        raise FileFormatError(f"{skeleton}: the skeleton is empty: it has no branches to measure")
    table = branch_table(curve, root)

    def words() -> None:
        if output:
            echo(f"{len(table)} branches, {table.order.max() + 1} orders, length {table.length.sum():.4g}")
            return
        columns = table.printed()
        names = [name.replace("_", " ") for name in columns]
        print_table(zip(*columns.values(), strict=True), names)

    tell({"skeleton": str(skeleton), "branches": list(table)}, words, write_each(outputs, table))


def tree(
    skeleton: Annotated[Path, argument("SKELETON", "Of a tree, with radii: 'glsk skeletonize --pipeline tree'.")],
    output: Annotated[list[Path] | None, output_option("FILE", "Write cylinders, as csv.")] = None,
    root: Root = None,
    up: Annotated[str | None, option("AXIS", "What points up, x to -z; else as it was grown, or z.")] = None,
    unit: Annotated[float, option("METRES", "One unit of the file, in metres: 0.001 for millimetres.")] = 1,
) -> None:
    """Measure a tree: height, stem, length and volume by order.

    Of length and volume there is a number for each order, from that of the stem on. Volume is that of parts with a
    surface: where there was none, radii are the scatter of the points, and the share is called traced. What is hardly
    as it should be is said on stderr, and in JSON as doubts.
    JSON and npz files say where the tree grows from, and keep the points that the stem's diameter is measured on. All
    is in metres if --unit says what a unit of the file is; only a csv file of cylinders is in the units of the file.
    """
    from .. import read_skeleton
    from ..analysis import Cylinders, cylinders, tree_measures

    outputs = [Output(path, (".csv",), "file is a table of cylinders", Cylinders.to_csv) for path in output or []]
    check_outputs(outputs, skeleton)
    curve = read_skeleton(skeleton)
    measures = tree_measures(curve, root, up=up, unit=unit)
    files = write_each(outputs, cylinders(curve, root, up)) if output else {}
    facts = {"skeleton": str(skeleton), **asdict(measures)}
    tell(facts, lambda: print_rows({**facts, "doubts": None}), files)
