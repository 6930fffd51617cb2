"""Filter scripts: what is read, what is refused and in which words, what is written."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import glsk_o3d
from glsk_o3d.apps.meshlab.script import MOST_BYTES, Call, Param, read_script, write_script
from glsk_o3d.apps.meshlab.steps import find_script, read_steps, step
from glsk_o3d.apps.meshlab.verbs import verbs
from glsk_o3d.errors import FileFormatError, ScriptError

OURS, THEIRS, MOVE = (
    "Generate Curve Skeleton (GLSkeleton)",
    "Select Outliers",
    "Transform: Translate, Center, set Origin",
)


def _script(*lines):
    return "\n".join(["<!DOCTYPE FilterScript>", "<FilterScript>", *lines, "</FilterScript>", ""])


def _of(filter, *params):
    """A script of one filter, from its third line on, with a line for each parameter: type, name and value, or XML."""
    lines = [p if p.startswith("<") else '<Param type="{}" name="{}" value="{}"/>'.format(*p.split()) for p in params]
    return _script(f'<filter name="{filter}">', *lines, "</filter>")


NEIGHBOURS = "RichInt KNearest 32"
DOCTYPE = "the DOCTYPE declares the entity"
LAUGHS = '<!ENTITY l0 "ha">' + "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        # no script
        (_of(THEIRS)[:60], 3, "not well-formed XML: unclosed token"),
        ('<?xml version="1.0" encoding="klingon"?>\n<FilterScript/>', 1, "cannot be read: unknown encoding: klingon"),
        ("<MeshLabProject/>", 1, "<MeshLabProject> cannot stand as the root of a filter script"),
        (_script(), 4, "the script has no filters"),
        (_of(THEIRS, '<Param name="KNearest"/>'), 4, f"filter '{THEIRS}': a <Param> without a type"),
        # hostile
        (f'<!DOCTYPE a [{LAUGHS}]>\n<FilterScript><filter name="&l9;"/></FilterScript>', 1, DOCTYPE),
        ('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<FilterScript>&x;</a>', 1, DOCTYPE),
        ("<FilterScript>" + "<filter name='a'>" * 50_000, 1, "<filter> cannot stand inside <filter>"),
        # unknown
        (_script('<filter name="Remove Duplicated Vertices"/>'), 3, "no filter .* 'Remove Duplicate Vertices'"),
        (_of(THEIRS, "RichInt KNearst 32"), 4, "no parameter is called 'KNearst': did you mean 'knearest'"),
        (_of(THEIRS, NEIGHBOURS, NEIGHBOURS.replace("KN", "kn")), 5, "parameter 'knearest': is given twice"),
        (
            _script('<filter name="NXS Build"/>'),
            3,
            "it writes or reads files, .*: scripts run only filters that work on",
        ),
        # wrong
        (_of(THEIRS, "RichBool KNearest true"), 4, "'KNearest': 'true': invalid literal for int"),
        (_of(OURS, "RichFloat refiner_recentre 3.5"), 4, "'refiner_recentre': must be an int"),
        (_of(OURS, "RichAbsPerc connector_radius nan%"), 4, "'connector_radius': must be a number .*, not 'nan%'"),
        (_of(MOVE, "RichEnum traslMethod 9"), 4, "'traslMethod': '9': Enum 9 not valid. Must be .* between 0 and 4"),
        (_of("Hausdorff Distance", "RichMesh SampledMesh -3"), 4, "'SampledMesh': there is no layer -3"),
        (
            _of(OURS, "RichString pipeline cao2010", "RichFloat lprreducer_phi 10"),
            3,
            "lprreducer_phi: LPRReducer is not in the pipeline, which has Sampler, RingBuilder, Contractor, ",
        ),
    ],
)
def test_broken_and_hostile_scripts(tmp_path, monkeypatch, text, line, message):
    if "'" in message:  # filters of MeshLab's are looked up
        pytest.importorskip("pymeshlab")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.mlx").write_text(text)
    with pytest.raises(ScriptError, match=rf"^s\.mlx, line {line}: (filter '.*': )?(parameter )?{message}"):
        read_steps("s.mlx")


def test_files_that_are_no_scripts(tmp_path):
    (tmp_path / "empty.mlx").touch()
    (tmp_path / "huge.mlx").write_bytes(b" " * MOST_BYTES + b"<FilterScript/>")
    for name, error in (("none", FileNotFoundError), ("empty", FileFormatError), ("huge", FileFormatError)):
        with pytest.raises(error, match=rf"{name}\.mlx: "):
            read_steps(tmp_path / f"{name}.mlx")


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
    from glsk_o3d.apps.meshlab.builtin import names, trial

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
    assert [param.text for call in back for param in call.params] == [
        param.text for call in written for param in call.params
    ]


def test_our_values_survive_a_script(tmp_path):
    verb = verbs()["generate_curve_skeleton_glsk"]
    values = {
        "ringbuilder_k": 20,
        "sampler_drop_invalid": True,
        "contractor_reducer": None,
        "contractor_stop": "RingSizeRatio",
        "ringsizeratio_threshold": 1 / 3,
        "connector_radius": "2.5%",
        "connector_links": "nearest",
    }
    write_script(tmp_path / "s.mlx", [step(verb, values).call])
    assert 'type="RichAbsPerc" name="connector_radius" value="2.5%"' in (tmp_path / "s.mlx").read_text()
    (back,) = read_steps(tmp_path / "s.mlx")
    pipeline = verb.plan(back.values)
    assert pipeline == verb.plan(values)
    contractor, connector = pipeline.stages[5:7]
    assert contractor.stop == glsk_o3d.RingSizeRatio(threshold=1 / 3)
    assert contractor.reducer is None
    assert connector == glsk_o3d.Connector(radius="2.5%", links="nearest")


def test_scripts_are_found_by_name_or_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert find_script("glskeleton").name == "glskeleton.mlx"
    assert str(find_script("mine.mlx")) == "mine.mlx"
    assert str(find_script("here/glskeleton")) == os.path.join("here", "glskeleton")
    (tmp_path / "glskeleton").write_text("mine")
    assert find_script("glskeleton").read_text() != "mine"
    assert find_script(f".{os.sep}glskeleton").read_text() == "mine"
    with pytest.raises(glsk_o3d.InvalidParameterError, match=r"'glskeletn': did you mean 'glskeleton'\? .* in \.mlx"):
        find_script("glskeletn")
