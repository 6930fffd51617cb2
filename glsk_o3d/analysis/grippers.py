"""Grippers where they can take an object: as arrays, as frames, drawn, and in files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..interop.atomic import write_csv, write_json
from ..interop.packages import import_open3d, require

GRIPPER_STEM = 0.5  # fitted to the eye: length of the drawn gripper behind its palm, over its opening
_GRASP_VECTORS, _GRASP_NUMBERS = ("position", "approach", "closing"), ("opening", "branch", "confidence", "quality")
_GRASP_COLUMNS = [f"{name}_{axis}" for name in _GRASP_VECTORS for axis in "xyz"] + list(_GRASP_NUMBERS)


@dataclass(frozen=True, eq=False)
class GraspCandidates:
    """Places and directions for a gripper with parallel jaws, best first.

    Lengths are in the cloud's units, directions have the length 1. Iteration gives a dict of plain numbers per
    candidate, with ``position_x`` and so on; an index, a slice or a mask selects some.

    Attributes
    ----------
    positions : (G, 3) float array
        On the axis, midway between the jaws.
    approach : (G, 3) float array
        Where the gripper comes in: towards the axis and perpendicular to it.
    closing : (G, 3) float array
        From jaw to jaw: perpendicular to the approach and to the axis.
    opening : (G,) float array
        Between the jaws as they come in: the width of the part and the clearance.
    branch : (G,) int array
        Position in `Skeleton.branches`.
    confidence : (G,) float array
        Of the skeleton there; NaN where it is unknown.
    quality : (G,) float array
        From 0 to 1; see `grasp_candidates`.
    places : int
        Places along the skeleton that were looked at.
    left_out : dict of str to int
        How many of these were not taken, by the first reason that holds.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import grasp_candidates
    >>> from glsk_o3d.samples import tube
    >>> straight = tube(length=1.0, radius=0.1)
    >>> axis = Skeleton(straight.nodes, straight.edges, straight.radii, (), (), (), confidence=[1, 1])
    >>> best = grasp_candidates(axis, max_opening=0.4)[:3]
    >>> best.poses.shape
    (3, 4, 4)
    """

    positions: np.ndarray
    approach: np.ndarray
    closing: np.ndarray
    opening: np.ndarray
    branch: np.ndarray
    confidence: np.ndarray
    quality: np.ndarray
    places: int = 0
    left_out: dict[str, int] = field(default_factory=dict)

    def __len__(self):
        return len(self.opening)

    def __getitem__(self, rows) -> GraspCandidates:
        rows = np.atleast_1d(np.arange(len(self))[rows])
        arrays = {name: value[rows] for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return replace(self, **arrays)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        columns = [column for array in self._vectors for column in array.T] + self._numbers
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield dict(zip(_GRASP_COLUMNS, row, strict=True))

    def __repr__(self):
        return f"GraspCandidates({len(self)} at {self.places} places{told(self.left_out, '; not taken: ')})"

    @property
    def _vectors(self):
        return [self.positions, self.approach, self.closing]

    @property
    def _numbers(self):
        return [self.opening, self.branch, self.confidence, self.quality]

    @property
    def axis(self) -> np.ndarray:
        """Direction of the skeleton, (G, 3) float array: the third one, approach x closing."""
        return np.cross(self.approach, self.closing)

    @property
    def poses(self) -> np.ndarray:
        """Frames of the gripper, (G, 4, 4) float array.

        The origin is the position, x the closing direction, y the axis of the part, z the approach; right-handed.
        """
        poses = np.tile(np.eye(4), (len(self), 1, 1))
        for column, vectors in enumerate((self.closing, self.axis, self.approach, self.positions)):
            poses[:, :3, column] = vectors
        return poses

    def to_line_set(self):
        """Each gripper as a fork of four lines, an ``open3d.geometry.LineSet``.

        The tips of its fingers are `opening` apart at the height of the axis, the fingers are as long; colours go from
        dark blue, the least quality among them, to yellow, the best.

        Raises
        ------
        MissingPackageError
        """
        o3d, viridis = import_open3d(), require("matplotlib").colormaps["viridis"]
        side, back = self.opening[:, None] / 2 * self.closing, -self.opening[:, None] * self.approach
        fork = [side, side + back, -side + back, -side, back, (1 + GRIPPER_STEM) * back]
        ends = (self.positions + np.array(fork)).transpose(1, 0, 2).reshape(-1, 3)
        lines = np.array([[0, 1], [1, 2], [2, 3], [4, 5]]) + len(fork) * np.arange(len(self))[:, None, None]
        drawn = o3d.geometry.LineSet()
        drawn.points = o3d.utility.Vector3dVector(ends)
        drawn.lines = o3d.utility.Vector2iVector(lines.reshape(-1, 2).astype(np.int32))
        worst, best = self.quality.min(initial=1), self.quality.max(initial=0)
        shade = (self.quality - worst) / (best - worst) if best > worst else np.ones(len(self))
        drawn.colors = o3d.utility.Vector3dVector(np.repeat(viridis(shade)[:, :3], 4, axis=0))
        return drawn

    def to_csv(self, path: str | os.PathLike) -> None:
        """Write a line of names and a line per candidate; an unknown confidence is left empty.

        Parameters
        ----------
        path : path-like
            Appears complete or not at all.

        Raises
        ------
        OSError
            The folder does not exist, or the file cannot be written.
        """
        write_csv(path, _GRASP_COLUMNS, ([_plain(value, "") for value in row.values()] for row in self))

    def to_json(self, path: str | os.PathLike) -> None:
        """Write candidates, poses and the reasons for what was left out; an unknown confidence is null.

        Parameters
        ----------
        path : path-like
            Appears complete or not at all.

        Raises
        ------
        OSError
            The folder does not exist, or the file cannot be written.
        """
        columns = dict(
            zip((*_GRASP_VECTORS, *_GRASP_NUMBERS), self._vectors + self._numbers, strict=True), pose=self.poses
        )
        rows = zip(*(array.tolist() for array in columns.values()), strict=True)
        grasps = [{name: _plain(value) for name, value in zip(columns, row, strict=True)} for row in rows]
        frame = "origin on the axis, x closing, y along the part, z approach; the cloud's units"
        write_json(path, {"frame": frame, "places": self.places, "left_out": self.left_out, "grasps": grasps})


def _plain(value, unknown=None):
    return unknown if isinstance(value, float) and math.isnan(value) else value


def told(left_out: Mapping[str, int], before: str) -> str:
    """How many places were left out and why, after some words; nothing where there are none."""
    return before + ", ".join(f"{count} {reason}" for reason, count in left_out.items()) if left_out else ""
