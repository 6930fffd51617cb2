"""remove_redundant_points: a smaller cloud and the indices of its points, in both APIs."""

import numpy as np
import open3d as o3d
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import (
    InvalidCloudError,
    InvalidParameterError,
    LPRReducer,
    RingBuilder,
    remove_redundant_points,
    samples,
    skeletonize,
)

POINTS = samples.y_junction(1500).points
_, KEPT = remove_redundant_points(POINTS)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_tensor_clouds(dtype):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(dtype)))
    cloud.point.intensity = o3d.core.Tensor(np.arange(1500.0)[:, None])
    before = cloud.point.positions.numpy().copy()
    reduced, kept = remove_redundant_points(cloud)
    assert isinstance(reduced, o3d.t.geometry.PointCloud)
    assert kept.dtype == o3d.core.int64
    selected = cloud.select_by_index(kept)
    for name in ("positions", "intensity"):
        np.testing.assert_array_equal(reduced.point[name].numpy(), selected.point[name].numpy())
        assert reduced.point[name].dtype == cloud.point[name].dtype
    np.testing.assert_array_equal(reduced.point.intensity.numpy()[:, 0], kept.numpy())
    removed = cloud.select_by_index(kept, invert=True)
    assert len(removed.point.positions) + len(reduced.point.positions) == 1500
    np.testing.assert_array_equal(cloud.point.positions.numpy(), before)
    if dtype is np.float64:
        np.testing.assert_array_equal(kept.numpy(), KEPT)


def test_legacy_clouds():
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    cloud.colors = o3d.utility.Vector3dVector(np.abs(POINTS))
    reduced, kept = remove_redundant_points(cloud)
    assert kept == KEPT.tolist()
    np.testing.assert_array_equal(np.asarray(reduced.points), POINTS[kept])
    np.testing.assert_array_equal(np.asarray(reduced.colors), np.abs(POINTS)[kept])
    np.testing.assert_array_equal(np.asarray(cloud.select_by_index(kept).points), POINTS[kept])


def test_arrays_tensors_and_lists():
    reduced, kept = remove_redundant_points(POINTS.tolist())
    np.testing.assert_array_equal(reduced, POINTS[KEPT])
    tensor, kept = remove_redundant_points(o3d.core.Tensor(POINTS))
    np.testing.assert_array_equal(tensor.numpy(), POINTS[KEPT])
    np.testing.assert_array_equal(kept.numpy(), KEPT)
    assert (np.diff(KEPT) > 0).all()
    assert remove_redundant_points(POINTS.astype(np.float32))[0].dtype == np.float32


def test_smaller_with_every_pass_and_more_even_than_chance():
    counts = [1500]
    for passes in (1, 2, 3):
        reduced, kept = remove_redundant_points(POINTS, passes=passes)
        assert 0.5 * counts[-1] < len(kept) < 0.75 * counts[-1]
        gap = cKDTree(reduced).query(POINTS)[0]
        chance = [
            cKDTree(POINTS[np.random.default_rng(i).choice(1500, len(kept), False)]).query(POINTS)[0] for i in range(5)
        ]
        assert gap.mean() < np.min([other.mean() for other in chance])
        assert gap.max() < np.mean([other.max() for other in chance])
        counts.append(len(kept))


def test_duplicates_and_outliers():
    twice = np.concatenate([POINTS, POINTS])
    _, kept = remove_redundant_points(twice)
    assert max(kept) < 1500  # the first of each
    far = np.concatenate([POINTS, [[3.0, 0, 0]]])
    assert 1500 in remove_redundant_points(far)[1]  # no business of this filter
    assert 1500 not in remove_redundant_points(far, rings=RingBuilder())[1]


def test_neither_denoises_nor_waits_for_many_points():
    noisy = samples.y_junction(400, noise=0.02).points
    _, kept = remove_redundant_points(noisy)
    assert 200 < len(kept) < 300  # small clouds, too
    np.testing.assert_array_equal(
        remove_redundant_points(noisy, rings=RingBuilder(outlier_factor=0, denoise=0))[1], kept
    )
    assert len(remove_redundant_points(noisy, rings=RingBuilder(outlier_factor=0))[1]) != len(kept)


def test_parameters():
    assert len(remove_redundant_points(POINTS, reducer=LPRReducer(phi=1e-12))[1]) > len(KEPT)
    with pytest.raises(InvalidParameterError, match="phi"):
        remove_redundant_points(POINTS, reducer=LPRReducer(phi=-1))
    with pytest.raises(InvalidParameterError, match="reducer"):
        remove_redundant_points(POINTS, reducer=0)
    for passes in (0, 1.0, True):
        with pytest.raises(InvalidParameterError, match="passes"):
            remove_redundant_points(POINTS, passes=passes)
    with pytest.raises(InvalidCloudError):
        remove_redundant_points(o3d.geometry.TriangleMesh.create_sphere())
    with pytest.raises(InvalidCloudError):
        remove_redundant_points(np.r_[POINTS, [[np.nan] * 3]])


def test_the_skeleton_stays_the_same_shape():
    whole, thin = (skeletonize(cloud) for cloud in (POINTS, remove_redundant_points(POINTS)[0]))
    assert (thin.n_loops, thin.n_components, len(thin.leaves)) == (whole.n_loops, whole.n_components, 3)
    assert cKDTree(whole.vertices).query(thin.vertices)[0].mean() < 0.4 * whole.radii.mean()
