"""The edges at every vertex of a graph, and the places on them that are nearest to points."""

from __future__ import annotations

import numpy as np

from .vectors import TINY, dot

NEAREST_TIE = 1e-9  # derived: of roundings, which must not choose between the edges of a vertex


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
    """The place nearest to each point `p` (n, 3) among its candidate edges of a graph with vertices `x` (m, 3).

    `candidates` (n, c) are at least one edge for each point, padded with -1. Returns the edges (n,), and t (n,) from 0
    at the first end of the edge to 1 at the second.
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
