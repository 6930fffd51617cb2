"""GraphML: keeps vertices, edges and radii to the last bit, with the length of every edge; loses all else.

networkx, Gephi and Cytoscape open it.
"""

from __future__ import annotations

import io
import math

import numpy as np

from ...interop.packages import require
from ...skeleton import Skeleton
from .graphs import graph_skeleton

_KEYS = ("x", "y", "z", "radius")


def write(skeleton: Skeleton) -> bytes:
    """The content of a GraphML file."""
    import networkx

    graph = networkx.Graph()
    table = np.column_stack([skeleton.vertices, skeleton.radii]).tolist()
    graph.add_nodes_from((i, dict(zip(_KEYS, row, strict=True))) for i, row in enumerate(table))
    edges = zip(*skeleton.edges.T.tolist(), skeleton.edge_lengths.tolist(), strict=True)
    graph.add_weighted_edges_from(edges, weight="length")
    stream = io.BytesIO()
    networkx.write_graphml_xml(graph, stream)
    return stream.getvalue()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a GraphML file."""
    graph = require("networkx").read_graphml(io.BytesIO(data))
    lost = [node for node, facts in graph.nodes(data=True) if not {"x", "y", "z"} <= facts.keys()]
    if lost:
        raise ValueError(f"node {lost[0]!r} lacks x, y or z")
    index = {node: i for i, node in enumerate(graph)}
    rows = [[facts.get(key, math.nan) for key in _KEYS] for _, facts in graph.nodes(data=True)]
    table = np.array(rows, float).reshape(-1, 4)
    return graph_skeleton(table[:, :3], [(index[a], index[b]) for a, b in graph.edges()], table[:, 3])
