"""Cylinders along the branches of a tree."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidParameterError
from ..geometry.groups import Members
from ..geometry.neighbourhoods import plane_axes
from ..geometry.polylines import arc_lengths, place_at, relative_distance
from ..geometry.vectors import AXES, Floats, along_axis, norm, unit
from .branches import branch_table
from .rows import Rows

PIECE_LENGTH = 4.0  # derived: radii; the chord of a bend as sharp as that is 3 % too short
TIP_QUANTILE = 0.95  # fitted: share of the points at a tip that its cylinder reaches
FAR_FROM_TIP = 3.0  # fitted: radii beside a tip, from which on points belong to no end of the branch
BASE_LENGTH = 4.0  # derived: radii of a junction, within which a branch that leaves it by 15 degrees or more is outside
BASE_SECTIONS = 24  # speed: sections along that
POINTS_ON_SECTION = 32  # speed: tested on each of these sections
RADIUS_SAMPLES = 8  # derived: places along a cylinder at which its radius is taken, evenly


@dataclass(frozen=True, eq=False)
class Cylinders(Rows, row="cylinder"):
    """One row per cylinder, from the root outwards along each branch.

    Lengths are in the cloud's units. Rows and CSV also have ``volume``.

    Attributes
    ----------
    start_point, end_point : (K, 3) float arrays
        Ends of the axis, the first towards the root.
    radius, length : (K,) float arrays
        Of the cylinder with the volume of the part; along the curve.
    parent, branch, order : (K,) int arrays
        The cylinder that it grows from, -1 at the root; row of the branch table, and its order, 0 for the stem.
    confidence : (K,) float array
        Mean confidence along it; 0 without a surface, where the radius is the scatter of the points.
    """

    start_point: np.ndarray
    end_point: np.ndarray
    radius: Floats
    length: Floats
    parent: np.ndarray
    branch: np.ndarray
    order: np.ndarray
    confidence: np.ndarray

    @property
    def volume(self) -> np.ndarray:
        """Of each cylinder, in the cube of the cloud's units."""
        return np.pi * self.radius**2 * self.length

    def _columns(self) -> dict[str, list[Any]]:
        return super()._columns() | {"volume": self.volume.tolist()}


def cylinders(skeleton: Any, root: Any = None, up: str | None = None) -> Cylinders:
    """Cylinders along the branches of a skeleton, each about four radii long.

    A branch begins where it has left its parent, on average over its section, so that nothing counts twice; the one
    that continues the axis begins at the junction. Free ends reach as far as their points, or a third of the radius
    less where they are round, which accounts for the volume. The stem begins no lower than its points.

    Parameters
    ----------
    skeleton : Skeleton
    root : str, int or (x, y, z), optional
        See `branch_table`. By default `report.root` of the pipeline `tree`; without it vertex 0 if vertices are
        numbered outwards from it; else the branch with the most volume.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Axis that points up. By default that of `root` here or in the pipeline `tree`, or else ``"z"``.

    Returns
    -------
    Cylinders

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, in parts, or has loops, no branches or no radii; or there is no such root, or
        `up` is no axis.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> stem = pipelines.tree("x")(tube(2000, length=1, radius=0.1).points)
    >>> table = cylinders(stem)
    >>> bool(abs(table.volume.sum() / (np.pi * 0.1**2 * (1 + 0.4 / 3)) - 1) < 0.05)  # it has round ends
    True
    """
    if skeleton.n_loops:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_loops} loops: cylinders need a tree; see pipelines.tree() (--pipeline tree)"
        )
    if skeleton.n_components > 1:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_components} components: cylinders need one tree; see pipelines.tree() "
            "(--pipeline tree) and editing.largest_component() (glsk edit --largest)"
        )
    if not np.isfinite(skeleton.radii).all():
        raise InvalidParameterError("the skeleton has no radii: a file of a format without them was read")
    if root is None and not skeleton.report.root:  # numbered outwards, all but the first have one neighbour before them
        root = 0 if np.array_equal(np.sort(skeleton.edges[:, 1]), np.arange(1, len(skeleton.vertices))) else None
    up, skeleton = up_axis(skeleton, root, up), skeleton.whole
    table, beyond = branch_table(skeleton, root), _beyond_tips(skeleton)
    last = np.full(len(table), -1)
    rows: list[tuple[Any, ...]] = []
    for row in np.argsort(table.level[: len(skeleton.branches)], kind="stable").tolist():
        path = skeleton.branches[row]
        path = path if path[0] == table.start[row] else path[::-1]
        parent = int(table.parent[row])
        last[row] = last[parent] if parent >= 0 else -1
        along = arc_lengths(skeleton.vertices[path])
        if parent >= 0 and table.order[row] > table.order[parent]:
            # what several branches share at a junction belongs to the first one
            beside = (table.start == path[0]) & ((table.order == table.order[parent]) | (np.arange(len(table)) < row))
            others = [parent, *np.flatnonzero(beside & (table.parent == parent)).tolist()]
            start = _length_inside(skeleton, path, along, [skeleton.branches[other] for other in others])
        else:
            start = -beyond.get(int(path[0]), 0.0)
            start = start if parent >= 0 else _start_of_stem(skeleton, path, along, start, up)
        stop = along[-1] + beyond.get(int(path[-1]), 0.0)
        if stop <= start:
            continue
        pieces = max(round((stop - start) / (PIECE_LENGTH * max(table.mean_radius[row], 1e-3 * (stop - start)))), 1)
        if table.confidence[row] == 0:  # a traced branch has no details between its vertices
            pieces = min(pieces, len(path) - 1)
        ends = np.linspace(start, stop, pieces + 1)
        places = _place_beyond(skeleton.vertices[path], along, ends)
        inside = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(RADIUS_SAMPLES) + 0.5) / RADIUS_SAMPLES
        sides = _tapered_radii(skeleton.radii[path], along, [beyond.get(end, 0) > 0 for end in path[[0, -1]].tolist()])
        radius = np.sqrt((np.interp(inside, along, sides) ** 2).mean(axis=1))
        confidence = np.interp(inside, along, skeleton.confidence[path]).mean(axis=1)
        for i in range(pieces):
            size = (radius[i], ends[i + 1] - ends[i])
            rows.append((places[i], places[i + 1], *size, last[row], row, table.order[row], confidence[i]))
            last[row] = len(rows) - 1
    if not rows:
        raise InvalidParameterError("the skeleton has no branches of any length: there is nothing to put cylinders on")
    return Cylinders(*(np.array(column) for column in zip(*rows, strict=True)))


def up_axis(skeleton: Any, root: Any, up: str | None) -> str:
    """The axis that points up: `up`, or by default that of the root, or of that in the pipeline, or z."""
    steps = skeleton.report.recipe.get("pipeline", ())
    roots = [root, *(step.get("root") for step in reversed(steps) if isinstance(step, dict)), "z"]
    up = next(axis for axis in roots if isinstance(axis, str) and axis in AXES) if up is None else up
    if up not in AXES:
        raise InvalidParameterError(f"up = {up!r}: must be 'x', 'y' or 'z', with a minus where that points down")
    return up


def points_near(skeleton: Any) -> np.ndarray:
    """Rows of the points no farther from their vertex than three radii and the longest edge there."""
    owner, longest = skeleton.vertex_of_point, np.zeros(len(skeleton.vertices))
    np.maximum.at(longest, skeleton.edges, skeleton.edge_lengths[:, None])
    owned = np.flatnonzero(owner >= 0)
    distance = norm(skeleton.points[owned] - skeleton.vertices[owner[owned]])
    return owned[distance <= (FAR_FROM_TIP * skeleton.radii + longest)[owner[owned]]]


def ground_height(points: np.ndarray, foot: np.ndarray, end: np.ndarray, radius: float, up: str) -> float:
    """Height of the lowest point within three radii of the foot of a stem; that of the foot if the stem leads down."""
    height, end_height = along_axis(np.array([foot, end]), up)
    low = along_axis(points[norm(points - foot) <= FAR_FROM_TIP * radius], up)
    return float(low.min() if len(low) and end_height > height - FAR_FROM_TIP * radius else height)


def _start_of_stem(skeleton: Any, path: np.ndarray, along: np.ndarray, start: float, up: str) -> float:
    """The first length along a stem, from a start on, at which it is as high as the lowest point there."""
    curve, lengths = skeleton.vertices[path], np.append(start, along[along > start])
    lowest = ground_height(skeleton.points[points_near(skeleton)], curve[0], curve[-1], skeleton.radii[path[0]], up)
    height = along_axis(_place_beyond(curve, along, lengths), up)
    k = int(np.argmax(height >= lowest))
    return float(np.interp(lowest, height[k - 1 : k + 1], lengths[k - 1 : k + 1])) if k else start


def _tapered_radii(radii: np.ndarray, along: np.ndarray, free: list[bool]) -> np.ndarray:
    """The radii along a branch; near its free ends, where they depend on the face, the taper behind continues."""
    radii = radii.copy()
    for side, is_free in zip((slice(None), slice(None, None, -1)), free, strict=True):
        distance, radius = np.abs(along - along[side][0])[side], radii[side]
        reach = min(radius[1], along[-1] / (1 + PIECE_LENGTH))
        if is_free and reach > 0:
            at_reach, behind = np.interp([reach, (1 + PIECE_LENGTH) * reach], distance, radius)
            close = distance < reach
            taper = (at_reach - behind) / (PIECE_LENGTH * reach)
            radius[close] = np.clip(at_reach + taper * (reach - distance[close]), at_reach / 2, 2 * at_reach)
    return radii


def _length_inside(skeleton: Any, path: np.ndarray, along: np.ndarray, others: list[np.ndarray]) -> float:
    """Length of the base of a branch that is inside other branches of its junction, averaged over its section."""
    length = min(along[-1], BASE_LENGTH * skeleton.radii[path[0]])
    lengths = length * (np.arange(BASE_SECTIONS) + 0.5) / BASE_SECTIONS
    places = place_at(skeleton.vertices[path], along, lengths)
    beyond = np.maximum(lengths, skeleton.radii[path[0]])  # nearer to the junction radii are those of the junction
    radius = np.interp(beyond, along, skeleton.radii[path])
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(POINTS_ON_SECTION)  # a sunflower's seeds fill a disc evenly
    disc = np.sqrt((np.arange(POINTS_ON_SECTION) + 0.5) / POINTS_ON_SECTION) * np.stack([np.cos(turn), np.sin(turn)])
    axes = plane_axes(unit(np.gradient(places, axis=0)))
    points = places[:, None] + (radius[:, None, None] * (axes @ disc)).swapaxes(1, 2)
    near = []
    for other in others:
        other = other if other[0] == path[0] else other[::-1]
        reach = np.searchsorted(arc_lengths(skeleton.vertices[other]), 2 * length)
        near.append(other[: max(reach, 1) + 1])
    ratio, _ = relative_distance(points.reshape(-1, 3), skeleton.vertices, skeleton.radii, near)
    return float(length * (ratio < 1).mean())


def _beyond_tips(skeleton: Any) -> dict[int, float]:
    """Length of a cylinder beyond every tip of the curve, by vertex, that accounts for the volume of the end.

    The points reach half a radius beyond the tip if the end is flat, and one if it is round, with two thirds of the
    volume.
    """
    ends = np.concatenate([skeleton.edges, skeleton.edges[:, ::-1]])
    ends = ends[skeleton.degree[ends[:, 0]] == 1]
    members = Members(skeleton.vertex_of_point, len(skeleton.vertices))
    beyond = {}
    for tip, beside in ends.tolist():
        points = skeleton.points[members.of(np.array([tip, beside]))]
        step = skeleton.vertices[tip] - skeleton.vertices[beside]
        if len(points) and step.any():
            offset, direction = points - skeleton.vertices[tip], step / np.linalg.norm(step)
            along = offset @ direction
            across = norm(offset - along[:, None] * direction)
            reach = np.quantile(along[across <= max(FAR_FROM_TIP * skeleton.radii[beside], across.min())], TIP_QUANTILE)
            half = skeleton.radii[beside] / 2
            beyond[tip] = max(float(reach - 2 / 3 * np.clip(reach - half, 0, half)), 0.0)
    return beyond


def _place_beyond(curve: np.ndarray, along: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """The places at lengths along a curve that goes straight on at both ends, (k, 3) float array."""
    backward, forward = unit(curve[[0, -1]] - curve[[1, -2]])
    places = place_at(curve, along, lengths) + np.maximum(-lengths, 0)[:, None] * backward
    return places + np.maximum(lengths - along[-1], 0)[:, None] * forward
