"""Paths of a graph, lengths along polylines, and the places on the edges of a graph that are nearest to points."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .groups import group_rank
from .neighbourhoods import plane_axes
from .vectors import TINY, Floats, dot, norm, unit

ROUNDING = np.finfo(float).eps  # derived: of a number, over itself
POLYLINE_CHUNK = 2**20  # speed: pairs of a point and an edge at a time: memory stays flat
TURNED_BACK = 1e-9  # precision: of the sum of two unit vectors that are opposite
NEAREST_TIE = 1e-9  # derived: of roundings, which must not choose between the edges of a vertex


def maximal_paths(n: int, edges: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Paths between the n vertices of a graph that have not two edges, each as its vertices and its edges in order.

    The edges (e, 2) come once each, without loops. A ring without such a vertex starts and ends at its first one.
    """
    links: list[dict[int, int]] = [{} for _ in range(n)]
    for edge, (a, b) in enumerate(edges.tolist()):
        links[a][b] = links[b][a] = edge
    degree, paths = [len(ends) for ends in links], []
    for start in (*(v for v in range(n) if degree[v] != 2), *range(n)):
        while links[start]:
            vertices, path = [start], list[int]()
            while not path or (vertices[-1] != start and degree[vertices[-1]] == 2):
                vertex, edge = next(iter(links[vertices[-1]].items()))
                del links[vertices[-1]][vertex], links[vertex][vertices[-1]]
                vertices.append(vertex)
                path.append(edge)
            paths.append((vertices, path))
    return paths


def arc_lengths(path: np.ndarray) -> np.ndarray:
    """Length along a path, (p, 3) float array, from its first place to every place, (p,) float array."""
    lengths = np.zeros(len(path))
    np.cumsum(norm(path[1:] - path[:-1]), out=lengths[1:])
    return lengths


def place_at(path: np.ndarray, lengths: np.ndarray, length: float | np.ndarray) -> Floats:
    """The place at a length along a path, (p, 3) float array with its `arc_lengths`; (3,), or (k, 3) for k lengths."""
    return np.stack([np.interp(length, lengths, column) for column in path.T], axis=-1)


def significance(curve: np.ndarray, kept: Sequence[int] | np.ndarray, long: float = 0.0, near: Any = 0.0) -> Floats:
    """Largest tolerance at which every place of a curve (p, 3) stays (Douglas and Peucker 1973), (p,) float array.

    It is infinite at those `kept`, its ends among them. To the distance from the chord a share `long` of the length to
    the nearer end of the part is added; places that are less than `near`, (p,) or one length, from it have 0.
    """
    weights, near, parts = np.zeros(len(curve)), np.broadcast_to(near, len(curve)), [*pairwise(kept)]
    weights[kept] = np.inf
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        part, along = curve[first : last + 1], arc_lengths(curve[first : last + 1])
        offset, chord, shorter = part - part[0], part[-1] - part[0], np.minimum(along, along[-1] - along)
        share = np.clip(offset @ chord / max(chord @ chord, TINY), 0, 1)
        weight = norm(offset - share[:, None] * chord) + long * shorter
        weight[(shorter < near[first : last + 1])] = 0
        farthest = first + 1 + int(weight[1:-1].argmax())
        # no more than that of the ends of its part, without which it would not be asked
        weights[farthest] = min(weight[farthest - first], weights[first], weights[last])
        parts += [(first, farthest), (farthest, last)]
    return weights


def relative_distance(
    points: np.ndarray, vertices: np.ndarray, surface: np.ndarray, paths: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Distance of points (n, 3) from paths over the distance of the surface from these, and the latter, two (n,).

    Paths are numbers of `vertices` (M, 3), from which the surface is `surface` (M,) away, and linearly between them.
    The edge counts where the ratio is least.
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
        thickness = np.maximum(surface[a] + foot / np.maximum(length, TINY) * (surface[b] - surface[a]), least)
        ratios = distance / thickness
        best = np.arange(len(p)), ratios.argmin(axis=1)
        ratio[first : first + rows], nearest[first : first + rows] = ratios[best], thickness[best]
    return ratio, nearest


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
    directions = x.T.take(edges[:, 1], axis=1) - starts
    squared_lengths = np.maximum((directions * directions).sum(axis=0), TINY)
    for column in candidates.T:
        rows = np.flatnonzero(column >= 0)
        candidate = column[rows]
        direction, offset = directions.take(candidate, axis=1), p.take(rows, axis=1) - starts.take(candidate, axis=1)
        share = (direction * offset).sum(axis=0) / squared_lengths.take(candidate)
        np.clip(share, 0, 1, out=share)
        offset -= share * direction
        squared = (offset * offset).sum(axis=0)
        nearer = np.flatnonzero(squared < (1 - NEAREST_TIE) * best[rows])  # a vertex has several: no rounding chooses
        rows = rows[nearer]
        edge[rows], t[rows], best[rows] = candidate[nearer], share[nearer], squared[nearer]
    return edge, t


def places_on_edges(x: np.ndarray, edges: np.ndarray, edge: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The places, (n, 3) float array, that `nearest_on_edges` names."""
    start, direction = x[edges[:, 0]], x[edges[:, 1]] - x[edges[:, 0]]
    return start.take(edge, axis=0) + t[:, None] * direction.take(edge, axis=0)


def twist_free_frames(places: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Frames (n, 3, 3) along polylines (n, 3), one after the other, of which row `first` (p,) begins each.

    The columns are the unit tangent and two directions across it. Every frame follows from the one before by the
    smallest rotation that takes one tangent to the next; a polyline that ends where it began has one tangent there.
    """
    begins = np.zeros(len(places), bool)
    begins[first] = True
    edge = np.diff(places, axis=0, prepend=places[:1])  # the one that leads to each place
    edge[begins] = 0
    edge = unit(edge)
    onward = np.concatenate([edge[1:], np.zeros((1, 3))])  # what follows the last place of a polyline is zero
    last = np.append(np.asarray(first)[1:], len(places)) - 1
    closed = (last - first > 1) & (places[first] == places[last]).all(axis=1)
    edge[first[closed]], onward[last[closed]] = edge[last[closed]], onward[first[closed]]
    tangent = edge + onward
    length = norm(tangent)
    turns_back = length < TURNED_BACK
    tangent[turns_back] = np.where(norm(onward[turns_back])[:, None] > 0, onward[turns_back], [0.0, 0.0, 1.0])
    tangent = unit(tangent)
    axes = plane_axes(tangent)
    # the smallest rotation from one tangent to the next takes the first axis of the one along
    before, after, carried = tangent[:-1], tangent[1:], axes[:-1, :, 0]
    cosine = np.maximum(1 + dot(before, after), TURNED_BACK)
    carried = carried - (dot(carried, after) / cosine)[:, None] * (before + after)
    u, v = np.einsum("ni,nij->jn", carried, axes[1:])
    turn = np.r_[0, np.where(begins[1:], 0, np.arctan2(v, u))].cumsum()
    turn -= np.repeat(turn[first], np.diff(np.append(first, len(places))))
    across, beside = np.moveaxis(axes, 2, 0)
    cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
    return np.stack([tangent, cosine * across + sine * beside, cosine * beside - sine * across], axis=2)
