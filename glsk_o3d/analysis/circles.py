"""Circles through points in a plane, of which up to half may be anywhere."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..geometry.vectors import TINY

TRIPLES = 500  # derived: with half of the points outliers 99.9 % of the draws have fifty triples that are on the circle
SCORED_POINTS = 1000  # speed: points that rank the triples
OUTLIER_DEVIATIONS = 3.0  # published: standard deviations beyond which residuals do not count
LEAST_DEVIATION = 0.02  # fitted: of residuals, over the radius: bark, oval stems
COVERED_DEGREES, COVERED_GAPS = 20.0, 6.0  # fitted: a gap is covered up to so many degrees, or median gaps
LEAST_ARC_SHARE = 0.1  # fitted: of the points, on an arc between open gaps; fewer may be undergrowth
WAVINESS = 0.01  # fitted: of a section, over its radius: bark and ovals, of which more points know no more
MOST_PASSES = 20  # derived: the points that count are the same after a few


class CircleFit(NamedTuple):
    """A circle, in the units of its points."""

    radius: float
    arc: float  # degrees with points
    points: int  # number of those that count
    error: float  # standard deviation of the radius, over the radius


def fit_circle(points: np.ndarray) -> CircleFit | None:
    """Fit a circle to points (n, 3 or more) in a plane, (n, 2), of which up to half may be anywhere.

    The start is the circle through three points from which the median distance of all is least (least median of
    squares, Rousseeuw 1984), of many triples drawn. From there the sum of the squared distances is minimised
    (Levenberg-Marquardt) over the points no farther than three standard deviations, until these stay the same. A few
    points on another side do not count, where they would weigh most. None if there are fewer than four on a circle.
    The error is that of least squares (Gauss 1823), for the noise of independent points and for waves of the section,
    which count as one point's.
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
    n, radius, jacobian = int(counted.sum()), abs(float(circle[2])), _jacobian(circle, p[counted])
    # of the radius, for distances of variance 1; rounding can make it negative
    variance = max(float(np.linalg.pinv(jacobian.T @ jacobian)[2, 2]), 0.0)
    noise = float((_residuals(circle, p[counted]) ** 2).sum()) / (n - 3) / radius**2
    return CircleFit(radius, float(gaps[covered].sum()), n, float(np.sqrt(variance * (noise + n * WAVINESS**2))))


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
