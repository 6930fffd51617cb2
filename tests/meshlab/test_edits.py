"""The filters that change skeletons: what the functions of glsk_o3d.editing do, in a MeshSet and in scripts."""

import inspect
import json
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d import editing
from glsk_o3d.cli.main import app
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError, ScriptError
from glsk_o3d.io.skeletons import read_skeleton
from glsk_o3d.meshlab.edits import edits
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.steps import PlainLayers, read_steps, step
from glsk_o3d.meshlab.verbs import verbs
from glsk_o3d.samples import sauropod, tree

MADE = "generate_curve_skeleton_glsk"
WAYS = {
    "generate_largest_skeleton_component_glsk": ({}, editing.largest_component),
    "generate_skeleton_without_loops_glsk": ({}, lambda s: editing.cut_loops(s)[0]),
    "generate_rerooted_skeleton_glsk": ({"root": "-z"}, lambda s: editing.reroot(s, "-z")),
    "generate_pruned_skeleton_glsk": ({"length": 0.8, "order": 2}, lambda s: editing.prune(s, length=0.8, order=2)),
    "generate_smoothed_skeleton_glsk": ({"passes": 3}, lambda s: editing.smooth(s, passes=3)),
    "generate_simplified_skeleton_glsk": ({"n": 30}, lambda s: editing.simplify(s, n=30)),
}


@pytest.fixture(scope="module")
def scan():
    return tree(3000, forks=3).points


@pytest.fixture(scope="module")
def whole(scan):
    return glsk.skeletonize(scan)


@pytest.fixture
def meshes(scan):
    pytest.importorskip("pymeshlab")
    meshes = glsk.MeshSet()
    meshes.add_points(scan)
    meshes.generate_curve_skeleton_glsk()
    return meshes


def _same(a, b):
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)
    np.testing.assert_array_equal(a.radii, b.radii)
    np.testing.assert_array_equal(a.vertex_of_point, b.vertex_of_point)


@pytest.mark.parametrize("verb", edits(), ids=lambda verb: verb.name)
def test_parameters_are_those_of_the_function(verb):
    _, *expected = inspect.signature(verb.function).parameters.values()
    *own, layer = verbs()[verb.name].slots.values()
    assert layer.name == "layer"
    assert [(slot.name, slot.default) for slot in own] == [(each.name, each.default) for each in expected]
    for slot in own:
        assert slot.facts["doc"].endswith(".")
        assert slot.facts["type"].startswith("length") == (slot.name in ("length", "radius", "tolerance"))


def test_every_function_has_a_verb():
    assert sorted(verb.function.__name__ for verb in edits()) == sorted(editing.__all__)
    assert set(WAYS) == {verb.name for verb in edits()}


def test_the_page_names_them(root):
    page = (root / "docs" / "editing.md").read_text()
    for verb in edits():
        (line,) = [line for line in page.splitlines() if f"| `{verb.title.removesuffix(' (GLSkeleton)')}` |" in line]
        assert line.startswith(f"| `{verb.function.__name__}(skeleton")


@pytest.mark.parametrize("name", WAYS)
def test_a_new_layer_has_what_the_function_makes(meshes, whole, name):
    params, function = WAYS[name]
    expected = function(whole)
    said = meshes.apply_filter(name, **params)
    _same(meshes.current_skeleton(), expected)
    np.testing.assert_array_equal(meshes.current_mesh().vertex_scalar_array(), expected.radii)
    assert said["layer"] == 2
    assert (said["vertices"], said["loops"], said["length"]) == (len(expected.vertices), 0, expected.length)
    _same(meshes.layer(1).flow, whole)
    assert meshes.current_mesh().label() == f"{name[9:-5].replace('_', ' ').title()} of cloud"


@pytest.mark.parametrize("name", WAYS)
def test_the_same_by_a_script_without_pymeshlab(tmp_path, monkeypatch, scan, whole, name):
    from glsk_o3d.meshlab.script import write_script

    params, function = WAYS[name]
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    write_script(tmp_path / "s.mlx", [step(verbs()[MADE], {}).call, step(verbs()[name], params).call])
    layers = PlainLayers(Layer.of(scan))
    for each in read_steps(tmp_path / "s.mlx"):
        layers.apply_step(each)
    _same(layers.layer().flow, function(whole))


def test_one_after_the_other_from_any_layer(meshes, whole):
    meshes.generate_pruned_skeleton_glsk(order=1, root="z")
    meshes.generate_rerooted_skeleton_glsk(root=3)
    meshes.generate_smoothed_skeleton_glsk(layer=1)
    pruned = editing.prune(whole, order=1, root="z")
    _same(meshes.layer(2).flow, pruned)
    _same(meshes.layer(3).flow, editing.reroot(pruned, 3))
    assert meshes.layer(3).flow.report.root == tuple(pruned.vertices[3])
    _same(meshes.layer(4).flow, editing.smooth(whole))


@pytest.mark.parametrize(
    ("name", "parameter", "percent"),
    [("pruned", "length", 12), ("pruned", "radius", 1), ("simplified", "tolerance", 0.5)],
)
def test_a_percentage_is_of_the_box_of_the_skeleton(meshes, whole, name, parameter, percent):
    import pymeshlab

    diagonal = np.linalg.norm(np.ptp(whole.vertices, axis=0))
    function = editing.prune if name == "pruned" else editing.simplify
    expected = function(whole, **{parameter: percent / 100 * diagonal})
    assert len(expected.vertices) < len(whole.vertices)
    assert diagonal < 0.99 * np.linalg.norm(np.ptp(whole.points, axis=0))
    for value in (f"{percent}%", pymeshlab.PercentageValue(percent), pymeshlab.PureValue(percent / 100 * diagonal)):
        meshes.apply_filter(f"generate_{name}_skeleton_glsk", **{parameter: value}, layer=1)
        _same(meshes.current_skeleton(), expected)


def test_roots_in_all_words(meshes, whole):
    end = whole.vertices[whole.leaves[0]]
    for root in (tuple(end), end, list(end), ",".join(map(repr, end.tolist())), np.int64(whole.leaves[0])):
        meshes.generate_rerooted_skeleton_glsk(root=root, layer=1)
        np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix()[0], end)
    meshes.generate_rerooted_skeleton_glsk(root=str(whole.leaves[0]), layer=1)
    np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix()[0], end)
    verb = verbs()["generate_rerooted_skeleton_glsk"]
    assert step(verb, {"root": (0, 0.5, 2)}).call.params[0].attributes == {"value": "0.0,0.5,2.0"}


def test_a_root_in_a_script_may_be_of_three_types(tmp_path):
    attributes = ('RichString" value="0.5,0,2.0', 'RichPosition" x="0.5" y="0" z="2', 'RichInt" value="4')
    for said, root in zip(attributes, ("0.5,0,2.0", "0.5,0.0,2.0", 4), strict=True):
        text = _filters("Rerooted Skeleton").replace("\n\n", f'\n<Param name="root" type="{said}"/>\n')
        (tmp_path / "s.mlx").write_text(text)
        (one,) = read_steps(tmp_path / "s.mlx")
        assert one.verb.plan(one.values) == {"root": root}


def test_radii_are_what_meshlab_left_as_scalars(meshes, whole):
    middle = float(np.median(whole.radii))
    meshes.compute_scalar_by_function_per_vertex(q="2*q")
    meshes.generate_pruned_skeleton_glsk(radius=2 * middle)
    assert len(meshes.current_skeleton().leaves) == len(editing.prune(whole, radius=middle).leaves) < len(whole.leaves)


def test_it_says_where_loops_were_cut():
    animal = PlainLayers(Layer.of(sauropod(2000).points))
    before = animal.apply_step(step(verbs()[MADE], {}))
    assert before["loops"] == 1
    for name in ("rerooted", "pruned"):
        with pytest.raises(ScriptError, match=r"1 loops: .*; cut them with generate_skeleton_without_loops_glsk$"):
            animal.apply_step(step(verbs()[f"generate_{name}_skeleton_glsk"], {"order": 0} if name == "pruned" else {}))
    said = animal.apply_step(step(verbs()["generate_skeleton_without_loops_glsk"], {}))
    assert (said["loops"], said["edges"]) == (0, before["edges"] - 1)
    np.testing.assert_array_equal(said["cut"], editing.cut_loops(animal.layer(1).flow)[1].mean(axis=1))
    assert "cut" not in animal.apply_step(step(verbs()["generate_smoothed_skeleton_glsk"], {}))


def test_a_segmentation_is_of_the_scan(scan, whole):
    n = len(scan) // 3
    faces = np.arange(3 * n).reshape(n, 3)
    layers = PlainLayers(Layer(scan, faces=faces))
    for name, values in (
        (MADE, {}),
        ("generate_pruned_skeleton_glsk", {"order": 0}),
        ("generate_segmented_cloud_glsk", {}),
    ):
        layers.apply_step(step(verbs()[name], values))
    np.testing.assert_array_equal(layers.layer().vertices, scan)
    np.testing.assert_array_equal(layers.layer().faces, faces)
    np.testing.assert_array_equal(layers.layer().scalars, editing.prune(whole, order=0).segment())


def _filters(*names, **params):
    inner = "\n".join(f'<Param type="{kind}" name="{name}" value="{value}"/>' for name, (kind, value) in params.items())
    calls = [f'<filter name="Generate {name} (GLSkeleton)">\n{inner}\n</filter>' for name in names]
    return "\n".join(["<FilterScript>", *calls, "</FilterScript>"])


def test_a_skeleton_from_a_file_can_be_changed(tmp_path, whole):
    whole.save(tmp_path / "s.ply")
    (tmp_path / "s.mlx").write_text(_filters("Rerooted Skeleton", root=("RichInt", 7)))
    words = [str(tmp_path / name) for name in ("s.mlx", "s.ply", "new.json")]
    result = CliRunner().invoke(app, ["run", *words[:2], "-o", words[2], "--json"])
    assert result.exit_code == 0, result.output
    (said,) = json.loads(result.stdout)["steps"]
    assert not set(said["result"]) & {"iterations", "converged", "stop_reason"}  # of which the file says nothing
    new = read_skeleton(tmp_path / "new.json")
    assert new.report.root == tuple(whole.vertices[7])
    np.testing.assert_array_equal(new.vertices, editing.reroot(whole, 7).vertices)
    np.testing.assert_array_equal(new.radii, editing.reroot(whole, 7).radii)
    for name in ("Segmented Cloud", "Refined Skeleton"):  # which need the points
        (tmp_path / "s.mlx").write_text(_filters("Smoothed Skeleton", name))
        result = CliRunner().invoke(app, ["run", *words[:2], "-o", str(tmp_path / "c.ply")])
        assert (result.exit_code, "make the scan the current layer" in result.stderr) == (1, True)


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("simplified", {}, "simplify needs either a tolerance or n"),
        ("simplified", {"n": 5, "tolerance": 1}, "simplify needs either a tolerance or n"),
        ("simplified", {"n": 0}, "n = 0: must be at least 1"),
        ("smoothed", {"passes": 2.5}, "passes = 2.5: must be an int"),
        ("pruned", {"length": -1}, "length = -1: must be at least 0"),
        ("pruned", {"length": "2 mm"}, "length = '2 mm': must be a number in the cloud's units or a percentage"),
        (
            "pruned",
            {"length": "2% of the frame"},
            "length = '2% of the frame': must be a number in",
        ),
        ("pruned", {"order": True}, "order = True: must be an int"),
        ("pruned", {"lenght": 1}, "no parameter of generate_pruned_skeleton_glsk is called 'lenght': did you mean"),
        ("rerooted", {"root": "up"}, "root = 'up': must be 'x', .* or the number of a vertex"),
        ("rerooted", {"root": -1}, "root = -1: must be 'x', .* or the number of a vertex"),
        ("rerooted", {"root": (0, 1)}, r"root = \(0, 1\): must be 'x', .* or the number of a vertex"),
        ("rerooted", {"root": None}, "root = None: must be 'x', .* or the number of a vertex"),
    ],
)
def test_refuses_before_anything_runs(name, params, message):
    with pytest.raises(InvalidParameterError, match=f"^{message}"):
        verbs()[f"generate_{name}_skeleton_glsk"].plan(params)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (_filters("Simplified Skeleton"), "line 2: filter '.*': simplify needs either"),
        (_filters("Pruned Skeleton", length=("RichAbsPerc", "-1")), "line 3: filter '.*': parameter 'length': must be"),
        (_filters("Pruned Skeleton", order=("RichFloat", 1)), "line 3: filter '.*': parameter 'order': a RichFloat is"),
        (_filters("Rerooted Skeleton", root=("RichString", "a")), "line 3: filter '.*': parameter 'root': must be 'x'"),
        (_filters("Prooned Skeleton"), "line 2: no filter is called .*: did you mean 'Generate Pruned Skeleton"),
    ],
)
def test_a_script_is_checked_before_it_runs(tmp_path, text, message):
    (tmp_path / "s.mlx").write_text(text)
    with pytest.raises(ScriptError, match=rf"s\.mlx, {message}"):
        read_steps(tmp_path / "s.mlx")


@pytest.mark.parametrize("name", WAYS)
def test_a_cloud_is_no_skeleton(scan, name):
    for layer in (Layer.of(scan), Layer(scan, faces=np.array([[0, 1, 2]]), edges=np.array([[0, 1]]))):
        with pytest.raises(
            InvalidCloudError, match=r"^the layer \(cloud\) is no skeleton: make one with generate_curve"
        ):
            verbs()[name].run(layer, WAYS[name][0])


def test_a_vertex_that_is_not_there_is_named_with_its_line(tmp_path, scan):
    (tmp_path / "s.mlx").write_text(
        _filters("Curve Skeleton", "Rerooted Skeleton").replace(
            'Rerooted Skeleton (GLSkeleton)">',
            'Rerooted Skeleton (GLSkeleton)"><Param type="RichInt" name="root" value="9999"/>',
        )
    )
    layers, (first, second) = PlainLayers(Layer.of(scan)), read_steps(tmp_path / "s.mlx")
    layers.apply_step(first)
    with pytest.raises(ScriptError, match=r"s\.mlx, line 5: filter '.*': root = 9999: there are vertices 0 to \d+$"):
        layers.apply_step(second)


def test_listings(capsys):
    pytest.importorskip("pymeshlab")
    assert set(WAYS) <= set(glsk.MeshSet.filter_list())
    glsk.MeshSet.print_filter_parameter_list("generate_pruned_skeleton_glsk")
    told = capsys.readouterr().out
    assert "\tlength : PercentageValue = 0.0 [min: 0]\n\t\tLeast length of a branch" in told
    assert "\torder : int or str = None [min: 0] (none)\n" in told
    assert "`" not in told
    assert glsk.MeshSet().filter_parameter_values("generate_smoothed_skeleton_glsk") == {"passes": 10, "layer": -1}
