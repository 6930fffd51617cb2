"""Things on a table: which points are of which, and their skeletons."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, samples
from glsk_o3d.analysis import scene_objects


def test_things_on_a_table_have_masks_and_skeletons():
    ring, rod = (
        samples.torus(1500).points + [0, 0, 0.3],
        samples.tube(800, length=1.0, radius=0.1).points + [0, 1.2, 0.3],
    )
    rng = np.random.default_rng(0)
    table = np.column_stack([rng.uniform(-2, 2, (5000, 2)), np.zeros(5000)])
    few = rng.normal(scale=0.02, size=(20, 3)) + [0, -1.5, 0.3]
    points = np.concatenate([rod, table, ring, few])
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    plane, objects = scene_objects(cloud, height=0.02, gap=0.12)
    np.testing.assert_allclose(abs(plane), [0, 0, 1, 0], atol=0.01)
    assert [thing.skeleton.n_loops for thing in objects] == [1, 0]
    assert [np.flatnonzero(thing.mask)[0] for thing in objects] == [5800, 0]
    for thing in objects:
        np.testing.assert_array_equal(thing.skeleton.points, points[thing.mask])
    holes = np.where(np.arange(len(points))[:, None] % 50 == 0, np.nan, points)  # as in the image of a camera
    again = scene_objects(holes, height=0.02, gap=0.12)[1]
    for thing, other in zip(objects, again, strict=True):
        np.testing.assert_array_equal(other.mask, thing.mask & np.isfinite(holes[:, 0]))
    assert scene_objects(table, height=0.02, gap=0.12)[1] == []
    with pytest.raises(InvalidParameterError, match="gap"):
        scene_objects(cloud, height=0.02, gap=0)
    with pytest.raises(InvalidCloudError, match="0 of 9 points are finite"):
        scene_objects(np.full((9, 3), np.nan), height=0.02, gap=0.1)
