"""What foresters read: height, stem and crown of a tree, its length, surface and volume by order."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from ..errors import InvalidParameterError, SkeletonWarning
from ..numerics.vectors import AXES, TINY, along_axis, norm
from .tree_cylinders import OUTSIDE, Cylinders, cylinders

BREAST_HEIGHT = 1.3  # published: metres above the ground at which foresters measure stems
TALLEST_TREE = 116.07  # published: metres, Hyperion, the tallest tree known, as measured in 2019
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}  # derived: of the international inch and foot


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
    root : (x, y, z)
        The foot of the stem, from which heights count, in the cloud's units.
    up : str
        The axis that was taken to point up.
    unit : float
        Metres of one unit of the cloud.

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
    up, unit = _upward(skeleton, root) if up is None else up, metres(unit)
    if up not in AXES:
        raise InvalidParameterError(f"up = {up!r}: must be 'x', 'y' or 'z', with a minus where that points down")
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
    for doubt in _doubts(-low / max(high - low, TINY), highest, up, unit):
        warnings.warn(doubt, SkeletonWarning, stacklevel=2)
    breast = np.flatnonzero(stem & (bottom <= BREAST_HEIGHT) & (top >= BREAST_HEIGHT))
    leaving = bottom[(pieces.order == 1) & stem[pieces.parent]]
    crowning = ~stem | (bottom > leaving.min(initial=np.inf))
    crown = unit * np.concatenate([pieces.start_point[crowning], pieces.end_point[crowning]])
    width, area = _extent(np.delete(crown, "xyz".index(up[-1]), axis=1))
    traced = np.where(np.isfinite(pieces.confidence), pieces.volume * (pieces.confidence == 0), np.nan)
    return TreeMeasures(
        height=highest,
        stem_diameter=2 * unit * _radius_at(BREAST_HEIGHT, height, pieces, breast[0]) if len(breast) else np.nan,
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


def _doubts(ground: float, highest: float, up: str, unit: float) -> Iterator[str]:
    """What makes directions and units doubtful: a root above half of the height, and a tree taller than any."""
    if ground > 0.5:
        yield f"the tree grows from {100 * ground:.0f} % of its height along {up}: does {up} point up?"
    if highest > TALLEST_TREE:
        yield (
            f"the tree is {highest:.4g} m high, and none is known above {TALLEST_TREE:.0f} m: is a unit of the cloud "
            f"{unit:g} m? pass unit=, such as 'mm'"
        )


def _radius_at(level: float, height: Callable[[np.ndarray], np.ndarray], pieces: Cylinders, at: int) -> float:
    """Radius of an axis at a height, between the middles of the cylinder there and of those before and after it."""
    near = np.flatnonzero((pieces.parent == at) | (np.arange(len(pieces.radius)) == pieces.parent[at]))
    near = np.append(near[pieces.order[near] == pieces.order[at]], at)
    middle = height((pieces.start_point + pieces.end_point)[near] / 2)
    order = np.argsort(middle)
    return float(np.interp(level, middle[order], pieces.radius[near][order]))


def metres(unit: float | str) -> float:
    """A unit of length in metres, given as that or by its name: ``"mm"`` is 0.001."""
    try:
        value = METRES[unit] if isinstance(unit, str) and unit in METRES else float(unit)
    except (TypeError, ValueError):
        value = np.nan
    if not 0 < value < np.inf:
        raise InvalidParameterError(f"unit = {unit!r}: must be metres, above 0, or one of {', '.join(METRES)}")
    return value


def _upward(skeleton: Any, root: Any) -> str:
    """The axis along which a tree was made to grow: by a root that is one, or by the Refiner that made it."""
    steps = skeleton.report.recipe.get("pipeline", ())
    asked = [root, *(step.get("root") for step in reversed(steps) if isinstance(step, dict))]
    return next((axis for axis in asked if isinstance(axis, str) and axis in AXES), "z")


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
