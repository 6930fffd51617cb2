"""Normals that agree on which side is out."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree

from .vectors import dot

# derived: cost of an edge between equal normals; a sparse graph would take 0 for no edge
EQUAL_NORMALS_COST = 1e-6


def orient_normals(points: np.ndarray, normals: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Turn normals so that neighbours agree (Hoppe et al. 1992): along the tree over which they turn least.

    `edges` (e, 2) say which points are neighbours. In every connected part the point farthest from the centroid of all
    points says which side is out. Open3D's function makes a Delaunay tetrahedralisation first, which breaks down on
    points of a sphere.
    """
    n = len(points)
    a, b = np.unique(np.sort(edges, axis=1), axis=0).T
    cost = 1 - np.abs(dot(normals[a], normals[b])) + EQUAL_NORMALS_COST
    tree = minimum_spanning_tree(coo_matrix((cost, (a, b)), shape=(n, n)).tocsr())
    part = connected_components(tree, directed=False)[1]
    outward = points - points.mean(axis=0)
    roots = np.empty(part.max() + 1, int)
    order = np.argsort(dot(outward, outward), kind="stable")
    roots[part[order]] = order  # the last one written, the farthest, stays
    before = dijkstra(tree, directed=False, indices=roots, min_only=True, return_predecessors=True, unweighted=True)[1]
    before[roots] = roots
    sign = _sign(normals, normals[before])
    while (before != before[before]).any():  # every turn doubles the part of the path that is behind
        sign, before = sign * sign[before], before[before]
    return normals * (sign * _sign(normals, outward)[before])[:, None]


def _sign(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.where(dot(a, b) < 0, -1.0, 1.0)
