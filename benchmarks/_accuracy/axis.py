"""Where points are along a curve of straight edges."""

from __future__ import annotations

import numpy as np


def feet(points, nodes, edges):
    """Distance of each point to a curve of straight edges, the edge it is nearest to, and how far along that edge."""
    start, end = nodes[edges].swapaxes(0, 1)
    span, offset = end - start, points[:, None] - start
    part = (offset * span).sum(axis=2) / np.maximum((span**2).sum(axis=1), np.finfo(float).tiny)
    part = np.clip(part, 0, 1)
    distance = np.linalg.norm(offset - part[:, :, None] * span, axis=2)
    edge = distance.argmin(axis=1)
    row = np.arange(len(points))
    return distance[row, edge], edge, part[row, edge]


def local_radius(axis, points):
    """Radius of the true axis where it is nearest to each point."""
    _, edge, part = feet(points, axis.nodes, axis.edges)
    start, end = axis.radii[axis.edges[edge]].T
    return start + (end - start) * part
