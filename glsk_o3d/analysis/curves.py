"""Curves as arrays of edges, as places along these, and how they bend."""

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidParameterError
from ..numerics.polylines import arc_lengths
from ..numerics.vectors import TINY, norm
from ..parameters import check_number
from ..skeleton import Skeleton

MOST_ON_A_CURVE = 10**7  # derived: on a curve; the arrays of so many take a gigabyte


def pieces(nodes, edges, step):
    """Edges cut into equal pieces no longer than `step`: the edge of each piece, and how far along it its middle is.

    Without edges every node stands for itself; `along` knows.
    """
    if len(edges) == 0:
        return np.arange(len(nodes)), np.zeros(len(nodes))
    length = norm(nodes[edges[:, 1]] - nodes[edges[:, 0]])
    check_places(length, step)
    count = np.maximum(np.ceil(length / step).astype(int), 1)
    row = np.repeat(np.arange(len(edges)), count)
    before = np.repeat(np.cumsum(count) - count, count)
    return row, (np.arange(len(row)) - before + 0.5) / count[row]


def check_places(length, step):
    """Raise InvalidParameterError where curves are so long that places on them, `step` apart, would fill the memory."""
    with np.errstate(all="ignore"):
        places = np.sum(length / step)
    if not places <= MOST_ON_A_CURVE:
        far = f"{np.sum(length):.3g} long, too long for places {np.min(step):.3g} apart on it"
        raise InvalidParameterError(f"the skeleton is {far}: are all its coordinates and radii right?")


def along(edges, row, part, values):
    """Values at the nodes, interpolated to the middles of the pieces."""
    if len(edges) == 0:
        return values[row]
    start, end = values[edges[row]].swapaxes(0, 1)
    return start + (end - start) * part.reshape(-1, *[1] * (values.ndim - 1))


def distances(curve, other, step):
    """From places along a curve to the nearest places along another, and the mean of the two radii there.

    Two (n,) float arrays; the places are `step` apart, and the radius is at least that.
    """
    (_, here, radius), (_, there, radius_there) = (places_along(skeleton, step) for skeleton in (curve, other))
    distance, nearest = cKDTree(there).query(here)
    return distance, np.maximum((radius + radius_there[nearest]) / 2, step)


def places_along(skeleton, step):
    """Places along a skeleton, at most `step` apart: the edge of each, (n,), where it is, (n, 3), and its radius, (n,).

    Without edges these are the vertices.
    """
    row, part = pieces(skeleton.vertices, skeleton.edges, step)
    place, radius = (along(skeleton.edges, row, part, values) for values in (skeleton.vertices, skeleton.radii))
    return row, place, radius


def check_graph(vertices, edges, name):
    """Edges as an (E, 2) int64 array; an InvalidParameterError says why `name`, as it calls the graph, is none."""
    edges = np.asarray(edges)
    edges = edges if edges.size else np.empty((0, 2), np.int64)
    if len(vertices) == 0:
        raise InvalidParameterError(f"the {name} is empty")
    if not np.isfinite(vertices).all():
        raise InvalidParameterError(f"the {name} has coordinates that are not finite")
    if edges.ndim != 2 or edges.shape[1] != 2 or edges.dtype.kind not in "iu":
        raise InvalidParameterError(f"the {name}'s edges must be an (E, 2) array of whole numbers")
    if edges.size and (edges.min() < 0 or edges.max() >= len(vertices)):
        raise InvalidParameterError(f"an edge of the {name} names a missing vertex")
    return edges.astype(np.int64)


def simple_edges(edges):
    """Edges, (E, 2) int array, as pairs i < j, sorted, each once, and none from a node to itself."""
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    return edges[edges[:, 0] != edges[:, 1]]


# All fitted, on circles, helices and skeletons of sampled clouds.
POLYNOMIAL_DEGREE = 4  # of the local polynomials: with an odd one less the second derivative of a bend is too small
MIN_WINDOW_VERTICES = 7  # vertices in a window, where the branch has as many
WINDOW_RADII = 5.0  # half the window, in median radii of the branch
STRAIGHT_ANGLE = 0.1  # radians turned over half a window below which a curve has no osculating plane to speak of


def curvature_torsion(skeleton: Skeleton, window: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Curvature and torsion of a skeleton's branches, as curves in space.

    Around every vertex a polynomial of fourth degree is fitted to the branch by weighted least squares, in arc length
    over a window; the Frenet formulas give curvature ``|r' x r''| / |r'|^3`` and torsion
    ``(r' x r'') . r''' / |r' x r''|^2``. Closed branches are treated as closed. Nearer to an open end than a quarter of
    the window, the values are those a quarter of the window away from it, because one-sided fits are inexact. Errors:
    docs/branches.md.

    Parameters
    ----------
    skeleton : Skeleton
    window : float, optional
        Half the length of the window, in the cloud's units; by default five median radii of the branch, or a quarter of
        its length where radii are unknown. A longer window smooths tighter bends and is more exact elsewhere. It always
        has at least seven vertices.

    Returns
    -------
    curvature, torsion : (M,) float arrays
        Per vertex, in 1 / the cloud's unit. Curvature is not negative; torsion is positive on a right-handed screw.
        Both are NaN at junctions and at vertices without edges; torsion also where the curve turns less than 0.1
        radians over half a window, and on curves with fewer than four vertices.

    Raises
    ------
    InvalidParameterError
        The window is not positive.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> curvature, torsion = curvature_torsion(skeletonize(torus(2000).points))
    >>> bool(abs(np.median(curvature) - 1 / 0.4) < 0.1)  # the axis is a circle of radius 0.4
    True
    """
    check_number("window", window, "float?", low=0, open_low=True)
    curvature, torsion = np.full((2, len(skeleton.vertices)), np.nan)
    for path in skeleton.branches:
        half = window or WINDOW_RADII * float(np.median(skeleton.radii[path]))
        curve = skeleton.vertices[path]
        closed = path[0] == path[-1] and skeleton.degree[path[0]] == 2
        curvature[path], torsion[path] = bend(curve, half if np.isfinite(half) and half > 0 else None, closed)
    curvature[skeleton.junctions] = torsion[skeleton.junctions] = np.nan
    return curvature, torsion


@np.errstate(all="ignore")
def bend(curve, half=None, closed=False):
    """Curvature and torsion, (n,) float arrays, of one curve, (n, 3) float array of two points or more.

    The last point of a closed curve is its first one again. `half` the window is by default a quarter of the length.
    """
    n = len(curve)
    along = arc_lengths(curve)
    unit = along[-1]
    if not (np.isfinite(unit) and unit > 0):
        return np.full((2, n), np.nan)
    curve, along, length = (curve - curve[0]) / unit, along / unit, 1.0
    half = min(half / unit if half else length / 4, length / 2)
    if closed:
        centre = along
        curve = np.concatenate([curve[:-1], curve[:-1], curve])
        along = np.concatenate([along[:-1] - length, along[:-1], along + length])
    else:
        centre = np.clip(along, half / 2, length - half / 2)
    least = min(MIN_WINDOW_VERTICES, len(along))
    reach = np.maximum(max(half, TINY), 1.001 * cKDTree(along[:, None]).query(centre[:, None], [least])[0][:, 0])
    first, last = np.searchsorted(along, centre - reach), np.searchsorted(along, centre + reach, side="right")
    row = first[:, None] + np.arange((last - first).max())
    inside = row < last[:, None]
    row = np.minimum(row, len(along) - 1)
    u = np.where(
        inside, (along[row] - centre[:, None]) / reach[:, None], 0
    )  # others may be so far that powers overflow
    weight = np.where(inside, np.maximum(1 - np.abs(u), 0) ** 1.5 + 1e-3, 0)[:, :, None]
    powers = u[:, :, None] ** np.arange(min(POLYNOMIAL_DEGREE, least - 1) + 1)
    local = curve[row] - curve[row].mean(axis=1, keepdims=True)
    fit = np.zeros((n, POLYNOMIAL_DEGREE + 1, 3))
    seen = (weight**2 * powers).transpose(0, 2, 1)
    fit[:, : powers.shape[2]] = np.linalg.pinv(seen @ powers, hermitian=True) @ (seen @ local)
    scale = reach[:, None]
    velocity, acceleration, jerk = fit[:, 1] / scale, 2 * fit[:, 2] / scale**2, 6 * fit[:, 3] / scale**3
    normal = np.cross(velocity, acceleration)
    size, speed = norm(normal), norm(velocity)
    curvature = np.divide(size, speed**3, out=np.full(n, np.nan), where=speed > 0)
    planar = (curvature * reach > STRAIGHT_ANGLE) & (least > 3)
    torsion = np.divide((normal * jerk).sum(axis=1), size**2, out=np.full(n, np.nan), where=planar)
    return curvature / unit, torsion / unit
