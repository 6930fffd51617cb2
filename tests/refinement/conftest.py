"""Skeletons made by hand."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton


@pytest.fixture(scope="session")
def ringed():
    """A skeleton each of whose vertices owns `per` points at exactly the distance `radius`, normals outward."""

    def make(vertices, edges, radius=0.1, per=12, seed=0):
        vertices = np.asarray(vertices, float)
        m = len(vertices)
        radius, owner = np.broadcast_to(radius, m), np.repeat(np.arange(m), per)
        normals = np.random.default_rng(seed).normal(size=(len(owner), 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        edges = sorted({(min(a, b), max(a, b)) for a, b in edges})
        points = vertices[owner] + radius[owner, None] * normals
        return Skeleton(vertices, edges, radius, owner, points, normals)

    return make


@pytest.fixture(scope="session")
def around():
    """A skeleton whose points belong to their nearest vertex."""

    def make(vertices, edges, points, normals, radius=0.1):
        owner = cKDTree(vertices).query(points)[1]
        return Skeleton(vertices, edges, np.full(len(vertices), radius), owner, points, normals)

    return make


@pytest.fixture(scope="session")
def random_skeleton():
    """A random geometric graph with uneven support; some points have no vertex, some vertices perhaps no point."""

    def make(seed, m=12, reach=0.5, n=40, every=True):
        rng = np.random.default_rng(seed)
        vertices = rng.uniform(size=(m, 3))
        edges = [(a, b) for a in range(m) for b in range(a + 1, m) if np.linalg.norm(vertices[a] - vertices[b]) < reach]
        owner = rng.integers(-1, m, n)
        owner[:m] = np.arange(m) if every else owner[:m]
        points, normals = rng.uniform(size=(n, 3)), rng.normal(size=(n, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Skeleton(vertices, edges, rng.uniform(0.05, 0.2, m), owner, points, normals)

    return make
