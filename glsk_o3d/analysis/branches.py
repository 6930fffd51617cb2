"""The branches of a skeleton: a row of measures for each."""

import heapq
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..curve.rooted import root_among
from ..data.skeleton import Skeleton, check_skeleton
from ..errors import InvalidParameterError
from ..geometry.cycles import edges_on_cycles
from ..geometry.polylines import arc_lengths, place_at, relative_distance
from ..geometry.vectors import Floats, Ints, norm
from .rows import Rows
from .segmentation import branch_of_point

HEADING_LENGTH = 4.0  # fitted: radii of a junction over which a branch has its direction; where nearer, parts blend
HEADING_PLACES = 65  # precision: along the half of a branch, each inside or outside the other branches
FAIR_SHARE = 0.3  # fitted: of the greatest growth length at a junction; on conifers, and plants with long leaves
PRINTED_COLUMNS = (
    *("branch", "kind", "parent", "level", "axis", "order", "length", "mean_radius", "start_radius", "end_radius"),
    *("tortuosity", "angle", "points", "confidence", "support"),
)
"""The columns that people read."""


@dataclass(frozen=True, eq=False)
class BranchTable(Rows, row="branch"):
    """One row per branch, in the order of `Skeleton.branches`, and then one per vertex without edges.

    Lengths are in the cloud's units, means are along the curve, NaN is unknown. Iteration gives a dict of plain numbers
    and strings per row; the two points become ``start_point_x`` and so on. ``print`` shows the main columns. More on
    every column: docs/branches.md.

    Attributes
    ----------
    kind : (B,) str array
        ``"loop"`` for branches that lie on a loop, ``"tip"`` for others with a free end, ``"inner"`` for others between
        junctions, ``"isolated"`` for a vertex without edges.
    component : (B,) int array
    parent, level : (B,) int arrays
        The row of the branch that it grows from, on the shortest path from the root, or -1 at the root; steps from the
        root.
    start, end, start_point, end_point : (B,) int and (B, 3) float arrays
        Vertices at the ends, `start` towards the root, and their coordinates.
    length, tortuosity : (B,) float arrays
        Along the curve; over the distance of the ends: 1 for a straight branch, infinite for a closed one.
    mean_radius, start_radius, end_radius : (B,) float arrays
    angle : (B,) float array
        Degrees between the directions of parent and branch at their junction: 0 goes straight on. NaN without a parent,
        and for a closed branch or parent.
    points : (B,) int array
        Points of the skeleton's cloud that belong to the branch; see `segment`.
    confidence, score, support : (B,) float arrays
        Mean confidence; `Skeleton.branch_scores`; and the share of samples of the cloud that show its least supported
        place or end, see `glsk_o3d.support`.
    axis, order : (B,) int arrays
        The first row of the axis of the branch. At a junction the thickest and straightest of the branches with much
        growth beyond them continues the axis. Centrifugal (Gravelius) order: 0 for axes at the root, and one more for
        each axis that grows from another.
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
    points: np.ndarray
    confidence: np.ndarray
    score: np.ndarray
    support: np.ndarray
    axis: np.ndarray
    order: np.ndarray

    def __repr__(self) -> str:
        return f"BranchTable({len(self)} branches, {self.level.max(initial=-1) + 1} levels)"

    def printed(self) -> dict[str, list[str]]:
        """The main columns in four digits, with a dash for unknown values, and the support only if known."""
        columns = {name: values for name, values in self._columns().items() if name in PRINTED_COLUMNS}
        if not np.isfinite(self.support).any():
            del columns["support"]

        def cell(value: Any) -> str:
            return f"{value:.4g}".replace("nan", "-") if isinstance(value, float) else str(value)

        return {name: list(map(cell, values)) for name, values in columns.items()}

    def __str__(self) -> str:
        columns = [[name, *cells] for name, cells in self.printed().items()]
        widths = [max(map(len, column)) for column in columns]
        lines = ("  ".join(map(str.rjust, row, widths)) for row in zip(*columns, strict=True))
        return "\n".join([repr(self), *lines])


@np.errstate(all="ignore")  # a file may hold coordinates whose squares no float64 holds
def branch_table(skeleton: Skeleton, root: Any = None) -> BranchTable:
    """Measure every branch of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    root : str, int or (x, y, z), optional
        As of `editing.reroot`: ``"x"`` to ``"-z"`` for the vertex that is lowest along this axis, ``"thickest"`` for
        the thickest end, a vertex, or a point whose nearest vertex it is. By default the root of the pipeline `tree`,
        if it made the skeleton. Without it, and in other components, the branch with the most volume has level 0.

    Returns
    -------
    BranchTable

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or there is no such root.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> table = branch_table(skeletonize(y_junction(2000).points))
    >>> sorted(table.level.tolist())
    [0, 1, 1]
    """
    check_skeleton(skeleton)
    m = len(skeleton.vertices)
    if m == 0:
        raise InvalidParameterError("the skeleton is empty: it has no branches to measure")
    root = skeleton.report.root or None if root is None else root
    chosen = None if root is None else root_among(skeleton.vertices, skeleton, root)
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    steps = [norm(np.diff(skeleton.vertices[path], axis=0)) for path in paths]
    length = np.array([step.sum() for step in steps])
    weights = [np.r_[step, 0] + np.r_[0, step] if step.any() else np.ones(len(step) + 1) for step in steps]

    def mean(values: np.ndarray) -> np.ndarray:
        return np.array([_mean(values[path], weight) for path, weight in zip(paths, weights, strict=True)])

    section = mean((skeleton.radii / np.nanmax(skeleton.radii, initial=np.finfo(float).tiny)) ** 2)
    volume = length * np.where(np.isnan(section), 1, section)
    at: dict[int, list[int]] = {}  # the rows of the paths that end at a vertex
    for row, path in enumerate(paths):
        for vertex in {int(path[0]), int(path[-1])}:
            at.setdefault(vertex, []).append(row)
    parent, level, backwards = _grow(skeleton, paths, at, length, volume, chosen)
    outward = [path[::-1] if turn else path for path, turn in zip(paths, backwards, strict=True)]
    start, end = (np.array([path[i] for path in outward]) for i in (0, -1))
    first, last = skeleton.vertices[start], skeleton.vertices[end]
    label = branch_of_point(skeleton, skeleton.points, skeleton.vertex_of_point)
    angle = np.array([_angle(skeleton, outward, at, i, parent[i]) for i in range(len(paths))])
    mean_radius = mean(skeleton.radii)
    axis, order = _axes(parent, level, start, angle, mean_radius, length)
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
        tortuosity=length / norm(last - first),
        mean_radius=mean_radius,
        start_radius=skeleton.radii[start],
        end_radius=skeleton.radii[end],
        angle=angle,
        points=np.bincount(label[label >= 0], minlength=len(paths)),
        confidence=mean(skeleton.confidence),
        score=np.append(skeleton.branch_scores, np.full(len(paths) - len(skeleton.branches), np.nan)),
        support=np.array([skeleton.support[path].min() for path in paths]),
        axis=axis,
        order=order,
    )


def _grow(
    skeleton: Skeleton, paths: list[Ints], at: dict[int, list[int]], length: Floats, volume: Floats, chosen: int | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parent and level of every path, and whether it runs towards the root: three (B,) arrays.

    Paths are reached from the roots, the nearest first. `chosen` is the root vertex of its component, or None; other
    components grow from the path with the most `volume`.
    """
    ends = [(int(path[0]), int(path[-1])) for path in paths]
    parent, level, backwards = np.full(len(paths), -1), np.full(len(paths), -1), np.zeros(len(paths), bool)
    component = skeleton.component_of_vertex[[pair[0] for pair in ends]]
    queue: list[tuple[float, int, int]] = []  # distance, vertex, and the path that leads to it
    for part in range(skeleton.n_components):
        if chosen is not None and skeleton.component_of_vertex[chosen] == part:
            if chosen in at:
                queue.append((0.0, chosen, -1))
                continue
            (row,) = (row for row, path in enumerate(paths) if chosen in path)
            place = int(np.argmax(paths[row] == chosen))
            steps = np.linalg.norm(np.diff(skeleton.vertices[paths[row]], axis=0), axis=1)
            backwards[row] = steps[:place].sum() > steps[place:].sum()
        else:
            rows = np.flatnonzero(component == part)
            row = rows[np.argmax(volume[rows])]
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


def _axes(parent: Ints, level: Ints, start: Ints, angle: Floats, radius: Floats, length: Floats) -> tuple[Ints, Ints]:
    """First row of every row's axis, and its order: of the branches that begin in one place, one continues the axis.

    Branches without a fair share of the greatest growth length are excluded first; that is their own length and that of
    all that grows from them (Hackenberg et al. 2015, SimpleTree, https://doi.org/10.3390/f6114245). So a spur, or a
    thick limb that soon ends, does not continue a stem. A single remaining branch continues the axis wherever it turns;
    of several the thick and straight one does.
    """
    growth = np.array(length, float)
    for row in np.argsort(-level, kind="stable").tolist():  # children before their parents
        if parent[row] >= 0:
            growth[parent[row]] += growth[row]
    _, fork = np.unique([parent, start], axis=1, return_inverse=True)
    fork = fork.ravel()  # NumPy 2.0 gives it two axes
    greatest = np.zeros(len(growth))
    np.maximum.at(greatest, fork, growth)
    fair = growth >= FAIR_SHARE * greatest[fork]
    straight = np.where(fair, np.cos(np.radians(angle)), 0)
    straight[fair & np.isfinite(angle) & (np.bincount(fork, fair)[fork] == 1)] = 1
    unknown = np.isin(fork, fork[(straight > 0) & np.isnan(radius)])  # without a radius the angle alone decides
    score = np.nan_to_num(straight * np.where(unknown, 1, radius))
    best = np.empty(len(score), int)
    rows = np.lexsort((-np.arange(len(score)), score))
    best[fork[rows]] = rows  # the last value counts
    continues = (best[fork] == np.arange(len(score))) & (score > 0)
    axis, order = np.arange(len(parent)), np.zeros(len(parent), int)
    for row in np.argsort(level, kind="stable").tolist():
        p = parent[row]
        if p >= 0:
            axis[row], order[row] = (axis[p], order[p]) if continues[row] else (row, order[p] + 1)
    return axis, order


def _mean(values: np.ndarray, weights: np.ndarray) -> Any:
    """Weighted mean of the values that are known, NaN without any."""
    known = np.isfinite(values) & (weights > 0)
    return np.average(values[known], weights=weights[known]) if known.any() else np.nan


def _kinds(skeleton: Skeleton, paths: list[np.ndarray]) -> np.ndarray:
    """The kind of every path, see `BranchTable`."""
    on_loop = np.zeros(len(paths), bool)
    on_loop[skeleton.branch_of_edge] = edges_on_cycles(len(skeleton.vertices), skeleton.edges)
    degree = skeleton.degree[[path[[0, -1]] for path in paths]]
    conditions = [(degree == 0).all(axis=1), on_loop, (degree == 1).any(axis=1)]
    return np.select(conditions, ["isolated", "loop", "tip"], "inner")


def _angle(skeleton: Skeleton, paths: list[np.ndarray], at: dict[int, list[int]], row: int, parent: int) -> Any:
    """Degrees by which a path turns away from its parent, NaN without a parent or if one of them is closed."""
    path, parent_path = paths[row], paths[parent]
    if parent < 0 or path[0] == path[-1] or parent_path[0] == parent_path[-1]:
        return np.nan
    limbs = {k: paths[k] if paths[k][0] == path[0] else paths[k][::-1] for k in at[int(path[0])]}

    def heading(k: int) -> Floats:
        return _heading(skeleton, limbs[k], [limb for other, limb in limbs.items() if other != k])

    direction, parent_direction = heading(row), -heading(parent)
    if not (direction.any() and parent_direction.any()):
        return np.nan
    sine = np.linalg.norm(np.cross(direction, parent_direction))
    return np.degrees(np.arctan2(sine, direction @ parent_direction))


def _heading(skeleton: Skeleton, path: np.ndarray, others: list[np.ndarray]) -> Floats:
    """Direction of a limb from its junction, over four radii of that from the place where it has left the other limbs.

    That place is no farther than the half of the limb; without radii the direction is that of the first quarter.
    """
    curve, radius = skeleton.vertices[path], skeleton.radii[path[0]]
    along = arc_lengths(curve)
    if not radius > 0:
        return place_at(curve, along, along[-1] / 4) - curve[0]
    at = along[-1] / 2 * np.linspace(0, 1, HEADING_PLACES)
    ratio, surface = relative_distance(place_at(curve, along, at), skeleton.vertices, skeleton.radii, others)
    outside = (ratio - 1) * surface > np.interp(at, along, skeleton.radii[path])
    near = at[outside.argmax()] if outside.any() else at[-1]
    return place_at(curve, along, near + HEADING_LENGTH * radius) - place_at(curve, along, near)
