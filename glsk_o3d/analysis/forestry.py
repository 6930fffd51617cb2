"""What foresters read: the cylinders of a tree, its volume and surface by order, stem diameter, height and crown."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from ..errors import InvalidParameterError, SkeletonWarning
from ..numerics.polylines import arc_lengths, place_at
from ..numerics.vectors import AXES, TINY, along_axis
from .branches import branch_table
from .rows import Rows

PIECE_LENGTH = 4.0  # derived: radii; the chord of a bend as sharp as that is 3 % too short
TIP_QUANTILE = 0.95  # fitted: share of the points at a tip that its cylinder reaches
OUTSIDE = 3.0  # fitted: radii aside of a tip, from which on points do not say how far it reaches
BREAST_HEIGHT = 1.3  # published: metres above the ground at which foresters measure stems
RADIUS_SAMPLES = 8  # derived: places along a cylinder at which its radius is taken, evenly


@dataclass(frozen=True, eq=False)
class Cylinders(Rows, row="cylinder"):
    """One row per cylinder, from the root outwards along each branch.

    Lengths are in the cloud's units.

    Attributes
    ----------
    start_point, end_point : (K, 3) float arrays
        Ends of the axis, the first towards the root.
    radius : (K,) float array
        That of the cylinder with the volume of the part.
    length : (K,) float array
        Along the curve.
    parent : (K,) int array
        The cylinder that it grows from, -1 at the root.
    branch : (K,) int array
        Row of the branch table.
    order : (K,) int array
        Order of the branch, see `BranchTable`: 0 for the stem.
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
    def volume(self) -> np.ndarray:
        """Of each, in the cube of the cloud's units."""
        return np.pi * self.radius**2 * self.length

    @property
    def area(self) -> np.ndarray:
        """Of the lateral surface of each, in the square of the cloud's units."""
        return 2 * np.pi * self.radius * self.length


def cylinders(skeleton: Any, root: Any = None) -> Cylinders:
    """Cylinders along the branches of a skeleton, each about four radii long.

    A branch that leaves its parent begins a radius of the parent away, so that nothing counts twice; the one that goes
    straight on begins at the junction. Free ends reach as far as their points do, but for the root less a third of the
    radius: a round cap has the volume of so much less of a cylinder.

    Parameters
    ----------
    skeleton : Skeleton
    root : int or (x, y, z), optional
        By default `report.root`, where the pipeline `tree` made it grow from; in a file that lacks that, vertex 0 if
        vertices are numbered from there outwards; else see `branch_table`.

    Returns
    -------
    Cylinders

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, in parts, or has loops, no branches or no radii; or the root is neither a vertex nor a
        point.

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
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    last = np.full(len(table), -1)
    rows: list[tuple] = []
    for row in np.argsort(table.level, kind="stable").tolist():
        if len(paths[row]) < 2:
            continue
        path = paths[row] if paths[row][0] == table.start[row] else paths[row][::-1]
        before = int(table.parent[row])
        last[row] = last[before] if before >= 0 else -1
        along = arc_lengths(skeleton.vertices[path])
        leaves_parent = before >= 0 and table.order[row] > table.order[before]
        # a stem is cut off flat, other ends are round: such a cap has the volume of a cylinder two thirds shorter
        start = table.end_radius[before] if leaves_parent else -beyond.get(int(path[0]), 0.0)
        stop = along[-1] + max(beyond.get(int(path[-1]), 0.0) - skeleton.radii[path[-2]] / 3, 0.0)
        if stop <= start:
            continue
        pieces = max(round((stop - start) / (PIECE_LENGTH * max(table.mean_radius[row], 1e-3 * stop))), 1)
        ends = np.linspace(start, stop, pieces + 1)
        places = _place_beyond(skeleton.vertices[path], along, ends)
        inside = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(RADIUS_SAMPLES) + 0.5) / RADIUS_SAMPLES
        radius = np.sqrt((np.interp(inside, along, skeleton.radii[path]) ** 2).mean(axis=1))
        confidence = np.interp(inside, along, skeleton.confidence[path]).mean(axis=1)
        facts = zip(places, places[1:], radius, np.diff(ends), confidence, strict=False)
        for first, end, thick, length, sure in facts:
            rows.append((first, end, thick, length, last[row], row, table.order[row], sure))
            last[row] = len(rows) - 1
    if not rows:
        raise InvalidParameterError("the skeleton has no branches: there is nothing to put cylinders on")
    return Cylinders(*(np.array(column) for column in zip(*rows, strict=True)))


def _root(skeleton: Any, root: Any) -> Any:
    """As given, or the vertex from which all are numbered outwards: each other one has one neighbour before it."""
    later = np.sort(skeleton.edges[:, 1])
    outwards = np.array_equal(later, np.arange(1, len(skeleton.vertices)))
    return 0 if root is None and not skeleton.report.root and outwards else root


def _beyond_tips(skeleton: Any) -> dict[int, float]:
    """How far the part goes on beyond every tip of the curve, by its points."""
    owner, ends = skeleton.vertex_of_point, np.concatenate([skeleton.edges, skeleton.edges[:, ::-1]])
    ends = ends[skeleton.degree[ends[:, 0]] == 1]
    order = np.argsort(owner, kind="stable")
    first, stop = (np.searchsorted(owner[order], np.arange(len(skeleton.vertices)), side) for side in ("left", "right"))
    beyond = {}
    for tip, beside in ends.tolist():
        points = skeleton.points[np.concatenate([order[first[v] : stop[v]] for v in (tip, beside)])]
        way = skeleton.vertices[tip] - skeleton.vertices[beside]
        if len(points) and way.any():
            offset, ahead = points - skeleton.vertices[tip], way / np.linalg.norm(way)
            along = offset @ ahead
            aside = np.linalg.norm(offset - along[:, None] * ahead, axis=1)
            reach = np.quantile(along[aside <= max(OUTSIDE * skeleton.radii[beside], aside.min())], TIP_QUANTILE)
            beyond[tip] = max(float(reach), 0.0)
    return beyond


def _beside(skeleton: Any) -> np.ndarray:
    """Points that are no farther from their vertex than where others are."""
    owner, longest = skeleton.vertex_of_point, np.zeros(len(skeleton.vertices))
    for ends in skeleton.edges.T:
        np.maximum.at(longest, ends, skeleton.edge_lengths)
    some = np.flatnonzero(owner >= 0)
    away = np.linalg.norm(skeleton.points[some] - skeleton.vertices[owner[some]], axis=1)
    return skeleton.points[some[away <= (OUTSIDE * skeleton.radii + longest)[owner[some]]]]


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
    height : float
        Of the highest point above the foot of the stem; points farther than three radii from the curve do not count.
    stem_diameter : float
        1.3 m above its foot; NaN where the axis of order 0 does not reach so high.
    crown_base : float
        Height at which the lowest branch leaves the stem; NaN without one.
    crown_width : float
        Largest horizontal distance of two points of the crown: of branches, and of the stem above the lowest one.
    crown_area : float
        Of the convex hull of the crown as seen from above.
    length, area, volume : tuple of float
        Of the axes, lateral surface and volume of each order, the stem first; see `Cylinders`.
    traced : float
        Share of the volume that has confidence 0: twigs without a surface, leaves, and what noise has spoilt. NaN if
        confidences are not known.

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


def tree_measures(skeleton: Any, root: Any = None, *, up: str = "z", unit: float = 1.0) -> TreeMeasures:
    """Measure a tree as foresters do.

    Parameters
    ----------
    skeleton : Skeleton
        One tree, as from `glsk_o3d.pipelines.tree`.
    root : int or (x, y, z), optional
        See `branch_table`.
    up : {"x", "y", "z", "-x", "-y", "-z"}
        Axis that points up.
    unit : float
        Metres of one unit of the cloud: 0.001 for millimetres.

    Returns
    -------
    TreeMeasures

    Raises
    ------
    InvalidParameterError
        See `cylinders`; or `up` is no axis, or `unit` is not positive.

    Warns
    -----
    SkeletonWarning
        The root is in the upper half of the tree.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> stem = pipelines.tree("x")(tube(2000, length=2, radius=0.1).points)
    >>> abs(tree_measures(stem, up="x").stem_diameter - 0.2) < 0.01
    True
    """
    if up not in AXES:
        raise InvalidParameterError(f"up = {up!r}: must be 'x', 'y' or 'z', with a minus where that points down")
    if not unit > 0:
        raise InvalidParameterError(f"unit = {unit}: must be metres, above 0")
    pieces = cylinders(skeleton, root)
    ground = pieces.start_point[0]

    def height(places: np.ndarray) -> np.ndarray:
        return unit * along_axis(places - ground, up)

    stem = pieces.order == 0
    bottom, top = height(pieces.start_point), height(pieces.end_point)
    low, high = min(bottom.min(), top.min()), max(bottom.max(), top.max())
    ground_height = -low / max(high - low, TINY)
    breast = np.flatnonzero(stem & (bottom <= BREAST_HEIGHT) & (top >= BREAST_HEIGHT))
    leaving = bottom[(pieces.order == 1) & stem[pieces.parent]]
    crowning = ~stem | (bottom > leaving.min(initial=np.inf))
    crown = unit * np.concatenate([pieces.start_point[crowning], pieces.end_point[crowning]])
    width, area = _extent(np.delete(crown, "xyz".index(up[-1]), axis=1))

    known, total = np.isfinite(pieces.confidence), pieces.volume.sum()
    if ground_height > 0.5:
        warnings.warn(
            f"the tree grows from {100 * ground_height:.0f} % of its height along {up}: does {up} point up?",
            SkeletonWarning,
            stacklevel=2,
        )

    def by_order(values: np.ndarray, power: int) -> tuple[float, ...]:
        return tuple((unit**power * np.bincount(pieces.order, values)).tolist())

    return TreeMeasures(
        height=float(max(high, height(_beside(skeleton)).max(initial=high))),
        stem_diameter=float(2 * unit * pieces.radius[breast[0]]) if len(breast) else np.nan,
        crown_base=float(leaving.min()) if len(leaving) else np.nan,
        crown_width=width,
        crown_area=area,
        length=by_order(pieces.length, 1),
        area=by_order(pieces.area, 2),
        volume=by_order(pieces.volume, 3),
        traced=float(np.where(known, pieces.volume * (pieces.confidence == 0), np.nan).sum() / max(total, TINY)),
    )


def _extent(places: np.ndarray) -> tuple[float, float]:
    """Largest distance, and area of the convex hull, of places in a plane."""
    if len(places) == 0:
        return 0.0, 0.0
    try:
        hull = ConvexHull(places)
    except (QhullError, ValueError):  # they are on a line
        return float(np.linalg.norm(np.ptp(places, axis=0))), 0.0
    return float(pdist(places[hull.vertices]).max()), float(hull.volume)
