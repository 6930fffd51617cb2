"""``glsk tree``: measures of one tree, or a table of many."""

from __future__ import annotations

import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from .. import analysis
from ..errors import BatchError, FileFormatError, GlskError, SkeletonWarning, in_words
from .console import print_rows, print_table, progress, say, value_in_words
from .options import ReportPage, Root, Where, argument, option, output_option
from .outputs import PAGE, Output, check_outputs, print_result, write_outputs
from .reporting import WrongUsage

if TYPE_CHECKING:
    from ..data.skeleton import Skeleton

PRINTED_MEASURES = (
    *("verdict", "height", "stem_diameter", "crown_base", "crown_area", "crown_volume"),
    *("length_with_traced", "length_without_traced", "volume_with_traced", "volume_without_traced"),
)
"""The columns that people read of a table of trees."""


def tree(
    trees: Annotated[list[Path], argument("TREE...", "Skeletons with radii, or scans: each is one tree.")],
    output: Annotated[list[Path] | None, output_option("CSV", "Write a table with a row for each tree.")] = None,
    cylinders: Annotated[
        Path | None, option("CSV", "Also write the cylinders of the tree, in the units of its file.")
    ] = None,
    report: ReportPage = None,
    root: Root = None,
    up: Annotated[str | None, option("AXIS", "What points up, x to -z; else as it was grown, or z.")] = None,
    unit: Annotated[float, option("METRES", "One unit of the files, in metres: 0.001 for millimetres.")] = 1,
    where: Where = None,
) -> None:
    """Measure trees: height, stem, taper, crown, length and volume, by order and by diameter.

    A scan becomes a skeleton by the pipeline 'tree'. Traced parts have no surface, so that their volume is that of the
    scatter of their points: length and volume are given with and without them. What is hardly as it should be is said
    on stderr, and in JSON as doubts. All is in metres if --unit says what a unit of the files is.
    A tree that fails does not stop the others: its row has the error, and the exit code is 1.
    """
    from .. import save_report

    outputs = [Output(path, (".csv",), "table of trees is CSV", _save_rows) for path in output or []]
    title = trees[0].name
    of_one = [
        Output(
            cylinders,
            (".csv",),
            "table of cylinders is CSV",
            lambda it, path: analysis.cylinders(it, root, up).to_csv(path),
        ),
        Output(report, *PAGE, lambda it, path: save_report(it, path, title=title, unit=unit, up=up)),
    ]
    if len(trees) > 1 and (cylinders or report):
        raise WrongUsage("--cylinders and --report are of one tree: give one TREE")
    check_outputs([*outputs, *of_one], *trees)
    rows: list[dict[str, Any]] = []
    with progress(remaining=True) as update:
        for number, path in enumerate(trees):
            update(path.name, number, len(trees))
            try:
                with warnings.catch_warnings():
                    if len(trees) > 1:  # then they have the name of the tree, and are in its row
                        warnings.simplefilter("ignore", SkeletonWarning)
                    skeleton = _skeleton(path, root, up, where)
                    measures = analysis.tree_measures(skeleton, root, up=up, unit=unit)
                for doubt in measures.doubts if len(trees) > 1 else ():
                    say("warning", f"{path}: {doubt}")
                rows.append({"tree": str(path), "verdict": skeleton.verdict.value, **measures.sums(), "error": ""})
            except (GlskError, OSError) as error:
                if len(trees) == 1:
                    raise
                say("warning", f"{path}: {in_words(error).removeprefix(f'{path}: ')}")
                rows.append({"tree": str(path), "error": in_words(error)})
    files = write_outputs(outputs, rows)
    if len(trees) == 1:
        grown = skeleton.with_facts(root=measures.root)
        facts = {"skeleton": str(trees[0]), "verdict": skeleton.verdict.value, **asdict(measures)}
        print_result(facts, lambda: _print_tree(facts), files | write_outputs(of_one, grown))
        return
    print_result({"trees": rows}, lambda: _print_trees(rows), files)
    if failed := sum(bool(row["error"]) for row in rows):
        raise BatchError(f"{failed} of {len(rows)} trees failed")


def _skeleton(path: Path, root: Any, up: str | None, where: str | None) -> Skeleton:
    """The skeleton in a file, or of the scan in it."""
    from .. import pipelines, read_skeleton
    from ..io.skeletons import holds_skeleton
    from ..io.streaming import points_for

    if holds_skeleton(path) or not path.is_file():
        if where is not None and path.is_file():
            raise FileFormatError(f"{path}: is a skeleton, and --where chooses points of scans")
        return read_skeleton(path)
    pipeline = pipelines.tree(root or up or "z")
    skeleton: Skeleton = pipeline(points_for(pipeline, path, where))
    return skeleton


def _save_rows(rows: list[dict[str, Any]], path: Path) -> None:
    from ..analysis.rows import write_table

    names = list(dict.fromkeys(name for row in rows for name in row))
    write_table(path, names, [[row.get(name, "") for name in names] for row in rows])


def _print_tree(facts: dict[str, Any]) -> None:
    """Print the measures of one tree, and below them its taper and its diameter classes."""
    print_rows({**facts, "taper": None, "classes": None, "doubts": None})
    for rows in (facts["taper"], facts["classes"]):
        if rows:
            cells = [[value_in_words(value, digits=4) for value in row.values()] for row in rows]
            print_table(cells, [name.replace("_", " ") for name in rows[0]])


def _print_trees(rows: list[dict[str, Any]]) -> None:
    """Print a line for each tree; the whole table is in the file."""
    cells = [
        [row["tree"], *("-" if row["error"] else value_in_words(row[name], digits=4) for name in PRINTED_MEASURES)]
        for row in rows
    ]
    print_table(cells, [name.replace("_", " ") for name in ("tree", *PRINTED_MEASURES)])
