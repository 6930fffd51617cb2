"""A circle through points of which some do not lie on it."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..numerics.vectors import TINY

TRIPLES = 500  # derived: with half of the points astray 99.9 % of the draws have fifty triples that are on the circle
SCORED = 1000  # speed: points that judge the triples
OUTLYING = 3.0  # published: standard deviations beyond which residuals do not count
ROUND = 0.02  # fitted: standard deviation over the radius, at least, by which residuals are judged: bark, oval stems
SEEN_GAP = 20.0, 6.0  # fitted: a gap between points is seen, too, up to so many degrees, or of the median gaps
FEW = 0.1  # fitted: of the points, on a side apart from others, where they may be undergrowth
PASSES = 20  # derived: the points that count have settled after a few


class CircleFit(NamedTuple):
    """A circle, in the units of its points."""

    radius: float
    arc: float  # degrees in which points are
    points: int  # how many count


def fit_circle(points: np.ndarray) -> CircleFit | None:
    """Fit a circle to points (n, 3 or more) in a plane, (n, 2), of which up to half may be anywhere.

    The start is the circle through three points from which the median distance of all is least (least median of
    squares, Rousseeuw 1984), of many triples drawn. From there the sum of the squared distances is minimised
    (Levenberg-Marquardt) over the points no farther than three standard deviations, until these stay the same. A few
    points on another side do not count, where they would weigh most. None if there are fewer than four on a circle.
    """
    if len(points) < 4:
        return None
    rng, p = np.random.default_rng(0), points - np.median(points, axis=0)
    corners = p[rng.integers(len(p), size=(TRIPLES, 3))]
    sides = corners[:, 1:] - corners[:, :1]
    usable = np.abs(np.linalg.det(sides)) > 1e-9 * (sides**2).sum(axis=(1, 2))
    if not usable.any():
        return None
    corners, sides = corners[usable], sides[usable]
    middle = np.linalg.solve(2 * sides, (sides**2).sum(axis=2)[:, :, None])[:, :, 0]
    centre, radius = corners[:, 0] + middle, np.linalg.norm(middle, axis=1)
    some = p[rng.permutation(len(p))[:SCORED]]
    away = np.median(np.abs(np.linalg.norm(some - centre[:, None], axis=2) - radius[:, None]), axis=1)
    best = away.argmin()
    circle, on = np.append(centre[best], radius[best]), np.zeros(len(p), bool)
    for _ in range(PASSES):
        residual = _residuals(circle, p)
        # 1.4826 median absolute deviations are a standard deviation
        scale = max(1.4826 * float(np.median(np.abs(residual[on] if on.any() else residual))), ROUND * circle[2])
        before, on = on, np.abs(residual) <= OUTLYING * scale
        if not on.any():
            return None
        order, _, seen = _around(circle, p[on])
        side = np.append(0, np.cumsum(~seen)[:-1])
        side[side == side[-1]] *= not seen[-1]  # the last goes on in the first
        on[np.flatnonzero(on)[order[np.bincount(side)[side] < FEW * len(side)]]] = False
        if on.sum() < 4:
            return None
        if (on == before).all():
            break
        circle = least_squares(_residuals, circle, _jacobian, method="lm", args=(p[on],)).x
    _, gaps, seen = _around(circle, p[on])
    return CircleFit(abs(float(circle[2])), float(gaps[seen].sum()), int(on.sum()))


def _residuals(circle: np.ndarray, p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p - circle[:2], axis=1) - circle[2]


def _jacobian(circle: np.ndarray, p: np.ndarray) -> np.ndarray:
    offset = circle[:2] - p
    return np.column_stack([offset / np.maximum(np.linalg.norm(offset, axis=1), TINY)[:, None], np.full(len(p), -1.0)])


def _around(circle: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points in their order around a circle, the degrees to the next of each, and whether these count as seen."""
    angle = np.degrees(np.arctan2(*(p - circle[:2]).T))
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle.min() + 360)
    return order, gaps, gaps <= max(SEEN_GAP[0], SEEN_GAP[1] * float(np.median(gaps)))
