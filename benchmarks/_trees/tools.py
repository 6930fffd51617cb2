"""What makes skeletons of trees: this package, level sets, and other tools, each called as its documentation says."""

from __future__ import annotations

from functools import partial

import numpy as np
from _peers import PEERS, Graph, Peer, ours, separators_of_points
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

NEIGHBOURS = (6, 10, 20, 30)  # with which PyGEL3D is tried, since its result hangs on them
HEIGHT = 10.0  # in metres, to which trees are scaled for PyTLidar, whose parameters are in metres


def level_sets(points: np.ndarray, k: int = 10) -> Graph:
    """Points in bands of equal geodesic distance from the lowest one; each connected piece of a band is a vertex."""
    n, (distance, neighbour) = len(points), cKDTree(points).query(points, k + 1)
    near = coo_matrix((distance[:, 1:].ravel(), (np.repeat(np.arange(n), k), neighbour[:, 1:].ravel())), (n, n)).tocsr()
    graph = near.maximum(near.T)
    while (pieces := connected_components(graph)[1]).any():  # join what is apart where it is nearest, piece by piece
        apart = pieces != pieces[0]
        gap, other = cKDTree(points[apart]).query(points[~apart])
        link = np.flatnonzero(~apart)[gap.argmin()], np.flatnonzero(apart)[other[gap.argmin()]]
        graph = graph.maximum(coo_matrix((np.full(2, gap.min()), (link, link[::-1])), (n, n)).tocsr())
    from_root = dijkstra(graph, indices=points[:, 2].argmin())
    band = (from_root / (1.5 * np.median(distance[:, 1:4]))).astype(int)
    a, b = graph.nonzero()
    same = band[a] == band[b]
    count, vertex = connected_components(coo_matrix((np.ones(same.sum()), (a[same], b[same])), (n, n)))
    places = np.stack([np.bincount(vertex, axis) for axis in points.T], axis=1) / np.bincount(vertex)[:, None]
    ends = np.unique(np.stack([vertex[a[~same]], vertex[b[~same]]], axis=1), axis=0)
    lengths = np.linalg.norm(np.diff(places[ends], axis=1)[:, 0], axis=1)
    tree = minimum_spanning_tree(coo_matrix((lengths + 1e-12, ends.T), (count, count)))
    return places, np.column_stack(tree.nonzero())


def pytlidar(points: np.ndarray) -> Graph:
    """PyTLidar's TreeQSM with the inputs that it estimates; the axes of its cylinders, each joined to its parent."""
    from PyTLidar.treeqsm import treeqsm
    from PyTLidar.Utils.define_input import define_input

    scale, foot = HEIGHT / np.ptp(points[:, 2]), points.min(axis=0)
    cloud = (points - foot) * scale
    silent = dict.fromkeys(("plot", "savetxt", "savemat", "savepdf", "disp"), 0)
    models, _ = treeqsm(cloud, define_input(cloud, 1, 1, 1)[0] | silent)
    found = models[0]["cylinder"]
    n, parent = len(found["start"]), np.asarray(found["parent"], int)
    start = np.asarray(found["start"], float)
    end = start + np.asarray(found["axis"], float) * np.asarray(found["length"], float)[:, None]
    child = np.flatnonzero(parent >= 0)
    further = np.linalg.norm(end[parent[child]] - start[child], axis=1)
    nearer_end = np.where(further < np.linalg.norm(start[parent[child]] - start[child], axis=1), n, 0) + parent[child]
    cylinders = np.column_stack([np.arange(n), n + np.arange(n)])
    return np.concatenate([start, end]) / scale + foot, np.concatenate(
        [cylinders, np.stack([nearer_end, child], axis=1)]
    )


def _swept(k):
    return Peer(f"PyGEL3D, {k} neighbours", ("PyGEL3D",), "points", partial(separators_of_points, neighbours=k))


TOOLS: dict[str, Peer] = {
    "tree": Peer("`tree`", (), "points", partial(ours, "tree")),
    "default": PEERS["default"],
    "untraced": Peer(
        "`default`, `Tracer.surface=0`", (), "points", partial(ours, "default", options={"Tracer.surface": 0})
    ),
    "cao2010": PEERS["cao2010"],
    "levels": Peer("geodesic level sets", (), "points", level_sets),
    "pytlidar": Peer("PyTLidar, TreeQSM", ("PyTLidar",), "points", pytlidar),
    **{f"pygel-{k}": _swept(k) for k in NEIGHBOURS},
    "pc-skeletor": PEERS["pc-skeletor"],
    "cgal": PEERS["cgal"],
}
"""By name; each is given points with z up."""
