"""Diffusion over a surface: closed forms on a plane, and what it must not mind."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d.geometry.diffusion import Diffusion
from glsk_o3d.geometry.neighbourhoods import nearest_neighbours

RNG = np.random.default_rng(0)
GRID = np.stack(np.meshgrid(np.arange(60.0), np.arange(60.0), [0.0]), axis=-1).reshape(-1, 3)


def diffused(points, values, length):
    _, neighbours = nearest_neighbours(points, min(9, len(points)))
    return Diffusion(points, neighbours)(values, np.full(len(points), float(length)))


@pytest.mark.parametrize("length", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("wave", [12.0, 20.0])
def test_a_wave_on_a_plane_shrinks_by_its_eigenvalue(length, wave):
    """(I - l^2 Laplacian)^-1 divides cos(k x) by 1 + l^2 k^2."""
    k = 2 * np.pi / wave
    inside = (np.abs(GRID[:, :2] - 29.5) < 29.5 - 4 * length).all(axis=1)
    actual = diffused(GRID, np.cos(k * GRID[:, :1]), length)[inside, 0]
    wanted = np.cos(k * GRID[inside, 0]) / (1 + (length * k) ** 2)
    np.testing.assert_allclose(actual, wanted, atol=0.08)


def test_few_points_diffuse_as_their_dense_system_says():
    """Conjugate gradients solve a system of eight points in eight steps: (I + l^2 4 / rho^2 (I - D^-1 W)) u' = u."""
    points, values, length = RNG.normal(size=(8, 3)), RNG.normal(size=(8, 2)), RNG.uniform(0.5, 3, 8)
    neighbours, weight = nearest_neighbours(points, 4)[1], np.zeros((8, 8))
    for row in neighbours:
        weight[row[0], row[1:]] += 0.5
        weight[row[1:], row[0]] += 0.5
    degree = weight.sum(axis=1)
    mean_square = (weight * cdist(points, points) ** 2).sum(axis=1) / degree
    laplacian = (4 / mean_square)[:, None] * (np.eye(8) - weight / degree[:, None])
    expected = np.linalg.solve(np.eye(8) + length[:, None] ** 2 * laplacian, values)
    np.testing.assert_allclose(Diffusion(points, neighbours)(values, length), expected, atol=1e-9)


def test_diffusion_does_not_depend_on_scale_and_offset():
    values = RNG.normal(size=(len(GRID), 3))
    expected = diffused(GRID, values, 2)
    np.testing.assert_allclose(diffused(1e3 * GRID + 1e6, values + 1e6, 2e3) - 1e6, expected, atol=1e-6)


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.zeros((20, 3)), np.repeat(GRID[:4], 9, axis=0)])
def test_points_in_one_place_diffuse_to_finite_numbers(points):
    assert np.isfinite(diffused(points, RNG.normal(size=(len(points), 2)), 1)).all()
