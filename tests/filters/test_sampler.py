"""Sampler: cloud -> points."""

import dataclasses

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples
from glsk_o3d.analysis import Gripper, grasp_candidates
from glsk_o3d.analysis.support import with_support

TORUS = samples.torus(n=600).points


def in_order(points):
    """The working cloud in the user's order and units."""
    return points.frame.out_of(points.cloud)[points.map.row_of_point]


def test_a_filter_of_points_takes_a_cloud_too():
    plain = glsk.Sampler()(TORUS)
    assert isinstance(plain, glsk.Points)
    np.testing.assert_allclose(np.sort(plain.to_point_cloud().points, axis=0), np.sort(TORUS, axis=0), atol=1e-15)
    np.testing.assert_array_equal(
        glsk.RingBuilder()(TORUS).rings.indices, (glsk.Sampler() | glsk.RingBuilder())(TORUS).rings.indices
    )


def test_a_large_cloud_is_sampled_and_every_point_has_its_place():
    points = samples.torus(8000, noise=0.001).points
    points[17] = [np.nan, 0, 0]
    points[4000] = [0, 0, 3]
    state = pipelines.rings().with_options(size=1600, drop_invalid=True, thin_to=800)(points)
    assert 800 < state.report.n_sampled < 3 * 1600
    assert state.report.n_contracted <= 800
    assert state.map.sampled.sum() == state.report.n_distinct
    assert (state.map.row_of_point[17], state.outlier[4000]) == (-1, True)
    assert not state.map.sampled[[17, 4000]].any()
    away = np.linalg.norm(in_order(state) - points, axis=1)
    assert away[state.map.sampled].max() < 1e-12
    assert np.delete(away, [17, *np.flatnonzero(state.outlier)]).max() < 0.1
    skeleton = (glsk.Contractor(reducer=glsk.LPRReducer()) | glsk.Connector() | glsk.Refiner())(state)
    assert skeleton.n_loops == 1
    assert (skeleton.vertex_of_point >= 0).sum() == 7999
    assert len(skeleton.supporting_points) == state.map.sampled.sum()
    # points that show the surface have a normal, no others
    np.testing.assert_array_equal(np.isfinite(skeleton.normals[:, 0]), state.map.sampled)


PIPE = o3d.geometry.TriangleMesh.create_cylinder(0.8, 47, resolution=24, split=1)
"""As CAD has it: triangles as long as the pipe, along z, and flat ends."""


@pytest.fixture(scope="module")
def axis():
    return glsk.skeletonize(PIPE)


def test_a_mesh_of_long_triangles_is_sampled_by_area(axis):
    assert (axis.n_components, axis.n_loops, len(axis.leaves)) == (1, 0, 2)
    assert abs(axis.length - 47) < 1.6
    assert np.median(np.hypot(*axis.vertices[:, :2].T)) < 0.02
    assert np.median(np.abs(axis.radii - 0.8)) < 0.02
    assert (axis.report.n_input, axis.report.n_by_area) == (len(PIPE.vertices), 25000)


def test_labels_are_those_of_the_vertices_of_the_mesh(axis):
    np.testing.assert_array_equal(axis.points, PIPE.vertices)
    assert len(axis.vertex_of_point) == len(axis.normals) == len(glsk.analysis.segment(axis)) == len(PIPE.vertices)
    near = np.linalg.norm(axis.points - axis.vertices[axis.vertex_of_point], axis=1)
    assert near.max() < 2 * 0.8
    np.testing.assert_array_equal(glsk.analysis.segment(axis, PIPE), 0)
    marked = glsk.annotate(axis, PIPE, color="branch")
    np.testing.assert_array_equal(marked.vertex.skeleton_vertex.numpy()[:, 0], axis.vertex_of_point)
    assert len(marked.triangle.indices) == len(PIPE.triangles)


def same(one, other, atol=0.0):
    np.testing.assert_allclose(one.vertices, other.vertices, rtol=0, atol=atol)
    np.testing.assert_array_equal(one.vertex_of_point, other.vertex_of_point)


def test_stages_one_after_another_keep_the_sample(axis):
    raw = (pipelines.rings() | glsk.Contractor(reducer=glsk.LPRReducer(least=8192)) | glsk.Connector())(PIPE)
    assert len(raw.vertex_of_point) == len(PIPE.vertices)
    same(glsk.Tracer()(glsk.Refiner()(raw)), axis)


def test_tensors_and_files_of_a_mesh_are_sampled_too(axis, tmp_path):
    tensor = o3d.t.geometry.TriangleMesh.from_legacy(PIPE, o3d.core.float64)
    same(glsk.skeletonize(tensor), axis)
    path = tmp_path / "pipe.ply"
    o3d.t.io.write_triangle_mesh(str(path), tensor)
    for choice, n in ((700, 700), ("vertices", len(PIPE.vertices)), ("auto", 25000)):
        cloud = glsk.read_cloud(path, sample=choice)
        assert len(cloud.points) == n
    assert cloud.has_normals()
    with pytest.raises(glsk.InvalidParameterError, match="sample"):
        glsk.read_cloud(path, sample="all")
    (row,) = glsk.batch.run_batch([path], tmp_path / "out", workers=1).rows.values()
    assert row["by_area"] == 25000


def test_a_sample_is_automatic_or_chosen():
    dense = o3d.geometry.TriangleMesh.create_torus(1, 0.3, 90, 30)
    for choice, n in (("auto", 0), ("vertices", 0), (3000, 3000), (np.int64(500), 500)):
        state = (glsk.Sampler(sample=choice) | glsk.RingBuilder())(dense)
        assert state.report.n_by_area == n
        assert len(state.cloud) == (n or len(dense.vertices))
    np.testing.assert_array_equal(glsk.RingBuilder()(dense).cloud, glsk.RingBuilder()(np.asarray(dense.vertices)).cloud)
    assert glsk.RingBuilder()(PIPE).report.n_by_area == 25000  # without a Sampler, too
    assert glsk.Sampler(sample="vertices")(PIPE).report.n_by_area == 0
    assert 800 < glsk.Sampler(sample=50000, size=1000)(PIPE).report.n_sampled < 3000
    for wrong in (7, 3.5, True, "all", None):
        with pytest.raises(glsk.InvalidParameterError, match="sample"):
            glsk.Sampler(sample=wrong)


def test_vertices_that_are_not_finite_are_dropped_and_missing_corners_refused():
    vertices = np.append(np.asarray(PIPE.vertices), [[np.nan] * 3, [3, 0, 0]], axis=0)
    triangles = np.append(np.asarray(PIPE.triangles), [[0, 1, len(vertices) - 2]], axis=0)
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles))
    with pytest.raises(glsk.InvalidCloudError, match="index 50"):
        glsk.skeletonize(mesh)
    skeleton = glsk.skeletonize(mesh, drop_invalid=True, sample=4096)
    assert (skeleton.report.n_dropped, skeleton.report.n_by_area) == (1, 4096)
    assert (skeleton.vertex_of_point >= 0).tolist() == np.isfinite(vertices).all(axis=1).tolist()
    for corner in (-1, len(vertices)):
        mesh.triangles = o3d.utility.Vector3iVector(np.append(triangles, [[0, 1, corner]], axis=0))
        with pytest.raises(glsk.InvalidCloudError, match="vertices"):
            glsk.skeletonize(mesh)


def test_files_keep_the_sample_of_a_mesh(tmp_path, axis):
    for ending in (".npz", ".json"):
        glsk.save_skeleton(axis, tmp_path / f"pipe{ending}")
        known = glsk.read_skeleton(tmp_path / f"pipe{ending}")
        np.testing.assert_array_equal(known.points, axis.points)
        np.testing.assert_array_equal(known.vertex_of_point, axis.vertex_of_point)
        np.testing.assert_array_equal(known.whole.points, axis.whole.points)
        same(glsk.Refiner()(known), glsk.Refiner()(axis))


def test_edits_of_a_mesh_keep_to_its_sample():
    bar = o3d.geometry.TriangleMesh.create_cylinder(0.1, 3, resolution=20, split=1).translate([0, 0, 1.5])
    stem = glsk.skeletonize(bar, "tree")
    edits = (
        glsk.editing.reroot(stem, "-z"),
        glsk.editing.simplify(stem, tolerance=0.01),
        glsk.editing.cut_loops(stem)[0],
    )
    for edited in edits:
        assert not edited.lacks_sample
        assert len(edited.vertex_of_point) == len(bar.vertices)
        assert edited.whole.vertex_of_point.max() < len(edited.vertices)


def test_a_changed_skeleton_of_a_sampled_mesh_says_what_it_lacks(axis):
    changed = dataclasses.replace(axis, half_width=axis.radii, half_thickness=axis.radii)
    assert changed.lacks_sample
    assert not axis.lacks_sample
    assert glsk.Refiner()(changed).n_components == 1  # as of a skeleton without points
    for ask in (
        lambda: with_support(changed, pipelines.default(), 2),
        lambda: grasp_candidates(changed, Gripper(2)),
    ):
        with pytest.raises(glsk.GlskError, match=r"was changed|has no points"):
            ask()


def test_a_sample_of_a_cloud_without_triangles_is_warned_of():
    with pytest.warns(glsk.SkeletonWarning, match="triangles"):
        skeleton = glsk.skeletonize(TORUS, sample=500)
    assert skeleton.report.n_by_area == 0
