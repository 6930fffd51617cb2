"""The branches of a skeleton, measured one by one."""

from __future__ import annotations

import csv
import heapq
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidParameterError
from ..interop.writing import write_atomically
from .curvature import curvature_torsion
from .graph import on_loops
from .segmentation import branch_of_point

if TYPE_CHECKING:
    from ..skeleton import Skeleton

AWAY = (1.0, 3.0)  # radii from a junction between which the direction of a branch is taken: nearer, parts blend

MOST_ROWS = 20  # that are printed
COLUMNS = {  # head: (column, format), of tables that are read by people
    "": ("branch", "d"),
    "kind": ("kind", "s"),
    "parent": ("parent", "d"),
    "level": ("level", "d"),
    "axis": ("axis", "d"),
    "order": ("order", "d"),
    "length": ("length", ".4g"),
    "radius": ("mean_radius", ".3g"),
    "first": ("start_radius", ".3g"),
    "last": ("end_radius", ".3g"),
    "bent": ("tortuosity", ".2f"),
    "angle": ("angle", ".1f"),
    "points": ("points", "d"),
    "sure": ("confidence", ".2f"),
}


@dataclass(frozen=True, eq=False)
class BranchTable:
    """One row per branch: those of `Skeleton.branches` in their order, then the vertices without edges.

    Lengths are in the cloud's units. Means are along the curve. NaN where something is unknown or means nothing.
    Iteration gives a dict of plain numbers and strings per row; the two points become ``start_x`` and so on. ``print``
    shows the main columns, under the heads of ``glsk branches``.

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
    axis : (B,) int array
        The first row of the axis that a branch is part of. Where branches part, the one with the largest mean radius
        times cos(`angle`) continues the axis of its parent, unless it turns back; each other one begins an axis.
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
    axis: np.ndarray
    order: np.ndarray

    def __len__(self):
        return len(self.kind)

    def _columns(self) -> dict[str, list]:
        columns: dict[str, list] = {"branch": list(range(len(self)))}
        for field in fields(self):
            array = getattr(self, field.name)
            if array.ndim == 1:
                columns[field.name] = array.tolist()
            else:
                name = field.name.removesuffix("_point")
                columns |= {f"{name}_{axis}": column.tolist() for axis, column in zip("xyz", array.T, strict=True)}
        return columns

    def __iter__(self) -> Iterator[dict[str, Any]]:
        columns = self._columns()
        for row in zip(*columns.values(), strict=True):
            yield dict(zip(columns, row, strict=True))

    def __repr__(self):
        return f"BranchTable({len(self)} branches, {self.level.max(initial=-1) + 1} levels)"

    def __str__(self):
        rows = [[*COLUMNS], *([cell(row, head) for head in COLUMNS] for row in self)]
        if len(rows) > MOST_ROWS + 1:
            rows[MOST_ROWS - 4 : -4] = [["..."] + [""] * (len(COLUMNS) - 1)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        texts = {head for head, (_, form) in COLUMNS.items() if form == "s"}
        lines = (
            "  ".join(
                word.ljust(width) if head in texts else word.rjust(width)
                for word, width, head in zip(row, widths, COLUMNS, strict=True)
            )
            for row in rows
        )
        return "\n".join([f"{self!r}: lengths in the cloud's units, angles in degrees", *map(str.rstrip, lines)])

    def to_csv(self, path: str | os.PathLike) -> None:
        """Write the table as CSV: a line of names, then a line per branch.

        NaN and infinity are left empty, as JSON has null for both.

        Parameters
        ----------
        path : path-like
            Appears complete or not at all.

        Raises
        ------
        OSError
            The folder does not exist, or the file cannot be written.
        """

        def write(temporary):
            with temporary.open("w", newline="", encoding="utf-8") as stream:
                out = csv.writer(stream, lineterminator="\n")
                out.writerow(self._columns())
                for row in self:
                    out.writerow("" if isinstance(v, float) and not math.isfinite(v) else v for v in row.values())

        write_atomically(path, write)


def cell(row: dict[str, Any], head: str) -> str:
    """A number of a row as it is read under a head of `COLUMNS`; a dash for what is unknown.

    Parameters
    ----------
    row : dict
        As iteration over a `BranchTable` gives it.
    head : str

    Returns
    -------
    str
    """
    name, form = COLUMNS[head]
    value = row[name]
    if (name == "parent" and value < 0) or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return format(value, form)


@np.errstate(all="ignore")  # a file may hold coordinates whose squares no float64 holds
def branch_table(skeleton: Skeleton, root: Any = None) -> BranchTable:
    """Measure every branch of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    root : int or (x, y, z), optional
        A vertex, or a point whose nearest vertex it is. Its branch, or all that meet there, are those of level 0 in its
        component. In other components, and by default, it is the branch with the most volume (the longest one, where
        radii are unknown), with its free or thicker end for a start.

    Returns
    -------
    BranchTable

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or the root is neither a vertex nor a point.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> table = branch_table(skeletonize(y_junction(2000).points))
    >>> sorted(table.level.tolist())
    [0, 1, 1]
    """
    m = len(skeleton.vertices)
    if m == 0:
        raise InvalidParameterError("the skeleton is empty: it has no branches to measure")
    chosen = None if root is None else _root_vertex(skeleton, root)
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    steps = [np.linalg.norm(np.diff(skeleton.vertices[path], axis=0), axis=1) for path in paths]
    length = np.array([step.sum() for step in steps])
    weights = [np.r_[step, 0] + np.r_[0, step] if step.any() else np.ones(len(step) + 1) for step in steps]

    def mean(values):
        return np.array([_mean(values[path], weight) for path, weight in zip(paths, weights, strict=True)])

    section = mean((skeleton.radii / np.nanmax(skeleton.radii, initial=np.finfo(float).tiny)) ** 2)
    parent, level, backwards = _grow(skeleton, paths, length, np.where(np.isnan(section), 1, section), chosen)
    outward = [path[::-1] if turn else path for path, turn in zip(paths, backwards, strict=True)]
    start, end = (np.array([path[i] for path in outward]) for i in (0, -1))
    first, last = skeleton.vertices[start], skeleton.vertices[end]
    with np.errstate(divide="ignore", invalid="ignore"):
        tortuosity = length / np.linalg.norm(last - first, axis=1)
    curvature, torsion = curvature_torsion(skeleton)
    label = branch_of_point(skeleton, skeleton.points, skeleton.vertex_of_point)
    angle = np.array([_angle(skeleton, outward, i, parent[i]) for i in range(len(paths))])
    mean_radius = mean(skeleton.radii)
    axis, order = _axes(parent, level, start, angle, mean_radius)
    return BranchTable(
        kind=_kinds(skeleton, paths),
        component=skeleton.component_of_vertex[start],
        parent=parent,
        level=level,
        start=start,
        end=end,
        start_point=first,
        end_point=last,
        length=length,
        tortuosity=tortuosity,
        mean_radius=mean_radius,
        start_radius=skeleton.radii[start],
        end_radius=skeleton.radii[end],
        angle=angle,
        mean_curvature=mean(curvature),
        mean_torsion=mean(torsion),
        points=np.bincount(label[label >= 0], minlength=len(paths)),
        confidence=mean(skeleton.confidence),
        axis=axis,
        order=order,
    )


def _root_vertex(skeleton, root) -> int:
    m = len(skeleton.vertices)
    if isinstance(root, (int, np.integer)) and not isinstance(root, bool):
        if not 0 <= root < m:
            raise InvalidParameterError(f"root = {root}: there are vertices 0 to {m - 1}")
        return int(root)
    try:
        point = np.asarray(root, float)
    except (TypeError, ValueError):
        point = np.empty(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InvalidParameterError(f"root = {root!r}: must be the number of a vertex or a point (x, y, z)")
    return int(np.argmin(np.linalg.norm(skeleton.vertices - point, axis=1)))


def _mean(values, weights):
    known = np.isfinite(values) & (weights > 0)
    return np.average(values[known], weights=weights[known]) if known.any() else np.nan


def _grow(skeleton, paths, length, section, chosen):
    """Parent and level of every path, and whether it runs towards the root: the nearest path first, from the roots."""
    ends = [(int(path[0]), int(path[-1])) for path in paths]
    at: dict[int, list[int]] = {}
    for row, pair in enumerate(ends):
        for vertex in set(pair):
            at.setdefault(vertex, []).append(row)
    parent, level, backwards = np.full(len(paths), -1), np.full(len(paths), -1), np.zeros(len(paths), bool)
    component = skeleton.component_of_vertex[[pair[0] for pair in ends]]
    queue: list[tuple[float, int, int]] = []  # distance, vertex, and the path that leads there
    for part in range(skeleton.n_components):
        if chosen is not None and skeleton.component_of_vertex[chosen] == part:
            if chosen in at:
                queue.append((0.0, chosen, -1))
                continue
            (row,) = (row for row, path in enumerate(paths) if chosen in path)
            place = int(np.argmax(paths[row] == chosen))
            way = np.linalg.norm(np.diff(skeleton.vertices[paths[row]], axis=0), axis=1)
            backwards[row] = way[:place].sum() > way[place:].sum()
        else:
            rows = np.flatnonzero(component == part)
            row = rows[np.argmax((length * section)[rows])]
            free, thick = (np.take(values, ends[row]) for values in (skeleton.degree == 1, skeleton.radii))
            backwards[row] = free[1] if free[0] != free[1] else thick[1] > thick[0]
        level[row] = 0
        queue += [(0.0, vertex, row) for vertex in ends[row]]
    heapq.heapify(queue)
    done = set()
    while queue:
        distance, vertex, via = heapq.heappop(queue)
        if vertex in done:
            continue
        done.add(vertex)
        for row in at[vertex]:
            if level[row] < 0:
                parent[row], level[row] = via, level[via] + 1 if via >= 0 else 0
                backwards[row] = ends[row][0] != vertex
                heapq.heappush(queue, (distance + length[row], ends[row][0 if backwards[row] else 1], row))
    return parent, level, backwards


def _axes(parent, level, start, angle, radius):
    """First row of every row's axis, and the axes before it: of those that begin in one place, one goes straight on."""
    straight = np.cos(np.radians(angle))
    _, fork = np.unique([parent, start], axis=1, return_inverse=True)
    fork = fork.ravel()  # NumPy 2.0 gives it two axes
    unknown = np.isin(fork, fork[(straight > 0) & np.isnan(radius)])  # there the angle alone decides
    onward = np.nan_to_num(straight * np.where(unknown, 1, radius))
    straightest: dict[tuple[int, int], int] = {}
    for row in np.lexsort((-np.arange(len(onward)), onward)).tolist():  # the last one stays
        if onward[row] > 0:
            straightest[int(parent[row]), int(start[row])] = row
    axis, order = np.arange(len(parent)), np.zeros(len(parent), int)
    for row in np.argsort(level, kind="stable").tolist():
        before = parent[row]
        if before >= 0:
            same = straightest.get((int(before), int(start[row]))) == row
            axis[row], order[row] = (axis[before], order[before]) if same else (row, order[before] + 1)
    return axis, order


def _kinds(skeleton, paths):
    looped = skeleton.edges[on_loops(len(skeleton.vertices), skeleton.edges)]
    looped = {frozenset(edge) for edge in looped.tolist()}

    def kind(path):
        if len(path) == 1:
            return "isolated"
        if frozenset(path[:2].tolist()) in looped:
            return "loop"
        return "tip" if (skeleton.degree[path[[0, -1]]] == 1).any() else "inner"

    return np.array([kind(path) for path in paths])


def _angle(skeleton, paths, row, parent):
    path, before = paths[row], paths[parent]
    if parent < 0 or path[0] == path[-1] or before[0] == before[-1]:
        return np.nan
    radius = skeleton.radii[path[0]]
    leaves = _heading(skeleton.vertices[path], radius)
    arrives = -_heading(skeleton.vertices[before[::-1] if before[-1] == path[0] else before], radius)
    if not (leaves.any() and arrives.any()):
        return np.nan
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(leaves, arrives)), leaves @ arrives))


def _heading(curve, radius):
    """Where a curve goes from its first point: from one to three radii, or the first quarter."""
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    reach = along[-1]
    near, far = np.minimum(np.multiply(AWAY, radius), [reach / 2, reach]) if radius > 0 else (0, reach / 4)
    a, b = (np.array([np.interp(place, along, column) for column in curve.T]) for place in (near, far))
    return b - a
