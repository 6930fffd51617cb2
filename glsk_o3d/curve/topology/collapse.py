"""Merge vertices of a curve, and collapse the triangles of a graph, so that it is one-dimensional."""

import heapq
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..curve import Curve
from ...geometry.groups import group_sum
from ...geometry.pairing import final_representatives
from ..axis.sections import VertexPoints


def some_vertices(curve: Curve, which: np.ndarray) -> dict[str, Any]:
    """The arrays of some vertices, by name, for `replace`: their places and all that is known of them."""
    return {name: getattr(curve, name)[which] for name in ("vertices", *OF_VERTICES)}


def merge_vertices(curve: Curve, group: np.ndarray) -> Curve:
    """Make one vertex of each group (M,), at the mean of its members weighted by the points they own.

    Groups have any labels. Points of merged vertices belong to the merged one. A vertex alone stays as it is, to the
    last bit, so that what is known of it holds.
    """
    label, group = np.unique(group, return_inverse=True)
    n, weight = len(label), curve.cloud.mass
    total = group_sum(weight, group, n)
    edges = np.sort(group[curve.edges], axis=1)
    alone = np.bincount(group)[group] == 1

    def merged(values: np.ndarray) -> Any:
        means = (group_sum((weight * values.T).T, group, n).T / total).T
        means[group[alone]] = values[alone]
        return means

    known = some_vertices(curve, np.arange(len(group)))
    return replace(
        curve,
        **{name: merged(values) for name, values in known.items()},
        edges=np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0),
        vertex_of_point=np.append(group, -1)[curve.vertex_of_point],
    )


def merge_into(curve: Curve, into: np.ndarray) -> Curve:
    """Merge vertices `into` others (M,), which stay where and what they are, and in their order.

    Points of merged vertices belong to the one that stays.
    """
    stay = np.unique(into)
    return with_fields(merge_vertices(curve, into), **some_vertices(curve, stay))


def drop_edges(curve: Curve, gone: ArrayLike) -> Curve:
    """Drop some edges, each named by its two vertices, the lower first; vertices stay."""
    dropped = (curve.edges[:, None] == np.asarray(gone)).all(axis=2).any(axis=1)
    return curve.changed(edges=curve.edges[~dropped])


def drop_vertices(curve: Curve, lone: np.ndarray) -> Curve:
    """Drop `lone` (M,) vertices, without edges, unless there are no others; their points go to the nearest left."""
    left = np.flatnonzero(~lone)
    if len(left) in (0, len(curve.vertices)):
        return curve
    representative = cKDTree(curve.vertices[left]).query(curve.vertices)[1]
    representative[left] = np.arange(len(left))
    return replace(
        curve,
        **some_vertices(curve, left),
        edges=representative[curve.edges],
        vertex_of_point=np.append(representative, -1)[curve.vertex_of_point],
    )


def with_fields(curve: Curve, **fields: Any) -> Curve:
    """The same graph with other fields than its edges, as by `replace`, but unchecked, and what is known of it kept."""
    made, known = object.__new__(type(curve)), vars(curve)
    names = (*ARRAYS, "report", "degree", "component_of_vertex", "branches")
    vars(made).update({name: known[name] for name in names if name in known} | fields)
    return made


def with_gaps(curve: Curve, ends: np.ndarray) -> Curve:
    """The same; its report has the ends, (g, 2, 3) float array, of more stretches that no point supports."""
    joined = (*curve.report.joined, *((tuple(a), tuple(b)) for a, b in ends.tolist()))
    return curve.changed(report=replace(curve.report, joined=joined))


def binary_size(curve: Curve) -> float:
    """The power of two next to the extent of a curve, so that scaling by it rounds nothing; 1 if it has none."""
    extent = np.ptp(curve.vertices, axis=0).max(initial=0)
    return float(2.0 ** np.round(np.log2(extent))) if extent > 0 else 1.0


def scaled(curve: Curve, factor: float) -> Curve:
    """The same in another unit of length."""
    lengths = ("vertices", "points", "radii", "half_width", "half_thickness")
    made = {name: factor * getattr(curve, name) for name in lengths}
    blank = curve.changed(**made, report=replace(curve.report, joined=()))
    return blank.with_gaps(factor * np.array(curve.report.joined))


def collapse_triangles(curve: Curve, by_degree: bool = False) -> Curve:
    """Merge the two ends of edges that lie on a triangle, the shortest edge first, until there is no triangle.

    The published order, least mean degree of the two ends first and length to break ties, is a combinatorial one:
    another sample of the same surface has another, and finer vertices make it worse. Lengths converge with the
    vertices' spacing. Points of merged vertices belong to the vertex they were merged into.
    """
    position, weight = curve.vertices.tolist(), curve.cloud.mass.tolist()
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
