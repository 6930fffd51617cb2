"""Lead the curve straight through a wide end: a paddle, a pan, a sign on a pole."""

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ...geometry.groups import group_sum
from ...geometry.near_links import linked
from ...geometry.neighbourhoods import nearest_neighbours
from ...geometry.vectors import TINY, norm
from ..curve import Curve
from ..numbers import CURVE
from ..surface import Surface


def level_wide_ends(curve: Curve, surface: Surface) -> Curve:
    """Move the vertices of wide ends to the means of bands of the surface that are equally far from the neck.

    A disc has no axis: every way through it is in the middle of its own sections, so that a fit leaves it as it is. Nor
    is the way ahead told by the limb, which meets a pan at an angle. The bands know the way from the neck to the rim,
    and their means hardly depend on the points. Balls on a neck are wide ends, too.
    """
    width = half_widths(curve)
    leaf = curve.degree == 1
    for branch in curve.branches:
        for path in (branch, branch[::-1]):
            if leaf[path[-1]] and len(run := _wide_end(path, curve.vertices, width, bool(leaf[path[0]]))):
                curve = _levelled(curve, run, surface)
    return curve


def half_widths(curve: Curve) -> np.ndarray:
    """Half width of the section at every vertex, or the distance to its points or those beside it, (M,) float array.

    Where normals mean nothing, as on scan lines, points are farther away than the half width.
    """
    away, (a, b) = curve.cloud.distance, curve.edges.T
    width = np.fmax(curve.sections.half_width, away)
    np.maximum.at(width, np.concatenate([a, b]), away[np.concatenate([b, a])])
    return width


def _wide_end(path: np.ndarray, vertices: np.ndarray, width: np.ndarray, other: bool) -> np.ndarray:
    """The last vertices of a path, from the neck before its widest place on; none if they are no wide end.

    The widest place is near the leaf. The neck is the narrowest place a half width or more before that, at most a
    third as wide, not much farther from the leaf than the end is wide, and not at an `other` leaf, since rims are
    narrow, too. Where a limb widens, points of one side only may belong to the curve. Behind the neck there are two
    vertices or more.
    """
    wide, places = width[path], vertices[path]
    top = int(np.argmax(np.where(norm(places - places[-1]) < CURVE.stub * wide, wide, 0)))
    thin = (CURVE.neck * wide[:top] <= wide[top]) & (norm(places[:top] - places[top]) >= wide[top])
    thin &= (not other) | (CURVE.neck * norm(places[:top] - places[0]) >= wide[top])
    thin &= norm(places[:top] - places[-1]) < CURVE.stub * wide[top]
    if not thin.any():
        return path[:0]
    neck = np.argmin(np.where(thin, wide[:top], np.inf))
    return path[neck:] if len(path) - neck > 3 else path[:0]


def _levelled(curve: Curve, run: np.ndarray, surface: Surface) -> Curve:
    """The curve with a run, whose first two vertices are the neck and stay, at the means of bands behind it."""
    vertex, k = curve.vertex_of_point[surface.supporting], surface.neighbours.shape[1]
    rows = np.flatnonzero(np.isin(vertex, run))
    neck = np.flatnonzero(np.isin(vertex[rows], run[:2]))
    if not len(neck):
        return curve
    index = np.full(len(vertex), -1)
    index[rows] = np.arange(len(rows))
    pairs = np.column_stack([np.repeat(np.arange(len(rows)), k), index[surface.neighbours[rows]].ravel()])
    away = dijkstra(linked(surface.points[rows], pairs[pairs[:, 1] >= 0]), indices=neck, min_only=True)
    reached, n = np.isfinite(away), len(run) - 2
    if reached.mean() < CURVE.majority:  # a bridge joins them, and no surface
        return curve
    away, points = away[reached], surface.points[rows[reached]]
    band = np.minimum((n * away / max(away.max(), TINY)).astype(int), n - 1)
    count = np.bincount(band, minlength=n)
    mean = group_sum(points, band, n) / np.maximum(count, 1)[:, None]
    occupied = np.flatnonzero(count)
    vertices, owner = curve.vertices.copy(), curve.vertex_of_point.copy()
    vertices[run[2:]] = np.column_stack([np.interp(np.arange(n), occupied, column) for column in mean[occupied].T])
    owned = np.flatnonzero(np.isin(owner, run[2:]))
    owner[owned] = run[2 + band[nearest_neighbours(points, 1, of=curve.points[owned])[1][:, 0]]]
    return curve.changed(vertices=vertices, vertex_of_point=owner)
