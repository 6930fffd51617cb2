"""Graphs as arrays of edges."""

from __future__ import annotations

import numpy as np

from ..errors import InvalidParameterError


def check_graph(vertices, edges, name):
    """Edges as an (E, 2) int64 array; an InvalidParameterError says why `name`, as it calls the graph, is none."""
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
    """Edges, (E, 2) int array, as pairs i < j, sorted, each once, and none from a node to itself."""
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    return edges[edges[:, 0] != edges[:, 1]]
