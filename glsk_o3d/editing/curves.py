"""Edits of the curve: other vertices on it, and another place in space."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..analysis.curves import check_places
from ..curve.resampling import resampled, smoothed
from ..data.decisions import Place
from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..parameters import check_number, shown
from .graph import with_all_points

SIMILARITY = 1e-6  # precision: a matrix in single precision is one


@with_all_points
def resample(skeleton: Skeleton, *, spacing: float) -> Skeleton:
    """The same curve through vertices at equal distances along each branch.

    Parameters
    ----------
    skeleton : Skeleton
    spacing : float
        In the cloud's units; on each branch as near to it as a whole number of steps.

    Returns
    -------
    Skeleton
        Ends, junctions and the root of a tree stay, and loops keep at least three vertices. What is known of vertices
        is interpolated; every point belongs to the vertex nearest to its place along the curve.

    Raises
    ------
    InvalidParameterError
        The spacing is not above 0, or so small that the vertices would fill the memory.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> ring = resample(skeletonize(samples.torus(2000).points), spacing=0.1)
    >>> len(ring.vertices), ring.n_loops
    (25, 1)
    """
    check_number("spacing", spacing, low=0, open_low=True)
    check_places(skeleton.edge_lengths, spacing)
    return resampled(skeleton, spacing)


@with_all_points
def smooth(skeleton: Skeleton, *, length: float) -> Skeleton:
    """The same graph with branches that are cubic smoothing splines of their vertices (Reinsch 1967).

    Parameters
    ----------
    skeleton : Skeleton
    length : float
        In the cloud's units: waves of this length keep half their height, those of half the length a 17th, and those
        twice as long 94 %. Ends and junctions stay, and branches with fewer than five vertices.

    Returns
    -------
    Skeleton

    Raises
    ------
    InvalidParameterError
        The length is not above 0.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> ring = skeletonize(samples.torus(2000).points)
    >>> smoother = smooth(ring, length=0.5)
    >>> bool(smoother.curvature.std() < 0.1 * ring.curvature.std())
    True
    """
    check_number("length", length, low=0, open_low=True)
    return smoothed(skeleton, length)


@with_all_points
def transform(skeleton: Skeleton, matrix: Any) -> Skeleton:
    """Move, turn and scale a skeleton with its points, as Open3D's ``transform`` does geometry.

    Parameters
    ----------
    skeleton : Skeleton
    matrix : (4, 4) array_like
        A rigid motion, which may mirror, times one scale.

    Returns
    -------
    Skeleton
        Lengths are scaled, and the places in its report move, too.

    Raises
    ------
    InvalidParameterError
        The matrix is none of a similarity.

    Examples
    --------
    >>> import numpy as np
    >>> from glsk_o3d import samples, skeletonize
    >>> ring = skeletonize(samples.torus(1000).points)
    >>> bool(np.isclose(transform(ring, np.diag([2, 2, 2, 1])).length, 2 * ring.length))
    True
    """
    linear, offset, scale = _similarity(matrix)
    report = skeleton.report

    def moved(places: Any) -> np.ndarray:
        return np.asarray(places, float).reshape(-1, 3) @ linear.T + offset

    def place(of: Place) -> Place:
        x, y, z = moved(of)[0].tolist()
        return x, y, z

    def moved_or_none(of: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(moved(of)[0].tolist()) if of else ()

    decisions = tuple(
        replace(
            decision,
            place=place(decision.place),
            branch=tuple(map(place, decision.branch)),
            radii=tuple(scale * radius for radius in decision.radii),
        )
        for decision in report.decisions
    )
    report = replace(
        report,
        decisions=decisions,
        support=tuple(replace(each, place=place(each.place)) for each in report.support),
        reasons=tuple(replace(each, place=moved_or_none(each.place)) for each in report.reasons),
        joined=tuple((place(a), place(b)) for a, b in report.joined),
        root=moved_or_none(report.root),
    )
    lengths = ("radii", "half_width", "half_thickness")
    return skeleton.changed(
        vertices=moved(skeleton.vertices),
        points=moved(skeleton.points),
        normals=skeleton.normals @ (linear / scale).T,
        report=report,
        **{name: scale * getattr(skeleton, name) for name in lengths},
    )


def _similarity(matrix: Any) -> tuple[np.ndarray, np.ndarray, float]:
    """The linear part of a similarity, its offset, and its scale; InvalidParameterError for any other matrix."""
    try:
        full = np.asarray(matrix, float)
    except (TypeError, ValueError):
        full = np.empty(0)
    if full.shape == (4, 4) and np.isfinite(full).all() and (full[3] == [0, 0, 0, 1]).all():
        linear, scale = full[:3, :3], float(np.abs(np.linalg.det(full[:3, :3])) ** (1 / 3))
        if scale > 0 and np.allclose(linear @ linear.T, scale**2 * np.eye(3), rtol=0, atol=SIMILARITY * scale**2):
            return linear, full[:3, 3], scale
    raise InvalidParameterError(
        f"matrix = {shown(matrix)}: must be a rigid motion times one scale, (4, 4) with the last row 0, 0, 0, 1"
    )
