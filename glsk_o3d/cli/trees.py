"""``glsk tree``: measures of one tree, or a table of many."""

from __future__ import annotations

import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from .. import analysis
from ..errors import BatchError, FileFormatError, GlskError, SkeletonWarning, in_words
from .console import echo, print_rows, print_table, progress, say, value_in_words
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
SAID = ("reasons", "doubts")
"""What is said of a tree in words."""


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
    scatter of their points: length and volume are given with and without them. Reasons are those of the skeleton's
    verdict, doubts are about measures that are hardly as they should be. All is in metres if --unit says what a unit of
    the files is.
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
    found: list[dict[str, Any]] = []
    with progress(remaining=True) as update, warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)  # what they say is with the tree
        for number, path in enumerate(trees):
            update(path.name, number, len(trees))
            try:
                skeleton = _skeleton(path, root, up, where)
                measures = analysis.tree_measures(skeleton, root, up=up, unit=unit)
            except (GlskError, OSError) as error:
                if len(trees) == 1:
                    raise
                say("warning", f"{path}: {in_words(error).removeprefix(f'{path}: ')}")
                found.append({"tree": str(path), "error": in_words(error)})
                continue
            trusted = {"verdict": skeleton.verdict.value, "reasons": tuple(map(str, skeleton.reasons))}
            found.append({"tree": str(path), **trusted, **asdict(measures), "error": ""})
    files = write_outputs(outputs, found)
    if len(trees) == 1:
        files |= write_outputs(of_one, skeleton.with_facts(root=measures.root))
    print_result({"trees": found}, lambda: (_print_tree if len(trees) == 1 else _print_trees)(found), files)
    if failed := sum(bool(row["error"]) for row in found):
        raise BatchError(f"{failed} of {len(found)} trees failed")


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


def _save_rows(found: list[dict[str, Any]], path: Path) -> None:
    """Write the single values of each tree, and what is said of it."""
    from ..analysis.rows import write_table

    rows = [
        {
            name: "; ".join(value) if name in SAID else value
            for name, value in row.items()
            if name in SAID or not isinstance(value, tuple)
        }
        for row in found
    ]
    names = list(dict.fromkeys(name for row in rows for name in row))
    write_table(path, names, [[row.get(name, "") for name in names] for row in rows])


def _print_tree(found: list[dict[str, Any]]) -> None:
    """Print the measures of one tree, and below them its taper and its diameter classes."""
    (facts,) = found
    tables = {name: facts[name] for name in ("taper", "classes")}
    print_rows({**facts, **dict.fromkeys(tables), **{name: [*facts[name]] for name in SAID}})
    for rows in filter(None, tables.values()):
        cells = [[value_in_words(value, digits=4) for value in row.values()] for row in rows]
        print_table(cells, [name.replace("_", " ") for name in rows[0]])


def _print_trees(found: list[dict[str, Any]]) -> None:
    """Print a line for each tree, and below them the doubts; the whole table is in the file."""
    cells = [
        [row["tree"], *("-" if row["error"] else value_in_words(row[name], digits=4) for name in PRINTED_MEASURES)]
        for row in found
    ]
    print_table(cells, [name.replace("_", " ") for name in ("tree", *PRINTED_MEASURES)])
    for row in found:
        for doubt in row.get("doubts", ()):
            echo(f"{row['tree']}: {doubt}")
