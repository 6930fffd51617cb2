"""Nearest neighbours, tangent planes and axes."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d.geometry.neighbourhoods import nearest_left, nearest_neighbours, plane_axes, principal, scatter
from glsk_o3d.geometry.vectors import PAIRS

RNG = np.random.default_rng(0)
CLOUD = RNG.normal(size=(300, 3))


@pytest.mark.parametrize("k", [1, 2, 9, 300])
def test_nearest_neighbours_are_those_of_all_distances(k):
    distance, neighbours = nearest_neighbours(CLOUD, k)
    brute = cdist(CLOUD, CLOUD)
    np.testing.assert_allclose(distance, np.sort(brute, axis=1)[:, :k], rtol=1e-12)
    np.testing.assert_array_equal(neighbours, np.argsort(brute, axis=1)[:, :k])
    np.testing.assert_array_equal(neighbours[:, 0], np.arange(300))


def test_threads_find_the_same(monkeypatch):
    points = np.random.default_rng(1).normal(size=(13000, 3))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    alone = nearest_neighbours(points, 9)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    for one, other in zip(alone, nearest_neighbours(points, 9), strict=True):
        np.testing.assert_array_equal(one, other)


ASK_ON_AND_ON = """
import signal
import numpy as np
from glsk_o3d.geometry.neighbourhoods import nearest_neighbours
signal.signal(signal.SIGINT, signal.default_int_handler)  # who starts the tests may ignore it
try:
    print("begun", flush=True)
    while True:
        nearest_neighbours(np.random.default_rng(0).random((30000, 3)), 16)
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.slow
def test_threads_may_be_interrupted():
    environment = os.environ | {"OMP_NUM_THREADS": "4"}
    asking = subprocess.Popen([sys.executable, "-c", ASK_ON_AND_ON], env=environment, stdout=subprocess.PIPE, text=True)
    try:
        assert asking.stdout.readline() == "begun\n"
        time.sleep(0.12)
        asking.send_signal(signal.SIGINT)
        assert asking.communicate()[0] == "stopped\n"
        assert asking.returncode == 0
    finally:
        asking.kill()
        asking.wait()


@pytest.mark.parametrize("share", [0.1, 0.9, 1.0])
@pytest.mark.parametrize("k", [1, 5, 12])
def test_nearest_remaining_points_are_as_if_asked_anew(share, k):
    remaining = RNG.random(300) < share
    remaining[:k] = True
    expected = nearest_neighbours(CLOUD[remaining], k)[1]
    np.testing.assert_array_equal(nearest_left(CLOUD, nearest_neighbours(CLOUD, 12)[1], remaining, k), expected)


def test_principal_components_are_those_of_covariances():
    neighbours = nearest_neighbours(CLOUD, 12)[1]
    spread, normals = principal(CLOUD, neighbours)
    covariance = np.stack([np.cov(p.T, bias=True) for p in CLOUD[neighbours]])
    np.testing.assert_allclose(spread / 12, np.linalg.eigvalsh(covariance), rtol=1e-9)
    across = np.einsum("ni,nij,nj->n", normals, covariance, normals)
    np.testing.assert_allclose(across, spread[:, 0] / 12, rtol=1e-9)
    entries = scatter(CLOUD, neighbours)
    np.testing.assert_allclose(entries / 12, np.stack([covariance[:, i, j] for i, j in PAIRS]), atol=1e-14)


def test_degenerate_neighbourhoods_still_give_normals():
    line = np.outer(np.arange(20.0), [1, 2, 2])
    for points in (line, np.ones((20, 3))):
        spread, normals = principal(points, nearest_neighbours(points, 8)[1])
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-13)
        assert (spread >= 0).all()
    normals = principal(line, nearest_neighbours(line, 8)[1])[1]
    np.testing.assert_allclose(normals @ np.array([1, 2, 2]) / 3, 0, atol=1e-7)


def test_plane_axes_are_orthonormal_and_right_handed():
    """Also of the axes, of normals that point nearly down, and of those on the seam."""
    down = [[x, y, -np.sqrt(1 - x * x - y * y)] for x in (1e-9, -1e-4, 0) for y in (1e-16, 1e-5)]
    seam = [[1, 0, 0.0], [1, 0, -0.0], [0.6, 0.8, -0.0], [0.6, -0.8, 0.0]]
    normals = np.concatenate([CLOUD / np.linalg.norm(CLOUD, axis=1, keepdims=True), np.eye(3), -np.eye(3), down, seam])
    axes = plane_axes(normals)
    frame = np.concatenate([axes, normals[:, :, None]], axis=2)
    np.testing.assert_allclose(frame.transpose(0, 2, 1) @ frame, np.tile(np.eye(3), (len(normals), 1, 1)), atol=4e-15)
    np.testing.assert_allclose(np.linalg.det(frame), 1, atol=1e-14)
