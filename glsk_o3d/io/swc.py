"""SWC: keeps vertices, edges and radii of trees, renumbered from the root outwards; holds no loops, loses all else.

Tools for neurons and plants open it.
"""

from __future__ import annotations

import numpy as np

from ..errors import FileFormatError
from ..skeleton import Skeleton
from .graphs import graph_skeleton
from .text import line, text, words_by_line


def write(skeleton: Skeleton, cut_loops: bool = False) -> bytes:
    """The content of an SWC file; FileFormatError if the skeleton has loops.

    With `cut_loops` one edge per loop is dropped instead, keeping the spanning forest of least length.
    """
    if skeleton.n_loops and not cut_loops:
        raise FileFormatError(
            f"SWC holds trees only and the skeleton has {skeleton.n_loops} loop(s): "
            "pass cut_loops=True to drop an edge of each, or choose another format"
        )
    import networkx

    graph = networkx.Graph()
    graph.add_nodes_from(range(len(skeleton.vertices)))
    graph.add_weighted_edges_from(zip(*skeleton.edges.T.tolist(), skeleton.edge_lengths.tolist(), strict=True))
    forest = networkx.minimum_spanning_tree(graph)
    order = list(networkx.dfs_preorder_nodes(forest))
    number = {vertex: i for i, vertex in enumerate(order, 1)}
    parent = {child: number[vertex] for vertex, child in networkx.dfs_edges(forest)}
    table = np.column_stack([skeleton.vertices, skeleton.radii]).tolist()
    rows = [line(number[vertex], 0, *table[vertex], parent.get(vertex, -1)) for vertex in order]
    return text(["# curve skeleton written by glsk-o3d: id type x y z radius parent", *rows])


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of an SWC file."""
    table = np.array([[float(word) for word in words[:7]] for words in words_by_line(data)])
    if table.ndim != 2 or table.shape[1] != 7:
        raise ValueError("it has no rows of 7 numbers (id type x y z radius parent)")
    names, parents = table[:, 0], table[:, 6]
    order = np.argsort(names)
    child = np.flatnonzero(parents >= 0)
    place = np.searchsorted(names[order], parents[child]).clip(max=len(names) - 1)
    if (names[order][place] != parents[child]).any() or len(np.unique(names)) < len(names):
        raise ValueError("a parent is not there, or two rows have one id")
    return graph_skeleton(table[:, 2:5], np.column_stack([child, order[place]]), table[:, 5])
