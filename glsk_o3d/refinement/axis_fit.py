"""Fit the skeleton to the axis of the surface around it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import bsr_array, csc_array

from ..numerics.groups import group_median, group_sum
from ..numerics.radii import plane_distance_radii, robust_radii
from ..numerics.solver import factorised
from ..numerics.vectors import COLUMNS, ROWS, TINY, dot, norm, unit
from ..skeleton import Skeleton

# All fitted, on the shapes with known axes.
FIT_BENDING = 2.0  # weight of a vertex's distance from the chord of its neighbours, per point
FIT_SMOOTHING = 0.3  # how much more of that where there is doubt, over the squared ratio of noise to spacing
FIT_WIDEST = 100.0  # that ratio at most: vertices in one place have none
FIT_STAY = 0.1  # weight of staying where it was, per point
FIT_OUTLYING = 0.5  # distance from the axis, in radii, at which a point's normal counts half
FIT_CENTROID = 0.5  # weight of the points themselves where their normals say nothing
# derived: over the diagonal, how far out of the box of its points an axis may be: they show a third of a tube at least,
FIT_BEYOND = 0.05  # whose axis is half a radius away from it, and a tube that is seen so is some ten radii long
HALF_SUPPORT = 8  # points that support a vertex half
NEAREST_TIE = 1e-9  # derived: of roundings, which must not choose between the edges of a vertex
ENTRIES = [0, 1, 2, 1, 3, 4, 2, 4, 5]  # the upper triangle of a symmetric matrix, spread out


def fit_axis(skeleton: Skeleton, passes: int) -> Skeleton:
    r"""Move the vertices to the axis of the surface; measure how well the points say where it is, and how far it is.

    The plane through a point p of a tube, spanned by its normal n and the tangent t of the axis, contains the axis:
    b (x(p) - p) = 0 with b = n x t and x(p) the place of the curve nearest to p. Each pass minimises, over all vertices
    at once,

    .. math:: \sum_p w (b \cdot (x(p) - p))^2 + \mu d |(x(p) - p)_\perp|^2
        + \sum_v c (\lambda |x_v - chord|^2 + \epsilon |x_v - old|^2 + ((x_v - old) \cdot t)^2)

    with c the number of points at a vertex. w = 1 / (1 + (2 r)^2), where r is the distance of the curve from that plane
    in local radii, is small for points of something else. The doubt d, from 0 to 1, is the share of the distance from
    the curve that the normals do not explain; where it is large, noise is as wide as the part and the points say more
    than their normals, and the curve may not bend within less than the points' spread s around it:
    :math:`\lambda = 2 (1 + 0.3 (d s^2 / h^2)^2)` with the spacing h of the vertices, so that the length over which the
    curve is smoothed grows with s and not with h. A half tube, scanned from one side, has an axis, but the centroid of
    its points is off it. So the first pass takes the normals alone, w = 1 and d = 0: it finds the axis from wherever
    the contraction left the curve.

    Parameters
    ----------
    skeleton : Skeleton
    passes : int
        0 leaves the vertices where they are.

    Returns
    -------
    Skeleton
        With the confidence (1 - d) c / (c + 8), where c counts over the vertex and its neighbours: near 1 on the axis
        of a tube, near 0 where the normals have no axis in common or points are few; and with radii, see
        `robust_radii`, or without passes `plane_distance_radii`.
    """
    m, ends = len(skeleton.vertices), skeleton.edges
    points = skeleton.supporting_points
    points = points[skeleton.degree[skeleton.vertex_of_point[points]] > 0]
    if len(points) == 0:
        return replace(skeleton, confidence=np.zeros(m), radii=_plane_radii(skeleton, skeleton.vertices))
    centre = skeleton.vertices.mean(axis=0)
    x, p, n = skeleton.vertices - centre, skeleton.points[points] - centre, skeleton.normals.take(points, axis=0)
    edges_at = incident_edges(ends, m)
    around = edges_at[skeleton.vertex_of_point[points]]
    pattern = _Pattern(skeleton, edges_at)
    low, high = axis_box(p)
    for step in range(passes):
        near = _nearest(x, ends, around, p, n)
        weight, pull = np.ones(len(p)), np.zeros(len(p))
        if step:
            radius = group_median(norm(near.offset), near.edge, len(ends))[near.edge]
            weight = 1 / (1 + near.miss / np.maximum((FIT_OUTLYING * radius) ** 2, TINY))
            pull = FIT_CENTROID * (near.share * near.doubt[ends[near.edge]]).sum(axis=1)
        x = _solve(x, near, p, weight, pull, pattern, FIT_SMOOTHING if step else 0)
        # normals that mean nothing may meet anywhere
        x = np.where(skeleton.degree[:, None] > 0, np.clip(x, low, high), x)
    near = _nearest(x, ends, around, p, n)
    radii = _plane_radii(skeleton, x + centre)
    if passes:  # the distance from a curve that nobody has centred is no radius
        vertex = skeleton.vertex_of_point[points]
        radii = robust_radii(radii, norm(near.offset), near.doubt, n, vertex)
    confidence = (1 - near.doubt) * near.support / (near.support + HALF_SUPPORT)
    return replace(skeleton, vertices=x + centre, confidence=confidence, radii=radii)


def _plane_radii(skeleton: Skeleton, vertices: np.ndarray) -> np.ndarray:
    return plane_distance_radii(vertices, skeleton.vertex_of_point, skeleton.points, skeleton.normals, skeleton.radii)


def axis_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates, (3,), that an axis of points, (n, 3) float array, n > 0, may have."""
    low, high = points.min(axis=0), points.max(axis=0)
    slack = FIT_BEYOND * np.linalg.norm(high - low)
    return low - slack, high + slack


def incident_edges(edges: np.ndarray, m: int) -> np.ndarray:
    """Edges at every vertex, (m, most) int array, filled up with -1."""
    vertex, edge = edges.ravel(), np.repeat(np.arange(len(edges)), 2)
    order = np.argsort(vertex, kind="stable")
    vertex, edge = vertex[order], edge[order]
    degree = np.bincount(vertex, minlength=m)
    table = np.full((m, max(degree.max(initial=0), 2)), -1)
    table[vertex, np.arange(len(vertex)) - np.repeat(np.cumsum(degree) - degree, degree)] = edge
    return table


def nearest_on_edges(
    x: np.ndarray, edges: np.ndarray, candidates: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The place nearest to each point among some edges.

    Parameters
    ----------
    x : (m, 3) float array
    edges : (e, 2) int array
    candidates : (n, c) int array
        Edges to look at for each point, -1 for none; at least one.
    p : (n, 3) float array

    Returns
    -------
    edge : (n,) int array
    t : (n,) float array
        From 0 at the first end of the edge to 1 at the second.
    """
    starts, ways = x[edges[:, 0]], x[edges[:, 1]] - x[edges[:, 0]]
    lengths = np.maximum(dot(ways, ways), TINY)  # squared
    edge, t, best = np.zeros(len(p), int), np.zeros(len(p)), np.full(len(p), np.inf)
    for column in candidates.T:
        some = np.flatnonzero(column >= 0)
        column = column[some]
        along, offset = ways.take(column, axis=0), p.take(some, axis=0) - starts.take(column, axis=0)
        part = np.clip(dot(along, offset) / lengths.take(column), 0, 1)
        offset -= part[:, None] * along
        squared = dot(offset, offset)
        nearer = squared < (1 - NEAREST_TIE) * best[some]  # a vertex belongs to all its edges: rounding must not choose
        some = some[nearer]
        edge[some], t[some], best[some] = column[nearer], part[nearer], squared[nearer]
    return edge, t


class _Nearest(NamedTuple):
    """What the points are to the place of the curve nearest to them."""

    edge: np.ndarray
    share: np.ndarray  # of the edge's two ends in that place
    tangent: np.ndarray  # of every edge
    across: np.ndarray  # b
    offset: np.ndarray  # x(p) - p
    miss: np.ndarray  # (b (x(p) - p))^2
    doubt: np.ndarray  # d, of every vertex
    apart: np.ndarray  # mean squared distance of the points around every vertex
    support: np.ndarray  # points at every vertex and its neighbours


def _nearest(x: np.ndarray, ends: np.ndarray, around: np.ndarray, p: np.ndarray, n: int) -> _Nearest:
    edge, t = nearest_on_edges(x, ends, around, p)
    share = np.column_stack([1 - t, t])
    start, way = x[ends[:, 0]], x[ends[:, 1]] - x[ends[:, 0]]
    tangent = unit(way)
    along = tangent.take(edge, axis=0)
    across = np.cross(n, along)
    offset = start.take(edge, axis=0) + t[:, None] * way.take(edge, axis=0) - p
    miss = dot(across, offset) ** 2
    apart = dot(offset, offset) - dot(offset, along) ** 2
    a, b = ends.T
    at = group_sum(np.column_stack([miss, apart, np.full(len(p), 0.5)]), edge, len(ends))
    at = group_sum(np.concatenate([at, at]), np.concatenate([a, b]), len(x))
    miss_at, apart_at, support = (at + group_sum(at[np.concatenate([b, a])], np.concatenate([a, b]), len(x))).T
    apart_at = np.maximum(apart_at, 0)  # but for rounding, a difference of squares
    # normals that point anywhere explain half of the distance; without points there is nothing but doubt
    doubt = np.where(apart_at > 0, np.minimum(2 * miss_at, apart_at) / np.maximum(apart_at, TINY), 1)
    return _Nearest(edge, share, tangent, across, offset, miss, doubt, apart_at / np.maximum(support, TINY), support)


def _solve(
    x: np.ndarray,
    near: _Nearest,
    p: np.ndarray,
    weight: np.ndarray,
    pull: np.ndarray,
    pattern: _Pattern,
    smoothing: float,
) -> np.ndarray:
    """The minimum of the energy in `fit_axis`: one sparse, symmetric, positive definite system."""
    ends, inner, beside = pattern.ends, pattern.inner, pattern.beside
    m, e = len(x), len(ends)
    along = near.tangent[:, :, None] * near.tangent[:, None]
    upright = np.eye(3) - along
    # Of every point w b b^T by its six different entries, and the pull, once for each pair of ends of its edge; and
    # what they say of its place, and that it is there, once for each end.
    weighted = weight[:, None] * near.across
    matrix = np.column_stack([weighted[:, ROWS] * near.across[:, COLUMNS], pull])
    target = dot(near.across, p)[:, None] * weighted
    target = np.column_stack([target, pull[:, None] * p, np.ones(len(p))])
    share, pairs = near.share, near.share[:, [0, 0, 1]] * near.share[:, [0, 1, 1]]
    at_pairs = group_sum(matrix, near.edge[:, None] + e * np.arange(3), 3 * e, pairs)
    at_ends = group_sum(target, near.edge[:, None] + e * np.arange(2), 2 * e, share)
    at_edges = at_pairs[:, ENTRIES].reshape(3, e, 3, 3) + at_pairs[:, 6].reshape(3, e, 1, 1) * upright
    wanted = at_ends[:, :3] + np.einsum("eij,ej->ei", np.tile(upright, (2, 1, 1)), at_ends[:, 3:6])
    facts = np.column_stack([wanted, at_ends[:, 6], np.tile(along.reshape(e, 9), (2, 1))])
    facts = group_sum(facts, ends.T.ravel(), m)
    right, count = facts[:, :3], facts[:, 3]
    along = facts[:, 4:].reshape(m, 3, 3) / np.maximum(np.bincount(ends.ravel(), minlength=m), 1)[:, None, None]
    stay = (FIT_STAY * count + 1e-3 * max(count.mean(), 1))[:, None, None] * np.eye(3) + count[:, None, None] * along
    right = right + np.einsum("nij,nj->ni", stay, x)

    reach = np.linalg.norm(x[beside] - x[inner, None], axis=2)
    chord = reach[:, ::-1] / np.maximum(reach.sum(axis=1, keepdims=True), TINY)
    stencil = np.column_stack([np.ones(len(inner)), -chord])
    squared = np.maximum(reach.prod(axis=1), TINY)
    width = np.minimum((near.doubt * near.apart)[inner], FIT_WIDEST * squared) / squared
    bend = FIT_BENDING * (1 + smoothing * width**2) * np.maximum(count[inner], 1)
    bend = bend[:, None, None] * stencil[:, :, None] * stencil[:, None]  # the same for all three coordinates
    blocks = np.concatenate(
        [at_edges[0], at_edges[1], at_edges[1], at_edges[2], stay, bend.reshape(-1, 1, 1) * np.eye(3)]
    )
    return factorised(pattern.matrix(blocks)).solve(right.ravel()).reshape(m, 3)


class _Pattern:
    """Where the blocks of `_solve` stand in its system: for both ends of edges, vertices, and these with two beside."""

    def __init__(self, skeleton: Skeleton, edges_at: np.ndarray) -> None:
        m, self.ends, self.inner = len(skeleton.vertices), skeleton.edges, np.flatnonzero(skeleton.degree == 2)
        # the other end of either edge
        self.beside = self.ends[edges_at[self.inner, :2]].sum(axis=2) - self.inner[:, None]
        (a, b), every, stencil = self.ends.T, np.arange(m), np.column_stack([self.inner, self.beside])
        rows = np.concatenate([a, a, b, b, every, np.repeat(stencil, 3, axis=1).ravel()])
        columns = np.concatenate([a, b, a, b, every, np.tile(stencil, 3).ravel()])
        places, self._place = np.unique(rows * m + columns, return_inverse=True)
        self._columns = places % m
        self._starts = np.searchsorted(places, m * np.arange(m + 1))

    def matrix(self, blocks: np.ndarray) -> csc_array:
        """The symmetric matrix that has the sum of the blocks, (b, 3, 3), in every place."""
        summed = group_sum(blocks, self._place, len(self._columns))
        rows = bsr_array((summed, self._columns, self._starts)).tocsr()
        return csc_array((rows.data, rows.indices, rows.indptr), shape=rows.shape)
