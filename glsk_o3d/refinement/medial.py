"""Centre the vertices in the surface around them."""

import numpy as np

from ..numerics.groups import group_sum

KEEP = 0.2  # weight of staying, per point


def medial_vertices(skeleton):
    """Vertices moved to the point nearest to the normal lines of the input points around them.

    For every vertex the points owned by it and its neighbours, p with normal n, give the least-squares point
    min_x sum |(I - n n^T)(x - p)|^2 + small |x - x0|^2, which lies on the axis of a tube even if the points cover only
    one side of it.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    (M, 3) float array
    """
    centre = skeleton.vertices.mean(axis=0)
    x0 = skeleton.vertices - centre
    m = len(x0)
    owned = skeleton.witnesses
    owner, p, n = skeleton.vertex_of_point[owned], skeleton.points[owned] - centre, skeleton.normals[owned]
    across = np.eye(3) - n[:, :, None] * n[:, None, :]
    lhs = group_sum(across, owner, m)
    rhs = group_sum(np.einsum("nij,nj->ni", across, p), owner, m)
    count = np.bincount(owner, minlength=m).astype(float)
    a, b = skeleton.edges.T
    lhs, rhs, count = (_with_neighbours(q, a, b) for q in (lhs, rhs, count))
    small = (KEEP * count + 1)[:, None, None]
    return np.linalg.solve(lhs + small * np.eye(3), (rhs + small[:, 0] * x0)[:, :, None])[:, :, 0] + centre


def smooth(skeleton):
    """Move every vertex with two neighbours halfway to their midpoint: thin parts have few points per vertex.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    (M, 3) float array
    """
    x = skeleton.vertices
    middle = (_with_neighbours(x, *skeleton.edges.T) - x) / 2
    return np.where(skeleton.degree[:, None] == 2, (x + middle) / 2, x)


def _with_neighbours(values, a, b):
    """Values of each vertex plus those of its neighbours along the edges (a, b)."""
    total = values.copy()
    np.add.at(total, a, values[b])
    np.add.at(total, b, values[a])
    return total
