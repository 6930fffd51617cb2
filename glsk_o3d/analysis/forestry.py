"""Forest measures of a tree: height, stem, volume by order; and doubts about them."""

import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..data.skeleton import Skeleton
from ..errors import SkeletonWarning
from ..geometry.neighbourhoods import plane_axes
from ..geometry.vectors import TINY, along_axis, norm
from ..geometry.vectors import unit as unit_vectors
from ..parameters import check_number
from .trees import Cylinders, cylinders, ground_height, points_near, up_axis

BREAST_HEIGHT = 1.3  # published: metres above the ground at which foresters measure stems
TALLEST_TREE = 116.07  # published: metres, Hyperion, the tallest tree known, as measured in 2019
SLICE = 0.1  # published: metres; the slice of a stem that its diameter is fitted to is from 5 cm below to 5 cm above
STEM_SPAN = 0.5  # fitted: metres up and down, over which the stem has its direction there
FEWEST_ON_CIRCLE = 12  # fitted: on a circle, of which fewer may be anything
LEAST_ARC = 60.0  # derived: degrees of a circle; a chord of less leaves the surface by an eighth of the radius
FORM_FACTOR = 2.0  # derived: wood over a cylinder as thick as at 1.3 m and as high as the tree; branches as thick as
# the trunk together (Leonardo) that reach to the top fill one, and their bends and the foot do not double that
TRIPLES = 500  # derived: with half of the points outliers 99.9 % of the draws have fifty triples that are on the circle
SCORED_POINTS = 1000  # speed: points that rank the triples
OUTLIER_DEVIATIONS = 3.0  # published: standard deviations beyond which residuals do not count
LEAST_DEVIATION = 0.02  # fitted: of residuals, over the radius: bark, oval stems
COVERED_DEGREES, COVERED_GAPS = 20.0, 6.0  # fitted: a gap is covered up to so many degrees, or median gaps
LEAST_ARC_SHARE = 0.1  # fitted: of the points, on an arc between open gaps; fewer may be undergrowth
MOST_PASSES = 20  # derived: the points that count are the same after a few


class CircleFit(NamedTuple):
    """A circle, in the units of its points."""

    radius: float
    arc: float  # degrees with points
    points: int  # number of those that count


UNKNOWN = CircleFit(np.nan, np.nan, 0)


@dataclass(frozen=True)
class TreeMeasures:
    """A tree in numbers. Lengths are in metres, volumes in cubic metres.

    Attributes
    ----------
    height : float
        Of the highest point above the foot of the stem, without points farther than three radii from the curve.
    stem_diameter, stem_arc : float
        Of the circle through the points of the stem in a slice of 10 cm across it, 1.3 m above the foot; degrees of it
        with points. NaN without such a circle.
    crown_base : float
        Height at which the lowest branch leaves the stem; NaN without one.
    length, volume : tuple of float
        Length of the axes and volume of each order, the stem first; see `Cylinders`. The volume is that of parts with a
        surface: confidence above 0, or unknown.
    traced : float
        Share of the length with confidence 0: twigs without a surface, leaves, noisy parts. NaN if confidences are
        unknown.
    root, up, unit : (x, y, z), str, float
        The foot of the stem in the cloud's units, the axis that points up, and the metres of one unit.
    doubts : tuple of str
        The warnings about implausible results.
    """

    height: float
    stem_diameter: float
    stem_arc: float
    crown_base: float
    length: tuple[float, ...]
    volume: tuple[float, ...]
    traced: float
    root: tuple[float, float, float]
    up: str
    unit: float
    doubts: tuple[str, ...]


def tree_measures(skeleton: Any, root: Any = None, *, up: str | None = None, unit: float = 1.0) -> TreeMeasures:
    """Measure a tree as foresters do.

    Parameters
    ----------
    skeleton : Skeleton
        One tree, as from `glsk_o3d.pipelines.tree`.
    root : str, int or (x, y, z), optional
        See `cylinders`.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Axis that points up. By default that of `root` here or in the pipeline `tree`, or else ``"z"``.
    unit : float
        One unit of the cloud, in metres: 0.001 for millimetres.

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
        The root is in the upper half of the tree, the tree is taller than any known one or has too much wood for its
        size, or the diameter at 1.3 m is unknown.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> stem = pipelines.tree("x")(tube(2000, length=2, radius=0.1).points)
    >>> abs(tree_measures(stem).stem_diameter - 0.2) < 0.01  # up is x, as in the pipeline
    True
    """
    up, skeleton = up_axis(skeleton, root, up), skeleton.whole
    check_number("unit", unit, low=0, open_low=True)
    pieces = cylinders(skeleton, root, up)
    foot, near = pieces.start_point[0], points_near(skeleton)
    ground = ground_height(skeleton.points[near], foot, pieces.end_point[0], float(pieces.radius[0]), up)

    def height(places: np.ndarray) -> np.ndarray:
        return unit * (along_axis(places, up) - ground)

    stem = pieces.order == 0
    bottom, top = height(pieces.start_point), height(pieces.end_point)
    low, high = min(bottom.min(), top.min()), max(bottom.max(), top.max())
    highest = float(height(skeleton.points[near]).max() if len(near) else high)
    branch_heights = bottom[(pieces.order == 1) & stem[pieces.parent]]
    traced = pieces.confidence == 0  # unknown is not
    length, volume = unit * pieces.length, unit**3 * np.where(traced, 0, pieces.volume)
    known = 1.0 if np.isfinite(pieces.confidence).all() else np.nan
    section, problem = _stem_section(skeleton, pieces, bottom, top, near, unit)
    doubts = _doubts(-low / max(high - low, TINY), highest, section, problem, float(volume.sum()), up, unit)
    for doubt in doubts:
        warnings.warn(doubt, SkeletonWarning, stacklevel=2)
    return TreeMeasures(
        height=highest,
        stem_diameter=2 * section.radius,
        stem_arc=section.arc,
        crown_base=float(branch_heights.min()) if len(branch_heights) else np.nan,
        length=tuple(np.bincount(pieces.order, length).tolist()),
        volume=tuple(np.bincount(pieces.order, volume).tolist()),
        traced=known * float(pieces.length[traced].sum() / max(pieces.length.sum(), TINY)),
        root=tuple(foot.tolist()),
        up=up,
        unit=unit,
        doubts=doubts,
    )


def _stem_section(
    skeleton: Skeleton, pieces: Cylinders, bottom: np.ndarray, top: np.ndarray, near: np.ndarray, unit: float
) -> tuple[CircleFit, str]:
    """The circle around the stem 1.3 m above the foot, in metres; or an unknown one, and the reason.

    The heights of both ends of the cylinders, `bottom` and `top` (K,), are in metres; `near` has rows of the points.
    """
    stem = pieces.order == 0
    across = stem & (bottom <= BREAST_HEIGHT) & (top >= BREAST_HEIGHT)
    if not across.any():
        return UNKNOWN, f"the stem does not pass {BREAST_HEIGHT} m above its foot"
    row, step = int(across.argmax()), pieces.end_point - pieces.start_point
    place = pieces.start_point[row] + (BREAST_HEIGHT - bottom[row]) / max(top[row] - bottom[row], TINY) * step[row]
    around = stem & (unit * norm((pieces.start_point + pieces.end_point) / 2 - place) <= STEM_SPAN)
    around[row] = True
    direction = unit_vectors(step[around].sum(axis=0, keepdims=True))
    vertices = np.concatenate([skeleton.branches[row] for row in np.unique(pieces.branch[stem])])
    offset = unit * (skeleton.points[near[np.isin(skeleton.vertex_of_point[near], vertices)]] - place)
    offset = offset[np.abs(offset @ direction[0]) <= SLICE / 2]
    fit = fit_circle(offset @ plane_axes(direction)[0])
    if len(skeleton.points) == 0:
        return UNKNOWN, "the skeleton has no points: .json and .npz files keep them"
    if fit is None or fit.points < max(FEWEST_ON_CIRCLE, len(offset) / 2):
        count = f"{0 if fit is None else fit.points} of {len(offset)} points of the stem are on a circle"
        return UNKNOWN, f"in a slice of {100 * SLICE:g} cm {count}, and half must be, at least {FEWEST_ON_CIRCLE}"
    if fit.arc < LEAST_ARC:
        return UNKNOWN, f"points show {fit.arc:.0f} degrees of it, and at least {LEAST_ARC:.0f} are needed"
    return fit, ""


def _doubts(
    ground: float, highest: float, section: CircleFit, problem: str, volume: float, up: str, unit: float
) -> tuple[str, ...]:
    """Implausible results of a tree, in words; `ground` is the place of its foot, as a share of its height."""
    doubts = []
    if ground > 0.5:
        doubts.append(f"the tree grows from {100 * ground:.0f} % of its height along {up}: does {up} point up?")
    if highest > TALLEST_TREE:
        doubts.append(
            f"the tree is {highest:.4g} m high, and none is known above {TALLEST_TREE:.0f} m: is a unit of the cloud "
            f"{unit:g} m? give its metres, such as 0.001"
        )
    if problem and highest > BREAST_HEIGHT:
        doubts.append(f"the diameter of the stem at {BREAST_HEIGHT} m is not known: {problem}")
    share = volume / (np.pi * section.radius**2 * highest)
    if share > FORM_FACTOR:
        thick = f"{200 * section.radius:.3g} cm thick, as at {BREAST_HEIGHT} m"
        doubts.append(
            f"the tree has {volume:.3g} m3 of wood, {share:.2g} times a cylinder as high and {thick}; more than "
            f"{FORM_FACTOR:g} is hardly one tree: are leaves, undergrowth or others in it, does it fork below, or does "
            f"{up} not point up?"
        )
    return tuple(doubts)


def fit_circle(points: np.ndarray) -> CircleFit | None:
    """Fit a circle to points (n, 3 or more) in a plane, (n, 2), of which up to half may be anywhere.

    The start is the circle through three points from which the median distance of all is least (least median of
    squares, Rousseeuw 1984), of many triples drawn. From there the sum of the squared distances is minimised
    (Levenberg-Marquardt) over the points no farther than three standard deviations, until these stay the same. A few
    points on another side do not count, where they would weigh most. None if there are fewer than four on a circle.
    """
    p = points - np.median(points, axis=0) if len(points) else points
    circle, counted = _circle_through_triple(p), np.zeros(len(p), bool)
    if circle is None:
        return None
    for _ in range(MOST_PASSES):
        residual = _residuals(circle, p)
        # 1.4826 median absolute deviations are a standard deviation
        deviation = 1.4826 * float(np.median(np.abs(residual[counted] if counted.any() else residual)))
        limit = OUTLIER_DEVIATIONS * max(deviation, LEAST_DEVIATION * circle[2])
        before, counted = counted, np.abs(residual) <= limit
        counted[counted] = _on_long_arcs(circle, p[counted])
        if counted.sum() < 4:
            return None
        if (counted == before).all():
            break
        circle = least_squares(_residuals, circle, _jacobian, method="lm", args=(p[counted],)).x
    _, gaps, covered = _around(circle, p[counted])
    return CircleFit(abs(float(circle[2])), float(gaps[covered].sum()), int(counted.sum()))


def _circle_through_triple(p: np.ndarray) -> np.ndarray | None:
    """Centre and radius, (3,), of the circle through three points with the least median distance of all points."""
    if len(p) < 4:
        return None
    rng = np.random.default_rng(0)
    corners = p[rng.integers(len(p), size=(TRIPLES, 3))]
    sides = corners[:, 1:] - corners[:, :1]
    usable = np.abs(np.linalg.det(sides)) > 1e-9 * (sides**2).sum(axis=(1, 2))
    if not usable.any():
        return None
    corners, sides = corners[usable], sides[usable]
    offset = np.linalg.solve(2 * sides, (sides**2).sum(axis=2)[:, :, None])[:, :, 0]
    centre, radius = corners[:, 0] + offset, np.linalg.norm(offset, axis=1)
    scored = p[rng.permutation(len(p))[:SCORED_POINTS]]
    score = np.median(np.abs(np.linalg.norm(scored - centre[:, None], axis=2) - radius[:, None]), axis=1)
    best = score.argmin()
    return np.append(centre[best], radius[best])


def _on_long_arcs(circle: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Which points lie on arcs with a fair share of all points, (n,) bool array; arcs end at gaps."""
    if len(p) == 0:
        return np.zeros(0, bool)
    order, _, covered = _around(circle, p)
    arc = np.append(0, np.cumsum(~covered)[:-1])
    arc[arc == arc[-1]] *= not covered[-1]  # the last arc goes on in the first
    fair = np.ones(len(p), bool)
    fair[order] = np.bincount(arc)[arc] >= LEAST_ARC_SHARE * len(p)
    return fair


def _residuals(circle: np.ndarray, p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p - circle[:2], axis=1) - circle[2]


def _jacobian(circle: np.ndarray, p: np.ndarray) -> np.ndarray:
    offset = circle[:2] - p
    return np.column_stack([offset / np.maximum(np.linalg.norm(offset, axis=1), TINY)[:, None], np.full(len(p), -1.0)])


def _around(circle: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points in their order around a circle, the degrees to the next one, and whether these count as covered."""
    angle = np.degrees(np.arctan2(*(p - circle[:2]).T))
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle.min() + 360)
    return order, gaps, gaps <= max(COVERED_DEGREES, COVERED_GAPS * float(np.median(gaps)))
