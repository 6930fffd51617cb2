"""How much of a shape's axis a cloud shows."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.numerics.groups import component_labels
from glsk_o3d.numerics.vectors import norm

from .shapes import Shape
from .shapes.paths import FINE_STEP, subdivided

# Fitted, as all of this page: so that what is called shown could be drawn by hand.
NEAREST_PIECES = 48  # of the axis, among which the one is whose surface a point is on
OWN_SURFACE, OWN_NOISE = 0.5, 0.01  # how far a point is from its surface at most: in the radius, and besides
SHOWN_BESIDE, SHOWN_LENGTH = 0.75, 0.5  # how far along the axis a point shows it: in the radius, and in the piece
EVERY = 12  # which points of the whole surface are asked: as many as a cloud of 4096 has, about
LONG_GAP = 2  # a stretch that shows nothing and is longer than so many radii is a gap
COVERAGE_WITH_GAP = 0.96  # at most, where there is a gap


def coverage(shape: Shape, points: np.ndarray) -> float:
    """Share of the axis that a cloud shows, of what the whole surface shows.

    A piece of the axis is shown if a point lies on its own surface, not on that of another part nearby. Where a stretch
    of more than two radii is not shown, the share is 0.96 at most. Below 0.97 nobody can be asked for the true axis.

    Parameters
    ----------
    shape : Shape
    points : (n, 3) float array
        A cloud of it.

    Returns
    -------
    float
        From 0 to 1.

    Raises
    ------
    InvalidParameterError
        The cloud is no (n, 3) array of finite numbers, or empty.

    Examples
    --------
    >>> from glsk_bench.shapes import shape
    >>> tube = shape("tubes", 0)
    >>> coverage(tube, tube.points)
    1.0
    """
    points = np.asarray(points, float)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0 or not np.isfinite(points).all():
        raise InvalidParameterError("points must be an (n, 3) array of finite numbers, and not empty")
    nodes, edges, radii = subdivided(shape.nodes, shape.edges, shape.radii, FINE_STEP)
    start, end = edges.T
    middle, radius, length = nodes[edges].mean(axis=1), radii[edges].mean(axis=1), norm(nodes[start] - nodes[end])
    whole = _shown(middle, radius, length, shape.points[::EVERY])
    missed = whole & ~_shown(middle, radius, length, points)
    share = 1 - length[missed].sum() / length[whole].sum()
    if missed.any():
        stretch = component_labels(len(nodes), edges[missed])[start[missed]]
        if np.bincount(stretch, (length / radius)[missed]).max() > LONG_GAP:
            share = min(share, COVERAGE_WITH_GAP)
    return float(share)


def _shown(middle, radius, length, points):
    """Beside which pieces of the axis there is a point of their own surface: (pieces,) bool array."""
    distance, near = cKDTree(middle).query(points, np.arange(1, min(NEAREST_PIECES, len(middle)) + 1))
    off = np.abs(distance - radius[near])
    own = near[np.arange(len(points)), off.argmin(axis=1)]
    found = np.unique(own[off.min(axis=1) < OWN_SURFACE * radius[own] + OWN_NOISE])
    if len(found) == 0:
        return np.zeros(len(middle), bool)
    return cKDTree(middle[found]).query(middle)[0] < SHOWN_BESIDE * radius + SHOWN_LENGTH * length
