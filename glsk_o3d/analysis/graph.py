"""Graphs as arrays of edges."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order

from ..errors import InvalidParameterError
from ..numerics.components import component_labels


def check_graph(vertices, edges, name):
    """Edges as an (E, 2) int64 array, if they and the vertices make a graph embedded in space.

    Parameters
    ----------
    vertices : (M, 3) float array
    edges : array_like
    name : str
        What to call the graph in an error.

    Returns
    -------
    (E, 2) int64 array

    Raises
    ------
    InvalidParameterError
    """
    edges = np.asarray(edges)
    edges = edges if edges.size else np.empty((0, 2), np.int64)
    if len(vertices) == 0:
        raise InvalidParameterError(f"the {name} is empty")
    if not np.isfinite(vertices).all():
        raise InvalidParameterError(f"the {name} has coordinates that are not finite")
    if edges.ndim != 2 or edges.shape[1] != 2 or edges.dtype.kind not in "iu":
        raise InvalidParameterError(f"the {name}'s edges must be an (E, 2) array of whole numbers")
    if edges.size and (edges.min() < 0 or edges.max() >= len(vertices)):
        raise InvalidParameterError(f"an edge of the {name} names a vertex that is not there")
    return edges.astype(np.int64)


def simple_edges(edges):
    """Edges as pairs i < j, sorted, each once, and none from a node to itself.

    Parameters
    ----------
    edges : (E, 2) int array

    Returns
    -------
    (F, 2) int array
    """
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    return edges[edges[:, 0] != edges[:, 1]]


def count_components(n, edges):
    """Connected components of a graph with n nodes.

    Parameters
    ----------
    n : int
    edges : (E, 2) int array

    Returns
    -------
    int
    """
    return int(component_labels(n, edges).max(initial=-1)) + 1


def on_loops(n, edges):
    """Which edges lie on a loop: those without which their ends are still connected.

    Parameters
    ----------
    n : int
    edges : (E, 2) int array
        Each once, and none from a node to itself.

    Returns
    -------
    (E,) bool array
    """
    # a tree from a root above all components; every edge that is not in it closes a loop with the tree
    _, first = np.unique(component_labels(n, edges), return_index=True)
    linked = np.concatenate([edges, np.column_stack([np.full(len(first), n), first])])
    graph = coo_matrix((np.ones(len(linked)), linked.T), shape=(n + 1, n + 1)).tocsr()
    order, parent = breadth_first_order(graph, n, directed=False)
    is_parent = parent[edges[:, ::-1]] == edges  # an end, of the other one
    closing = ~is_parent.any(axis=1)
    # of each node the loops with one end in its subtree and the other outside, a bit each: they pass the edge above it
    passing = [0] * (n + 1)
    for loop, ends in enumerate(edges[closing].tolist()):
        for node in ends:
            passing[node] ^= 1 << loop
    for node in order[:0:-1].tolist():
        passing[parent[node]] ^= passing[node]
    below = np.where(is_parent[:, 0], edges[:, 1], edges[:, 0])
    return closing | np.array([loops != 0 for loops in passing])[below]
