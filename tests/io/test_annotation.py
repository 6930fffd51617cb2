"""Results as attributes of clouds: through selections, sampling and files, in both APIs."""

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import annotate, samples
from glsk_o3d.analysis import branch_table, segment

POINTS = samples.y_junction(800).points
RNG = np.random.default_rng(1)
INTENSITY = RNG.random((800, 1)).astype(np.float32)
COLORS = RNG.integers(0, 256, (800, 3)).astype(np.uint8)


@pytest.fixture(scope="module", params=[np.float32, np.float64])
def cloud(request):
    places = POINTS.astype(request.param)
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(places))
    for name, values in (("intensity", INTENSITY), ("colors", COLORS), ("normals", places)):
        cloud.point[name] = o3d.core.Tensor(values)
    return cloud


@pytest.fixture(scope="module")
def skeleton(cloud):
    return glsk.skeletonize(cloud)


def attributes(cloud):
    return {name: cloud.point[name].numpy() for name in cloud.point}


def assert_equal(actual, expected):
    assert actual.keys() == expected.keys()
    for name, values in expected.items():
        assert actual[name].dtype == values.dtype, name
        np.testing.assert_array_equal(actual[name], values, err_msg=name)


def test_tensor_clouds_keep_what_they_have_and_gain_ours(cloud, skeleton):
    before, vertex, branch = attributes(cloud), skeleton.vertex_of_point, segment(skeleton)
    annotated = attributes(annotate(skeleton, cloud))
    kind = cloud.point.positions.numpy().dtype
    gained = {
        "skeleton_vertex": vertex.astype(np.int32),
        "branch": branch.astype(np.int32),
        "order": branch_table(skeleton).order[branch].astype(np.int32),
        "radius": skeleton.radii[vertex].astype(kind),
        "confidence": skeleton.confidence[vertex].astype(kind),
    }
    assert_equal(annotated, before | {name: values[:, None] for name, values in gained.items()})
    assert_equal(attributes(cloud), before)
    assert not np.shares_memory(annotated["positions"], before["positions"])


def test_legacy_clouds_arrays_and_meshes_become_tensor_ones(skeleton):
    vectors = o3d.utility.Vector3dVector
    legacy = o3d.geometry.PointCloud(vectors(POINTS))
    legacy.colors, legacy.normals = vectors(COLORS / 255), vectors(POINTS)
    annotated = annotate(skeleton, legacy)
    assert annotated.point.positions.dtype == annotated.point.radius.dtype == o3d.core.float64
    np.testing.assert_array_equal(annotated.point.positions.numpy(), POINTS)
    np.testing.assert_array_equal(annotated.point.normals.numpy(), POINTS)
    np.testing.assert_allclose(annotated.point.colors.numpy(), COLORS / 255)
    np.testing.assert_array_equal(annotated.point.branch.numpy()[:, 0], segment(skeleton, POINTS))
    for array, dtype in ((POINTS, np.float64), (POINTS.astype(np.float32), np.float32), (POINTS.tolist(), np.float64)):
        assert annotate(skeleton, array).point.positions.numpy().dtype == dtype
    mesh = o3d.geometry.TriangleMesh(vectors(POINTS), o3d.utility.Vector3iVector([[0, 1, 2]]))
    for cloud in (mesh, o3d.t.geometry.TriangleMesh.from_legacy(mesh)):
        marked = annotate(skeleton, cloud)
        assert isinstance(marked, o3d.t.geometry.TriangleMesh)
        assert len(marked.triangle.indices) == 1
        np.testing.assert_array_equal(marked.vertex.skeleton_vertex.numpy()[:, 0], skeleton.vertex_of_point)
    np.testing.assert_array_equal(annotate(skeleton).point.positions.numpy(), skeleton.points)


def test_whole_numbers_and_points_that_are_not_finite():
    points = np.round(POINTS * 1000)
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.int32)))
    annotated = annotate(glsk.skeletonize(cloud), cloud)
    assert (annotated.point.positions.dtype, annotated.point.radius.dtype) == (o3d.core.int32, o3d.core.float64)
    points[7] = np.nan
    state = (glsk.Sampler(drop_invalid=True) | glsk.RingBuilder() | glsk.Contractor())(points)
    annotated = annotate((glsk.Connector() | glsk.Refiner())(state), points, color="radius")
    assert annotated.point.branch.numpy()[7] == annotated.point.skeleton_vertex.numpy()[7] == -1
    assert np.isnan(annotated.point.radius.numpy()[7])
    np.testing.assert_array_equal(annotated.point.colors.numpy()[7], [153] * 3)


@pytest.mark.parametrize("color", ["branch", "radius", (0.2, 0.4, 1.0)])
@pytest.mark.parametrize("kind", [o3d.core.float32, o3d.core.float64])
def test_colours_of_meshes_are_those_of_clouds_in_files_too(skeleton, tmp_path, kind, color):
    vectors = o3d.utility.Vector3dVector
    mesh = o3d.geometry.TriangleMesh(vectors(POINTS), o3d.utility.Vector3iVector([[0, 1, 2]]))
    mesh.vertex_colors = vectors(COLORS / 255)  # which are replaced
    shown = annotate(skeleton, POINTS, color=color).point.colors.numpy()
    assert shown.dtype == np.uint8
    assert color != "branch" or len(np.unique(np.column_stack([shown, segment(skeleton)]), axis=0)) == 3
    for cloud in (mesh, o3d.t.geometry.TriangleMesh.from_legacy(mesh, kind)):
        marked = annotate(skeleton, cloud, color=color)
        np.testing.assert_allclose(marked.vertex.colors.numpy(), shown / 255, atol=1e-7)
        np.testing.assert_allclose(np.asarray(marked.to_legacy().vertex_colors), shown / 255, atol=1e-7)
        o3d.t.io.write_triangle_mesh(str(tmp_path / "m.ply"), marked)
        back = o3d.t.io.read_triangle_mesh(str(tmp_path / "m.ply")).vertex.colors.numpy()
        np.testing.assert_allclose(np.round(255.0 * back if back.dtype.kind == "f" else back), shown, atol=1)
