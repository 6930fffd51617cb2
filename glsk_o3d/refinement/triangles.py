"""Collapse triangles, so that the graph is one-dimensional."""

from __future__ import annotations

import heapq
import math

import numpy as np

from ..numerics.pairing import final_representatives
from ..skeleton import Skeleton
from .merging import merge_vertices
from .vertex_points import VertexPoints


def collapse_triangles(skeleton: Skeleton, by_degree: bool = False) -> Skeleton:
    """Merge the two ends of edges that lie on a triangle, the shortest edge first, until there is no triangle.

    The published order, least mean degree of the two ends first and length to break ties, is a combinatorial one:
    another sample of the same surface has another, and finer vertices make it worse. Lengths converge with the
    vertices' spacing. Points of merged vertices belong to the vertex they were merged into.
    """
    position, weight = skeleton.vertices.tolist(), VertexPoints(skeleton).mass.tolist()
    around: list[set[int]] = [set() for _ in position]
    for a, b in skeleton.edges.tolist():
        around[a].add(b)
        around[b].add(a)

    def cost(a: int, b: int) -> tuple[float, float]:
        degree = (len(around[a]) + len(around[b])) / 2 if by_degree else 0.0
        return degree, math.dist(position[a], position[b])

    queue = [(*cost(a, b), a, b) for a, b in skeleton.edges.tolist() if around[a] & around[b]]
    heapq.heapify(queue)
    representative = list(range(len(position)))
    while queue:
        *priced, a, b = heapq.heappop(queue)
        if b not in around[a] or not around[a] & around[b]:
            continue
        if tuple(priced) != cost(a, b):
            heapq.heappush(queue, (*cost(a, b), a, b))
            continue
        representative[b] = a
        both = weight[a] + weight[b]
        position[a] = [(weight[a] * x + weight[b] * y) / both for x, y in zip(position[a], position[b], strict=True)]
        weight[a] = both
        for c in around[b]:
            around[c].discard(b)
            if c != a:
                around[c].add(a)
                around[a].add(c)
        around[b].clear()
        # The merge changes the degrees around it and makes new triangles: price all that may have become cheaper.
        for c in {a, *around[a]}:
            for d in around[c]:
                if around[c] & around[d]:
                    heapq.heappush(queue, (*cost(c, d), c, d))
    return merge_vertices(skeleton, final_representatives(np.array(representative, int)))
