"""Results as attributes of clouds: through selections, sampling and files, in both APIs."""

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import InvalidParameterError, annotate_contraction, samples
from glsk_o3d.io.colors import thickness_shades

POINTS = samples.y_junction(800).points
RNG = np.random.default_rng(1)
INTENSITY = RNG.random((800, 1)).astype(np.float32)
COLORS = RNG.integers(0, 256, (800, 3)).astype(np.uint8)
FLOATS = [np.float32, np.float64]


def tensor_cloud(dtype):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(dtype)))
    cloud.point.intensity = o3d.core.Tensor(INTENSITY)
    cloud.point.colors = o3d.core.Tensor(COLORS)
    cloud.point.normals = o3d.core.Tensor(POINTS.astype(dtype))
    return cloud


@pytest.fixture(scope="module", params=FLOATS)
def cloud(request):
    return tensor_cloud(request.param)


@pytest.fixture(scope="module")
def skeleton(cloud):
    return glsk.skeletonize(cloud)


@pytest.fixture(scope="module")
def state(cloud):
    return (glsk.RingBuilder() | glsk.Contractor(reducer=glsk.LPRReducer()))(cloud)


def held(cloud):
    return {name: cloud.point[name].numpy() for name in cloud.point}


def assert_equal(found, expected):
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert found[name].dtype == values.dtype, name
        np.testing.assert_array_equal(found[name], values, err_msg=name)


def test_tensor_clouds_keep_what_they_have_and_gain_ours(cloud, skeleton, state):
    before = held(cloud)
    annotated = held(skeleton.annotate(cloud))
    kind = cloud.point.positions.numpy().dtype
    assert_equal({name: annotated[name] for name in before}, before)
    floats = dict.fromkeys(("radius", "confidence", "thickness"), kind)
    assert annotated.keys() - before.keys() == {"skeleton_vertex", "branch", "order", *floats}
    for name, dtype in {**dict.fromkeys(("skeleton_vertex", "branch", "order"), np.int32), **floats}.items():
        assert annotated[name].dtype == dtype
        assert annotated[name].shape == (800, 1)
    np.testing.assert_array_equal(annotated["skeleton_vertex"][:, 0], skeleton.vertex_of_point)
    np.testing.assert_array_equal(annotated["branch"][:, 0], skeleton.segment())
    np.testing.assert_array_equal(annotated["order"][:, 0], skeleton.branch_table().order[skeleton.segment()])
    np.testing.assert_array_equal(annotated["radius"][:, 0], skeleton.radii[skeleton.vertex_of_point].astype(kind))

    contracted = held(annotate_contraction(state, skeleton.annotate(cloud)))
    assert contracted.keys() - annotated.keys() == {"contracted"}
    assert contracted["contracted"].dtype == kind
    np.testing.assert_array_equal(contracted["contracted"], state.contracted[state.survivor_of_point].astype(kind))
    assert_equal(held(cloud), before)
    assert not np.shares_memory(annotated["positions"], before["positions"])


def test_through_selections_and_sampling(cloud, skeleton, state):
    annotated = annotate_contraction(state, skeleton.annotate(cloud))
    everything = held(annotated)
    mask = everything["branch"][:, 0] == 1
    assert_equal(held(annotated.select_by_mask(o3d.core.Tensor(mask))), {n: v[mask] for n, v in everything.items()})
    some = np.flatnonzero(mask)[::3]
    assert_equal(held(annotated.select_by_index(o3d.core.Tensor(some))), {n: v[some] for n, v in everything.items()})

    thin = annotated.voxel_down_sample(0.08)
    assert 50 < len(thin.point.positions) < 400
    assert held(thin).keys() == everything.keys()
    again = skeleton.annotate(thin)  # labels are labels again, not means of labels
    assert set(np.unique(again.point.branch.numpy())) == set(range(3))
    np.testing.assert_array_equal(again.point.branch.numpy()[:, 0], skeleton.segment(thin))


@pytest.mark.parametrize("ending", ["ply", "pcd", "npz"])
def test_through_files(cloud, skeleton, tmp_path, ending):
    annotated = skeleton.annotate(cloud)
    path = str(tmp_path / f"cloud.{ending}")
    assert o3d.t.io.write_point_cloud(path, annotated)
    assert_equal(held(o3d.t.io.read_point_cloud(path)), held(annotated))


def test_contracted_positions_are_columns_of_a_ply_file(cloud, state, tmp_path):
    annotated = annotate_contraction(state, cloud)
    assert o3d.t.io.write_point_cloud(str(tmp_path / "cloud.ply"), annotated)
    back = o3d.t.io.read_point_cloud(str(tmp_path / "cloud.ply"))
    columns = np.hstack([back.point[f"contracted_{i}"].numpy() for i in range(3)])
    np.testing.assert_array_equal(columns, annotated.point.contracted.numpy())


def test_legacy_clouds_arrays_and_meshes_become_tensor_ones(skeleton):
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
    legacy.colors = o3d.utility.Vector3dVector(COLORS / 255)
    legacy.normals = o3d.utility.Vector3dVector(POINTS)
    annotated = skeleton.annotate(legacy)
    assert annotated.point.positions.dtype == annotated.point.radius.dtype == o3d.core.float64
    np.testing.assert_array_equal(annotated.point.positions.numpy(), POINTS)
    np.testing.assert_array_equal(annotated.point.normals.numpy(), POINTS)
    np.testing.assert_allclose(annotated.point.colors.numpy(), COLORS / 255)
    np.testing.assert_array_equal(annotated.point.branch.numpy()[:, 0], skeleton.segment(POINTS))
    for array, dtype in ((POINTS, np.float64), (POINTS.astype(np.float32), np.float32), (POINTS.tolist(), np.float64)):
        assert skeleton.annotate(array).point.positions.numpy().dtype == dtype
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(POINTS), o3d.utility.Vector3iVector(np.array([[0, 1, 2]]))
    )
    for given in (mesh, o3d.t.geometry.TriangleMesh.from_legacy(mesh)):
        marked = skeleton.annotate(given)
        assert isinstance(marked, o3d.t.geometry.TriangleMesh)
        assert len(marked.triangle.indices) == 1
        np.testing.assert_array_equal(marked.vertex.skeleton_vertex.numpy()[:, 0], skeleton.vertex_of_point)
    own = skeleton.annotate()
    np.testing.assert_array_equal(own.point.positions.numpy(), skeleton.points)


def test_whole_numbers_and_points_that_are_not_finite():
    points = np.round(POINTS * 1000)
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.int32)))
    annotated = glsk.skeletonize(cloud).annotate(cloud)
    assert annotated.point.positions.dtype == o3d.core.int32
    assert annotated.point.radius.dtype == o3d.core.float64
    points[7] = np.nan
    state = (glsk.RingBuilder(drop_invalid=True) | glsk.Contractor())(points)
    assert np.isnan(annotate_contraction(state, points).point.contracted.numpy()[7]).all()
    assert np.isfinite(np.delete(annotate_contraction(state).point.contracted.numpy(), 7, axis=0)).all()
    moved = annotate_contraction(state, np.r_[points[:3] + 0.1, [[np.inf] * 3]]).point.contracted.numpy()
    np.testing.assert_array_equal(
        moved, np.r_[annotate_contraction(state).point.contracted.numpy()[:3], [[np.nan] * 3]]
    )
    annotated = (glsk.Connector() | glsk.Refiner())(state).annotate(points, color="radius")
    assert annotated.point.branch.numpy()[7] == annotated.point.skeleton_vertex.numpy()[7] == -1
    assert np.isnan(annotated.point.radius.numpy()[7])
    np.testing.assert_array_equal(annotated.point.colors.numpy()[7], [153] * 3)


def test_colours(cloud, skeleton):
    shown = skeleton.annotate(cloud, color="branch").point.colors.numpy()
    assert shown.dtype == np.uint8
    label = skeleton.segment()
    assert len(np.unique(np.column_stack([shown, label]), axis=0)) == len(np.unique(shown, axis=0)) == 3
    by_radius = skeleton.annotate(cloud, color="radius").point.colors.numpy()
    radius = skeleton.radii[skeleton.vertex_of_point]
    brightness = by_radius @ [0.2, 0.7, 0.1]
    assert brightness[radius.argmin()] < brightness[radius.argmax()]
    marked = skeleton.annotate(cloud, color="thickness")
    expected = np.round(255 * thickness_shades(marked.point.thickness.numpy()[:, 0].astype(float)))
    assert np.abs(marked.point.colors.numpy() - expected).max() <= 1
    by_order = skeleton.annotate(cloud, color="order")
    for order in np.unique(by_order.point.order.numpy()):
        assert len(np.unique(by_order.point.colors.numpy()[by_order.point.order.numpy()[:, 0] == order], axis=0)) == 1
    legacy = skeleton.annotate(cloud, color="branch").to_legacy()
    np.testing.assert_allclose(np.asarray(legacy.colors), shown / 255, atol=1e-6)
    with pytest.raises(InvalidParameterError, match="color"):
        skeleton.annotate(cloud, color="size")
