"""Nearest neighbours, tangent planes and axes."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d.numerics import neighbourhoods as module
from glsk_o3d.numerics.neighbourhoods import (
    PAIRS,
    nearest_neighbours,
    plane_axes,
    principal,
    row_medians,
    scatter,
)

RNG = np.random.default_rng(0)
CLOUD = RNG.normal(size=(300, 3))


@pytest.mark.parametrize("k", [1, 2, 9, 300])
def test_nearest_neighbours_against_all_distances(k):
    distance, neighbours = nearest_neighbours(CLOUD, k)
    distance, neighbours = np.reshape(distance, (300, k)), np.reshape(neighbours, (300, k))
    brute = cdist(CLOUD, CLOUD)
    np.testing.assert_allclose(distance, np.sort(brute, axis=1)[:, :k], rtol=1e-12)
    np.testing.assert_array_equal(neighbours, np.argsort(brute, axis=1)[:, :k])
    np.testing.assert_array_equal(neighbours[:, 0], np.arange(300))


@pytest.mark.parametrize("seed", range(4))
def test_plane_of_an_exact_plane(seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = np.column_stack([rng.uniform(size=(200, 2)), np.zeros(200)]) @ turn.T + rng.normal(size=3)
    normals = principal(points, nearest_neighbours(points, 10)[1])[1]
    np.testing.assert_allclose(np.abs(normals @ turn[:, 2]), 1, atol=1e-12)


def test_against_covariances():
    neighbours = nearest_neighbours(CLOUD, 12)[1]
    spread, normals = principal(CLOUD, neighbours)
    covariance = np.stack([np.cov(p.T, bias=True) for p in CLOUD[neighbours]])
    np.testing.assert_allclose(spread / 12, np.linalg.eigvalsh(covariance), rtol=1e-9)
    across = np.einsum("ni,nij,nj->n", normals, covariance, normals)
    np.testing.assert_allclose(across, spread[:, 0] / 12, rtol=1e-9)
    entries = scatter(CLOUD, neighbours)
    np.testing.assert_allclose(entries / 12, np.stack([covariance[:, i, j] for i, j in PAIRS]), atol=1e-14)


def test_normals_of_a_sphere():
    points = CLOUD / np.linalg.norm(CLOUD, axis=1, keepdims=True)
    points = np.concatenate([points, points + 1e-3 * np.random.default_rng(1).normal(size=points.shape)])
    normals = principal(points, nearest_neighbours(points, 12)[1])[1]
    assert np.median(np.abs(np.einsum("ij,ij->i", normals, points))) > 0.99


def test_chunks_do_not_show(monkeypatch):
    neighbours = nearest_neighbours(CLOUD, 8)[1]
    whole = principal(CLOUD, neighbours)[1]
    monkeypatch.setattr(module, "_CHUNK", 64)
    np.testing.assert_array_equal(principal(CLOUD, neighbours)[1], whole)


@pytest.mark.parametrize("k", [3, 8])
def test_degenerate_neighbourhoods_still_give_normals(k):
    line = np.outer(np.arange(20.0), [1, 2, 2])
    for points in (line, np.ones((20, 3))):
        spread, normals = principal(points, np.arange(20)[:, None] * 0 + np.arange(k))
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-13)
        assert (spread >= 0).all()
    normals = principal(line, nearest_neighbours(line, k)[1])[1]
    np.testing.assert_allclose(normals @ np.array([1, 2, 2]) / 3, 0, atol=1e-7)


@pytest.mark.parametrize("k", range(1, 9))
def test_medians_of_rows(k):
    values = RNG.normal(size=(50, k))
    np.testing.assert_array_equal(row_medians(values), np.median(values, axis=1))


NORMALS = {
    "random": CLOUD / np.linalg.norm(CLOUD, axis=1, keepdims=True),
    "axes": np.concatenate([np.eye(3), -np.eye(3)]),
    "nearly down": np.array([[x, y, -np.sqrt(1 - x * x - y * y)] for x in (1e-9, -1e-4, 0) for y in (1e-16, 1e-5)]),
    "on the seam": np.array([[1, 0, 0.0], [1, 0, -0.0], [0.6, 0.8, -0.0], [0.6, -0.8, 0.0]]),
}


@pytest.mark.parametrize("which", NORMALS)
def test_plane_axes_are_orthonormal_and_right_handed(which):
    normals = NORMALS[which]
    axes = plane_axes(normals)
    frame = np.concatenate([axes, normals[:, :, None]], axis=2)
    np.testing.assert_allclose(frame.transpose(0, 2, 1) @ frame, np.tile(np.eye(3), (len(normals), 1, 1)), atol=4e-15)
    np.testing.assert_allclose(np.linalg.det(frame), 1, atol=1e-14)
