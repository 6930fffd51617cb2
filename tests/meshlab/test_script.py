"""Filter scripts: what is read, what is refused and in which words, what is written."""

import dataclasses
import os
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import glsk_o3d
from glsk_o3d import Filter, Skeleton, samples
from glsk_o3d.errors import FileFormatError, MissingPackageError, ScriptError
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.meshlab.script import MOST_BYTES, Call, Param, read_script, script_text, write_script
from glsk_o3d.meshlab.steps import PlainLayers, find_script, read_steps, step
from glsk_o3d.meshlab.verbs import verbs
from glsk_o3d.parameters import documented, parameter
from glsk_o3d.recipes.catalogue import catalogue

SKELETON = "Generate Curve Skeleton (GLSkeleton)"


def _script(*lines):
    return "\n".join(["<!DOCTYPE FilterScript>", "<FilterScript>", *lines, "</FilterScript>", ""])


def _ours(*params):
    return _script(f' <filter name="{SKELETON}">', *params, " </filter>")


def _theirs(*params):
    return _script(' <filter name="Select Outliers">', *params, " </filter>")


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
BROKEN = {
    "breaks off": (
        _script(' <filter name="Select Outliers">')[:60],
        "s.mlx, line 3: not well-formed XML: unclosed token",
    ),
    "not XML": ("ply\nformat ascii 1.0\n", "s.mlx, line 1: not well-formed XML: syntax error"),
    "another document": (
        "<MeshLabProject/>",
        "s.mlx, line 1: <MeshLabProject> cannot stand as the root of a filter script: only <FilterScript> may",
    ),
    "no filters": (_script(), "s.mlx, line 4: the script has no filters"),
    "unknown filter": (
        _script(' <filter name="Remove Duplicated Vertices"/>'),
        "s.mlx, line 3: no filter is called 'Remove Duplicated Vertices': did you mean 'Remove Duplicate Vertices'?",
    ),
    "unknown filter of ours": (
        _script(' <filter name="Select All"/>', ' <filter name="Generate Curve Skeletons"/>'),
        "s.mlx, line 4: no filter is called 'Generate Curve Skeletons': "
        "did you mean 'Generate Curve Skeleton (GLSkeleton)'?",
    ),
    "unknown parameter": (
        _theirs('  <Param type="RichInt" name="KNearst" value="32"/>'),
        "s.mlx, line 4: filter 'Select Outliers': no parameter is called 'KNearst': did you mean 'knearest'?",
    ),
    "unknown parameter of ours": (
        _ours('  <Param type="RichAbsPerc" name="conector_radius" value="2%"/>'),
        f"s.mlx, line 4: filter '{SKELETON}': no parameter is called 'conector_radius': "
        "did you mean 'connector_radius'?",
    ),
    "wrong type": (
        _theirs("", '  <Param type="RichBool" name="KNearest" value="true"/>'),
        "s.mlx, line 5: filter 'Select Outliers': parameter 'KNearest': a RichBool is not what it takes: "
        "it may be a RichInt or RichEnum or RichMesh",
    ),
    "wrong type of ours": (
        _ours('  <Param type="RichFloat" name="refiner_recentre" value="3"/>'),
        f"s.mlx, line 4: filter '{SKELETON}': parameter 'refiner_recentre': a RichFloat is not what it takes: "
        "it may be a RichInt",
    ),
    "not a number": (
        _theirs('  <Param type="RichInt" name="KNearest" value="many"/>'),
        "s.mlx, line 4: filter 'Select Outliers': parameter 'KNearest': 'many' is not an int",
    ),
    "not finite": (
        _ours('  <Param type="RichAbsPerc" name="connector_radius" value="nan%"/>'),
        f"s.mlx, line 4: filter '{SKELETON}': parameter 'connector_radius': 'nan' is not finite",
    ),
    "out of range": (
        _ours('  <Param type="RichAbsPerc" name="connector_radius" value="-0.5"/>'),
        f"s.mlx, line 4: filter '{SKELETON}': parameter 'connector_radius': must be above 0",
    ),
    "no such choice": (
        _ours('  <Param type="RichString" name="pipeline" value="cao2001"/>'),
        f"s.mlx, line 4: filter '{SKELETON}': parameter 'pipeline': must be one of "
        "'default', 'tree', 'wen2024', 'cao2010'",
    ),
    "enum out of range": (
        _script(
            ' <filter name="Transform: Translate, Center, set Origin">',
            '  <Param type="RichEnum" name="traslMethod" value="9"/>',
            " </filter>",
        ),
        "s.mlx, line 4: filter 'Transform: Translate, Center, set Origin': parameter 'traslMethod': "
        "Enum 9 not valid. Must be a value between 0 and 4",
    ),
    "of a part that is not there": (
        _ours(
            '  <Param type="RichString" name="pipeline" value="cao2010"/>',
            '  <Param type="RichFloat" name="lprreducer_phi" value="10"/>',
        ),
        f"s.mlx, line 3: filter '{SKELETON}': lprreducer_phi: LPRReducer is not in the pipeline, which has "
        "RingBuilder, Contractor, RingSizeRatio, Connector, Refiner",
    ),
    "given twice": (
        _theirs(*['  <Param type="RichInt" name="KNearest" value="32"/>'] * 2),
        "s.mlx, line 5: filter 'Select Outliers': parameter 'KNearest' is given twice",
    ),
    "no value": (
        _theirs('  <Param type="RichInt" name="KNearest"/>'),
        "s.mlx, line 4: filter 'Select Outliers': parameter 'KNearest': it has no value",
    ),
    "laughs": (
        f'<!DOCTYPE FilterScript [<!ENTITY l0 "ha">{LAUGHS}]>\n<FilterScript><filter name="&l9;"/></FilterScript>',
        "s.mlx, line 1: the DOCTYPE declares entities or refers to a file, which is refused: "
        "it may only be <!DOCTYPE FilterScript>",
    ),
    "steals a file": (
        '<!DOCTYPE FilterScript [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<FilterScript>&x;</FilterScript>',
        "s.mlx, line 1: the DOCTYPE declares entities or refers to a file, which is refused: "
        "it may only be <!DOCTYPE FilterScript>",
    ),
    "asks a server": (
        '<?xml version="1.0"?>\n<!DOCTYPE FilterScript SYSTEM "http://localhost:9/x.dtd">\n<FilterScript/>',
        "s.mlx, line 2: the DOCTYPE declares entities or refers to a file, which is refused: "
        "it may only be <!DOCTYPE FilterScript>",
    ),
    "hidden defaults": (
        '<!DOCTYPE FilterScript [<!ATTLIST filter name CDATA "Select All">]>\n<FilterScript><filter/></FilterScript>',
        "s.mlx, line 1: the DOCTYPE declares entities or refers to a file, which is refused: "
        "it may only be <!DOCTYPE FilterScript>",
    ),
    "undeclared entity": (
        _script(' <filter name="&lol;"/>'),
        "s.mlx, line 3: not well-formed XML: undefined entity",
    ),
    "includes a file": (
        _script(' <xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'),
        "s.mlx, line 3: <xi:include> cannot stand inside <FilterScript>: only <filter> may",
    ),
    "deep": (
        "<FilterScript>" + "<filter name='a'>" * 50_000,
        "s.mlx, line 1: <filter> cannot stand inside <filter>: only <Param> may",
    ),
    "deeper": (
        _theirs("  <Param type='RichInt' name='KNearest' value='3'><Param/></Param>"),
        "s.mlx, line 4: <Param> cannot stand inside <Param>: nothing may",
    ),
    "text": (
        _script(" rm -rf /"),
        "s.mlx, line 3: the text 'rm -rf /' cannot stand here: values are attributes",
    ),
    "long name": (
        _script(f' <filter name="{"x" * 1000}"/>'),
        "s.mlx, line 3: a name of more than 200 characters",
    ),
    "unknown encoding": (
        '<?xml version="1.0" encoding="klingon"?>\n<FilterScript/>',
        "s.mlx, line 1: cannot be read: unknown encoding: klingon",
    ),
}


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize("name", BROKEN)
def test_broken_and_hostile_scripts(tmp_path, monkeypatch, name):
    text, message = BROKEN[name]
    if "parameter" in message:
        pytest.importorskip("pymeshlab")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.mlx").write_text(text)
    with pytest.raises(ScriptError) as caught:
        read_steps("s.mlx")
    assert str(caught.value) == message


def test_files_that_are_no_scripts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.mlx").touch()
    (tmp_path / "folder.mlx").mkdir()
    (tmp_path / "huge.mlx").write_bytes(b" " * MOST_BYTES + b"<FilterScript/>")
    for name, error, message in (
        ("none.mlx", FileNotFoundError, "none.mlx: no such file"),
        ("empty.mlx", FileFormatError, "empty.mlx: the file is empty"),
        ("folder.mlx", FileFormatError, "folder.mlx: is a folder or a device, not a filter script"),
        (os.devnull, FileFormatError, f"{os.devnull}: is a folder or a device, not a filter script"),
        ("huge.mlx", FileFormatError, "huge.mlx: is larger than 1 MiB, too large for a filter script"),
    ):
        with pytest.raises(error) as caught:
            read_steps(name)
        assert str(caught.value) == message


def test_meshlab_filters_without_pymeshlab(tmp_path, monkeypatch):
    from glsk_o3d.meshlab import builtin

    builtin.trial.cache_clear()
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.mlx").write_text(_theirs())
    with pytest.raises(MissingPackageError) as caught:
        read_steps("s.mlx")
    assert str(caught.value) == (
        "s.mlx: 'Select Outliers' (line 3) is a filter of MeshLab's own: pymeshlab cannot be imported: "
        'pip install "glsk-o3d[meshlab]"'
    )
    (tmp_path / "s.mlx").write_text(_ours('  <Param type="RichInt" name="ringbuilder_k" value="12"/>'))
    assert [one.values for one in read_steps("s.mlx")] == [{"ringbuilder_k": 12}]


def test_what_meshlab_writes_is_read(tmp_path):
    pymeshlab = pytest.importorskip("pymeshlab")
    meshes = pymeshlab.MeshSet()
    meshes.create_sphere(radius=2.0)
    meshes.meshing_merge_close_vertices(threshold=pymeshlab.PercentageValue(0.5))
    meshes.compute_matrix_from_translation(traslmethod="Center on Layer BBox")
    meshes.compute_color_perlin_noise_per_vertex(color1=pymeshlab.Color(10, 20, 30, 40), offset=[1.0, 2.0, 3.0])
    meshes.set_matrix(transformmatrix=np.diag([1.0, 2.0, 3.0, 1.0]))
    meshes.save_filter_script(str(tmp_path / "s.mlx"))
    steps = read_steps(tmp_path / "s.mlx")
    assert [one.name for one in steps] == [
        "create_sphere",
        "meshing_merge_close_vertices",
        "compute_matrix_from_translation",
        "compute_color_perlin_noise_per_vertex",
        "set_matrix",
    ]
    assert steps[0].values["radius"] == 2.0
    assert steps[1].values["threshold"].value() == pytest.approx(
        0.5e-4 * 4 * np.sqrt(3), rel=1e-5
    )  # of its largest, 1 %
    assert steps[2].values["traslmethod"] == 2
    assert steps[3].values["color1"].blue() == 30
    np.testing.assert_array_equal(steps[3].values["offset"], [1, 2, 3])
    np.testing.assert_array_equal(steps[4].values["transformmatrix"], np.diag([1, 2, 3, 1]))


def test_every_name_is_one_of_pymeshlab():
    pymeshlab = pytest.importorskip("pymeshlab")
    from glsk_o3d.meshlab.builtin import names, trial

    assert set(names().values()) == set(pymeshlab.filter_list()) - {"save_snapshot"}  # needs a window
    assert all(isinstance(trial().filter_parameter_values(name), dict) for name in names().values())


words = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1, max_size=20)
params = st.builds(
    lambda name, value: Param(name, "RichString", {"name": name, "type": "RichString", "value": value}), words, words
)
calls = st.builds(Call, words, st.lists(params, max_size=4, unique_by=lambda param: param.name).map(tuple))


@given(st.lists(calls, min_size=1, max_size=4))
def test_what_is_written_is_read(tmp_path_factory, written):
    path = tmp_path_factory.getbasetemp() / "w.mlx"
    write_script(path, written)
    back = read_script(path)
    assert [call.name for call in back] == [call.name for call in written]
    assert script_text(back) == script_text(written)


@pytest.mark.parametrize("verb", verbs().values(), ids=verbs())
def test_our_defaults_survive_a_script(tmp_path, verb):
    needed = {"tolerance": 0.1} if "tolerance" in verb.slots else {}
    write_script(tmp_path / "s.mlx", [step(verb, needed).call])
    (back,) = read_steps(tmp_path / "s.mlx")
    assert back.verb is verb
    assert verb.plan(back.values) == verb.plan(needed)


def test_our_values_survive_a_script(tmp_path):
    verb = verbs()["generate_curve_skeleton_glsk"]
    values = {
        "ringbuilder_k": 20,
        "ringbuilder_drop_invalid": True,
        "contractor_reducer": None,
        "contractor_stop": "RingSizeRatio",
        "ringsizeratio_threshold": 1 / 3,
        "connector_radius": "2.5%",
        "connector_links": 1,
    }
    write_script(tmp_path / "s.mlx", [step(verb, values).call])
    assert 'type="RichAbsPerc" name="connector_radius" value="2.5%"' in (tmp_path / "s.mlx").read_text()
    (back,) = read_steps(tmp_path / "s.mlx")
    pipeline = verb.plan(back.values)
    assert pipeline == verb.plan(values)
    assert pipeline.stages[1].stop == glsk_o3d.RingSizeRatio(threshold=1 / 3)
    assert pipeline.stages[1].reducer is None
    assert pipeline.stages[2] == glsk_o3d.Connector(radius="2.5%", links="nearest")


def test_the_whole_pipeline_has_the_parameters_of_all_its_parts():
    known = {"pipeline", "layer"}
    for cls in (*map(type, glsk_o3d.pipelines.default().stages), glsk_o3d.LPRReducer, glsk_o3d.ExplainedScore):
        known |= {f"{cls.__name__.lower()}_{field.name}" for field in dataclasses.fields(cls)}
    assert known <= set(verbs()["generate_curve_skeleton_glsk"].slots)


def test_a_filter_of_the_pymeshlab_of_another_year(tmp_path, monkeypatch):
    pymeshlab = pytest.importorskip("pymeshlab")
    (tmp_path / "s.mlx").write_text(_theirs())
    monkeypatch.setattr(pymeshlab, "filter_list", lambda: ["create_sphere"])
    with pytest.raises(
        ScriptError, match="line 3: filter 'Select Outliers': the pymeshlab that is installed has no such"
    ):
        read_steps(tmp_path / "s.mlx")


@pytest.mark.parametrize("filter", ["NXS Build", "NXS Compress", "Export to Sketchfab"])
def test_filters_that_write_files_or_send_them_are_refused(tmp_path, filter):
    pytest.importorskip("pymeshlab")
    (tmp_path / "s.mlx").write_text(f'<FilterScript>\n<filter name="{filter}"/>\n</FilterScript>')
    with pytest.raises(ScriptError, match=f"line 2: filter '{filter}': .*only filters that work on layers"):
        read_steps(tmp_path / "s.mlx")
    assert [path.name for path in tmp_path.iterdir()] == ["s.mlx"]


def test_filters_that_write_files_run_where_somebody_says_that_the_script_is_trusted(tmp_path, monkeypatch):
    pytest.importorskip("pymeshlab")
    from typer.testing import CliRunner

    from glsk_o3d.cli.main import app
    from glsk_o3d.meshlab.meshset import MeshSet

    script = tmp_path / "s.mlx"
    script.write_text('<FilterScript>\n<filter name="Export to Sketchfab"/>\n</FilterScript>')
    (told,) = read_steps(script, any_filter=True)
    assert told.name == "export_mesh_to_sketchfab"
    meshes = MeshSet()
    with pytest.raises(ScriptError, match="unless any_filter=True says that this one is trusted"):
        meshes.load_filter_script(script)
    meshes.load_filter_script(script, any_filter=True)

    np.savetxt(tmp_path / "s.xyz", samples.torus(100).points)
    words = ["run", str(script), str(tmp_path / "s.xyz"), "-o", str(tmp_path / "o.ply")]
    refused = CliRunner().invoke(app, words)
    assert refused.exit_code == 1
    assert "unless any_filter=True says that this one is trusted" in refused.output
    ran = []
    monkeypatch.setattr(MeshSet, "apply_step", lambda self, step, watch: ran.append(step.name))
    CliRunner().invoke(app, [*words, "--any-meshlab-filter"])
    assert ran == ["export_mesh_to_sketchfab"]


def test_a_new_filter_is_a_verb_by_itself(monkeypatch, tmp_path):
    @documented
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class VertexDoubler(Filter):
        """Twice as large."""

        consumes = produces = Skeleton
        factor: float = parameter(2.0, "How much.", type="float", low=1)

        def _run(self, skeleton, watch):
            return dataclasses.replace(skeleton, vertices=self.factor * skeleton.vertices)

    known = {**catalogue(), "VertexDoubler": VertexDoubler}
    monkeypatch.setattr("glsk_o3d.meshlab.verbs.catalogue", lambda: known)
    verbs.cache_clear()
    try:
        assert verbs()["generate_by_vertex_doubler_glsk"].title == "Generate By Vertex Doubler (GLSkeleton)"
        title = "Generate By Vertex Doubler (GLSkeleton)"
        param = Param("factor", "RichFloat", {"type": "RichFloat", "name": "factor", "value": "3"})
        write_script(tmp_path / "s.mlx", [Call(SKELETON), Call(title, (param,))])
        points = samples.torus(1000).points
        layers = PlainLayers(Layer.of(points))
        for one in read_steps(tmp_path / "s.mlx"):
            layers.apply_step(one)
        np.testing.assert_array_equal(layers.layer(2).vertices, 3 * glsk_o3d.skeletonize(points).vertices)
        (tmp_path / "s.mlx").write_text((tmp_path / "s.mlx").read_text().replace('"3"', '"0.5"'))
        with pytest.raises(ScriptError, match="parameter 'factor': must be at least 1"):
            read_steps(tmp_path / "s.mlx")
    finally:
        verbs.cache_clear()


def test_scripts_are_found_by_name_or_path():
    assert find_script("glskeleton").name == "glskeleton.mlx"
    assert find_script("glskeleton.mlx") == find_script("glskeleton")
    assert str(find_script("mine.mlx")) == "mine.mlx"
    assert str(find_script("here/glskeleton")) == os.path.join("here", "glskeleton")
    with pytest.raises(glsk_o3d.InvalidParameterError) as caught:
        find_script("glskeletn")
    assert str(caught.value) == (
        "no filter script is called 'glskeletn': did you mean 'glskeleton'? (a file's name ends in .mlx)"
    )


def test_a_file_does_not_hide_a_script_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "glskeleton").write_text("mine")
    assert find_script("glskeleton").suffix == ".mlx"
    assert find_script(f".{os.sep}glskeleton").read_text() == "mine"
    (tmp_path / "glskeleton.mlx").write_text("my script")
    assert find_script("glskeleton.mlx").read_text() == "my script"


@pytest.mark.parametrize(
    ("filter", "param", "message"),
    [
        ("Perlin color", 'RichColor" name="color1" r="99999999999999" g="1" b="5" a="5', "whole numbers from 0 to 255"),
        ("Perlin color", 'RichColor" name="color1" r="300" g="1" b="5" a="5', "whole numbers from 0 to 255"),
        ("Perlin color", 'RichColor" name="color1" r="3" g="1" b="-5" a="5', "whole numbers from 0 to 255"),
        ("Perlin color", 'RichColor" name="color1" r="3" g="1" b="5" a="0.5', "'0.5' is not an int"),
        ("Select Outliers", 'RichInt" name="KNearest" value="1_0', "'1_0' is not an int"),
        ("Hausdorff Distance", 'RichMesh" name="SampledMesh" value="-3', "there is no layer -3"),
    ],
)
def test_values_that_meshlab_would_not_check(tmp_path, filter, param, message):
    pytest.importorskip("pymeshlab")
    (tmp_path / "s.mlx").write_text(_script(f' <filter name="{filter}">', f'  <Param type="{param}"/>', " </filter>"))
    with pytest.raises(ScriptError, match=f"s.mlx, line 4: filter '{filter}': parameter '\\w+': .*{message}"):
        read_steps(tmp_path / "s.mlx")


def test_a_parameter_given_twice_in_different_case(tmp_path):
    pytest.importorskip("pymeshlab")
    names = ("KNearest", "knearest")
    (tmp_path / "s.mlx").write_text(_theirs(*[f'<Param type="RichInt" name="{name}" value="9"/>' for name in names]))
    with pytest.raises(ScriptError, match="line 5: filter 'Select Outliers': parameter 'knearest' is given twice"):
        read_steps(tmp_path / "s.mlx")


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "stl", "pcd", "xyz"])
def test_a_mesh_is_read_as_it_was_written(tmp_path, ending):
    o3d = pytest.importorskip("open3d")
    mesh = o3d.geometry.TriangleMesh.create_torus()
    mesh.compute_vertex_normals()
    points, faces, normals = (np.array(each) for each in (mesh.vertices, mesh.triangles, mesh.vertex_normals))
    bytes = np.random.default_rng(0).integers(256, size=(len(points), 3))
    colors = np.column_stack([bytes / 255, np.ones(len(points))])
    layer = Layer(points, faces=faces, normals=normals, colors=colors, scalars=np.arange(len(points)) / 3)
    layer.save(tmp_path / f"m.{ending}")
    back = Layer.read(tmp_path / f"m.{ending}")
    assert back.label == f"m.{ending}"
    if ending in ("stl", "obj"):  # in the reader's own order
        assert (back.vertices.shape, back.faces.shape) == (points.shape, faces.shape)
        corners, its = (np.sort(each.vertices[each.faces].mean(axis=1), axis=0) for each in (layer, back))
        np.testing.assert_allclose(its, corners, atol=1e-5)  # six digits
        return
    np.testing.assert_allclose(back.vertices, points, atol=0 if ending in ("ply", "xyz") else 1e-5)
    if ending in ("pcd", "xyz"):
        assert back.faces is None
    else:
        np.testing.assert_array_equal(back.faces, faces)
    if ending in ("ply", "pcd"):
        np.testing.assert_allclose(back.normals, normals, atol=1e-6)
        np.testing.assert_allclose(back.colors, colors)
    if ending == "ply":
        np.testing.assert_array_equal(back.scalars, layer.scalars)


def test_a_reduced_cloud_keeps_normals_and_colours():
    points = samples.torus(1000).points
    colors = np.column_stack([np.random.default_rng(0).random((1000, 3)), np.ones(1000)])
    scan = Layer(points, normals=-points, colors=colors)
    reduced = verbs()["generate_reduced_cloud_glsk"].run(scan, {})
    kept = [np.flatnonzero((points == vertex).all(axis=1))[0] for vertex in reduced.vertices]
    assert 0 < len(kept) < 1000
    np.testing.assert_array_equal(reduced.normals, -points[kept])
    np.testing.assert_array_equal(reduced.colors, colors[kept])
