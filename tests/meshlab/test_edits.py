"""The filters that change skeletons: what the functions of glsk_o3d.editing do, in a MeshSet and in scripts."""

import inspect
import sys

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import editing, save_skeleton
from glsk_o3d.analysis import segment
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError, ScriptError
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.script import write_script
from glsk_o3d.meshlab.steps import PlainLayers, read_steps, step
from glsk_o3d.meshlab.verbs import EditVerb, verbs
from glsk_o3d.samples import torus, tree

MADE = "generate_curve_skeleton_glsk"
EDITS = {name: verb for name, verb in verbs().items() if isinstance(verb, EditVerb)}
WAYS = {
    "generate_largest_skeleton_component_glsk": ({}, editing.largest_component),
    "generate_skeleton_without_loops_glsk": ({}, lambda s: editing.cut_loops(s)[0]),
    "generate_rerooted_skeleton_glsk": ({"root": "-z"}, lambda s: editing.reroot(s, "-z")),
    "generate_pruned_skeleton_glsk": ({"length": 0.8, "order": 2}, lambda s: editing.prune(s, length=0.8, order=2)),
    "generate_simplified_skeleton_glsk": ({"tolerance": 0.02}, lambda s: editing.simplify(s, tolerance=0.02)),
}


@pytest.fixture(scope="module")
def scan():
    return tree(2000, forks=3).points


@pytest.fixture(scope="module")
def whole(scan):
    return glsk.skeletonize(scan)


@pytest.fixture
def layers(scan, whole):
    layers = PlainLayers(Layer.of(scan))
    layers.layers.append(Layer.of(whole, source=layers.layer()))
    return layers


def applied(layers, name, **values):
    return layers.apply_step(step(verbs()[f"generate_{name}_glsk"], values))


def same(a, b):
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)
    np.testing.assert_array_equal(a.radii, b.radii)
    np.testing.assert_array_equal(a.vertex_of_point, b.vertex_of_point)


def filters(*names, param=None):
    """A script of filters of ours, the last with a parameter, in the third line and after."""
    inside = '\n<Param type="{}" name="{}" value="{}"/>\n'.format(*param) if param else ""
    calls = [f'<filter name="Generate {name} (GLSkeleton)">' for name in names]
    return "\n".join(["<FilterScript>", "</filter>\n".join(calls) + f"{inside}</filter>", "</FilterScript>"])


def test_every_function_has_a_verb_with_its_parameters_and_a_line_on_the_page(root):
    assert sorted(verb.function.__name__ for verb in EDITS.values()) == sorted(editing.__all__)
    assert set(WAYS) == set(EDITS)
    page = (root / "docs" / "editing.md").read_text().splitlines()
    for verb in EDITS.values():
        _, *expected = inspect.signature(verb.function).parameters.values()
        *own, _ = verb.slots.values()
        assert [(slot.name, slot.default) for slot in own] == [(each.name, each.default) for each in expected]
        for slot in own:
            assert slot.kind == {"root": "root", "order": "int"}.get(slot.name, "length")
        (line,) = [line for line in page if f"| `{verb.title.removesuffix(' (GLSkeleton)')}` |" in line]
        assert line.startswith(f"| `{verb.function.__name__}(skeleton")


@pytest.mark.parametrize("name", WAYS)
def test_a_session_and_a_script_without_pymeshlab_make_what_the_function_makes(
    tmp_path, monkeypatch, scan, whole, name
):
    pytest.importorskip("pymeshlab")
    params, function = WAYS[name]
    expected = function(whole)
    meshes = glsk.MeshSet()
    meshes.add_points(scan)
    meshes.generate_curve_skeleton_glsk()
    said = meshes.apply_filter(name, **params)
    same(meshes.current_skeleton(), expected)
    np.testing.assert_array_equal(meshes.current_mesh().vertex_scalar_array(), expected.radii)
    assert said["layer"] == 2
    assert (said["vertices"], said["loops"], said["length"]) == (len(expected.vertices), 0, expected.length)
    assert meshes.current_mesh().label() == f"{name[9:-5].replace('_', ' ').title()} of cloud"

    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    write_script(tmp_path / "s.mlx", [step(verbs()[MADE], {}).call, step(verbs()[name], params).call])
    layers = PlainLayers(Layer.of(scan))
    for each in read_steps(tmp_path / "s.mlx"):
        layers.apply_step(each)
    same(layers.layer().skeleton, expected)


def test_one_after_the_other_from_any_layer(layers, whole):
    applied(layers, "pruned_skeleton", order=1)
    applied(layers, "rerooted_skeleton", root=3)
    applied(layers, "simplified_skeleton", tolerance=0.01, layer=1)
    pruned = editing.prune(whole, order=1)
    same(layers.layer(2).skeleton, pruned)
    same(layers.layer(3).skeleton, editing.reroot(pruned, 3))
    assert layers.layer(3).skeleton.report.root == tuple(pruned.vertices[3])
    same(layers.layer(4).skeleton, editing.simplify(whole, tolerance=0.01))


@pytest.mark.parametrize(
    ("name", "parameter", "percent"),
    [("pruned", "length", 12), ("simplified", "tolerance", 0.5)],
)
def test_a_percentage_is_of_the_box_of_the_skeleton(layers, whole, name, parameter, percent):
    diagonal = np.linalg.norm(np.ptp(whole.vertices, axis=0))
    function = editing.prune if name == "pruned" else editing.simplify
    expected = function(whole, **{parameter: percent / 100 * diagonal})
    assert len(expected.vertices) < len(whole.vertices)
    assert diagonal < 0.99 * np.linalg.norm(np.ptp(whole.points, axis=0))
    applied(layers, f"{name}_skeleton", **{parameter: f"{percent}%"})
    same(layers.layer().skeleton, expected)


def test_roots_in_all_words(layers, whole, tmp_path):
    number = int(whole.leaves[0])
    end = whole.vertices[number]
    for root in (tuple(end), end, list(end), ",".join(map(repr, end.tolist())), np.int64(number), str(number)):
        applied(layers, "rerooted_skeleton", root=root, layer=1)
        np.testing.assert_array_equal(layers.layer().vertices[0], end)
    verb = verbs()["generate_rerooted_skeleton_glsk"]
    assert step(verb, {"root": (0, 0.5, 2)}).call.params[0].attributes == {"value": "0.0,0.5,2.0"}
    attributes = ('RichString" value="0.5,0,2.0', 'RichPosition" x="0.5" y="0" z="2', 'RichInt" value="4')
    for said, root in zip(attributes, ("0.5,0,2.0", "0.5,0,2", 4), strict=True):
        text = filters("Rerooted Skeleton").replace("</filter>", f'<Param name="root" type="{said}"/></filter>')
        (tmp_path / "s.mlx").write_text(text)
        (one,) = read_steps(tmp_path / "s.mlx")
        assert one.verb.plan(one.values) == {"root": root}


def test_it_says_where_loops_were_cut():
    layers = PlainLayers(Layer.of(torus(800).points))
    before = applied(layers, "curve_skeleton")
    for name, values in (("rerooted", {}), ("pruned", {"order": 0})):
        with pytest.raises(ScriptError, match=r"1 loops: .*; cut them with generate_skeleton_without_loops_glsk$"):
            applied(layers, f"{name}_skeleton", **values)
    said = applied(layers, "skeleton_without_loops")
    assert (said["loops"], said["edges"]) == (0, before["edges"] - 1)
    np.testing.assert_array_equal(said["cut"], editing.cut_loops(layers.layer(1).skeleton)[1].mean(axis=1))
    assert "cut" not in applied(layers, "simplified_skeleton")


def test_a_segmentation_is_of_the_scan(layers, scan, whole):
    applied(layers, "pruned_skeleton", order=0)
    applied(layers, "segmented_cloud")
    np.testing.assert_array_equal(layers.layer().vertices, scan)
    np.testing.assert_array_equal(layers.layer().scalars, segment(editing.prune(whole, order=0)))


def test_a_skeleton_from_a_file_can_be_changed(tmp_path, whole):
    save_skeleton(whole, tmp_path / "s.ply")
    layers = PlainLayers(Layer.read(tmp_path / "s.ply"))
    said = applied(layers, "rerooted_skeleton", root=7)
    assert not set(said) & {"iterations", "converged", "stop_reason"}  # of which the file says nothing
    new = layers.layer().skeleton
    assert new.report.root == tuple(whole.vertices[7])
    np.testing.assert_array_equal(new.vertices, editing.reroot(whole, 7).vertices)
    np.testing.assert_array_equal(new.radii, editing.reroot(whole, 7).radii)
    with pytest.raises(ScriptError, match="make the scan the current layer"):
        applied(layers, "segmented_cloud")  # which needs the points


ROOT = "must be 'x', .* or the number of a vertex"


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("simplified", {"tolerance": -1}, "tolerance = -1: must be at least 0"),
        ("pruned", {"length": -1}, "length = -1: must be at least 0"),
        ("pruned", {"length": "2% of the frame"}, "length = '2% of the frame': must be a number in"),
        ("pruned", {"lenght": 1}, "no parameter of generate_pruned_skeleton_glsk is called 'lenght': did you mean"),
        ("rerooted", {"root": "up"}, f"root = 'up': {ROOT}"),
        ("rerooted", {"root": (0, 1)}, rf"root = \(0, 1\): {ROOT}"),
    ],
)
def test_refuses_before_anything_runs(name, params, message):
    with pytest.raises(InvalidParameterError, match=f"^{message}"):
        verbs()[f"generate_{name}_skeleton_glsk"].plan(params)


def test_a_vertex_that_is_not_there_is_named_with_its_line(tmp_path, layers):
    (tmp_path / "s.mlx").write_text(filters("Rerooted Skeleton", param=("RichInt", "root", 9999)))
    with pytest.raises(ScriptError, match=r"s\.mlx, line 2: filter '.*': root = 9999: there are vertices 0 to \d+$"):
        layers.apply_step(read_steps(tmp_path / "s.mlx")[0])


@pytest.mark.parametrize("name", WAYS)
def test_a_cloud_is_no_skeleton(scan, name):
    for layer in (Layer.of(scan), Layer(scan, faces=np.array([[0, 1, 2]]), edges=np.array([[0, 1]]))):
        with pytest.raises(InvalidCloudError, match=r"^the layer \(cloud\) is no skeleton: make one with"):
            EDITS[name].run(layer, WAYS[name][0])
