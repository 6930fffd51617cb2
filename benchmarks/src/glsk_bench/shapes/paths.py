"""Axes cut finely, and as paths and loops."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from glsk_o3d.numerics.vectors import norm

FINE_STEP = 0.5  # fitted: pieces of an axis, in the radius: their balls differ from the cone by a few percent of it


def subdivided(
    nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut every edge in equal pieces no longer than `step` times its smaller radius.

    Parameters
    ----------
    nodes : (M, 3) float array
    edges : (E, 2) int array
    radii : (M,) float array
    step : float

    Returns
    -------
    nodes : (M + p, 3) float array
        Those there were, then the new ones edge by edge.
    edges : (E + p, 2) int array
        The pieces of each edge one after another.
    radii : (M + p,) float array
    """
    a, b = edges.T
    span, swell = nodes[b] - nodes[a], radii[b] - radii[a]
    pieces = np.maximum(np.ceil(norm(span) / (step * np.minimum(radii[a], radii[b]))).astype(int), 1)
    new = pieces - 1
    edge = np.repeat(np.arange(len(edges)), new)
    t = (_counted(new) + 1) / pieces[edge]
    inner = nodes[a[edge]] + t[:, None] * span[edge]
    all_radii = np.concatenate([radii, radii[a[edge]] + t * swell[edge]])
    # piece k of an edge, of those in a row, begins at new node k - 1 of this edge: but for the first, at the old one
    piece_edge, k = np.repeat(np.arange(len(edges)), pieces), _counted(pieces)
    after = len(nodes) + (np.cumsum(new) - new)[piece_edge] + k
    start = np.where(k == 0, a[piece_edge], after - 1)
    end = np.where(k == pieces[piece_edge] - 1, b[piece_edge], after)
    return np.vstack([nodes, inner]), np.column_stack([start, end]), all_radii


def _counted(sizes):
    """0, 1, 2, ... for each of groups that lie one behind the other."""
    return np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)


def chains(n: int, edges: np.ndarray) -> list[list[int]]:
    """Paths between nodes that do not have two neighbours; a ring of its own begins and ends at its first node.

    Parameters
    ----------
    n : int
        Number of nodes.
    edges : (e, 2) int array
        Each once.

    Returns
    -------
    list of list of int
        The nodes of each path in order.
    """
    around: list[dict[int, None]] = [{} for _ in range(n)]
    for a, b in edges.tolist():
        around[a][b] = around[b][a] = None
    degree = [len(links) for links in around]
    found = []
    for start in sorted(range(n), key=lambda node: degree[node] == 2):
        for step in list(around[start]):
            if step not in around[start]:
                continue  # walked from its other end
            path, ahead = [start], step
            while True:
                here = path[-1]
                del around[here][ahead], around[ahead][here]
                path.append(ahead)
                if ahead == start or degree[ahead] != 2:
                    break
                ahead = next(iter(around[ahead]))
            found.append(path)
    return found


def shortest_loop(n: int, edges: np.ndarray, lengths: np.ndarray, path: list[int]) -> list[int]:
    """The shortest loop through the first edge of a path, and so through all of a chain.

    Parameters
    ----------
    n : int
        Number of nodes.
    edges : (e, 2) int array
    lengths : (e,) float array
    path : list of int

    Returns
    -------
    list of int
        Its nodes in order, each once; none if there is no loop.
    """
    if path[0] == path[-1]:
        return path[:-1]
    kept = (edges != path[:2]).any(axis=1) & (edges != path[1::-1]).any(axis=1)
    (a, b), length = edges[kept].T, lengths[kept]
    links = coo_matrix((np.r_[length, length], (np.r_[a, b], np.r_[b, a])), (n, n)).tocsr()
    distance, before = dijkstra(links, indices=path[0], return_predecessors=True)
    if not np.isfinite(distance[path[1]]):
        return []
    loop = [path[1]]
    while loop[-1] != path[0]:
        loop.append(int(before[loop[-1]]))
    return loop
