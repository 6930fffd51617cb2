"""Nearest neighbours, tangent planes and axes."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d.numerics import neighbourhoods as module
from glsk_o3d.numerics.neighbourhoods import (
    nearest_left,
    nearest_neighbours,
    plane_axes,
    principal,
    row_medians,
    scatter,
)
from glsk_o3d.numerics.vectors import PAIRS

RNG = np.random.default_rng(0)
CLOUD = RNG.normal(size=(300, 3))


@pytest.mark.parametrize("k", [1, 2, 9, 300])
def test_nearest_neighbours_against_all_distances(k):
    distance, neighbours = nearest_neighbours(CLOUD, k)
    brute = cdist(CLOUD, CLOUD)
    np.testing.assert_allclose(distance, np.sort(brute, axis=1)[:, :k], rtol=1e-12)
    np.testing.assert_array_equal(neighbours, np.argsort(brute, axis=1)[:, :k])
    np.testing.assert_array_equal(neighbours[:, 0], np.arange(300))


@pytest.mark.parametrize("k", [1, 9])
@pytest.mark.parametrize("count", ["2", "3", "64"])
def test_threads_find_the_same(count, k, monkeypatch):
    points = np.random.default_rng(1).normal(size=(13000, 3))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    alone = nearest_neighbours(points, k)
    monkeypatch.setenv("OMP_NUM_THREADS", count)
    for one, other in zip(alone, nearest_neighbours(points, k), strict=True):
        np.testing.assert_array_equal(one, other)


def test_few_points_start_no_threads(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setattr(module, "ThreadPoolExecutor", None)
    assert nearest_neighbours(CLOUD, 4)[1].shape == (300, 4)
    with pytest.raises(TypeError):
        nearest_neighbours(np.random.default_rng(0).normal(size=(8192, 3)), 4)


ASK_ON_AND_ON = """
import signal
import numpy as np
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
signal.signal(signal.SIGINT, signal.default_int_handler)  # who starts the tests may ignore it
try:
    print("begun", flush=True)
    while True:
        nearest_neighbours(np.random.default_rng(0).random((30000, 3)), 16)
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.parametrize("delay", [0.05, 0.12, 0.19, 0.23])
def test_threads_may_be_interrupted(delay):
    environment = os.environ | {"OMP_NUM_THREADS": "4"}
    asking = subprocess.Popen([sys.executable, "-c", ASK_ON_AND_ON], env=environment, stdout=subprocess.PIPE, text=True)
    try:
        assert asking.stdout.readline() == "begun\n"
        time.sleep(delay)
        asking.send_signal(signal.SIGINT)
        assert asking.communicate()[0] == "stopped\n"
        assert asking.returncode == 0
    finally:
        asking.kill()
        asking.wait()


AT_THE_END = """
import atexit
import numpy as np
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
atexit.register(lambda: print(nearest_neighbours(np.random.default_rng(0).random((30000, 3)), 16)[1].shape))
"""


def test_an_interpreter_that_ends_still_finds_them():
    environment = os.environ | {"OMP_NUM_THREADS": "4"}
    done = subprocess.run([sys.executable, "-c", AT_THE_END], env=environment, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("(30000, 16)\n", "")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99, 1.0])
@pytest.mark.parametrize("k", [1, 5, 12])
def test_nearest_among_those_left_as_if_asked_anew(share, k):
    left = RNG.random(300) < share
    left[:k] = True
    expected = nearest_neighbours(CLOUD[left], k)[1]
    np.testing.assert_array_equal(nearest_left(CLOUD, nearest_neighbours(CLOUD, 12)[1], left, k), expected)


def test_those_with_enough_known_neighbours_are_not_asked_anew(monkeypatch):
    known, left = nearest_neighbours(CLOUD, 12)[1], np.ones(300, bool)
    left[known[0, 1:4]] = False  # nine of the first point's twelve are left
    asked = []

    def ask(points, k, of):
        asked.append(len(of))
        return nearest_neighbours(points, k, of)

    monkeypatch.setattr(module, "nearest_neighbours", ask)
    nearest_left(CLOUD, known, left, 9)
    assert asked == []
    nearest_left(CLOUD, known, left, 10)
    assert 0 < sum(asked) < 40


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
    monkeypatch.setattr(module, "SCATTER_CHUNK", 64)
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
