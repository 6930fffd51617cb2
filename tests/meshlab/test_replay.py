"""A saved script does again what the session did, if nobody went to another layer in between."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d.cli.main import app
from glsk_o3d.errors import GlskError
from glsk_o3d.io.skeletons import read_skeleton
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.script import read_script
from glsk_o3d.samples import torus

pymeshlab = pytest.importorskip("pymeshlab")

POINTS = torus(400).points
SCANS = (POINTS, 2 * POINTS[:300] + [0, 0, 1])


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
)


def _act(meshes, name, layer):
    """What somebody may do next; filters refuse much of it, as they do to everybody."""
    there = sorted(mesh.id() for mesh in meshes)
    chosen = [there[i % len(there)] for i in np.ravel(layer)] if there and layer is not None else [-1]
    try:
        if name == "distance":
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
    session.generate_pruned_skeleton_glsk(length="5%", order=3)
    session.generate_rerooted_skeleton_glsk(root="thickest", layer=3)
    session.generate_copy_of_current_mesh()
    session.generate_smoothed_skeleton_glsk(passes=3)
    session.generate_simplified_skeleton_glsk(n=np.int64(12), layer=np.int64(2))
    session.generate_segmented_cloud_glsk(layer=4)
    again = _replayed(session, SCANS, tmp_path / "s.mlx")
    assert len(session.mesh(8).vertex_matrix()) == 12
    assert [mesh.id() for mesh in again] == [mesh.id() for mesh in session] == list(range(10))
    for ours, theirs in zip(session, again, strict=True):
        _equal(ours, theirs)


def test_the_command_and_the_session_agree(tmp_path):
    session = _loaded([POINTS])
    session.generate_contracted_cloud_glsk(max_iterations=2)
    session.generate_segmented_cloud_glsk(layer=0)
    session.compute_selection_by_condition_per_vertex(condselect="x > 1.1")
    session.meshing_remove_selected_vertices()
    session.generate_skeleton_graph_glsk(layer=1)
    session.save_filter_script(tmp_path / "s.mlx")
    Layer.of(POINTS).save(tmp_path / "scan.ply")
    words = ["run", str(tmp_path / "s.mlx"), str(tmp_path / "scan.ply"), "-o", str(tmp_path / "s.json")]
    assert CliRunner().invoke(app, words).exit_code == 0
    back = read_skeleton(tmp_path / "s.json")
    np.testing.assert_array_equal(back.vertices, session.current_skeleton().vertices)
    np.testing.assert_array_equal(back.edges, session.current_skeleton().edges)


def test_a_script_without_ours_is_one_that_meshlab_opens(tmp_path):
    session = _loaded(SCANS)
    session.meshing_remove_duplicate_vertices()
    with pytest.raises(GlskError):
        session.generate_one_rings_glsk(k=1)  # is not in it
    session.set_selection_all()
    session.save_filter_script(tmp_path / "s.mlx")
    pymeshlab.MeshSet().load_filter_script(str(tmp_path / "s.mlx"))
    assert [call.name for call in read_script(tmp_path / "s.mlx")] == ["Remove Duplicate Vertices", "Select All"]


def test_layers_that_were_added_or_cleared_are_in_no_script(tmp_path):
    session = _loaded([SCANS[1]])
    session.generate_one_rings_glsk()
    session.clear()
    session.add_points(POINTS)
    session.apply_filter_script()
    again = _replayed(session, [POINTS], tmp_path / "s.mlx")
    for ours, theirs in zip(session, again, strict=True):
        _equal(ours, theirs)
