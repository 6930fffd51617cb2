"""A gripper with parallel jaws: how far it opens, and the boxes that its fingers and its palm fill."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidParameterError
from ..parameters import parameter, problem_with

# Published: shapes of the Franka Hand in its maker's description (franka_description, franka_hand.xacro), which opens
# 80 mm, over that: the fingertip and how far it is from the finger's joint; the capsule around the hand as far as that
# joint; how far the tip is ahead of the point between the jaws that robots are told to move.
FINGER_PER_OPENING = (15.2 / 80, 17.5 / 80, 54.5 / 80)
PALM_PER_OPENING = (180 / 80, 80 / 80, 58.4 / 80)
REACH_PER_OPENING = 9.5 / 80


@dataclass(frozen=True)
class Gripper:
    """A gripper with two parallel jaws, as boxes. Lengths are in the cloud's units.

    What is not given is in proportion to `max_opening`, as on the Franka Hand, which opens 0.08 m.

    Attributes
    ----------
    max_opening : float
        Between the jaws, as wide as they open.
    min_opening : float
        Down to which they close; parts that are no wider cannot be held.
    finger : (3,) tuple of float
        Thickness of a finger, along the closing direction; its width, along the part; its length, from the palm to its
        tip.
    palm : (3,) tuple of float
        What is behind the fingers: its extent along the closing direction, along the part, and along the approach.
    reach : float
        How far the fingertips reach past the axis of the part; less on parts that are thinner than twice this.

    Raises
    ------
    InvalidParameterError
        A length is no finite number, not positive, or the jaws close wider than they open, or the palm would be past
        the axis.

    Examples
    --------
    >>> hand = Gripper(0.08)
    >>> [round(length, 4) for length in (*hand.finger, *hand.palm, hand.reach)]
    [0.0152, 0.0175, 0.0545, 0.18, 0.08, 0.0584, 0.0095]
    """

    max_opening: float
    min_opening: float = 0.0
    finger: Any = None
    palm: Any = None
    reach: Any = None

    def __post_init__(self) -> None:
        opening = checked("max_opening", self.max_opening, low=0, open_low=True)
        finger = _sides("finger", self.finger, FINGER_PER_OPENING, opening)
        given = dict(
            max_opening=opening,
            min_opening=checked("min_opening", self.min_opening, low=0, high=opening),
            finger=finger,
            palm=_sides("palm", self.palm, PALM_PER_OPENING, opening),
            reach=checked(
                "reach", opening * REACH_PER_OPENING if self.reach is None else self.reach, low=0, high=finger[2]
            ),
        )
        for name, value in given.items():
            object.__setattr__(self, name, value)

    def boxes(self, opening: Any, depth: Any) -> tuple[np.ndarray, np.ndarray]:
        """The two fingers and the palm, in the frame of the gripper: x closing, y along the part, z approach.

        Parameters
        ----------
        opening : float or (n,) array_like
            Between the jaws.
        depth : float or (n,) array_like
            How far the fingertips are past the axis of the part, where the origin is.

        Returns
        -------
        low, high : (3, 3) or (n, 3, 3) float array
            Opposite corners of the finger towards -x, of that towards +x, and of the palm.
        """
        inner, tip = np.asarray(opening, float)[..., None, None] / 2, np.asarray(depth, float)[..., None, None]
        thickness, width, length = self.finger
        extent, across, deep = self.palm
        low = [[-thickness, -width / 2, -length], [0, -width / 2, -length], [-extent / 2, -across / 2, -length - deep]]
        high = [[0, width / 2, 0], [thickness, width / 2, 0], [extent / 2, across / 2, -length]]
        moved = inner * [[-1.0, 0, 0], [1, 0, 0], [0, 0, 0]] + tip * [0.0, 0, 1]
        return low + moved, high + moved


def _sides(name: str, given: Any, ratios: tuple[float, ...], opening: float) -> tuple[float, ...]:
    """The sides of a box, by default in proportion to the opening."""
    if given is None:
        return tuple(opening * ratio for ratio in ratios)
    sides = tuple(given) if isinstance(given, Iterable) else ()
    if len(sides) != 3:
        raise InvalidParameterError(f"{name} = {given!r}: must be three lengths")
    return tuple(checked(f"a side of {name}", side, low=0, open_low=True) for side in sides)


def checked(name: str, value: Any, *, type: str = "float", **limits: Any) -> float:
    """A number within limits, as those of `parameters.parameter`; InvalidParameterError for anything else."""
    problem = problem_with(value, parameter(None, "", type=type, **limits).metadata)
    if problem:
        raise InvalidParameterError(f"{name} = {value!r}: {problem}")
    return float(value)
