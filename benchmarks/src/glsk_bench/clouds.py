"""Clouds of a shape as scanners give them, and how much of its axis they show."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d.errors import InvalidParameterError, did_you_mean
from glsk_o3d.geometry.groups import component_labels
from glsk_o3d.geometry.vectors import norm
from glsk_o3d.samples.capsules import checked_generator

from .scanning import MIXED_SHARE, WALL_BEHIND, camera_places, depth_image, lidar_scan, mixed_image, seen_cosines
from .shapes import Shape, Thing
from .shapes.axis import subdivided
from .shapes.curves import direction, generator
from .shapes.drawing import check_seed

__all__ = ["VARIANTS", "cloud", "coverage"]

# Fitted, as all of this page: damage that clouds come with. Lengths are shares of the diagonal.
DENSITY_RATIO = 10  # between both ends of the longest extent
CUTS = 4  # balls cut out
CUT_RADII, WIDEST_CUT = 1.3, 0.15  # their radius, in that of the nearest part, and at most
OUTLIER_SHARE, OUTLIER_MARGIN = 0.01, 0.1  # of the points; and how much larger their box is, on every side
VIEW_SHIFT, VIEW_TURN = 0.005, 0.5  # of the second and third view where they do not fit; the turn in degrees


def cloud(shape: Shape, variant: str, n: int = 4096, seed: int = 0) -> np.ndarray:
    """Draw a cloud of a shape.

    Parameters
    ----------
    shape : Shape
    variant : str
        One of `VARIANTS`: ``clean``, uniform by area; ``density``, ten times denser at one end; ``holes``, four balls
        cut out; ``outliers``, 1 % anywhere in a somewhat larger box, last; ``noise05``, ``noise1``, ``noise2``,
        Gaussian of 0.5, 1 and 2 % of the diagonal; ``scan2``, as two cameras see it; ``depth2``, two depth cameras with
        their noise; ``misreg``, three views that do not fit; ``lidar``, scan lines of three laser scanners;
        ``flying``, two depth cameras before a wall, with mixed pixels at edges.
    n : int
        Number of points, at most a quarter of the shape's `points`: not all of those are seen by scanners.
    seed : int
        Of the cloud, not negative. Where cameras stand and holes are does not depend on `n`.

    Returns
    -------
    (n, 3) float64 array

    Raises
    ------
    InvalidParameterError
        There is no such variant, `n` or `seed` is no whole number of its range, or the shape has too few points for
        so large a cloud.

    Examples
    --------
    >>> from glsk_bench.shapes import shape
    >>> tube = shape("tubes", 0)
    >>> scan = cloud(tube, "scan2", n=1024)
    >>> scan.shape, coverage(tube, scan) > 0.97
    ((1024, 3), True)
    """
    if not isinstance(variant, str) or variant not in DRAWN_FOR:
        raise InvalidParameterError(did_you_mean(str(variant), VARIANTS, "variant of clouds"))
    checked_generator(n, 0, 0)  # refuses a wrong n
    check_seed(seed)
    rng = generator("cloud", shape.name, variant, n, seed)
    look = generator("eyes", shape.name, variant, seed)
    return DRAWN_FOR[variant](shape, n, rng, look)


def _picked(shape, weights, n, rng):
    """Rows of n points, each at most once, with chances in proportion to their weights, in random order."""
    fit = np.flatnonzero(weights > 0)
    if len(fit) < n:
        raise InvalidParameterError(f"{shape.name} has {len(fit)} points for a cloud of {n}: ask for fewer points")
    score = np.log(weights[fit]) + rng.gumbel(size=len(fit))
    return fit[np.argsort(-score, kind="stable")[:n]]  # all in order: a partition differs between processors


def _clean(shape, n, rng, look):
    """Uniform by area."""
    return shape.points[_picked(shape, np.ones(len(shape.points)), n, rng)]


def _density(shape, n, rng, look):
    """Denser from one end of the longest extent to the other."""
    centred = shape.points - shape.points.mean(axis=0)
    longest = np.linalg.svd(centred[::7], full_matrices=False)[2][0]  # a seventh of the points tells it as well
    along = centred @ longest
    return shape.points[_picked(shape, DENSITY_RATIO ** ((along - along.min()) / np.ptp(along)), n, rng)]


def _holes(shape, n, rng, look):
    """Nothing in some balls around points of the surface."""
    kept = np.ones(len(shape.points))
    for middle in shape.points[look.choice(len(shape.points), CUTS, replace=False)]:
        nearest = np.abs(norm(shape.nodes - middle) - shape.radii).argmin()
        kept *= norm(shape.points - middle) > min(CUT_RADII * shape.radii[nearest], WIDEST_CUT)
    return shape.points[_picked(shape, kept, n, rng)]


def _outliers(shape, n, rng, look):
    """The last rows anywhere in a box around the shape."""
    points = _clean(shape, n, rng, look)
    low, size = shape.points.min(axis=0), np.ptp(shape.points, axis=0)
    count = round(OUTLIER_SHARE * n)
    high = low + (1 + OUTLIER_MARGIN) * size
    points[n - count :] = rng.uniform(low - OUTLIER_MARGIN * size, high, (count, 3))
    return points


def _noisy(size, shape, n, rng, look):
    """Every coordinate off by Gaussian noise of this size."""
    points = _clean(shape, n, rng, look)
    return points + rng.normal(0, size, points.shape)


def _scan2(shape, n, rng, look):
    """What two cameras see, denser where they are nearer and look more squarely."""
    weights = np.zeros(len(shape.points))
    for eye in camera_places(look, 2):
        weights += seen_cosines(shape, eye) / norm(shape.points - eye) ** 2
    return shape.points[_picked(shape, weights, n, rng)]


def _misreg(shape, n, rng, look):
    """What three cameras see, each but the first moved and turned a little."""
    views = []
    for eye, count in zip(camera_places(look, 3), _shares(n, 3), strict=True):
        view = shape.points[_picked(shape, seen_cosines(shape, eye), count, rng)]
        turn = Rotation.from_rotvec(np.radians(VIEW_TURN) * direction(look.normal(size=3)))
        shift = VIEW_SHIFT * direction(look.normal(size=3))
        views.append(turn.apply(view) + shift if views else view)
    return np.vstack(views)


def _views(cameras, scan, shape, n, rng, look):
    """As many points of each scanner; scanners without any, where n is tiny, see nothing."""
    places = zip(camera_places(look, cameras), _shares(n, cameras), strict=True)
    return np.vstack([scan(shape, eye, count, rng) for eye, count in places if count])


def _flying(shape, n, rng, look):
    """What two depth cameras see before a wall, each with another share of mixed pixels."""
    views = []
    for eye, count in zip(camera_places(look, 2), _shares(n, 2), strict=True):
        share, wall = look.uniform(*MIXED_SHARE), look.uniform(*WALL_BEHIND)
        views += [mixed_image(shape, eye, count, rng, share, wall)] if count else []
    return np.vstack(views)


def _shares(n, parts):
    """Whole numbers, as equal as can be, that add up to n."""
    return np.diff(np.linspace(0, n, parts + 1).round().astype(int))


DRAWN_FOR: dict[str, Callable] = {
    "clean": _clean,
    "density": _density,
    "holes": _holes,
    "outliers": _outliers,
    "noise05": partial(_noisy, 0.005),
    "noise1": partial(_noisy, 0.01),
    "noise2": partial(_noisy, 0.02),
    "scan2": _scan2,
    "depth2": partial(_views, 2, depth_image),
    "misreg": _misreg,
    "lidar": partial(_views, 3, lidar_scan),
    "flying": _flying,
}
"""The functions that draw, by variant."""
VARIANTS = tuple(DRAWN_FOR)
"""The names of the variants."""


# Fitted, as all of this page: so that what is called shown could be drawn by hand.
NEAREST_PIECES = 48  # of the axis, among which the one is whose surface a point is on
OWN_SURFACE, OWN_NOISE = 0.5, 0.01  # how far a point is from its surface at most: in the radius, and besides
SHOWN_BESIDE, SHOWN_LENGTH = 0.75, 0.5  # how far along the axis a point shows it: in the radius, and in the piece
EVERY = 12  # which points of the whole surface are asked: as many as a cloud of 4096 has, about
LONG_GAP = 2  # a stretch that shows nothing and is longer than so many radii is a gap
COVERAGE_WITH_GAP = 0.96  # at most, where there is a gap
NEAREST_THING_PIECES = 24  # of the axis of a thing, among which the one is nearest whose surface a point is on
SHOWN_AROUND = 0.05  # how near a point of the surface of a thing is to one that shows it, at most


def coverage(shape: Shape, points: np.ndarray) -> float:
    """Share of the axis that a cloud shows, relative to the whole surface.

    A piece of the axis is shown by a point on its own surface, not on that of another part nearby. The surface of a
    `Thing` belongs to the piece that is nearest in its half widths. If a stretch of more than two radii is not shown,
    the share is 0.96 at most. Below 0.97 the true axis cannot be asked for.

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
    nodes, edges, radii = subdivided(shape.nodes, shape.edges, shape.radii)
    start, end = edges.T
    middle, radius, length = nodes[edges].mean(axis=1), radii[edges].mean(axis=1), norm(nodes[start] - nodes[end])
    own = _thing_pieces if isinstance(shape, Thing) else _cone_pieces
    of_surface, of_cloud = own(shape, middle, radius, points)
    whole = _shown(middle, radius, length, of_surface)
    missed = whole & ~_shown(middle, radius, length, of_cloud)
    share = 1 - length[missed].sum() / length[whole].sum()
    if missed.any():
        stretch = component_labels(len(nodes), edges[missed])[start[missed]]
        if np.bincount(stretch, (length / radius)[missed]).max() > LONG_GAP:
            share = min(share, COVERAGE_WITH_GAP)
    return float(share)


def _cone_pieces(shape, middle, radius, points):
    """The pieces of the axis on whose own surface points are: those of the whole surface, and some others."""
    return _nearest_surface(middle, radius, shape.points[::EVERY]), _nearest_surface(middle, radius, points)


def _nearest_surface(middle, radius, points):
    """The pieces of which the surface is the nearest to a point, and near."""
    distance, near = cKDTree(middle).query(points, np.arange(1, min(NEAREST_PIECES, len(middle)) + 1))
    off = np.abs(distance - radius[near])
    own = near[np.arange(len(points)), off.argmin(axis=1)]
    return own[off.min(axis=1) < OWN_SURFACE * radius[own] + OWN_NOISE]


def _thing_pieces(shape, middle, radius, points):
    """The pieces of the axis that points of the whole surface are nearest to, and those that some others are, which are
    told by the nearest of these.
    """
    surface, wide = shape.points[::EVERY], shape.half_width[cKDTree(shape.nodes).query(middle)[1]]
    distance, near = cKDTree(middle).query(surface, np.arange(1, min(NEAREST_THING_PIECES, len(middle)) + 1))
    own = near[np.arange(len(surface)), (distance / wide[near]).argmin(axis=1)]
    distance, nearest = cKDTree(surface).query(points, distance_upper_bound=SHOWN_AROUND)
    return own, own[nearest[np.isfinite(distance)]]


def _shown(middle, radius, length, pieces):
    """Beside which pieces of the axis there is one of some pieces that a point shows: (pieces,) bool array."""
    found = np.unique(pieces)
    if len(found) == 0:
        return np.zeros(len(middle), bool)
    return cKDTree(middle[found]).query(middle)[0] < SHOWN_BESIDE * radius + SHOWN_LENGTH * length
