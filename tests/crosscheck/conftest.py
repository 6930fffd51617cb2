"""Meshes and clouds with known one-rings, and the check of a torus."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from glsk_o3d import samples
from glsk_o3d.crosscheck import cross_check


@pytest.fixture(scope="session")
def even_ball():
    """Points on a sphere of radius 1/2, almost a regular lattice (Fibonacci), and their Delaunay triangles."""

    def make(n):
        i = np.arange(n) + 0.5
        z, turn = 1 - 2 * i / n, np.pi * (1 + np.sqrt(5)) * i
        points = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z]) / 2
        faces = ConvexHull(points).simplices.astype(np.int64)
        a, b, c = points[faces].transpose(1, 0, 2)
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
        faces[inward] = faces[inward][:, ::-1]
        return points, faces

    return make


@pytest.fixture(scope="session")
def ring():
    ring = samples.torus(1500)
    ring.points.flags.writeable = False  # the input is not changed
    return ring


@pytest.fixture(scope="session")
def check(ring):
    return cross_check(ring.points)


@pytest.fixture(scope="session")
def grid():
    """Faces of a grid of n by m vertices, closed in either direction or not."""

    def make(n, m, close_n, close_m):
        i, j = (a.ravel() for a in np.mgrid[: n - 1 + close_n, : m - 1 + close_m])
        corners = [(i + a) % n * m + (j + b) % m for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        return np.concatenate([np.column_stack([corners[k] for k in which]) for which in ((0, 1, 2), (0, 2, 3))])

    return make
