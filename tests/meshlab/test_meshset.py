"""MeshSet: MeshLab's filters and ours in one session and in one script."""

import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d.cli.main import app
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError, MissingPackageError, ScriptError
from glsk_o3d.io.skeletons import read_skeleton
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.steps import PlainLayers, read_steps
from glsk_o3d.meshlab.verbs import verbs
from glsk_o3d.samples import sample_object

pymeshlab = pytest.importorskip("pymeshlab")

MIXED = """<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="Remove Duplicate Vertices"/>
 <filter name="Generate Reduced Cloud (GLSkeleton)">
  <Param type="RichFloat" name="phi" value="1000"/>
 </filter>
 <filter name="Select Outliers">
  <Param type="RichDynamicFloat" name="PropThreshold" value="0.9"/>
  <Param type="RichInt" name="KNearest" value="16"/>
 </filter>
 <filter name="Delete Selected Vertices"/>
 <filter name="Generate Skeleton Graph (GLSkeleton)">
  <Param type="RichAbsPerc" name="radius" value="2%"/>
 </filter>
 <filter name="Generate Refined Skeleton (GLSkeleton)">
  <Param type="RichInt" name="recentre" value="2"/>
 </filter>
</FilterScript>
"""


@pytest.fixture(scope="module")
def points():
    cloud = sample_object(1500).points
    return np.concatenate([cloud, cloud[:200], [[9.0, 9, 9], [9, -9, 9]]])


@pytest.fixture
def meshes(points):
    meshes = glsk.MeshSet()
    meshes.add_points(points)
    return meshes


def _same(a, b):
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)
    np.testing.assert_array_equal(a.radii, b.radii)


def _by_hand(points):
    """The same filters as in MIXED, each from the library that it is of."""
    scan = pymeshlab.MeshSet()
    scan.add_mesh(pymeshlab.Mesh(points))
    scan.meshing_remove_duplicate_vertices()
    clean = scan.current_mesh().vertex_matrix()
    once = (glsk.RingBuilder() | glsk.Contractor(max_iterations=1) | glsk.LPRReducer(phi=1000))(clean)
    rest = pymeshlab.MeshSet()
    rest.add_mesh(pymeshlab.Mesh(once.points[once.point_of_survivor]))
    rest.compute_selection_point_cloud_outliers(propthreshold=0.9, knearest=16)
    rest.meshing_remove_selected_vertices()
    kept = rest.current_mesh().vertex_matrix()
    contract = glsk.RingBuilder() | glsk.Contractor(reducer=glsk.LPRReducer())
    radius = 0.02 * rest.current_mesh().bounding_box().diagonal()
    return (contract | glsk.Connector(radius=radius) | glsk.Refiner(recentre=2))(kept)


def test_a_mixed_script_does_what_its_filters_do_by_hand(points, meshes, tmp_path):
    (tmp_path / "s.mlx").write_text(MIXED)
    expected = _by_hand(points)
    assert len(expected.edges) > 20
    meshes.load_filter_script(tmp_path / "s.mlx")
    meshes.apply_filter_script()
    _same(meshes.current_skeleton(), expected)
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), expected.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix(), expected.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), expected.radii)

    Layer.of(points).save(tmp_path / "scan.ply")
    words = ["run", str(tmp_path / "s.mlx"), str(tmp_path / "scan.ply"), "-o", str(tmp_path / "run.json")]
    assert CliRunner().invoke(app, words).exit_code == 0
    _same(read_skeleton(tmp_path / "run.json"), expected)

    session = glsk.MeshSet()
    session.add_points(points)
    session.meshing_remove_duplicate_vertices()
    session.generate_reduced_cloud_glsk(phi=1000)
    session.apply_filter("compute_selection_point_cloud_outliers", propthreshold=0.9, knearest=16)
    session.meshing_remove_selected_vertices()
    session.generate_skeleton_graph_glsk(radius=pymeshlab.PercentageValue(2))
    session.apply_filter("generate_refined_skeleton_glsk", recentre=2)
    _same(session.current_skeleton(), expected)

    session.save_filter_script(tmp_path / "saved.mlx")
    again = glsk.MeshSet()
    again.add_points(points)
    again.load_filter_script(tmp_path / "saved.mlx")
    again.apply_filter_script()
    _same(again.current_skeleton(), expected)
    again.save_filter_script(tmp_path / "again.mlx")
    assert (tmp_path / "again.mlx").read_text() == (tmp_path / "saved.mlx").read_text()
    again.clear_filter_script()
    again.save_filter_script(tmp_path / "none.mlx")
    assert "<filter " not in (tmp_path / "none.mlx").read_text()


def test_a_script_of_ours_alone_gives_the_same_without_pymeshlab(points, meshes, tmp_path):
    meshes.generate_contracted_cloud_glsk(max_iterations=3)
    meshes.generate_skeleton_graph_glsk(radius=0.05)
    meshes.generate_refined_skeleton_glsk()
    meshes.generate_segmented_cloud_glsk()
    meshes.save_filter_script(tmp_path / "s.mlx")
    plain = PlainLayers(Layer.of(points))
    for step in read_steps(tmp_path / "s.mlx"):
        plain.apply_step(step)
    for number in range(1, 5):
        mesh, layer = meshes.mesh(number), plain.layer(number)
        np.testing.assert_array_equal(mesh.vertex_matrix(), layer.vertices)
        np.testing.assert_array_equal(mesh.vertex_scalar_array(), layer.scalars)


def test_lengths_in_all_words(meshes, points):
    lengths = {
        0.023 * meshes.current_mesh().bounding_box().diagonal(): ("2.3%", pymeshlab.PercentageValue(2.3)),
        "2.3%": ("2.3% of the frame",),
        0.1: (0.1, np.float64(0.1), pymeshlab.PureValue(0.1)),
    }
    contract = glsk.RingBuilder() | glsk.Contractor(reducer=glsk.LPRReducer())
    for plain, words in lengths.items():
        expected = (contract | glsk.Connector(radius=plain) | glsk.Refiner())(points)
        for length in words:
            meshes.generate_curve_skeleton_glsk(connector_radius=length, layer=0)
            _same(meshes.current_skeleton(), expected)


def test_the_result_of_a_filter(meshes, points):
    said = meshes.generate_curve_skeleton_glsk()
    skeleton = glsk.skeletonize(points)
    _same(meshes.current_skeleton(), skeleton)
    assert said["layer"] == meshes.current_mesh_id() == 1
    assert (said["vertices"], said["edges"]) == (len(skeleton.vertices), len(skeleton.edges))
    assert (said["loops"], said["components"]) == (skeleton.n_loops, skeleton.n_components)
    assert said["length"] == skeleton.length
    assert said["converged"] is skeleton.report.converged
    assert meshes.current_mesh().label() == "Curve Skeleton of cloud"
    assert np.array_equal(meshes.mesh(0).vertex_matrix(), points)


def test_filters_go_on_where_the_last_one_ended_unless_the_layer_was_changed(meshes, points):
    meshes.generate_contracted_cloud_glsk(max_iterations=2)
    contracted = meshes.current_mesh().vertex_matrix()
    meshes.generate_contracted_cloud_glsk(max_iterations=1)
    assert meshes.layer().flow.report.stages[:2] == meshes.layer(1).flow.report.stages
    once_more = glsk.Contractor(reducer=glsk.LPRReducer(), max_iterations=1)
    two = glsk.Contractor(reducer=glsk.LPRReducer(), max_iterations=2)
    expected = (glsk.RingBuilder() | two | once_more)(points)
    np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix(), expected.contracted)

    meshes.set_current_mesh(1)
    meshes.compute_matrix_from_scaling_or_normalization(axisx=2.0, uniformflag=True)
    changed = meshes.current_mesh().vertex_matrix()
    assert not np.array_equal(changed, contracted)
    assert meshes.layer().flow is None
    meshes.generate_contracted_cloud_glsk(max_iterations=1)
    np.testing.assert_array_equal(
        meshes.current_mesh().vertex_matrix(), (glsk.RingBuilder() | once_more)(changed).contracted
    )


def test_a_segmented_mesh_keeps_its_faces():
    points = sample_object(1500, noise=0).points
    faces = np.arange(1500, dtype=np.int32).reshape(-1, 3)
    meshes = glsk.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, faces), "animal")
    meshes.generate_curve_skeleton_glsk()
    skeleton = meshes.current_skeleton()
    said = meshes.generate_segmented_cloud_glsk()
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.face_matrix(), faces)
    np.testing.assert_array_equal(mesh.vertex_matrix(), points)
    labels = mesh.vertex_scalar_array().astype(int)
    np.testing.assert_array_equal(labels, skeleton.segment())
    assert said["branches"] == len(skeleton.branches) > 1
    for i, path in enumerate(skeleton.branches):
        assert np.isin(path[1:-1], skeleton.vertex_of_point[labels == i]).any() or len(path) < 3
    colours = np.unique(np.column_stack([labels, mesh.vertex_color_matrix()]), axis=0)
    assert len(colours) == len(np.unique(labels))  # one for each
    assert len(np.unique(colours[:, 1:], axis=0)) == min(len(colours), 18)


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        (
            "generate_curve_skeleton_glks",
            {},
            "no filter is called 'generate_curve_skeleton_glks': did you mean 'generate_curve_skeleton_glsk'?",
        ),
        (
            "meshing_remove_duplicated_vertices",
            {},
            "no filter is called 'meshing_remove_duplicated_vertices': "
            "did you mean 'meshing_remove_duplicate_vertices'?",
        ),
        (
            "generate_curve_skeleton_glsk",
            {"conector_radius": 1},
            "no parameter of generate_curve_skeleton_glsk is called 'conector_radius': "
            "did you mean 'connector_radius'?",
        ),
        (
            "generate_curve_skeleton_glsk",
            {"connector_radius": "2 mm"},
            "connector_radius = '2 mm': must be a number in",
        ),
        ("generate_curve_skeleton_glsk", {"connector_radius": True}, "connector_radius = True: must be a number"),
        ("generate_curve_skeleton_glsk", {"ringbuilder_k": 12.5}, "ringbuilder_k = 12.5: must be an int, or 'auto'"),
        (
            "generate_curve_skeleton_glsk",
            {"connector_links": 2},
            "connector_links = 2: must be one of 'all', 'nea",
        ),
        (
            "generate_contracted_cloud_glsk",
            {"stop": "RingSizRatio"},
            "stop = 'RingSizRatio': no stop is called 'RingSizRatio': did you mean 'RingSizeRatio'?",
        ),
        (
            "generate_contracted_cloud_glsk",
            {"reducer": None, "lprreducer_phi": 3},
            "lprreducer_phi: LPRReducer is not in the pipeline, which has Contractor, ExplainedScore",
        ),
        ("generate_one_rings_glsk", {"layer": 7}, "layer = 7: there is no such layer"),
    ],
)
def test_wrong_names_and_values(meshes, name, params, message):
    with pytest.raises(InvalidParameterError) as caught:
        meshes.apply_filter(name, **params)
    assert str(caught.value).startswith(message)
    assert meshes.mesh_number() == 1


def test_layers_that_are_no_clouds(meshes):
    with pytest.raises(InvalidCloudError, match="load a scan first"):
        glsk.MeshSet().generate_curve_skeleton_glsk()
    with pytest.raises(InvalidCloudError, match=r"\(cloud\) has no edges"):
        meshes.current_skeleton()
    meshes.generate_curve_skeleton_glsk()
    with pytest.raises(InvalidCloudError, match="make the scan the current layer"):
        meshes.generate_curve_skeleton_glsk()


def test_a_filter_that_fails_in_a_script(meshes, tmp_path):
    (tmp_path / "s.mlx").write_text(
        '<FilterScript>\n<filter name="Select None"/>\n<filter name="Close Holes"/>\n</FilterScript>'
    )
    meshes.load_filter_script(tmp_path / "s.mlx")
    with pytest.raises(ScriptError, match=r"s.mlx, line 3: filter 'Close Holes': .*does not have Any Faces"):
        meshes.apply_filter_script()
    (tmp_path / "s.mlx").write_text('<FilterScript>\n<filter name="Generate One Rings (GLSkeleton)"/>\n</FilterScript>')
    few = PlainLayers(Layer.of(np.eye(3)))
    with pytest.raises(ScriptError, match=r"s.mlx, line 2: filter 'Generate One Rings \(GLSkeleton\)': .*8 distinct"):
        few.apply_step(read_steps(tmp_path / "s.mlx")[0])


def test_a_script_that_is_wrong_leaves_the_current_one(meshes, tmp_path):
    meshes.meshing_remove_duplicate_vertices()
    with pytest.raises(FileNotFoundError):
        meshes.load_filter_script(tmp_path / "none.mlx")
    meshes.save_filter_script(tmp_path / "s.mlx")
    assert [step.name for step in read_steps(tmp_path / "s.mlx")] == ["meshing_remove_duplicate_vertices"]


def test_listings_have_both_kinds(capfd, meshes):
    names = glsk.MeshSet.filter_list()
    assert {"meshing_remove_duplicate_vertices", *verbs()} <= set(names)
    meshes.print_filter_list()
    assert capfd.readouterr().out.split() == names
    meshes.print_filter_parameter_list("generate_skeleton_graph_glsk")
    assert "\tradius : PercentageValue = 1% of the frame [above: 0]\n" in capfd.readouterr().out
    with pytest.raises(InvalidParameterError, match="did you mean 'generate_skeleton_graph_glsk'"):
        meshes.print_filter_parameter_list("generate_skeleton_graf_glsk")
    meshes.search("curve skeleton")
    assert "generate_curve_skeleton_glsk : The curve skeleton" in capfd.readouterr().out
    meshes.generate_one_rings_glsk(k=9)
    meshes.print_filter_script()
    assert "0: generate_one_rings_glsk\n\tk : RichInt = 9\n" in capfd.readouterr().out
    values = meshes.filter_parameter_values("generate_skeleton_graph_glsk", radius=pymeshlab.PercentageValue(3))
    assert values["radius"] == "3.0%"
    assert meshes.filter_parameter_values("compute_selection_point_cloud_outliers")["knearest"] == 32


def test_what_pymeshlab_prints_of_its_own_is_still_there():
    code = "import glsk_o3d as g; g.MeshSet.print_filter_parameter_list('create_sphere'); g.MeshSet.search('poisson')"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "radius : float = 1" in run.stdout
    assert "generate_surface_reconstruction_screened_poisson" in run.stdout


@pytest.mark.parametrize("ending", ["ply", "obj", "json"])
def test_saved_skeletons_keep_their_edges(meshes, tmp_path, ending):
    meshes.generate_curve_skeleton_glsk()
    meshes.save_current_mesh(tmp_path / f"s.{ending}")
    back = read_skeleton(tmp_path / f"s.{ending}")
    np.testing.assert_array_equal(back.vertices, meshes.current_skeleton().vertices)
    np.testing.assert_array_equal(back.edges, meshes.current_skeleton().edges)


def test_a_skeleton_that_meshlab_changed_is_what_meshlab_made_of_it(meshes):
    meshes.generate_curve_skeleton_glsk()
    before = meshes.current_skeleton()
    meshes.compute_matrix_from_scaling_or_normalization(axisx=2.0, uniformflag=True, scalecenter="origin")
    after = meshes.current_skeleton()
    np.testing.assert_array_equal(after.vertices, 2 * before.vertices)
    np.testing.assert_array_equal(after.edges, before.edges)
    np.testing.assert_array_equal(after.radii, before.radii)  # scalars are what MeshLab leaves alone
    assert len(after.points) == 0


def test_it_is_a_meshset_of_pymeshlab(meshes):
    assert isinstance(meshes, pymeshlab.MeshSet)
    assert "generate_curve_skeleton_glsk" in dir(glsk.MeshSet)
    assert "curve skeleton" in glsk.MeshSet.generate_curve_skeleton_glsk.__doc__


def test_mesh_of_vertices_and_edges(skeleton):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(skeleton.to_pymeshlab())
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)


def test_obj_of_meshlab_keeps_the_edges(tree, tmp_path):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(tree.to_pymeshlab())
    meshes.save_current_mesh(str(tmp_path / "m.obj"))
    back = read_skeleton(tmp_path / "m.obj")
    np.testing.assert_allclose(back.vertices, tree.vertices, atol=1e-6)
    np.testing.assert_array_equal(back.edges, tree.edges)


def test_without_pymeshlab_it_is_named(tree, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingPackageError, match=r"pymeshlab.*pip install .glsk-o3d.meshlab"):
        tree.to_pymeshlab()


def test_without_pymeshlab_meshset_names_the_extra_and_all_else_works():
    code = """
import sys
sys.modules["pymeshlab"] = None
import glsk_o3d
from glsk_o3d import *
from glsk_o3d.recipes.catalogue import catalogue
assert "Refiner" in catalogue()
glsk_o3d.MeshSet
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stderr.rstrip().endswith(
        'MissingPackageError: pymeshlab cannot be imported: pip install "glsk-o3d[meshlab]"'
    )


def test_what_meshlab_does_to_our_layers_is_kept(meshes, points, tmp_path):
    o3d = pytest.importorskip("open3d")

    def saved():
        meshes.save(tmp_path / "c.ply")
        return o3d.t.io.read_point_cloud(str(tmp_path / "c.ply")).point

    meshes.generate_segmented_cloud_glsk()
    meshes.compute_color_by_function_per_vertex(x="255", y="0", z="0")
    np.testing.assert_array_equal(saved()["colors"].numpy(), np.tile([255, 0, 0], (len(points), 1)))
    meshes.generate_contracted_cloud_glsk(layer=0)
    contracted = meshes.layer().flow
    meshes.compute_scalar_by_function_per_vertex(q="42")
    assert (saved()["quality"].numpy() == 42).all()
    assert meshes.layer().flow is contracted
    meshes.generate_reduced_cloud_glsk(layer=0)
    meshes.compute_normal_for_point_clouds()
    np.testing.assert_array_equal(saved()["normals"].numpy(), meshes.current_mesh().vertex_normal_matrix())


def test_scalars_of_a_skeleton_are_its_radii(meshes, tmp_path):
    meshes.generate_curve_skeleton_glsk()
    before = meshes.current_skeleton()
    for factor in (10, 0):
        meshes.compute_scalar_by_function_per_vertex(q=f"{factor}*q")
        after = meshes.current_skeleton()
        np.testing.assert_allclose(after.radii, factor * before.radii, rtol=1e-6)
        np.testing.assert_array_equal([after.half_width, after.half_thickness], [after.radii] * 2)
        assert after.report is before.report
        np.testing.assert_array_equal(after.points, before.points)
        for save in (meshes.save, meshes.save_current_mesh):
            save(tmp_path / "s.ply")
            np.testing.assert_array_equal(read_skeleton(tmp_path / "s.ply").radii, after.radii)


def test_a_segmentation_has_the_points_of_its_skeleton(points):
    n = len(points) // 3
    meshes = glsk.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, np.arange(3 * n, dtype=np.int32).reshape(n, 3)))
    meshes.generate_reduced_cloud_glsk()
    reduced = meshes.current_mesh().vertex_matrix()
    for filters in (
        ["generate_curve_skeleton_glsk", "generate_segmented_cloud_glsk"],
        ["generate_segmented_cloud_glsk"],
    ):
        meshes.set_current_mesh(1)
        for name in filters:
            meshes.apply_filter(name)
        np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix(), reduced)
        assert meshes.current_mesh().face_number() == 0
    meshes.set_current_mesh(1)
    meshes.generate_skeleton_graph_glsk()  # goes on from the flow, which is of all points
    meshes.generate_segmented_cloud_glsk()
    np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix(), points)
    assert meshes.current_mesh().face_number() == n


def test_a_contracted_cloud_is_no_scan(meshes):
    meshes.generate_contracted_cloud_glsk()
    for name in ("curve_skeleton", "one_rings", "refined_skeleton", "segmented_cloud"):
        with pytest.raises(InvalidCloudError, match=r"\(Contracted Cloud of cloud\) .*make the scan the current layer"):
            meshes.apply_filter(f"generate_{name}_glsk")
    meshes.generate_skeleton_graph_glsk()
    meshes.generate_one_rings_glsk(layer=0)
    meshes.generate_curve_skeleton_glsk()  # where rings are made nothing has moved yet


def test_a_layer_that_is_not_there_is_refused_before_meshlab_looks(meshes):
    for number in (9, -3):
        with pytest.raises(InvalidParameterError, match=f"sampledmesh = {number}: there is no such layer"):
            meshes.get_hausdorff_distance(sampledmesh=number)


def test_which_parameters_are_layers():
    from glsk_o3d.meshlab import builtin

    later = pymeshlab.MeshSet()
    for _ in range(3):
        later.add_mesh(builtin.trial().mesh(0))
    for number in (0, 1):
        later.set_current_mesh(number)
        later.delete_current_mesh()
    later.set_current_mesh(2)
    unlike_elsewhere = set()
    for name in pymeshlab.filter_list():
        here, there = builtin.trial().filter_parameter_values(name), later.filter_parameter_values(name)
        ours = {key for key, value in here.items() if builtin.is_layer(key, value)}
        theirs = {key for key, value in here.items() if type(value) is int and value != there[key]}
        assert theirs <= ours
        unlike_elsewhere |= ours - theirs
    assert unlike_elsewhere == {"referencemesh", "sourcemesh", "basemesh"}  # the first layer, whatever there is


THIRDS = np.array([[1 / 3, 0, 0, 1e3 / 7], [0, 1 / 7, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("create_sphere", {"radius": 1 / 3}),
        ("apply_coord_taubin_smoothing", {"lambda_": 1 / 3, "mu": -0.37}),
        ("set_matrix", {"transformmatrix": THIRDS}),
        ("compute_matrix_from_rotation", {"rotaxis": 3, "customaxis": np.array([1 / 3, 1 / 7, 1]), "angle": 33.3}),
        ("meshing_merge_close_vertices", {"threshold": pymeshlab.PercentageValue(3.3)}),
    ],
)
def test_a_saved_script_repeats_the_session_to_the_digits_that_meshlab_writes(tmp_path, name, params):
    def start():
        meshes = glsk.MeshSet()
        if name != "create_sphere":  # which is for an empty one
            meshes.add_mesh(sphere.current_mesh())
        return meshes

    sphere = pymeshlab.MeshSet()
    sphere.create_sphere(radius=1.0)
    session, again = start(), start()
    session.apply_filter(name, **params)
    session.save_filter_script(tmp_path / "s.mlx")
    again.load_filter_script(tmp_path / "s.mlx")
    again.apply_filter_script()
    found, expected = (meshes.current_mesh().vertex_matrix() for meshes in (again, session))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)  # six digits


def test_normals_turn_with_the_matrix_of_a_layer(points):
    normals = np.random.default_rng(0).normal(size=points.shape)
    turn = np.eye(4)
    turn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    meshes = glsk.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals))
    meshes.set_matrix(transformmatrix=turn, freeze=False)
    meshes.generate_segmented_cloud_glsk()
    mesh = meshes.current_mesh()
    np.testing.assert_allclose(mesh.vertex_matrix(), points @ turn[:3, :3].T)
    np.testing.assert_allclose(mesh.vertex_normal_matrix(), normals @ turn[:3, :3].T)
    meshes.set_current_mesh(0)
    meshes.set_matrix(transformmatrix=np.diag([2.0, 1, 1, 1]), freeze=False)
    stretched = meshes.layer().normals
    slopes = normals / [2, 1, 1]
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(stretched, slopes * lengths / np.linalg.norm(slopes, axis=1, keepdims=True))


def test_layers_that_are_gone_are_forgotten(meshes, points):
    for _ in range(2):
        meshes.generate_contracted_cloud_glsk(layer=0)
    meshes.delete_current_mesh()
    meshes.generate_one_rings_glsk(layer=0)
    assert set(meshes._flows) == {1, 3}
    contracted = meshes.mesh(1).vertex_matrix()
    meshes.clear()
    assert meshes.mesh_number() == 0
    meshes.add_points(points)
    meshes.add_points(contracted)  # as layer 1 was, but nobody says from where
    assert meshes.layer().flow is None


def test_steps_of_a_session_say_which_filter_failed(meshes):
    meshes.generate_one_rings_glsk(layer=0)
    meshes.meshing_remove_duplicate_vertices()
    with pytest.raises(ScriptError, match=r"^filter 'Generate One Rings \(GLSkeleton\)': there is no layer"):
        _emptied(meshes).apply_filter_script()
    meshes._script = meshes._script[1:]
    with pytest.raises(ScriptError, match=r"^filter 'Remove Duplicate Vertices': "):
        _emptied(meshes).apply_filter_script()


def _emptied(meshes):
    meshes.clear()
    return meshes


def test_listings_have_limits_and_words(capfd):
    for name in ("generate_curve_skeleton_glsk", "generate_one_rings_glsk"):
        glsk.MeshSet.print_filter_parameter_list(name)
    told = capfd.readouterr().out
    assert "\tringbuilder_k : int or str = auto [min: 4; max: 256] (auto, published)\n" in told
    assert "\tradius : PercentageValue or str = None [above: 0] (none)\n" in told


def test_no_name_is_no_filter(meshes):
    with pytest.raises(InvalidParameterError, match="no filter is called 'None'"):
        meshes.apply_filter(None)
