"""A saved script does again what the session did, on the layers on which it was done."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d.cli.main import app
from glsk_o3d.errors import GlskError, ScriptError
from glsk_o3d.io.skeletons import read_skeleton
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.script import read_script
from glsk_o3d.meshlab.steps import PlainLayers, read_steps
from glsk_o3d.samples import torus

pymeshlab = pytest.importorskip("pymeshlab")

POINTS = torus(400).points
SCANS = (POINTS, 2 * POINTS[:300] + [0, 0, 1])
CHANGE = '<filter name="Change the current layer">\n<Param type="RichMesh" name="mesh" value="{}"/>\n</filter>\n'


def _loaded(scans):
    meshes = glsk.MeshSet()
    for scan in scans:
        meshes.add_points(scan)
    return meshes


def _replayed(session, scans, path):
    session.save_filter_script(path)
    again = _loaded(scans)
    again.load_filter_script(path)
    again.apply_filter_script()
    return again


def _equal(a, b):
    np.testing.assert_array_equal(a.vertex_matrix(), b.vertex_matrix())
    np.testing.assert_array_equal(a.edge_matrix(), b.edge_matrix())
    np.testing.assert_array_equal(a.face_matrix(), b.face_matrix())
    np.testing.assert_array_equal(a.vertex_scalar_array(), b.vertex_scalar_array())
    np.testing.assert_array_equal(a.vertex_color_matrix(), b.vertex_color_matrix())
    np.testing.assert_array_equal(a.vertex_selection_array(), b.vertex_selection_array())
    assert a.label() == b.label()


OURS = {
    "generate_one_rings_glsk": {"k": 9},
    "generate_contracted_cloud_glsk": {"max_iterations": 2},
    "generate_reduced_cloud_glsk": {"phi": 1000},
    "generate_skeleton_graph_glsk": {"radius": "3%"},
    "generate_refined_skeleton_glsk": {"recentre": 1},
    "generate_segmented_cloud_glsk": {},
}
EDITS = {
    "generate_largest_skeleton_component_glsk": {},
    "generate_skeleton_without_loops_glsk": {},
    "generate_rerooted_skeleton_glsk": {"root": (0.5, 0, 0)},
    "generate_pruned_skeleton_glsk": {"length": "5%", "radius": 0.01},
    "generate_smoothed_skeleton_glsk": {"passes": 2},
    "generate_simplified_skeleton_glsk": {"tolerance": pymeshlab.PercentageValue(1)},
}
THEIRS = {
    "compute_matrix_from_scaling_or_normalization": {"axisx": 1.5, "uniformflag": True},
    "compute_selection_by_condition_per_vertex": {"condselect": "x > 0"},
    "meshing_remove_selected_vertices": {},
    "generate_copy_of_current_mesh": {},
    "generate_from_selected_vertices": {"deleteoriginal": False},
    "delete_current_mesh": {},
    "compute_scalar_by_function_per_vertex": {"q": "x*x/3"},
    "create_sphere": {"subdiv": 1},
}
numbers = st.integers(0, 5)
ACTS = st.one_of(
    st.tuples(st.sampled_from(sorted(OURS)), st.none() | numbers),
    st.tuples(st.sampled_from(sorted(EDITS)), st.none()),
    st.tuples(st.sampled_from(sorted(EDITS)), numbers),
    st.tuples(st.sampled_from(sorted(THEIRS)), st.none()),
    st.tuples(st.just("distance"), st.tuples(numbers, numbers)),
    st.tuples(st.just("look"), numbers),
)


def _act(meshes, name, layer):
    """What somebody may do next; filters refuse much of it, as they do to everybody."""
    there = sorted(mesh.id() for mesh in meshes)
    chosen = [there[i % len(there)] for i in np.ravel(layer)] if there and layer is not None else [-1]
    try:
        if name == "look":
            if there:
                meshes.set_current_mesh(*chosen)
        elif name == "distance":
            if there and all(meshes.mesh(number).vertex_number() for number in chosen):  # else MeshLab crashes
                meshes.compute_scalar_by_distance_from_another_mesh_per_vertex(
                    measuremesh=chosen[0], refmesh=chosen[-1], signeddist=False
                )
        elif name in OURS | EDITS:
            meshes.apply_filter(name, **(OURS | EDITS)[name], **({} if layer is None else {"layer": chosen[0]}))
        else:
            meshes.apply_filter(name, **THEIRS[name])
    except (GlskError, pymeshlab.PyMeshLabException):
        pass


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
@settings(max_examples=50)
@given(n_scans=st.integers(1, 2), begun=st.booleans(), acts=st.lists(ACTS, min_size=3, max_size=9))
def test_any_session_replays_bit_for_bit(tmp_path_factory, n_scans, begun, acts):
    scans = SCANS[:n_scans]
    session = _loaded(scans)
    if begun:  # by chance alone there is hardly ever a skeleton to change
        session.generate_curve_skeleton_glsk()
    for name, layer in acts:
        _act(session, name, layer)
    path = tmp_path_factory.getbasetemp() / "replay.mlx"
    session.save_filter_script(path)
    if "<filter " not in path.read_text():
        return
    again = _replayed(session, scans, path)
    assert [mesh.id() for mesh in again] == [mesh.id() for mesh in session]
    for ours, theirs in zip(session, again, strict=True):
        _equal(ours, theirs)
    before = path.read_text()
    again.save_filter_script(path)
    assert path.read_text() == before


def test_what_changes_skeletons_replays_between_meshlabs_filters(tmp_path):
    session = _loaded(SCANS)
    session.generate_curve_skeleton_glsk(layer=0)
    session.generate_skeleton_without_loops_glsk()
    session.compute_scalar_by_function_per_vertex(q="q/3")  # the radii
    session.generate_rerooted_skeleton_glsk(root="thickest")
    session.generate_pruned_skeleton_glsk(length="5%", order=3, layer=3)
    session.set_current_mesh(4)
    session.generate_copy_of_current_mesh()
    session.generate_smoothed_skeleton_glsk(passes=3)
    session.generate_simplified_skeleton_glsk(n=np.int64(12), layer=np.int64(2))
    session.generate_segmented_cloud_glsk(layer=5)
    again = _replayed(session, SCANS, tmp_path / "s.mlx")
    assert len(session.mesh(8).vertex_matrix()) == 12
    assert [mesh.id() for mesh in again] == [mesh.id() for mesh in session] == list(range(10))
    for ours, theirs in zip(session, again, strict=True):
        _equal(ours, theirs)


def test_the_command_and_the_session_agree(tmp_path):
    session = _loaded([POINTS])
    session.generate_contracted_cloud_glsk(max_iterations=2)
    session.set_current_mesh(0)
    session.compute_selection_by_condition_per_vertex(condselect="x > 1.1")
    session.meshing_remove_selected_vertices()
    session.generate_segmented_cloud_glsk(layer=0)
    session.set_current_mesh(1)
    session.generate_skeleton_graph_glsk()
    session.save_filter_script(tmp_path / "s.mlx")
    assert [call.name for call in read_script(tmp_path / "s.mlx")].count("Change the current layer") == 1
    assert read_steps(tmp_path / "s.mlx")[-1].values["layer"] == 1
    Layer.of(POINTS).save(tmp_path / "scan.ply")
    words = ["run", str(tmp_path / "s.mlx"), str(tmp_path / "scan.ply"), "-o", str(tmp_path / "s.json")]
    assert CliRunner().invoke(app, words).exit_code == 0
    back = read_skeleton(tmp_path / "s.json")
    np.testing.assert_array_equal(back.vertices, session.current_skeleton().vertices)
    np.testing.assert_array_equal(back.edges, session.current_skeleton().edges)


def test_no_change_is_written_where_none_was_needed(tmp_path):
    session = _loaded(SCANS)
    session.set_current_mesh(0)
    session.set_current_mesh(1)
    session.meshing_remove_duplicate_vertices()
    session.set_current_mesh(0)  # only to look
    session.set_current_mesh(1)
    session.set_selection_all()
    session.set_current_mesh(0)
    session.save_filter_script(tmp_path / "s.mlx")
    plain = pymeshlab.MeshSet()
    plain.load_filter_script(str(tmp_path / "s.mlx"))  # still one that MeshLab opens
    assert [call.name for call in read_script(tmp_path / "s.mlx")] == ["Remove Duplicate Vertices", "Select All"]


def test_of_several_scans_the_one_that_was_chosen(tmp_path):
    session = _loaded(SCANS)
    session.set_current_mesh(0)
    session.meshing_remove_duplicate_vertices()
    session.generate_curve_skeleton_glsk()
    again = _replayed(session, SCANS, tmp_path / "s.mlx")
    np.testing.assert_array_equal(again.current_skeleton().vertices, session.current_skeleton().vertices)
    np.testing.assert_array_equal(session.current_skeleton().vertices, glsk.skeletonize(POINTS).vertices)


def test_numbers_are_those_of_a_replay(tmp_path):
    session = _loaded([SCANS[1]])
    session.delete_current_mesh()
    session.clear_filter_script()
    session.add_points(POINTS)  # layer 1 here, and 0 for who begins with it
    session.generate_contracted_cloud_glsk(max_iterations=2)
    session.add_points(SCANS[1])  # only to look at: layer 3 here, and nowhere in a replay
    session.generate_reduced_cloud_glsk(layer=2)
    session.set_current_mesh(1)
    session.compute_scalar_by_distance_from_another_mesh_per_vertex(measuremesh=1, refmesh=4)
    again = _replayed(session, [POINTS], tmp_path / "s.mlx")
    for here, there in {1: 0, 2: 1, 4: 2}.items():
        _equal(session.mesh(here), again.mesh(there))
    with pytest.raises(GlskError):  # what is there now is what the script is run on
        session.apply_filter_script()


@pytest.mark.parametrize("filter", ["meshing_remove_duplicate_vertices", "generate_one_rings_glsk"])
def test_a_layer_that_was_added_later_is_in_no_script(tmp_path, filter):
    session = _loaded([POINTS])
    session.generate_one_rings_glsk()
    session.add_points(SCANS[1])
    session.apply_filter(filter)
    with pytest.raises(ScriptError, match=r"s\.mlx: filter '[\w ()]+' needs layer 2, which was added between"):
        session.save_filter_script(tmp_path / "s.mlx")
    assert not list(tmp_path.iterdir())
    session.clear_filter_script()
    session.generate_one_rings_glsk(layer=0)
    session.save_filter_script(tmp_path / "s.mlx")


def test_a_filter_that_failed_was_not_the_first(tmp_path):
    session = _loaded([np.eye(3)])
    with pytest.raises(GlskError):
        session.generate_one_rings_glsk()
    session.add_points(POINTS)
    session.generate_one_rings_glsk()
    again = _replayed(session, [np.eye(3), POINTS], tmp_path / "s.mlx")
    _equal(again.current_mesh(), session.current_mesh())


def test_a_cleared_session_begins_anew(tmp_path):
    session = _loaded([POINTS])
    session.generate_one_rings_glsk()
    session.clear()
    session.add_points(SCANS[1])
    session.apply_filter_script()
    session.set_current_mesh(0)
    session.meshing_remove_duplicate_vertices()
    again = _replayed(session, [SCANS[1]], tmp_path / "s.mlx")
    for ours, theirs in zip(session, again, strict=True):
        _equal(ours, theirs)
    session.clear()
    session.add_points(POINTS)
    session.generate_one_rings_glsk()
    with pytest.raises(ScriptError, match="needs layer 0, which was added between"):
        session.save_filter_script(tmp_path / "s.mlx")


def _written(path, *filters):
    path.write_text(f"<FilterScript>\n{''.join(filters)}</FilterScript>")
    return path


OURS_ALONE = '<filter name="Generate Contracted Cloud (GLSkeleton)"/>\n'


def test_layers_change_without_pymeshlab(tmp_path, monkeypatch):
    path = _written(tmp_path / "s.mlx", OURS_ALONE, CHANGE.format(0), OURS_ALONE)
    meshes = _loaded([POINTS])
    meshes.load_filter_script(path)
    meshes.apply_filter_script()
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    layers = PlainLayers(Layer.of(POINTS))
    said = [layers.apply_step(step) for step in read_steps(path)]
    assert [each["layer"] for each in said] == [1, 0, 2]
    np.testing.assert_array_equal(layers.layer().vertices, layers.layer(1).vertices)
    np.testing.assert_array_equal(layers.layer().vertices, meshes.current_mesh().vertex_matrix())
    for step in read_steps(_written(path, CHANGE.format(0))):
        layers.apply_step(step)
    layers.save(tmp_path / "c.xyz")
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "c.xyz"), POINTS)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (CHANGE.format(7), "line 2: filter 'Change the current layer': (mesh|layer) = 7: there"),
        (CHANGE.format(-1), "line 3: filter 'Change the current layer': parameter 'mesh': must be at least 0"),
        (CHANGE.format("a"), "line 3: filter 'Change the current layer': parameter 'mesh': 'a' is not an int"),
        (CHANGE.format(0).replace("mesh", "layr"), "line 3: .* no parameter is called 'layr': there are mesh"),
        ('<filter name="Change the current layer"/>', "line 2: .* its parameter 'mesh' is not there: which layer"),
    ],
)
def test_a_change_to_nothing(tmp_path, change, message):
    path = _written(tmp_path / "s.mlx", change)
    with pytest.raises(ScriptError, match=rf"s\.mlx, {message}"):
        PlainLayers(Layer.of(POINTS)).apply_step(*read_steps(path))
    with pytest.raises(ScriptError, match=rf"s\.mlx, {message}"):
        _loaded([POINTS]).apply_step(*read_steps(path))
