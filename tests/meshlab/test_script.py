"""Filter scripts: what is read, what is refused and in which words, what is written."""

import dataclasses
import os
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import glsk_o3d
from glsk_o3d.errors import FileFormatError, MissingPackageError, ScriptError
from glsk_o3d.meshlab.script import MOST_BYTES, Call, Param, read_script, write_script
from glsk_o3d.meshlab.steps import find_script, read_steps, step
from glsk_o3d.meshlab.verbs import verbs

SKELETON = "Generate Curve Skeleton (GLSkeleton)"


def _script(*lines):
    return "\n".join(["<!DOCTYPE FilterScript>", "<FilterScript>", *lines, "</FilterScript>", ""])


def _ours(*params):
    return _script(f' <filter name="{SKELETON}">', *params, " </filter>")


def _theirs(*params):
    return _script(' <filter name="Select Outliers">', *params, " </filter>")


def _param(type, name, value):
    return f'  <Param type="{type}" name="{name}" value="{value}"/>'


NEIGHBOURS = _param("RichInt", "KNearest", "32")
OURS, THEIRS = f"filter '{SKELETON}'", "filter 'Select Outliers'"
DOCTYPE = "the DOCTYPE declares entities or refers to a file, which is refused: it may only be <!DOCTYPE FilterScript>"
LAUGHS = '<!ENTITY l0 "ha">' + "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
BROKEN = {
    "breaks off": (_theirs()[:60], 3, "not well-formed XML: unclosed token"),
    "not XML": ("ply\nformat ascii 1.0\n", 1, "not well-formed XML: syntax error"),
    "another document": ("<MeshLabProject/>", 1, "<MeshLabProject> cannot stand as the root of a filter script"),
    "no filters": (_script(), 4, "the script has no filters"),
    "unknown filter": (
        _script(' <filter name="Remove Duplicated Vertices"/>'),
        3,
        "no filter is called 'Remove Duplicated Vertices': did you mean 'Remove Duplicate Vertices'?",
    ),
    "unknown filter of ours": (
        _script(' <filter name="Select All"/>', ' <filter name="Generate Curve Skeletons"/>'),
        4,
        f"no filter is called 'Generate Curve Skeletons': did you mean '{SKELETON}'?",
    ),
    "no name": (_script(" <filter/>"), 3, "a <filter> without a name"),
    "unknown parameter": (
        _theirs(_param("RichInt", "KNearst", "32")),
        4,
        f"{THEIRS}: no parameter is called 'KNearst': did you mean 'knearest'?",
    ),
    "unknown parameter of ours": (
        _ours(_param("RichAbsPerc", "conector_radius", "2%")),
        4,
        f"{OURS}: no parameter is called 'conector_radius': did you mean 'connector_radius'?",
    ),
    "wrong type": (
        _theirs("", _param("RichBool", "KNearest", "true")),
        5,
        f"{THEIRS}: parameter 'KNearest': a RichBool is not what it takes: it may be a RichInt or RichEnum or RichMesh",
    ),
    "wrong type of ours": (
        _ours(_param("RichFloat", "refiner_recentre", "3")),
        4,
        f"{OURS}: parameter 'refiner_recentre': a RichFloat is not what it takes: it may be a RichInt",
    ),
    "not a number": (
        _theirs(_param("RichInt", "KNearest", "many")),
        4,
        f"{THEIRS}: parameter 'KNearest': 'many' is not an int",
    ),
    "not finite": (
        _ours(_param("RichAbsPerc", "connector_radius", "nan%")),
        4,
        f"{OURS}: parameter 'connector_radius': 'nan' is not finite",
    ),
    "out of range": (
        _ours(_param("RichAbsPerc", "connector_radius", "-0.5")),
        4,
        f"{OURS}: parameter 'connector_radius': must be above 0",
    ),
    "no such choice": (
        _ours(_param("RichString", "pipeline", "cao2001")),
        4,
        f"{OURS}: parameter 'pipeline': must be one of 'default', 'tree', 'wen2024', 'cao2010'",
    ),
    "of a part that is not there": (
        _ours(_param("RichString", "pipeline", "cao2010"), _param("RichFloat", "lprreducer_phi", "10")),
        3,
        f"{OURS}: lprreducer_phi: LPRReducer is not in the pipeline, which has "
        "RingBuilder, Contractor, RingSizeRatio, Connector, Refiner",
    ),
    "given twice": (_theirs(NEIGHBOURS, NEIGHBOURS), 5, f"{THEIRS}: parameter 'KNearest' is given twice"),
    "twice in another case": (
        _theirs(NEIGHBOURS, NEIGHBOURS.replace("KN", "kn")),
        5,
        f"{THEIRS}: parameter 'knearest' is given twice",
    ),
    "no value": (
        _theirs('  <Param type="RichInt" name="KNearest"/>'),
        4,
        f"{THEIRS}: parameter 'KNearest': it has no value: a RichInt has it in value",
    ),
    "no type": (_theirs('  <Param name="KNearest" value="3"/>'), 4, f"{THEIRS}: a <Param> without a type"),
    "laughs": (f'<!DOCTYPE a [{LAUGHS}]>\n<FilterScript><filter name="&l9;"/></FilterScript>', 1, DOCTYPE),
    "steals a file": ('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<FilterScript>&x;</a>', 1, DOCTYPE),
    "asks a server": ('<?xml version="1.0"?>\n<!DOCTYPE a SYSTEM "http://localhost:9/x.dtd">\n<a/>', 2, DOCTYPE),
    "undeclared entity": (_script(' <filter name="&lol;"/>'), 3, "not well-formed XML: undefined entity"),
    "includes a file": (
        _script(' <xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'),
        3,
        "<xi:include> cannot stand inside <FilterScript>",
    ),
    "deep": ("<FilterScript>" + "<filter name='a'>" * 50_000, 1, "<filter> cannot stand inside <filter>"),
    "deeper": (
        _theirs("  <Param type='RichInt' name='a' value='3'><a/></Param>"),
        4,
        "<a> cannot stand inside <Param>",
    ),
    "unknown encoding": (
        '<?xml version="1.0" encoding="klingon"?>\n<FilterScript/>',
        1,
        "cannot be read: unknown encoding: klingon",
    ),
    "enum out of range": (
        _script(
            ' <filter name="Transform: Translate, Center, set Origin">',
            _param("RichEnum", "traslMethod", "9"),
            "</filter>",
        ),
        4,
        "filter 'Transform: Translate, Center, set Origin': parameter 'traslMethod': "
        "Enum 9 not valid. Must be a value between 0 and 4",
    ),
}


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize("name", BROKEN)
def test_broken_and_hostile_scripts(tmp_path, monkeypatch, name):
    text, line, message = BROKEN[name]
    if "parameter" in message:
        pytest.importorskip("pymeshlab")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.mlx").write_text(text)
    with pytest.raises(ScriptError) as caught:
        read_steps("s.mlx")
    assert str(caught.value) == f"s.mlx, line {line}: {message}"


def test_files_that_are_no_scripts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.mlx").touch()
    (tmp_path / "folder.mlx").mkdir()
    (tmp_path / "huge.mlx").write_bytes(b" " * MOST_BYTES + b"<FilterScript/>")
    for name, error, message in (
        ("none.mlx", FileNotFoundError, "none.mlx: no such file"),
        ("empty.mlx", FileFormatError, "empty.mlx: the file is empty"),
        ("folder.mlx", FileFormatError, "folder.mlx: is a folder, not a file"),
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
        "s.mlx: MeshLab's own filters 'Select Outliers' (line 3): pymeshlab cannot be imported: "
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
    assert [one.name for one in steps][3:] == ["compute_color_perlin_noise_per_vertex", "set_matrix"]
    assert steps[0].values["radius"] == 2.0
    assert steps[1].values["threshold"].value() == pytest.approx(0.5e-4 * 4 * np.sqrt(3), rel=1e-5)
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
params = st.builds(lambda name, value: Param(name, "RichString", {"value": value}), words, words)
calls = st.builds(Call, words, st.lists(params, max_size=4))


@settings(max_examples=20)
@given(st.lists(calls, min_size=1, max_size=4))
def test_what_is_written_is_read(tmp_path_factory, written):
    path = tmp_path_factory.getbasetemp() / "w.mlx"
    write_script(path, written)
    back = read_script(path)
    assert [call.name for call in back] == [call.name for call in written]
    assert [param.value(["RichString"]) for call in back for param in call.params] == [
        param.attributes["value"] for call in written for param in call.params
    ]


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


@pytest.mark.parametrize("filter", ["NXS Build", "Export to Sketchfab"])
def test_filters_that_write_files_or_send_them_run_in_trusted_scripts_alone(tmp_path, filter):
    pytest.importorskip("pymeshlab")
    (tmp_path / "s.mlx").write_text(f'<FilterScript>\n<filter name="{filter}"/>\n</FilterScript>')
    meshes = glsk_o3d.MeshSet()
    for read in (read_steps, meshes.load_filter_script):
        with pytest.raises(ScriptError, match=f"line 2: filter '{filter}': .*unless any_filter=True says"):
            read(tmp_path / "s.mlx")
        read(tmp_path / "s.mlx", any_filter=True)
    assert [path.name for path in tmp_path.iterdir()] == ["s.mlx"]


def test_scripts_are_found_by_name_or_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert find_script("glskeleton").name == "glskeleton.mlx"
    assert find_script("glskeleton.mlx") == find_script("glskeleton")
    assert str(find_script("mine.mlx")) == "mine.mlx"
    assert str(find_script("here/glskeleton")) == os.path.join("here", "glskeleton")
    for name in ("glskeleton", "glskeleton.mlx"):
        (tmp_path / name).write_text("mine")
    assert find_script("glskeleton").read_text() != "mine"
    assert find_script("glskeleton.mlx").read_text() == find_script(f".{os.sep}glskeleton").read_text() == "mine"
    with pytest.raises(glsk_o3d.InvalidParameterError, match=r"'glskeletn': did you mean 'glskeleton'\? .* in \.mlx"):
        find_script("glskeletn")


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
