"""Merge vertices, drop vertices and edges, and collapse triangles, so that a graph is one-dimensional."""

import heapq
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..data.graph import AnyGraph, all_of_vertices, in_order_of_ends
from ..geometry.groups import group_sum
from ..geometry.pairing import final_representatives
from .axis.sections import VertexPoints
from .curve import Curve


def merge_vertices(graph: AnyGraph, group: np.ndarray) -> AnyGraph:
    """Make one vertex of each group (M,), at the mean of its members weighted by the points they own.

    Groups have any labels. Points of merged vertices belong to the merged one. A vertex alone stays as it is, to the
    last bit, so that what is known of it holds.
    """
    label, group = np.unique(group, return_inverse=True)
    n, weight = len(label), VertexPoints(graph).mass
    total = group_sum(weight, group, n)
    edges = np.sort(group[graph.edges], axis=1)
    alone = np.bincount(group)[group] == 1

    def mean(values: np.ndarray) -> Any:
        means = (group_sum((weight * values.T).T, group, n).T / total).T
        means[group[alone]] = values[alone]
        return means

    return graph.changed(
        **{name: mean(values) for name, values in all_of_vertices(graph).items()},
        edges=np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0),
        vertex_of_point=np.append(group, -1)[graph.vertex_of_point],
    )


def merge_into(graph: AnyGraph, into: np.ndarray) -> AnyGraph:
    """Merge vertices `into` others (M,), which stay where and what they are, and in their order.

    Points of merged vertices belong to the one that stays.
    """
    return merge_vertices(graph, into).changed(**all_of_vertices(graph, np.unique(into)))


def drop_edges(curve: Curve, gone: ArrayLike) -> Curve:
    """Drop some edges, each named by its two vertices, the lower first; vertices stay."""
    dropped = (curve.edges[:, None] == np.asarray(gone)).all(axis=2).any(axis=1)
    return curve.changed(edges=curve.edges[~dropped])


def drop_vertices(curve: Curve, lone: np.ndarray) -> Curve:
    """Drop `lone` (M,) vertices, without edges, unless there are no others; points go to the nearest other."""
    remaining = np.flatnonzero(~lone)
    if len(remaining) in (0, len(curve.vertices)):
        return curve
    representative = cKDTree(curve.vertices[remaining]).query(curve.vertices)[1]
    representative[remaining] = np.arange(len(remaining))
    return curve.changed(
        **all_of_vertices(curve, remaining),
        edges=in_order_of_ends(representative[curve.edges], len(remaining)),
        vertex_of_point=np.append(representative, -1)[curve.vertex_of_point],
    )


def collapse_triangles(curve: AnyGraph, by_degree: bool = False) -> AnyGraph:
    """Merge the two ends of edges that lie on a triangle, the shortest edge first, until there is no triangle.

    The published order, least mean degree of the two ends first and length to break ties, is a combinatorial one:
    another sample of the same surface has another, and finer vertices make it worse. Lengths converge with the
    vertices' spacing. Points of merged vertices belong to the vertex they were merged into.
    """
    position, weight = curve.vertices.tolist(), VertexPoints(curve).mass.tolist()
    around: list[set[int]] = [set() for _ in position]
    for a, b in curve.edges.tolist():
        around[a].add(b)
        around[b].add(a)

    def priced(a: int, b: int) -> tuple[float, float, int, int]:
        degree = (len(around[a]) + len(around[b])) / 2 if by_degree else 0.0
        return degree, math.dist(position[a], position[b]), a, b

    queue = [priced(a, b) for a, b in curve.edges.tolist() if not around[a].isdisjoint(around[b])]
    heapq.heapify(queue)
    representative = list(range(len(position)))
    while queue:
        cheapest = heapq.heappop(queue)
        a, b = cheapest[2:]
        if b not in around[a] or around[a].isdisjoint(around[b]):
            continue
        price = priced(a, b)
        if cheapest != price:
            heapq.heappush(queue, price)
            continue
        representative[b] = a
        both = weight[a] + weight[b]
        position[a] = [(weight[a] * x + weight[b] * y) / both for x, y in zip(position[a], position[b], strict=True)]
        weight[a] = both
        fresh = around[b] - around[a]
        for c in around[b]:
            around[c].discard(b)
            if c != a:
                around[c].add(a)
                around[a].add(c)
        around[b].clear()
        # Edges at the merged vertex have another length, those at its neighbours another degree, and those between its
        # neighbours are on new triangles: price all that may have become cheaper.
        if by_degree:
            changed = [(c, d) for c in {a, *around[a]} for d in around[c]]
        else:
            across = [(c, d) for c in fresh & around[a] for d in around[c] & around[a]]
            changed = [(min(pair), max(pair)) for pair in [*across, *((a, c) for c in around[a])]]
        for c, d in changed:
            if not around[c].isdisjoint(around[d]):
                heapq.heappush(queue, priced(c, d))
    return merge_vertices(curve, final_representatives(np.array(representative, int)))
