"""Cylinders along the branches of a tree, and what foresters read: height, stem, crown, volume by order."""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from ..errors import InvalidParameterError, SkeletonWarning
from ..numerics.groups import Members
from ..numerics.polylines import arc_lengths, place_at
from ..numerics.vectors import AXES, TINY, along_axis, norm
from .branches import branch_table
from .rows import Rows

BREAST_HEIGHT = 1.3  # published: metres above the ground at which foresters measure stems
TALLEST_TREE = 116.07  # published: metres, Hyperion, the tallest tree known, as measured in 2019
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}  # derived: of the international inch and foot
PIECE_LENGTH = 4.0  # derived: radii; the chord of a bend as sharp as that is 3 % too short
TIP_QUANTILE = 0.95  # fitted: share of the points at a tip that its cylinder reaches
OUTSIDE = 3.0  # fitted: radii aside of a tip, from which on points do not say how far it reaches
RADIUS_SAMPLES = 8  # derived: places along a cylinder at which its radius is taken, evenly


@dataclass(frozen=True, eq=False)
class Cylinders(Rows, row="cylinder"):
    """One row per cylinder, from the root outwards along each branch.

    Lengths are in the cloud's units. Rows and CSV also have ``diameter``, ``area`` and ``volume``.

    Attributes
    ----------
    start_point, end_point : (K, 3) float arrays
        Ends of the axis, the first towards the root.
    radius, length : (K,) float arrays
        Of the cylinder with the volume of the part; along the curve.
    parent, branch, order : (K,) int arrays
        The cylinder that it grows from, -1 at the root; row of the branch table, and that branch's order, 0 for the
        stem.
    confidence : (K,) float array
        Mean confidence along it; 0 where there was no surface to fit it to and its radius is the scatter of its points.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import y_junction
    >>> table = cylinders(pipelines.tree()(y_junction(2000).points))
    >>> int(table.order.max()), int((table.parent < 0).sum())
    (1, 1)
    """

    start_point: np.ndarray
    end_point: np.ndarray
    radius: np.ndarray
    length: np.ndarray
    parent: np.ndarray
    branch: np.ndarray
    order: np.ndarray
    confidence: np.ndarray

    @property
    def diameter(self) -> np.ndarray:
        """Of each cylinder."""
        return 2 * self.radius

    @property
    def volume(self) -> np.ndarray:
        """Of each cylinder, in the cube of the cloud's units."""
        return np.pi * self.radius**2 * self.length

    @property
    def area(self) -> np.ndarray:
        """Lateral surface of each cylinder, in the square of the cloud's units."""
        return 2 * np.pi * self.radius * self.length

    def _columns(self) -> dict[str, list]:
        return super()._columns() | {name: getattr(self, name).tolist() for name in ("diameter", "area", "volume")}


def cylinders(skeleton: Any, root: Any = None) -> Cylinders:
    """Cylinders along the branches of a skeleton, each about four radii long.

    A branch that leaves its parent begins a radius of the parent away, so that nothing counts twice; the one that goes
    straight on begins at the junction. Free ends reach as far as their points do, but for the root less a third of the
    radius: a round cap has the volume of so much less of a cylinder.

    Parameters
    ----------
    skeleton : Skeleton
    root : str, int or (x, y, z), optional
        See `branch_table`. By default `report.root`, where the pipeline `tree` made it grow from; in a file that lacks
        that, vertex 0 if vertices are numbered from there outwards; else the branch with the most volume.

    Returns
    -------
    Cylinders

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, in parts, or has loops, no branches or no radii; or there is no such root.

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
            f"the skeleton has {skeleton.n_loops} loops: cylinders are of trees; see pipelines.tree()"
        )
    if skeleton.n_components > 1:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_components} components: cylinders are of one tree; see pipelines.tree() and "
            "editing.largest_component()"
        )
    if not np.isfinite(skeleton.radii).all():
        raise InvalidParameterError("the skeleton has no radii: a file of a format without them was read")
    table, beyond = branch_table(skeleton, _root(skeleton, root)), _beyond_tips(skeleton)
    last = np.full(len(table), -1)
    rows: list[tuple] = []
    for row in np.argsort(table.level[: len(skeleton.branches)], kind="stable").tolist():
        path = skeleton.branches[row]
        path = path if path[0] == table.start[row] else path[::-1]
        before = int(table.parent[row])
        last[row] = last[before] if before >= 0 else -1
        along = arc_lengths(skeleton.vertices[path])
        leaves_parent = before >= 0 and table.order[row] > table.order[before]
        # a stem is cut off flat, other ends are round: such a cap has the volume of a cylinder two thirds shorter
        start = table.end_radius[before] if leaves_parent else -beyond.get(int(path[0]), 0.0)
        stop = along[-1] + max(beyond.get(int(path[-1]), 0.0) - skeleton.radii[path[-2]] / 3, 0.0)
        if stop <= start:
            continue
        pieces = max(round((stop - start) / (PIECE_LENGTH * max(table.mean_radius[row], 1e-3 * (stop - start)))), 1)
        ends = np.linspace(start, stop, pieces + 1)
        places = _place_beyond(skeleton.vertices[path], along, ends)
        inside = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(RADIUS_SAMPLES) + 0.5) / RADIUS_SAMPLES
        radius = np.sqrt((np.interp(inside, along, skeleton.radii[path]) ** 2).mean(axis=1))
        confidence = np.interp(inside, along, skeleton.confidence[path]).mean(axis=1)
        for i in range(pieces):
            size = (radius[i], ends[i + 1] - ends[i])
            rows.append((places[i], places[i + 1], *size, last[row], row, table.order[row], confidence[i]))
            last[row] = len(rows) - 1
    if not rows:
        raise InvalidParameterError("the skeleton has no branches of any length: there is nothing to put cylinders on")
    return Cylinders(*(np.array(column) for column in zip(*rows, strict=True)))


def _root(skeleton: Any, root: Any) -> Any:
    """As given, or the vertex from which all are numbered outwards: each other one has one neighbour before it."""
    later = np.sort(skeleton.edges[:, 1])
    outwards = np.array_equal(later, np.arange(1, len(skeleton.vertices)))
    return 0 if root is None and not skeleton.report.root and outwards else root


def _beyond_tips(skeleton: Any) -> dict[int, float]:
    """How far the part goes on beyond every tip of the curve, by its points: by vertex."""
    ends = np.concatenate([skeleton.edges, skeleton.edges[:, ::-1]])
    ends = ends[skeleton.degree[ends[:, 0]] == 1]
    members = Members(skeleton.vertex_of_point, len(skeleton.vertices))
    beyond = {}
    for tip, beside in ends.tolist():
        points = skeleton.points[members.of(np.array([tip, beside]))]
        way = skeleton.vertices[tip] - skeleton.vertices[beside]
        if len(points) and way.any():
            offset, ahead = points - skeleton.vertices[tip], way / np.linalg.norm(way)
            along = offset @ ahead
            aside = norm(offset - along[:, None] * ahead)
            reach = np.quantile(along[aside <= max(OUTSIDE * skeleton.radii[beside], aside.min())], TIP_QUANTILE)
            beyond[tip] = max(float(reach), 0.0)
    return beyond


def _place_beyond(curve: np.ndarray, along: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """The places so far along a curve, which goes straight on at both ends."""
    places = place_at(curve, along, lengths)
    for end, beside, more in ((0, 1, -lengths), (-1, -2, lengths - along[-1])):
        way = curve[end] - curve[beside]
        unit = way / max(float(np.linalg.norm(way)), TINY)
        places = places + np.maximum(more, 0)[:, None] * unit
    return places


@dataclass(frozen=True)
class TreeMeasures:
    """A tree in numbers. Lengths are in metres, areas in square metres, volumes in cubic metres.

    Attributes
    ----------
    height, stem_diameter : float
        Of the highest point above the foot of the stem, but for points farther than three radii from the curve; 1.3 m
        above the foot, NaN where the axis of order 0 does not reach so high.
    crown_base : float
        Height at which the lowest branch leaves the stem; NaN without one.
    crown_width, crown_area : float
        Largest horizontal distance of two points of the crown, of branches and of the stem above the lowest one; of its
        convex hull as seen from above.
    length, area, volume : tuple of float
        Of the axes, lateral surface and volume of each order, the stem first; see `Cylinders`.
    traced : float
        Share of the volume that has confidence 0: twigs without a surface, leaves, and what noise has spoilt. NaN if
        confidences are not known.
    root, up, unit : (x, y, z), str, float
        The foot of the stem in the cloud's units, the axis that was taken to point up, and metres of one unit.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import y_junction
    >>> measures = tree_measures(pipelines.tree()(y_junction(2000).points))
    >>> len(measures.volume), measures.height > 0.5
    (2, True)
    """

    height: float
    stem_diameter: float
    crown_base: float
    crown_width: float
    crown_area: float
    length: tuple[float, ...]
    area: tuple[float, ...]
    volume: tuple[float, ...]
    traced: float
    root: tuple[float, float, float]
    up: str
    unit: float


def tree_measures(skeleton: Any, root: Any = None, *, up: str | None = None, unit: float | str = 1.0) -> TreeMeasures:
    """Measure a tree as foresters do.

    Parameters
    ----------
    skeleton : Skeleton
        One tree, as from `glsk_o3d.pipelines.tree`.
    root : str, int or (x, y, z), optional
        See `cylinders`.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Axis that points up. By default that along which the tree was made to grow, by `root` here or in the pipeline
        `tree`; else ``"z"``.
    unit : float or {"m", "cm", "mm", "in", "ft"}
        One unit of the cloud, in metres or by its name.

    Returns
    -------
    TreeMeasures

    Raises
    ------
    InvalidParameterError
        See `cylinders`; or `up` is no axis, or `unit` is neither positive nor one of these.

    Warns
    -----
    SkeletonWarning
        The root is in the upper half of the tree, or the tree is taller than any: units are hardly as said.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> stem = pipelines.tree("x")(tube(2000, length=2, radius=0.1).points)
    >>> abs(tree_measures(stem).stem_diameter - 0.2) < 0.01  # up is x, as in the pipeline
    True
    """
    steps = skeleton.report.recipe.get("pipeline", ())
    grown = [root, *(step.get("root") for step in reversed(steps) if isinstance(step, dict)), "z"]
    up = next(axis for axis in grown if isinstance(axis, str) and axis in AXES) if up is None else up
    if up not in AXES:
        raise InvalidParameterError(f"up = {up!r}: must be 'x', 'y' or 'z', with a minus where that points down")
    unit = metres(unit)
    pieces = cylinders(skeleton, root)
    ground = pieces.start_point[0]

    def height(places: np.ndarray) -> np.ndarray:
        return unit * along_axis(places - ground, up)

    def by_order(values: np.ndarray, power: int) -> tuple[float, ...]:
        return tuple((unit**power * np.bincount(pieces.order, values)).tolist())

    stem = pieces.order == 0
    bottom, top = height(pieces.start_point), height(pieces.end_point)
    low, high = min(bottom.min(), top.min()), max(bottom.max(), top.max())
    highest = float(max(high, height(_points_near(skeleton)).max(initial=high)))
    _warn_of_doubts(-low / max(high - low, TINY), highest, up, unit)
    middles = height((pieces.start_point + pieces.end_point) / 2)
    leaving = bottom[(pieces.order == 1) & stem[pieces.parent]]
    crowning = ~stem | (bottom > leaving.min(initial=np.inf))
    crown = unit * np.concatenate([pieces.start_point[crowning], pieces.end_point[crowning]])
    width, area = _extent(np.delete(crown, "xyz".index(up[-1]), axis=1))
    breast = np.flatnonzero(stem & (bottom <= BREAST_HEIGHT) & (top >= BREAST_HEIGHT))
    traced = np.where(np.isfinite(pieces.confidence), pieces.volume * (pieces.confidence == 0), np.nan)
    return TreeMeasures(
        height=highest,
        stem_diameter=2 * unit * _radius_at(BREAST_HEIGHT, middles, pieces, breast[0]) if len(breast) else np.nan,
        crown_base=float(leaving.min()) if len(leaving) else np.nan,
        crown_width=width,
        crown_area=area,
        length=by_order(pieces.length, 1),
        area=by_order(pieces.area, 2),
        volume=by_order(pieces.volume, 3),
        traced=float(traced.sum() / max(pieces.volume.sum(), TINY)),
        root=tuple(ground.tolist()),
        up=up,
        unit=unit,
    )


def _warn_of_doubts(ground: float, highest: float, up: str, unit: float) -> None:
    """Warn of a root above half of the height, and of a tree taller than any: directions or units are not as said."""
    doubts = []
    if ground > 0.5:
        doubts.append(f"the tree grows from {100 * ground:.0f} % of its height along {up}: does {up} point up?")
    if highest > TALLEST_TREE:
        doubts.append(
            f"the tree is {highest:.4g} m high, and none is known above {TALLEST_TREE:.0f} m: is a unit of the cloud "
            f"{unit:g} m? pass unit=, such as 'mm'"
        )
    for doubt in doubts:
        warnings.warn(doubt, SkeletonWarning, stacklevel=3)


def _radius_at(level: float, middles: np.ndarray, pieces: Cylinders, at: int) -> float:
    """Radius of an axis at a height, between the middles of the cylinder there and of those before and after it."""
    near = np.flatnonzero((pieces.parent == at) | (np.arange(len(pieces)) == pieces.parent[at]))
    near = np.append(near[pieces.order[near] == pieces.order[at]], at)
    near = near[np.argsort(middles[near])]
    return float(np.interp(level, middles[near], pieces.radius[near]))


def metres(unit: float | str) -> float:
    """A unit of length in metres, given as that or by its name: ``"mm"`` is 0.001."""
    try:
        value = METRES[unit] if isinstance(unit, str) and unit in METRES else float(unit)
    except (TypeError, ValueError):
        value = np.nan
    if not 0 < value < np.inf:
        raise InvalidParameterError(f"unit = {unit!r}: must be metres, above 0, or one of {', '.join(METRES)}")
    return value


def _points_near(skeleton: Any) -> np.ndarray:
    """The points no farther from their vertex than three radii and the longest edge there."""
    owner, longest = skeleton.vertex_of_point, np.zeros(len(skeleton.vertices))
    for ends in skeleton.edges.T:
        np.maximum.at(longest, ends, skeleton.edge_lengths)
    some = np.flatnonzero(owner >= 0)
    away = norm(skeleton.points[some] - skeleton.vertices[owner[some]])
    return skeleton.points[some[away <= (OUTSIDE * skeleton.radii + longest)[owner[some]]]]


def _extent(places: np.ndarray) -> tuple[float, float]:
    """Largest distance, and area of the convex hull, of places in a plane."""
    if len(places) == 0:
        return 0.0, 0.0
    try:
        hull = ConvexHull(places)
    except (QhullError, ValueError):  # they are on a line
        return float(np.linalg.norm(np.ptp(places, axis=0))), 0.0
    return float(pdist(places[hull.vertices]).max()), float(hull.volume)
