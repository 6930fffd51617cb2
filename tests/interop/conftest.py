"""Small skeletons that know everything a skeleton can hold."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from glsk_o3d.report import IterationRecord, Report
from glsk_o3d.skeleton import Skeleton


def build(vertices, edges, n_points=7, seed=0):
    """A skeleton with awkward numbers in every field: no short decimals, dropped points, NaN and infinity."""
    rng = np.random.default_rng(seed)
    m = len(vertices)
    points, normals = rng.normal(size=(2, n_points, 3))
    owners = rng.integers(0, m, n_points)
    points[0], points[1], normals[:2], owners[:2] = np.nan, [np.inf, -np.inf, -0.0], np.nan, -1
    floats = iter([0.1 + 0.2, math.nan, 1 / 3, math.inf, -0.0, 1e-300, np.float64(0.9), -math.inf] * 9)
    wholes = iter([1, np.int64(4), 2**53 + 1] * 9)
    records = tuple(
        IterationRecord(**{f.name: next(wholes if f.type in (int, "int") else floats) for f in fields(IterationRecord)})
        for _ in range(2)
    )
    report = Report(n_input=n_points, seconds={"RingBuilder": 1 / 7}, iterations=records, warnings=("häßlich",))
    confidence = np.where(np.arange(m) == 1, np.nan, rng.random(m) / 3)
    return Skeleton(vertices, edges, rng.random(m) / 3, owners, points, normals, report, confidence)


@pytest.fixture
def make():
    return build


@pytest.fixture
def tree():
    """A trunk with a fork: 6 vertices, 5 edges, 3 leaves, 1 junction."""
    vertices = np.array([[0, 0, 0], [0, 0, 1], [0.1, 0, 2], [1, 0, 3], [-1, 1 / 3, 3], [-1.5, 0.7, 4]]) * math.pi
    return build(vertices, [[0, 1], [1, 2], [2, 3], [2, 4], [4, 5]])


@pytest.fixture
def loop():
    """A ring of five vertices with a tail and with one long chord: two loops."""
    angle = np.arange(5) * 0.4 * np.pi
    vertices = np.array([*np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [2, 0, 0]])
    return build(vertices, [[0, 1], [0, 2], [0, 4], [0, 5], [1, 2], [2, 3], [3, 4]])


@pytest.fixture
def forest():
    """Two paths and a vertex by itself: three components."""
    vertices = np.random.default_rng(5).normal(size=(6, 3)) + [1e6, 0, 0]
    return build(vertices, [[0, 3], [1, 2], [2, 5]])


@pytest.fixture
def dot():
    """One vertex, no edge."""
    return build(np.array([[0.1, 0.2, 0.3]]), np.empty((0, 2)))


@pytest.fixture(params=["tree", "loop", "forest", "dot"])
def skeleton(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def bare(tree):
    """A skeleton without a cloud."""
    return replace(tree, points=(), normals=(), vertex_of_point=())
