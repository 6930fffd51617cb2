"""The object of a scene: what plane, cluster and sample leave of its points."""

import numpy as np
import open3d as o3d
import pytest
from glsk_o3d_ros.scene import largest_cluster, largest_plane, sample

from glsk_o3d import samples


@pytest.mark.parametrize("gap", [0.1, 0.2, 0.3, 0.45])
def test_the_largest_cluster_is_that_of_all_points(gap):
    noise = np.random.default_rng(0).uniform(-2, 2, (200, 3))
    tubes = [samples.tube(n, length=2, radius=0.2, noise=0.01).points for n in (700, 1500)]
    points = np.concatenate([noise, tubes[0], tubes[1] + [0, 0.9, 0]])
    label = np.array(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).cluster_dbscan(gap, 10))
    expected = label == np.bincount(label[label >= 0]).argmax()
    assert (largest_cluster(points, gap) != expected).sum() <= 2  # at its border
    assert expected.sum() > 1400


def test_a_gap_of_any_size_is_answered():
    points = samples.torus(1000).points
    assert largest_cluster(points, 1e3).all()
    assert not largest_cluster(points, 1e-6).any()


def test_the_largest_plane_is_that_with_most_points():
    table = np.column_stack([np.random.default_rng(0).uniform(-1, 1, (2000, 2)), np.full(2000, 0.5)])
    plane = largest_plane(np.concatenate([table, samples.torus(1000).points]), 0.01)
    np.testing.assert_allclose(plane * np.sign(plane[2]), [0, 0, 1, -0.5], atol=1e-6)


def test_a_sample_has_the_points_in_their_order():
    points = np.arange(3000.0).reshape(-1, 3)
    few = sample(points, 100)
    assert few.shape == (100, 3)
    assert (np.diff(few[:, 0]) > 0).all()
    assert np.isin(few[:, 0], points[:, 0]).all()
    assert sample(points, 1000) is points
