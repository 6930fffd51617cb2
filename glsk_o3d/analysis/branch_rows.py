"""A row of measures per branch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .rows import Rows

PRINTED_ROWS = 20  # at most; fitted to a screen
PRINTED_COLUMNS = {  # format, of the columns that are read by people
    "branch": "d",
    "kind": "s",
    "parent": "d",
    "level": "d",
    "axis": "d",
    "order": "d",
    "length": ".4g",
    "mean_radius": ".3g",
    "start_radius": ".3g",
    "end_radius": ".3g",
    "tortuosity": ".2f",
    "angle": ".1f",
    "points": "d",
    "confidence": ".2f",
    "support": ".2f",
}


@dataclass(frozen=True, eq=False)
class BranchTable(Rows, row="branch"):
    """One row per branch: those of `Skeleton.branches` in their order, then the vertices without edges.

    Lengths are in the cloud's units. Means are along the curve. NaN where something is unknown or means nothing.
    Iteration gives a dict of plain numbers and strings per row; the two points become ``start_point_x`` and so
    on. ``print`` shows the main columns, as ``glsk branches`` does with spaces for underscores.

    Attributes
    ----------
    kind : (B,) str array
        ``"loop"`` for branches that lie on a loop, ``"tip"`` for others with a free end, ``"inner"`` for others between
        junctions, ``"isolated"`` for a vertex without edges.
    component : (B,) int array
    parent : (B,) int array
        The row that a branch grows from, on the shortest way from the root; -1 for those at the root.
    level : (B,) int array
        Steps from the root: 0 for those at the root, 1 for their children.
    start, end : (B,) int arrays
        Vertices at the ends, `start` towards the root.
    start_point, end_point : (B, 3) float arrays
    length : (B,) float array
    tortuosity : (B,) float array
        Length over the distance of the ends: 1 for a straight branch, infinite for a closed one.
    mean_radius, start_radius, end_radius : (B,) float arrays
    angle : (B,) float array
        Degrees between the direction in which the parent arrives and that in which the branch leaves: 0 goes straight
        on. Each is taken from one to three radii away from the junction, without radii from the nearest quarter. NaN
        without a parent, and where the branch or its parent is closed: it has no direction.
    mean_curvature, mean_torsion : (B,) float arrays
        See `curvature_torsion`.
    points : (B,) int array
        Points of the skeleton's cloud that belong to the branch; see `segment`.
    confidence : (B,) float array
        Mean confidence.
    support : (B,) float array
        Share of samples of the cloud that show its least shown place, or end; see `glsk_o3d.support`.
    axis : (B,) int array
        The first row of the axis that a branch is part of. Where branches part, the one with the largest mean radius
        times cos(`angle`) continues the axis of its parent, unless it turns back, or ends within its own radius; each
        other one begins an axis.
    order : (B,) int array
        Centrifugal (Gravelius) order: 0 for axes at the root, and one more for each axis that grows from another.
        Unlike `level` it is the same all along a stem.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> table = skeletonize(y_junction(2000).points).branch_table()
    >>> len(table), list(table)[0]["kind"], table.length.shape
    (3, 'tip', (3,))
    """

    kind: np.ndarray
    component: np.ndarray
    parent: np.ndarray
    level: np.ndarray
    start: np.ndarray
    end: np.ndarray
    start_point: np.ndarray
    end_point: np.ndarray
    length: np.ndarray
    tortuosity: np.ndarray
    mean_radius: np.ndarray
    start_radius: np.ndarray
    end_radius: np.ndarray
    angle: np.ndarray
    mean_curvature: np.ndarray
    mean_torsion: np.ndarray
    points: np.ndarray
    confidence: np.ndarray
    support: np.ndarray
    axis: np.ndarray
    order: np.ndarray

    def __repr__(self):
        return f"BranchTable({len(self)} branches, {self.level.max(initial=-1) + 1} levels)"

    @property
    def printed_columns(self) -> dict[str, str]:
        """The columns that are read by people, each with its format; the support only if it is known."""
        known = np.isfinite(self.support).any()
        return {name: form for name, form in PRINTED_COLUMNS.items() if known or name != "support"}

    def __str__(self):
        columns = self.printed_columns
        rows = [[*columns], *([cell(row, name) for name in columns] for row in self)]
        if len(rows) > PRINTED_ROWS + 1:
            rows[PRINTED_ROWS - 4 : -4] = [["..."] + [""] * (len(columns) - 1)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = (
            "  ".join(
                word.ljust(width) if form == "s" else word.rjust(width)
                for word, width, form in zip(row, widths, columns.values(), strict=True)
            )
            for row in rows
        )
        return "\n".join([f"{self!r}: lengths in the cloud's units, angles in degrees", *map(str.rstrip, lines)])


def cell(row: dict[str, Any], name: str) -> str:
    """A number of a row of a `BranchTable` as people read it, a dash for what is unknown; `name` is of `COLUMNS`."""
    value = row[name]
    if (name == "parent" and value < 0) or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return format(value, PRINTED_COLUMNS[name])
