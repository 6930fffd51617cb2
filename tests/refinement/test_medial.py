"""Centring by normal lines, and smoothing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.refinement import medial
from glsk_o3d.refinement.medial import KEEP, medial_vertices, smooth


def half_tube(around, height=0.12, n=4000):
    """Scanned from above only: vertices above the axis of a tube of radius 0.15."""
    rng = np.random.default_rng(0)
    angle, along = rng.uniform(0, np.pi, n), rng.uniform(-1, 1, n)
    normals = np.column_stack([0 * along, np.cos(angle), np.sin(angle)])
    points = 0.15 * normals + along[:, None] * [1, 0, 0]
    x = np.linspace(-0.95, 0.95, 20)
    vertices = np.column_stack([x, 0 * x, 0 * x + height])
    sign = rng.choice([-1, 1], (n, 1))  # normals are known up to it
    return around(vertices, [(i, i + 1) for i in range(19)], points, sign * normals)


def neighbourhood(skeleton, v):
    near = {v} | {b for a, b in skeleton.edges.tolist() if a == v} | {a for a, b in skeleton.edges.tolist() if b == v}
    return np.flatnonzero(np.isin(skeleton.vertex_of_point, list(near)))


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 12), st.booleans())
def test_is_the_least_squares_point(random_skeleton, seed, m, every):
    skeleton = random_skeleton(seed, m, every=every)
    moved = medial_vertices(skeleton)
    for v in range(m):
        own = neighbourhood(skeleton, v)
        n = skeleton.normals[own]
        across = (np.eye(3) - n[:, :, None] * n[:, None]).reshape(-1, 3)
        right = np.einsum("nij,nj->ni", across.reshape(-1, 3, 3), skeleton.points[own]).ravel()
        stay = np.sqrt(KEEP * len(own) + 1)
        lhs, rhs = np.vstack([across, stay * np.eye(3)]), np.concatenate([right, stay * skeleton.vertices[v]])
        np.testing.assert_allclose(moved[v], np.linalg.lstsq(lhs, rhs, rcond=None)[0], atol=1e-9)


def test_vertices_over_half_a_tube_move_into_its_axis(around):
    skeleton = half_tube(around)
    height = [0.12]
    for _ in range(6):
        skeleton = replace(skeleton, vertices=medial_vertices(skeleton))
        height.append(np.abs(skeleton.vertices[:, 2]).max())
    # each pass leaves KEEP of the way against half a weight per point: 0.2 / 0.7
    assert height[1] == pytest.approx(0.12 * KEEP / (0.5 + KEEP), rel=0.15)
    assert height[6] < 1e-3
    assert np.abs(skeleton.vertices[:, 1]).max() < 5e-3


@pytest.mark.parametrize(("keep", "left"), [(0, 0), (0.5, 1 / 2), (1e9, 1)])
def test_keep_pulls_back(around, monkeypatch, keep, left):
    monkeypatch.setattr(medial, "KEEP", keep)
    assert medial_vertices(half_tube(around))[:, 2].mean() == pytest.approx(0.12 * left, abs=0.004)


def test_no_points_no_move(around):
    skeleton = half_tube(around)
    far = replace(skeleton, vertices=np.concatenate([skeleton.vertices, [[5, 6, 7]]]), radii=np.full(21, 0.1))
    np.testing.assert_allclose(medial_vertices(far)[20], [5, 6, 7], atol=1e-12)
    silent = replace(skeleton, normals=np.full_like(skeleton.normals, np.nan))
    np.testing.assert_allclose(medial_vertices(silent), skeleton.vertices, atol=1e-12)


def test_goes_with_the_cloud(random_skeleton):
    raw = random_skeleton(5)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    moved = replace(raw, vertices=raw.vertices @ turn + 1e4, points=raw.points @ turn + 1e4, normals=raw.normals @ turn)
    np.testing.assert_allclose(medial_vertices(moved) - 1e4, medial_vertices(raw) @ turn, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 20))
def test_smooth_moves_vertices_with_two_neighbours_halfway(random_skeleton, seed, m):
    skeleton = random_skeleton(seed, m, 0.4)
    before = skeleton.vertices.copy()
    moved = smooth(skeleton)
    np.testing.assert_array_equal(skeleton.vertices, before)
    for v in range(m):
        near = [a + b - v for a, b in skeleton.edges.tolist() if v in (a, b)]
        expected = (before[v] + before[near].mean(axis=0)) / 2 if len(near) == 2 else before[v]
        np.testing.assert_allclose(moved[v], expected, atol=1e-12)


def test_smooth_keeps_leaves_and_junctions_exactly(random_skeleton):
    skeleton = random_skeleton(2, 20, 0.4)
    still = skeleton.degree != 2
    assert 0 < still.sum() < 20
    np.testing.assert_array_equal(smooth(skeleton)[still], skeleton.vertices[still])
