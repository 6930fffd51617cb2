"""MeshSet: MeshLab's filters and ours in one session and in one script."""

import re
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import to_pymeshlab
from glsk_o3d.analysis import segment
from glsk_o3d.apps.meshlab.layers import Layer
from glsk_o3d.apps.meshlab.script import read_script
from glsk_o3d.apps.meshlab.steps import read_steps
from glsk_o3d.errors import GlskError, InvalidCloudError, InvalidParameterError, MissingPackageError, ScriptError
from glsk_o3d.io.skeletons import read_skeleton
from glsk_o3d.samples import sample_object

pymeshlab = pytest.importorskip("pymeshlab")

POINTS = np.concatenate([sample_object(1000).points, sample_object(100).points, [[9.0, 9, 9], [9, -9, 9]]])
LARGER = 1.7 * POINTS[:1000] @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
WHOLE = "generate_curve_skeleton_glsk"


def holding(*clouds):
    meshes = glsk.MeshSet()
    for cloud in clouds:
        meshes.add_points(cloud)
    return meshes


@pytest.fixture
def meshes():
    return holding(POINTS)


def same(a, b):
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)
    np.testing.assert_array_equal(a.radii, b.radii)


def repeated(session, clouds, path):
    """Another session with the same clouds, after the saved script of the first."""
    session.save_filter_script(path)
    again = holding(*clouds)
    again.load_filter_script(path)
    again.apply_filter_script()
    return again


# ---- sessions and scripts


def test_a_mixed_session_and_its_script_do_what_its_filters_do_by_hand(meshes, tmp_path):
    scan = pymeshlab.MeshSet()
    scan.add_mesh(pymeshlab.Mesh(POINTS))
    scan.meshing_remove_duplicate_vertices()
    radius = 0.02 * scan.current_mesh().bounding_box().diagonal()
    pipeline = glsk.pipelines.default().with_options({"Connector.radius": radius})
    expected = pipeline(scan.current_mesh().vertex_matrix())
    assert len(expected.edges) > 20

    meshes.meshing_remove_duplicate_vertices()
    meshes.generate_curve_skeleton_glsk(connector_radius=pymeshlab.PercentageValue(2))
    same(meshes.current_skeleton(), expected)
    again = repeated(meshes, [POINTS], tmp_path / "saved.mlx")
    same(again.current_skeleton(), expected)
    mesh = again.current_mesh()
    np.testing.assert_array_equal(mesh.edge_matrix(), expected.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), expected.radii)
    again.save_filter_script(tmp_path / "again.mlx")
    assert (tmp_path / "again.mlx").read_text() == (tmp_path / "saved.mlx").read_text()
    again.clear_filter_script()
    again.save_filter_script(tmp_path / "none.mlx")
    assert "<filter " not in (tmp_path / "none.mlx").read_text()


def test_a_script_without_ours_is_one_that_meshlab_opens(meshes, tmp_path):
    meshes.meshing_remove_duplicate_vertices()
    with pytest.raises(GlskError):
        meshes.generate_curve_skeleton_glsk(ringbuilder_k=1)  # is not in it
    with pytest.raises(FileNotFoundError):  # what is wrong leaves the current script
        meshes.load_filter_script(tmp_path / "none.mlx")
    meshes.set_selection_all()
    meshes.save_filter_script(tmp_path / "s.mlx")
    pymeshlab.MeshSet().load_filter_script(str(tmp_path / "s.mlx"))
    assert [call.name for call in read_script(tmp_path / "s.mlx")] == ["Remove Duplicate Vertices", "Select All"]


def test_a_filter_that_fails_names_file_line_and_filter(meshes, tmp_path):
    def load(meshes, name):
        (tmp_path / "s.mlx").write_text(f'<FilterScript>\n<filter name="{name}"/>\n</FilterScript>')
        meshes.load_filter_script(tmp_path / "s.mlx")
        return meshes

    before = Path.cwd()
    for name, message in (
        ("Close Holes", ".*does not have Any Faces"),
        (
            "Surface Reconstruction: Screened Poisson",
            r".*correct per vertex normals\. E\.g\. it is necessary that your",
        ),
    ):
        with pytest.raises(ScriptError, match=f"s.mlx, line 2: filter '{name}': {message}"):
            load(meshes, name).apply_filter_script()
    assert Path.cwd() == before
    ours = "Generate Curve Skeleton (GLSkeleton)"
    for session, message in ((holding(np.eye(3)), ".*8 "), (glsk.MeshSet(), "there is no layer")):
        with pytest.raises(ScriptError, match=rf"s.mlx, line 2: filter '{re.escape(ours)}': {message}"):
            load(session, ours).apply_filter_script()


# ---- lengths: percentages are of the diagonal of the layer's bounding box, as MeshLab's are


@pytest.mark.filterwarnings("ignore:uncertain topology:glsk_o3d.SkeletonWarning")  # so few points are close calls
@pytest.mark.parametrize("layer", [0, 1])
def test_a_percentage_is_of_the_box_of_the_layer(layer):
    meshes = holding(POINTS[:800], LARGER[:800])
    long = meshes.mesh(layer).bounding_box().diagonal() * 0.05
    expected = glsk.pipelines.default().with_options({"Connector.radius": long})(meshes.mesh(layer).vertex_matrix())
    for words in (long, np.float64(long), "5%", pymeshlab.PercentageValue(5)):
        meshes.generate_curve_skeleton_glsk(connector_radius=words, layer=layer)
        same(meshes.current_skeleton(), expected)


def test_scripts_keep_percentages(tmp_path):
    meshes = holding(LARGER)
    meshes.generate_curve_skeleton_glsk(ringbuilder_radius=pymeshlab.PercentageValue(20), connector_radius="1%")
    meshes.save_filter_script(tmp_path / "s.mlx")
    text = (tmp_path / "s.mlx").read_text()
    assert '<Param type="RichAbsPerc" name="ringbuilder_radius" value="20.0%"/>' in text
    assert '<Param type="RichAbsPerc" name="connector_radius" value="1%"/>' in text
    large = holding(4096 * LARGER)  # a power of 2: every step is the same but for the exponents
    large.apply_step(read_steps(tmp_path / "s.mlx")[0])
    expected = 4096 * meshes.current_mesh().vertex_matrix()
    np.testing.assert_allclose(large.current_mesh().vertex_matrix(), expected, rtol=1e-9, atol=1e-9)


# ---- layers


def test_the_result_of_a_filter(meshes):
    result = meshes.generate_curve_skeleton_glsk()
    skeleton = glsk.skeletonize(POINTS)
    same(meshes.current_skeleton(), skeleton)
    assert result["layer"] == meshes.current_mesh_id() == 1
    assert (result["vertices"], result["edges"]) == (len(skeleton.vertices), len(skeleton.edges))
    assert (result["loops"], result["components"]) == (skeleton.n_loops, skeleton.n_components)
    assert result["length"] == skeleton.length
    assert result["converged"] is skeleton.report.converged
    assert meshes.current_mesh().label() == "Curve Skeleton of cloud"
    assert np.array_equal(meshes.mesh(0).vertex_matrix(), POINTS)


@pytest.mark.filterwarnings("ignore:uncertain topology:glsk_o3d.SkeletonWarning")
def test_a_segmentation_has_the_points_and_faces_of_its_skeleton():
    points = sample_object(1200, noise=0).points
    faces = np.arange(1200, dtype=np.int32).reshape(-1, 3)
    meshes = glsk.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, faces), "animal")
    meshes.generate_curve_skeleton_glsk()
    skeleton = meshes.current_skeleton()
    result = meshes.generate_segmented_cloud_glsk()
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.face_matrix(), faces)
    np.testing.assert_array_equal(mesh.vertex_matrix(), points)
    labels = mesh.vertex_scalar_array().astype(int)
    np.testing.assert_array_equal(labels, segment(skeleton))
    assert result["branches"] == len(skeleton.branches) > 1
    colours = np.unique(np.column_stack([labels, mesh.vertex_color_matrix()]), axis=0)
    assert len(colours) == len(np.unique(labels))  # one for each


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("generate_curve_skeleton_glks", {}, "no filter is called .*: did you mean 'generate_curve_skeleton_glsk'"),
        (WHOLE, {"conector_radius": 1}, f"no parameter of {WHOLE} is .* did you mean 'connector_radius'"),
        (WHOLE, {"connector_radius": "2 mm"}, "connector_radius = '2 mm': must be a number in"),
        (WHOLE, {"ringbuilder_k": 12.5}, "ringbuilder_k = 12.5: must be an int, or 'auto'"),
        (WHOLE, {"contractor_stop": "RingSizRatio"}, "contractor_stop = .* did you mean 'RingSizeRatio'"),
        (WHOLE, {"contractor_reducer": None, "lprreducer_phi": 3}, "lprreducer_phi: LPRReducer is not in the pipeline"),
        ("get_hausdorff_distance", {"sampledmesh": 9}, "sampledmesh = 9: there is no such layer"),  # else it crashes
    ],
)
def test_wrong_names_and_values(meshes, name, params, message):
    with pytest.raises(InvalidParameterError, match=f"^{message}"):
        meshes.apply_filter(name, **params)
    assert meshes.mesh_number() == 1


def test_layers_that_are_no_scans(meshes):
    with pytest.raises(InvalidCloudError, match="load a scan first"):
        glsk.MeshSet().generate_curve_skeleton_glsk()
    with pytest.raises(InvalidCloudError, match=r"\(cloud\) has no edges"):
        meshes.current_skeleton()
    meshes.generate_curve_skeleton_glsk()
    with pytest.raises(InvalidCloudError, match="is a skeleton or another line drawing"):
        meshes.generate_curve_skeleton_glsk()


def test_scalars_of_a_skeleton_are_its_radii_and_moved_vertices_its_own(meshes, tmp_path):
    meshes.generate_curve_skeleton_glsk()
    before = meshes.current_skeleton()
    for factor in (10, 0):
        meshes.compute_scalar_by_function_per_vertex(q=f"{factor}*q")
        after = meshes.current_skeleton()
        np.testing.assert_allclose(after.radii, factor * before.radii, rtol=1e-6)
        np.testing.assert_array_equal([after.half_width, after.half_thickness], [after.radii] * 2)
        assert after.report is before.report
        np.testing.assert_array_equal(after.points, before.points)
        for ending in ("ply", "obj", "json"):
            meshes.save_current_mesh(tmp_path / f"s.{ending}")
            back = read_skeleton(tmp_path / f"s.{ending}")
            np.testing.assert_array_equal(back.vertices, before.vertices)
            np.testing.assert_array_equal(back.edges, before.edges)
            if ending != "obj":
                np.testing.assert_array_equal(back.radii, after.radii)
    meshes.compute_matrix_from_scaling_or_normalization(axisx=2.0, uniformflag=True, scalecenter="origin")
    moved = meshes.current_skeleton()
    np.testing.assert_array_equal(moved.vertices, 2 * before.vertices)
    np.testing.assert_array_equal(moved.edges, before.edges)
    assert len(moved.points) == 0


# ---- what there is


def test_a_skeleton_as_a_mesh_of_meshlab(skeleton, tmp_path, monkeypatch):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(to_pymeshlab(skeleton))
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)
    if len(skeleton.edges):
        meshes.save_current_mesh(str(tmp_path / "m.obj"))
        np.testing.assert_array_equal(read_skeleton(tmp_path / "m.obj").edges, skeleton.edges)
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingPackageError, match=r"pymeshlab.*pip install .glsk-o3d.meshlab"):
        to_pymeshlab(skeleton)


def test_normals_turn_with_the_matrix_of_a_layer():
    points, normals = np.random.default_rng(0).normal(size=(2, 50, 3))
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals))
    turn = np.eye(4)[[1, 0, 2, 3]] * [-1, 1, 1, 1]
    meshes.set_matrix(transformmatrix=turn, freeze=False)
    layer = Layer.of_mesh(meshes.current_mesh())
    np.testing.assert_allclose(layer.vertices, points @ turn[:3, :3].T)
    np.testing.assert_allclose(layer.normals, normals @ turn[:3, :3].T)


def test_a_mesh_is_read_as_it_was_written(tmp_path):
    mesh = o3d.geometry.TriangleMesh.create_torus()
    mesh.compute_vertex_normals()
    points, faces, normals = (np.array(item) for item in (mesh.vertices, mesh.triangles, mesh.vertex_normals))
    colors = np.random.default_rng(0).integers(256, size=(len(points), 4)) / 255
    colors[:, 3] = 1
    layer = Layer(points, faces=faces, normals=normals, colors=colors, scalars=np.arange(len(points)) / 3)
    for ending in ("xyz", "ply"):
        layer.save(tmp_path / f"m.{ending}")
        back = Layer.read(tmp_path / f"m.{ending}")
        np.testing.assert_array_equal(back.vertices, points)
    for name in ("faces", "normals", "scalars"):
        np.testing.assert_array_equal(getattr(back, name), getattr(layer, name))
    np.testing.assert_allclose(back.colors, colors)
