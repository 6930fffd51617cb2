"""The skeleton does not hang on roundings, nor on the order of the points."""

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")]


@pytest.mark.parametrize("name", ["y_junction", "two_rings", "sauropod"])
def test_a_topology_stays_where_points_move_by_roundings(name):
    points = getattr(samples, name)(2000).points
    size = 1e-7 * np.linalg.norm(np.ptp(points, axis=0))
    still, moved = (
        glsk.skeletonize(points + size * seed * np.random.default_rng(seed).normal(size=points.shape))
        for seed in (0, 1)
    )
    assert (moved.n_components, moved.n_loops) == (still.n_components, still.n_loops)
    assert len(moved.leaves) == len(still.leaves)


def grids():
    """Clouds with many equal distances: what is nearest is a tie."""
    x, y, z = np.meshgrid(*map(np.arange, (5, 6, 14)), indexing="ij")
    block = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype(float)
    shell = block[((block == 0) | (block == [4, 5, 13])).any(axis=1)]
    return {
        "a full block": block,
        "a block of which every point comes twice": np.concatenate([shell, shell]),
        "a sheet": block[block[:, 0] == 2] + 0.1,
        "a rounded torus": np.round(12 * samples.torus(600).points),
    }


@pytest.mark.parametrize("pipeline", ["default", "tree", "cao2010"])
@pytest.mark.parametrize("name", grids())
def test_ties_are_decided_by_place_not_by_number(name, pipeline):
    points = grids()[name]
    order = np.random.default_rng(0).permutation(len(points))
    skeleton, shuffled = (glsk.skeletonize(each, pipeline) for each in (points, points[order]))
    for field in ("vertices", "edges", "radii"):
        np.testing.assert_array_equal(getattr(shuffled, field), getattr(skeleton, field))
    for field in ("vertex_of_point", "points", "normals"):
        np.testing.assert_array_equal(getattr(shuffled, field), getattr(skeleton, field)[order])


def test_a_sample_of_a_large_grid_is_one_of_its_places():
    points = np.round(40 * samples.torus(9000).points, 1)
    order = np.random.default_rng(0).permutation(len(points))
    skeleton, shuffled = (glsk.skeletonize(each, size=1000, thin_to=500) for each in (points, points[order]))
    assert skeleton.report.n_sampled < len(points)
    np.testing.assert_array_equal(shuffled.vertices, skeleton.vertices)
    np.testing.assert_array_equal(shuffled.edges, skeleton.edges)
