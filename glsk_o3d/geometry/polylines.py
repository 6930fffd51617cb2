"""How far points are from polylines, and the places on the edges of a graph that are nearest to points."""

from collections.abc import Sequence

import numpy as np

from .groups import group_rank
from .vectors import TINY, Floats, dot, norm

ROUNDING = np.finfo(float).eps  # derived: of a number, over itself
POLYLINE_CHUNK = 2**20  # speed: pairs of a point and an edge at a time: memory stays flat


def arc_lengths(path: np.ndarray) -> np.ndarray:
    """Length along a path, (p, 3) float array, from its first place to every place, (p,) float array."""
    lengths = np.zeros(len(path))
    np.cumsum(norm(path[1:] - path[:-1]), out=lengths[1:])
    return lengths


def place_at(path: np.ndarray, lengths: np.ndarray, length: float | np.ndarray) -> Floats:
    """The place so far along a path, (p, 3) float array with its `arc_lengths`; (3,), or (k, 3) for k lengths."""
    places = np.empty((*np.shape(length), 3))
    for axis in range(3):
        places[..., axis] = np.interp(length, lengths, path[:, axis])
    return places


def relative_distance(
    points: np.ndarray, vertices: np.ndarray, surface: np.ndarray, paths: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Distance of points (n, 3) from some paths over the distance of the surface from these, and the latter, two (n,).

    Paths are numbers of `vertices` (M, 3), from which the surface is `surface` (M,) away, and linearly between them. Of
    all edges that one counts where the ratio is least.
    """
    a, b = (np.concatenate([path[part] for path in paths]) for part in (slice(-1), slice(1, None)))
    start, step = vertices[a], vertices[b] - vertices[a]
    length = norm(step)
    direction = step / np.maximum(length, TINY)[:, None]
    # relative to one of them: products of coordinates far from the origin would cancel
    points, start = points - start[0], start - start[0]
    size = max(np.abs(points).max(), np.abs(start).max())
    least = max(ROUNDING * size, TINY)  # of a line, which has no thickness but roundings
    ratio, nearest = np.empty(len(points)), np.empty(len(points))
    rows = max(POLYLINE_CHUNK // len(a), 1)
    for first in range(0, len(points), rows):
        p = points[first : first + rows]
        along = p @ direction.T - dot(start, direction)
        squared = dot(p, p)[:, None] - 2 * p @ start.T + dot(start, start)
        foot = np.clip(along, 0, length)
        distance = np.sqrt(np.maximum(squared + foot * (foot - 2 * along), 0))
        there = np.maximum(surface[a] + foot / np.maximum(length, TINY) * (surface[b] - surface[a]), least)
        over = distance / there
        edge, every = over.argmin(axis=1), np.arange(len(p))
        ratio[first : first + rows], nearest[first : first + rows] = over[every, edge], there[every, edge]
    return ratio, nearest


NEAREST_TIE = 1e-9  # derived: of roundings, which must not choose between the edges of a vertex


def incident_edges(edges: np.ndarray, m: int) -> np.ndarray:
    """Edges at every vertex, (m, most) int array, filled up with -1."""
    vertex, edge = edges.ravel(), np.repeat(np.arange(len(edges)), 2)
    rank = group_rank(vertex, m)
    table = np.full((m, max(rank.max(initial=0) + 1, 2)), -1)
    table[vertex, rank] = edge
    return table


def nearest_on_edges(
    x: np.ndarray, edges: np.ndarray, candidates: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The place nearest to each point `p` (n, 3) among its candidate edges of a graph with vertices `x` (m, 3).

    `candidates` (n, c) are at least one edge for each point, padded with -1. Returns the edges (n,), and t (n,) from 0
    at the first end of the edge to 1 at the second.
    """
    edge, t, best = np.zeros(len(p), int), np.zeros(len(p)), np.full(len(p), np.inf)
    starts, p = x.T.take(edges[:, 0], axis=1), np.ascontiguousarray(p.T)  # along the memory
    ways = x.T.take(edges[:, 1], axis=1) - starts
    lengths = np.maximum((ways * ways).sum(axis=0), TINY)  # squared
    for column in candidates.T:
        some = np.flatnonzero(column >= 0)
        every = len(some) == len(column)  # mostly of the first edge: there is nothing to take
        column, here, least = (column, p, best) if every else (column[some], p.take(some, axis=1), best[some])
        along, offset = ways.take(column, axis=1), here - starts.take(column, axis=1)
        part = (along * offset).sum(axis=0) / lengths.take(column)
        np.clip(part, 0, 1, out=part)
        offset -= part * along
        squared = (offset * offset).sum(axis=0)
        nearer = np.flatnonzero(squared < (1 - NEAREST_TIE) * least)  # a vertex has several: rounding must not choose
        some = some[nearer]
        edge[some], t[some], best[some] = column[nearer], part[nearer], squared[nearer]
    return edge, t


def places_on_edges(x: np.ndarray, edges: np.ndarray, edge: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The places, (n, 3) float array, that `nearest_on_edges` names."""
    start, way = x[edges[:, 0]], x[edges[:, 1]] - x[edges[:, 0]]
    return start.take(edge, axis=0) + t[:, None] * way.take(edge, axis=0)
