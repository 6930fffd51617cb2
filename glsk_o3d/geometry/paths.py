"""The paths that a graph is made of."""

import numpy as np


def maximal_paths(n: int, edges: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Paths between the vertices of a graph that have not two edges, each as its vertices and its edges in order.

    Of n vertices; the edges (e, 2) come once each and join no vertex with itself. Every edge is in one path. A ring
    without such a vertex starts and ends at its first one.
    """
    around: list[dict[int, int]] = [{} for _ in range(n)]
    for edge, (a, b) in enumerate(edges.tolist()):
        around[a][b] = around[b][a] = edge
    degree, paths = [len(links) for links in around], []
    ends = [v for v in range(n) if degree[v] != 2]
    for start in (*ends, *range(n)):
        while around[start]:
            here, vertices, path = start, [start], list[int]()
            while here != start or not path:
                ahead, edge = next(iter(around[here].items()))
                del around[here][ahead], around[ahead][here]
                vertices.append(ahead)
                path.append(edge)
                here = ahead
                if degree[here] != 2:
                    break
            paths.append((vertices, path))
    return paths
