"""The sample of a cloud in blocks is that of the whole."""

import tracemalloc

import numpy as np
import pytest

from glsk_o3d.geometry import grid_sampling
from glsk_o3d.geometry.grid_sampling import sample_blocks, sample_cloud, sample_grid
from glsk_o3d.samples import torus


def in_blocks(points, rows):
    return lambda: (points[i : i + rows] for i in range(0, len(points), rows))


def clouds():
    random = np.random.default_rng(3)
    surface = torus(20000).points
    yield "surface", surface

    yield "far from the origin", surface + [4e5, 5e6, 100]
    yield "a few far off", np.concatenate([surface, random.normal(scale=1e4, size=(12, 3))])
    yield "volume", random.random((20000, 3))
    yield "line", np.outer(random.random(20000), [1.0, 2, 3])
    yield "on a lattice", np.unique(random.integers(0, 60, (30000, 3)), axis=0).astype(float)
    dense = np.concatenate([surface, surface[:300] * 0.01])
    yield "uneven, in the order of a scanner", dense[np.argsort(dense[:, 0])]


@pytest.mark.parametrize("rows", [7919, 1 << 20])
@pytest.mark.parametrize("points", [pytest.param(points, id=name) for name, points in clouds()])
def test_the_sample_of_blocks_is_that_of_the_whole(points, rows):
    kept, _, weight = sample_grid(points, 2500)
    actual, counts = sample_blocks(in_blocks(points, rows), lambda n: 2500)
    np.testing.assert_array_equal(actual, points[kept])
    np.testing.assert_array_equal(counts, weight)


@pytest.mark.parametrize(("n", "rows"), [(5001, 1000), (5001, 5000), (300, 1)])
def test_a_small_last_block_changes_nothing(n, rows):
    """Such as a last block of one point."""
    for seed in range(5):
        points = np.random.default_rng(seed).random((n, 3))
        kept = sample_grid(points, n // 10)[0]
        np.testing.assert_array_equal(sample_blocks(in_blocks(points, rows), lambda _: n // 10)[0], points[kept])


@pytest.mark.parametrize(("chunk", "threads"), [(37, 1), (1000, 3)])
def test_a_sample_does_not_depend_on_threads_and_chunks(chunk, threads, monkeypatch):
    rng = np.random.default_rng(0)
    # one cell has more points than a chunk, and many of them are copies
    points = np.concatenate([rng.random((4000, 3)), 0.5 + 1e-4 * rng.random((3000, 3)), np.full((2000, 3), 0.25)])
    points = rng.permutation(np.concatenate([points, points[::3]]))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    known = sample_grid(points, 500), sample_blocks(in_blocks(points, 2500), lambda _: 500)
    monkeypatch.setattr(grid_sampling, "GRID_CHUNK", chunk)
    monkeypatch.setenv("OMP_NUM_THREADS", str(threads))
    actual = sample_grid(points, 500), sample_blocks(in_blocks(points, 2500), lambda _: 500)
    for one, other in zip(known[0] + known[1], actual[0] + actual[1], strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_sample_of_a_sample_counts_all_points():
    points = torus(20000).points
    kept, _, counts = sample_grid(points, 4000)
    fewer, _, of_these = sample_cloud(points[kept], 1000, counts)
    assert len(fewer) < 1500
    assert of_these.sum() == 20000
    np.testing.assert_array_equal(sample_cloud(points[kept], 4000, counts)[2], counts)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_cloud(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # each thread holds blocks, and how many at once is chance

    def peak(n):
        tracemalloc.start()
        sample_blocks(lambda: (np.random.default_rng(k).normal(size=(20000, 3)) for k in range(n)), lambda _: 2000)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few, many = peak(10), peak(60)
    assert many < 1.2 * few  # the cells are as many; of all the points it would be six times as much
