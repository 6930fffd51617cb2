"""``glsk grasps``: where a gripper with parallel jaws can take an object, and what is in its way."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from .console import echo, print_table
from .options import argument, option, output_option
from .outputs import check_outputs, tell
from .reporting import WrongUsage

if TYPE_CHECKING:
    from ..analysis import GraspCandidates

GRASP_ENDINGS = (".json", ".csv")
HEADS = ("x", "y", "z", "approach x", "approach y", "approach z", "opening", "quality", "seen", "branch")


def grasps(
    skeleton: Annotated[Path, argument("SKELETON", "Of the object; JSON and npz files know its points.")],
    opening: Annotated[float, option("LENGTH", "Of the gripper, at its widest.")],
    cloud: Annotated[Path | None, option("FILE", "All points of the object, where the skeleton has none.")] = None,
    scene: Annotated[list[Path] | None, option("FILE", "Points of what else is there; may be repeated.")] = None,
    plane: Annotated[list[str] | None, option("A,B,C,D", "A table, ax + by + cz + d = 0; may be repeated.")] = None,
    cone: Annotated[str | None, option("DIRECTION,DEGREES", "Come in no farther from this, such as -z,60.")] = None,
    clearance: Annotated[
        float | None, option("LENGTH", "Half on each side; by default a tenth of the opening.")
    ] = None,
    finger: Annotated[str | None, option("THICKNESS,WIDTH,LENGTH", "By default as the Franka Hand has it.")] = None,
    palm: Annotated[str | None, option("EXTENT,WIDTH,DEPTH", "Of the hand behind the fingers; else the same.")] = None,
    around: Annotated[int, option("N", "Directions around each place.", min=1)] = 8,
    spacing: Annotated[float | None, option("LENGTH", "Of the places; by default the radius of the branch.")] = None,
    min_confidence: Annotated[float, option("SHARE", "Of the skeleton, from 0 to 1.")] = 0.5,
    count: Annotated[int, option("N", "How many to show and write, of each place its best first.", "-n", min=1)] = 20,
    output: Annotated[list[Path] | None, output_option("FILE", "json or csv; may be repeated.")] = None,
) -> None:
    """Find where a gripper with two jaws can take an object.

    All lengths are in the file's units. The jaws close across the branches of the skeleton. A grasp is left out where a
    finger or the palm, on a straight way in, would meet points of the object or of the scene, or the far side of a
    plane. Space that was not scanned counts as free.
    """
    from .. import read_cloud, read_skeleton
    from ..analysis import Gripper, grasp_candidates

    files = [(path, GRASP_ENDINGS, "grasps are JSON or CSV") for path in output or []]
    check_outputs(files, skeleton, cloud, *(scene or []))
    planes = [_numbers("--plane", text, 4) for text in plane or []]
    gripper = Gripper(
        opening,
        finger=None if finger is None else _numbers("--finger", finger, 3),
        palm=None if palm is None else _numbers("--palm", palm, 3),
    )
    found = grasp_candidates(
        read_skeleton(skeleton),
        gripper,
        cloud=None if cloud is None else read_cloud(cloud),
        obstacles=[*planes, *map(read_cloud, scene or [])],
        clearance=clearance,
        around=around,
        spacing=spacing,
        min_confidence=min_confidence,
        cone=None if cone is None else _cone(cone),
    )
    best = found[:count]
    for path in output or []:
        {".json": best.to_json, ".csv": best.to_csv}[path.suffix.lower()](path)
    facts = {"skeleton": str(skeleton), "found": len(found), **best.as_dict()}
    tell(facts, lambda: _print(best, len(found)), output or [])


def _numbers(option: str, text: str, count: int) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise WrongUsage(f"{option} {text}: write {count} numbers with commas between them")
    return values


def _cone(text: str) -> tuple[tuple[float, ...], float]:
    """An axis with or without a minus, or three numbers; and degrees."""
    direction, comma, degrees = text.rpartition(",")
    if not comma:
        raise WrongUsage(f"--cone {text}: write a direction and degrees, such as -z,60")
    name = direction.strip().lower()
    if name.removeprefix("-") in ("x", "y", "z"):
        way = tuple((-1.0 if name[0] == "-" else 1.0) * (axis == name[-1]) for axis in "xyz")
    else:
        way = _numbers("--cone", direction, 3)
    return way, _numbers("--cone", degrees, 1)[0]


def _print(best: GraspCandidates, found: int) -> None:
    from ..decisions import coordinates

    echo(f"{found} grasps at {best.places} places")
    for reason, times in best.left_out.items():
        limit = " (confidence below --min-confidence)" if reason == "uncertain" else ""
        echo(f"left out: {times} {reason}{limit}")
    columns = (best.position, best.approach, best.opening, best.quality, best.seen, best.branch)
    rows = []
    for place, way, opening, quality, seen, branch in zip(*columns, strict=True):
        numbers = [f"{opening:.4g}", f"{quality:.2f}", str(seen), str(branch)]
        rows.append([*coordinates(place).split(", "), *(f"{value:.2f}" for value in way), *numbers])
    if rows:
        print_table(rows, HEADS)
