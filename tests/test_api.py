"""remove_redundant_points: a smaller cloud and the indices of its points, in both APIs."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, remove_redundant_points, samples

POINTS = samples.y_junction(1500).points
_, KEPT = remove_redundant_points(POINTS)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_tensor_cloud_keeps_its_attributes_and_types(dtype):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(dtype)))
    cloud.point.intensity = o3d.core.Tensor(np.arange(1500.0)[:, None])
    reduced, kept = remove_redundant_points(cloud)
    assert isinstance(reduced, o3d.t.geometry.PointCloud)
    assert kept.dtype == o3d.core.int64
    selected = cloud.select_by_index(kept)
    for name in ("positions", "intensity"):
        np.testing.assert_array_equal(reduced.point[name].numpy(), selected.point[name].numpy())
        assert reduced.point[name].dtype == cloud.point[name].dtype
    np.testing.assert_array_equal(cloud.point.positions.numpy(), POINTS.astype(dtype))
    if dtype is np.float64:
        np.testing.assert_array_equal(kept.numpy(), KEPT)


def test_legacy_clouds_arrays_tensors_and_lists_keep_the_same_points():
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    cloud.colors = o3d.utility.Vector3dVector(np.abs(POINTS))
    reduced, kept = remove_redundant_points(cloud)
    assert kept == KEPT.tolist() == sorted(kept)
    np.testing.assert_array_equal(np.asarray(reduced.points), POINTS[kept])
    np.testing.assert_array_equal(np.asarray(reduced.colors), np.abs(POINTS)[kept])
    np.testing.assert_array_equal(remove_redundant_points(POINTS.tolist())[0], POINTS[kept])
    tensor, rows = remove_redundant_points(o3d.core.Tensor(POINTS))
    np.testing.assert_array_equal(tensor.numpy(), POINTS[rows.numpy()])
    assert remove_redundant_points(POINTS.astype(np.float32))[0].dtype == np.float32


def test_duplicates_go_and_outliers_stay():
    twice = np.concatenate([POINTS, POINTS])
    _, kept = remove_redundant_points(twice)
    assert max(kept) < 1500  # the first of each
    far = np.concatenate([POINTS, [[3.0, 0, 0]]])
    assert 1500 in remove_redundant_points(far)[1]  # no business of this filter


@pytest.mark.parametrize("passes", [0, 1.0])
def test_wrong_passes_are_refused(passes):
    with pytest.raises(InvalidParameterError, match="passes"):
        remove_redundant_points(POINTS, passes=passes)
    with pytest.raises(InvalidCloudError):
        remove_redundant_points(o3d.geometry.TriangleMesh.create_sphere())
