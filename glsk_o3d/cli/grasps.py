"""``glsk grasps``: where a gripper with parallel jaws can take an object, and what is in its way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from .. import analysis
from .console import echo, print_table, value_in_words
from .options import argument, option, output_option
from .outputs import Output, check_outputs, tell, write_each

GRASP_ENDINGS = (".json", ".csv")


def grasps(
    skeleton: Annotated[Path, argument("SKELETON", "Of the object; JSON and npz files know its points.")],
    opening: Annotated[float, option("LENGTH", "Of the gripper, at its widest.")],
    cloud: Annotated[Path | None, option("FILE", "Points not to touch; by default those of the skeleton.")] = None,
    plane: Annotated[str | None, option("A,B,C,D", "A table, ax + by + cz + d = 0.")] = None,
    min_confidence: Annotated[float, option("SHARE", "Of the skeleton, from 0 to 1.")] = 0.5,
    count: Annotated[int, option("N", "How many to show and write, of each place its best first.", "-n", min=1)] = 20,
    output: Annotated[list[Path] | None, output_option("FILE", "json or csv; may be repeated.")] = None,
) -> None:
    """Find where a gripper with two jaws can take an object.

    All lengths are in the file's units. The jaws close across the branches of the skeleton. A grasp is left out where a
    finger or the palm, on a straight way in, would meet points, or the far side of a plane. Space that was not scanned
    counts as free.
    """
    from .. import read_cloud, read_skeleton

    def save(best: analysis.GraspCandidates, path: Path) -> None:
        {".json": best.to_json, ".csv": best.to_csv}[path.suffix.lower()](path)

    outputs = [Output(path, GRASP_ENDINGS, "grasps are JSON or CSV", save) for path in output or []]
    check_outputs(outputs, skeleton, cloud)
    found = analysis.grasp_candidates(
        read_skeleton(skeleton),
        opening,
        cloud=None if cloud is None else read_cloud(cloud),
        plane=None if plane is None else plane.split(","),
        min_confidence=min_confidence,
    )
    best = found[:count]
    facts = {"skeleton": str(skeleton), "found": len(found), **best.as_dict()}
    tell(facts, lambda: _print(best, len(found)), write_each(outputs, best))


def _print(best: analysis.GraspCandidates, found: int) -> None:
    first = f", the first {len(best)} of them here: -n for more" if len(best) < found else ""
    echo(f"{found} grasps at {best.places} places{first}")
    for reason, times in best.left_out.items():
        limit = " (confidence below --min-confidence)" if reason == "uncertain" else ""
        echo(f"left out: {times} {reason}{limit}")
    columns = [f"{name}_{axis}" for name in ("position", "approach") for axis in "xyz"]
    columns += ["opening", "quality", "seen", "branch"]
    if found:
        heads = [column.removeprefix("position_").replace("_", " ") for column in columns]
        cells = [[value_in_words(round(grasp[name], 9), digits=4) for name in columns] for grasp in best]
        print_table(cells, heads)
