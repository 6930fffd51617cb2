"""A gripper with parallel jaws, and grasps for it: as arrays, as frames, drawn, and in files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import InvalidParameterError
from ..interop.atomic import write_json
from ..interop.packages import import_open3d
from ..parameters import check_number
from .rows import Rows

# Published: shapes of the Franka Hand in its maker's description (franka_description, franka_hand.xacro), which opens
# 80 mm, over that: the fingertip and how far it is from the finger's joint; the capsule around the hand as far as that
# joint; how far the tip is ahead of the point between the jaws that robots are told to move.
FINGER_PER_OPENING = (15.2 / 80, 17.5 / 80, 54.5 / 80)
PALM_PER_OPENING = (180 / 80, 80 / 80, 58.4 / 80)
REACH_PER_OPENING = 9.5 / 80


@dataclass
class Gripper:
    """A gripper with two parallel jaws, as boxes. Lengths are in the cloud's units.

    Default sizes are proportional to `max_opening`, as on the Franka Hand, which opens 0.08 m.

    Attributes
    ----------
    max_opening : float
        Widest opening between the jaws.
    finger, palm : (3,) tuples of float
        Extents along the closing direction, along the part, and along the approach: of a finger, from the palm to its
        tip, and of what is behind the fingers.
    reach : float
        Distance that the fingertips reach past the axis of the part; less on parts thinner than twice this.

    Raises
    ------
    InvalidParameterError
        A length is no finite number, not positive, or the palm would be past the axis.

    Examples
    --------
    >>> [round(length, 4) for length in Gripper(0.08).finger]
    [0.0152, 0.0175, 0.0545]
    """

    max_opening: float
    finger: Any = None
    palm: Any = None
    reach: Any = None

    def __post_init__(self) -> None:
        self.max_opening = check_number("max_opening", self.max_opening, low=0, open_low=True)
        self.finger = _sides("finger", self.finger, FINGER_PER_OPENING, self.max_opening)
        self.palm = _sides("palm", self.palm, PALM_PER_OPENING, self.max_opening)
        reach = self.max_opening * REACH_PER_OPENING if self.reach is None else self.reach
        self.reach = check_number("reach", reach, low=0, high=self.finger[2])

    def boxes(self, opening: Any, depth: Any) -> tuple[np.ndarray, np.ndarray]:
        """The two fingers and the palm, in the frame of the gripper: x closing, y along the part, z approach.

        The origin is on the axis of the part. The opening between the jaws and the depth of the fingertips past the
        axis are numbers or (n,) arrays. `low` and `high`, (3, 3) or (n, 3, 3) float arrays, are opposite corners of the
        finger towards -x, of that towards +x, and of the palm.
        """
        inner, tip = np.asarray(opening, float)[..., None, None] / 2, np.asarray(depth, float)[..., None, None]
        thickness, width, length = self.finger
        extent, across, deep = self.palm
        low = [[-thickness, -width / 2, -length], [0, -width / 2, -length], [-extent / 2, -across / 2, -length - deep]]
        high = [[0, width / 2, 0], [thickness, width / 2, 0], [extent / 2, across / 2, -length]]
        shift = inner * [[-1.0, 0, 0], [1, 0, 0], [0, 0, 0]] + tip * [0.0, 0, 1]
        return low + shift, high + shift


@dataclass(frozen=True, eq=False)
class GraspCandidates(Rows, row="grasp"):
    """Places and directions for a gripper with parallel jaws: the best of each place first, then the second best.

    Lengths are in the cloud's units, directions have the length 1. Iteration gives a dict of plain numbers per
    candidate, with ``position_x`` and so on; an index, a slice or a mask selects some.

    Attributes
    ----------
    position, approach, closing : (G, 3) float arrays
        On the axis, midway between the jaws; direction of the approach, perpendicular to the axis; from jaw to jaw,
        perpendicular to both.
    opening, depth : (G,) float arrays
        Between the jaws during the approach: the width of the part plus three clearances, or two or one where more is
        not free. Distance of the fingertips past the position.
    branch : (G,) int array
        Position in `Skeleton.branches`.
    confidence, quality : (G,) float arrays
        From 0 to 1; the skeleton's confidence there is NaN where it is unknown.
    contact : (G,) float array
        Cosine of the angle between the closing direction and the surface, at the worse of both jaws, as the points of
        the object show it; of a round section without points that of the slope along the part.
    seen : (G,) int array
        Number of sides with points of the three around the gripper: two at the jaws and one towards the palm. Unseen
        surface may be in the way. 0 if not checked.
    gripper : Gripper
        The gripper of the candidates.
    places : int
        Number of places along the skeleton that were searched: all, unless a budget ended it.
    left_out : dict of str to int
        Numbers of rejected places, and of rejected approaches to the others, by the first reason; and of places that
        were not searched.
    """

    position: np.ndarray
    approach: np.ndarray
    closing: np.ndarray
    opening: np.ndarray
    depth: np.ndarray
    branch: np.ndarray
    confidence: np.ndarray
    contact: np.ndarray
    quality: np.ndarray
    seen: np.ndarray
    gripper: Gripper
    places: int = 0
    left_out: dict[str, int] = field(default_factory=dict)

    def __getitem__(self, rows: Any) -> GraspCandidates:
        rows = np.atleast_1d(np.arange(len(self))[rows])
        selected: dict[str, Any] = {name: array[rows] for name, array in self._arrays().items()}
        return replace(self, **selected)

    def __repr__(self) -> str:
        rejected = f"; not taken: {in_words(self.left_out)}" if self.left_out else ""
        return f"GraspCandidates({len(self)} at {self.places} places{rejected})"

    @property
    def axis(self) -> np.ndarray:
        """Direction of the skeleton, (G, 3) float array: the third one, approach x closing."""
        return np.cross(self.approach, self.closing)

    @property
    def poses(self) -> np.ndarray:
        """Frames of the gripper, (G, 4, 4) float array: x closing, y along the part, z approach."""
        poses = np.tile(np.eye(4), (len(self), 1, 1))
        for column, vectors in enumerate((self.closing, self.axis, self.approach, self.position)):
            poses[:, :3, column] = vectors
        return poses

    def to_line_set(self) -> Any:
        """Each gripper as a fork of four lines, an ``open3d.geometry.LineSet``.

        Two are the fingers, from tip to palm, with the opening between them, one joins them, one is as long as the palm
        is deep.
        """
        o3d, hand = import_open3d(), self.gripper
        side, tip = self.opening[:, None] / 2 * self.closing, self.depth[:, None] * self.approach
        base = tip - hand.finger[2] * self.approach
        fork = [side + tip, side + base, -side + base, -side + tip, base, base - hand.palm[2] * self.approach]
        ends = (self.position + np.array(fork)).transpose(1, 0, 2).reshape(-1, 3)
        lines = np.array([[0, 1], [1, 2], [2, 3], [4, 5]]) + len(fork) * np.arange(len(self))[:, None, None]
        lines = o3d.utility.Vector2iVector(lines.reshape(-1, 2).astype(np.int32))
        return o3d.geometry.LineSet(o3d.utility.Vector3dVector(ends), lines)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write candidates, poses, gripper and `left_out`; an unknown confidence is null."""
        write_json(path, self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes: plain numbers, lists and dicts."""
        columns = {name: array.tolist() for name, array in self._arrays().items()}
        columns["confidence"] = [None if math.isnan(value) else value for value in columns["confidence"]]
        columns["pose"] = self.poses.tolist()
        return {
            "frame": "origin on the axis, x closing, y along the part, z approach; the cloud's units",
            "gripper": asdict(self.gripper),
            "places": self.places,
            "left_out": self.left_out,
            "grasps": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
        }


def in_words(left_out: Mapping[str, int]) -> str:
    """Numbers of rejected places and approaches, each with its reason."""
    return ", ".join(f"{count} {reason}" for reason, count in left_out.items())


def _sides(name: str, lengths: Any, ratios: tuple[float, ...], opening: float) -> tuple[float, ...]:
    """The sides of a box, by default in proportion to the opening."""
    if lengths is None:
        return tuple(opening * ratio for ratio in ratios)
    sides = tuple(lengths) if isinstance(lengths, Iterable) else ()
    if len(sides) != 3:
        raise InvalidParameterError(f"{name} = {lengths!r}: must be three lengths")
    return tuple(check_number(f"a side of {name}", side, low=0, open_low=True) for side in sides)
