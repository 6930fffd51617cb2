"""Radii of an axis that has none, from a cloud around it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from glsk_o3d.analysis.curves import along, pieces
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.geometry.groups import group_median
from glsk_o3d.geometry.vectors import TINY, dot, norm

NEAREST_PLACES = 20_000  # fitted: along an axis, among which the nearest is sought, and one for each edge
LEAST_OWNERS = 3  # fitted: points that a radius is measured by, at least: one or two may be anything
FARTHEST_MEDIAN = 0.5  # derived: no body's points are farther from its middle than so much of its diagonal


def radii_from_points(nodes, edges, points):
    """Radii of an axis that has none, (M,) float array of positive numbers, from a cloud around it.

    The radius at a node is the median distance of the points whose nearest place on the axis is nearer to that node
    than to the other end of its edge. Nodes with fewer than three such points have the radius of the nearest one with
    enough, along the axis, or straight where nothing of their part has enough. An InvalidParameterError says that the
    points are not around the axis: too few for any node, far away, or on it.
    """
    node, distance = _owner(nodes, edges, points)
    count = np.bincount(node, minlength=len(nodes))
    radii = group_median(distance, node, len(nodes))
    known = (count >= LEAST_OWNERS) & (radii > 0)
    if np.median(distance) > FARTHEST_MEDIAN * np.linalg.norm(np.ptp(points, axis=0)):
        raise InvalidParameterError("the axis has no points near: are it and the cloud in one place and unit?")
    if not known.any():
        raise InvalidParameterError(
            f"no node of the axis has {LEAST_OWNERS} points around it, so that radii cannot be measured: give them"
        )
    return radii[_nearest_known(nodes, edges, known)]


def _owner(nodes, edges, points):
    """The node that the nearest place on the axis belongs to, and how far that place is; (n,) arrays."""
    if len(edges) == 0:
        distance, node = cKDTree(nodes).query(points)
        return node, distance
    step = max(norm(nodes[edges[:, 1]] - nodes[edges[:, 0]]).sum() / NEAREST_PLACES, TINY)
    row, part = pieces(nodes, edges, step)
    edge = edges[row[cKDTree(along(edges, row, part, nodes)).query(points)[1]]]
    start, span = nodes[edge[:, 0]], nodes[edge[:, 1]] - nodes[edge[:, 0]]
    share = np.clip(dot(points - start, span) / np.maximum(dot(span, span), TINY), 0, 1)
    distance = norm(points - start - share[:, None] * span)
    return np.where(share < 0.5, edge[:, 0], edge[:, 1]), distance


def _nearest_known(nodes, edges, known):
    """The nearest node that is known, along the edges or else straight, (M,) int array; their own for those."""
    n, (a, b) = len(nodes), edges.T
    length = np.maximum(norm(nodes[b] - nodes[a]), TINY)
    graph = coo_matrix((length, (a, b)), (n, n)).tocsr()
    source = dijkstra(graph, directed=False, indices=np.flatnonzero(known), return_predecessors=True, min_only=True)[2]
    apart = np.flatnonzero(source < 0)
    if len(apart):
        source[apart] = np.flatnonzero(known)[cKDTree(nodes[known]).query(nodes[apart])[1]]
    return source
