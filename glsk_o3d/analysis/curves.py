"""Curves as places along their edges, and how far apart two are."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def pieces(nodes, edges, step):
    """Edges cut into equal pieces no longer than `step`: the edge of each piece, and how far along it its middle is.

    Without edges every node stands for itself; `along` knows.
    """
    if len(edges) == 0:
        return np.arange(len(nodes)), np.zeros(len(nodes))
    length = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
    count = np.maximum(np.ceil(length / step).astype(int), 1)
    row = np.repeat(np.arange(len(edges)), count)
    before = np.repeat(np.cumsum(count) - count, count)
    return row, (np.arange(len(row)) - before + 0.5) / count[row]


def along(edges, row, part, values):
    """Values at the nodes, interpolated to the middles of the pieces."""
    if len(edges) == 0:
        return values[row]
    start, end = values[edges[row]].swapaxes(0, 1)
    return start + (end - start) * part.reshape(-1, *[1] * (values.ndim - 1))


def distances(curve, other, step):
    """From places along a curve to the nearest places along another, and the mean of the two radii there.

    Two (n,) float arrays; the places are `step` apart, and the radius is at least that.
    """
    (here, radius), (there, radius_there) = (_places(skeleton, step) for skeleton in (curve, other))
    distance, nearest = cKDTree(there).query(here)
    return distance, np.maximum((radius + radius_there[nearest]) / 2, step)


def _places(skeleton, step):
    row, part = pieces(skeleton.vertices, skeleton.edges, step)
    return tuple(along(skeleton.edges, row, part, values) for values in (skeleton.vertices, skeleton.radii))
