"""The topology does not hang on roundings: points that move by next to nothing give the same graph."""

import warnings

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples

JITTER = 1e-7  # of the diagonal


def topology(points):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        skeleton = glsk.skeletonize(points)
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


@pytest.mark.parametrize("name", ["torus", "helix", "y_junction", "two_rings", "tube", "sauropod"])
def test_jitter_changes_nothing(name):
    points = getattr(samples, name)(2000).points
    size = JITTER * np.linalg.norm(np.ptp(points, axis=0))
    found = {topology(points)}
    for seed in range(3):
        found.add(topology(points + size * np.random.default_rng(seed).normal(size=points.shape)))
    assert len(found) == 1


def grids():
    """Clouds with many equal distances: what is nearest is a tie."""
    x, y, z = np.meshgrid(*map(np.arange, (5, 6, 14)), indexing="ij")
    block = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype(float)
    shell = block[((block == 0) | (block == [4, 5, 13])).any(axis=1)]
    angle = 2 * np.pi * np.arange(12) / 12
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return {
        "a full block": block,
        "the border of a block": shell,
        "a sheet": block[block[:, 0] == 2] + 0.1,
        "a tube of equal circles": np.concatenate([ring + [0, 0, 0.5 * row] for row in range(20)]),
        "a block of which every point comes twice": np.concatenate([shell, shell]),
        "a rounded torus": np.round(12 * samples.torus(600).points),
    }


@pytest.mark.parametrize("pipeline", ["default", "tree", "cao2010"])
@pytest.mark.parametrize("name", grids())
def test_ties_are_decided_by_place_not_by_number(name, pipeline):
    points = grids()[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        skeleton = glsk.skeletonize(points, pipeline)
        for seed in range(3):
            order = np.random.default_rng(seed).permutation(len(points))
            shuffled = glsk.skeletonize(points[order], pipeline)
            np.testing.assert_array_equal(shuffled.vertices, skeleton.vertices)
            np.testing.assert_array_equal(shuffled.edges, skeleton.edges)
            np.testing.assert_array_equal(shuffled.radii, skeleton.radii)
            np.testing.assert_array_equal(shuffled.vertex_of_point, skeleton.vertex_of_point[order])
            np.testing.assert_array_equal(shuffled.points, points[order])
            np.testing.assert_array_equal(shuffled.normals, skeleton.normals[order])


def test_a_sample_of_a_large_grid_is_one_of_its_places():
    points = np.round(40 * samples.torus(9000).points, 1)
    order = np.random.default_rng(0).permutation(len(points))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        skeleton, shuffled = (glsk.skeletonize(each, thin_to=500) for each in (points, points[order]))
    assert skeleton.report.n_sampled < len(points)
    np.testing.assert_array_equal(shuffled.vertices, skeleton.vertices)
    np.testing.assert_array_equal(shuffled.edges, skeleton.edges)
