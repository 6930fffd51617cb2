"""The sample of a cloud in blocks is that of the whole."""

import tracemalloc

import numpy as np
import pytest

from glsk_o3d.numerics.grid_sampling import sample_blocks, sample_cloud, sample_grid
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
    found, counts = sample_blocks(in_blocks(points, rows), lambda n: 2500)
    np.testing.assert_array_equal(found, points[kept])
    np.testing.assert_array_equal(counts, weight)


def test_a_sample_of_a_sample_counts_all_points():
    points = torus(20000).points
    kept, _, counts = sample_grid(points, 4000)
    fewer, _, of_these = sample_cloud(points[kept], 1000, counts)
    assert len(fewer) < 1500
    assert of_these.sum() == 20000
    np.testing.assert_array_equal(sample_cloud(points[kept], 4000, counts)[2], counts)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_cloud():
    def peak(n):
        tracemalloc.start()
        sample_blocks(lambda: (np.random.default_rng(k).normal(size=(20000, 3)) for k in range(n)), lambda _: 2000)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few, many = peak(10), peak(60)
    assert many < 1.2 * few  # the cells are as many; of all the points it would be six times as much
