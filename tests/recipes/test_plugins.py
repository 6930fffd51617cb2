"""Filters and pipelines of other distributions: merged with the built-in ones, and skipped where they are broken."""

import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

import glsk_o3d as glsk
from glsk_o3d import (
    Cloud,
    InvalidCloudError,
    InvalidParameterError,
    Pipeline,
    PluginWarning,
    RecipeError,
    Skeleton,
    StageError,
    samples,
    skeletonize,
)
from glsk_o3d.apps.meshlab.verbs import verbs
from glsk_o3d.pipeline import Filter
from glsk_o3d.pipelines import PIPELINES
from glsk_o3d.recipes import from_recipe, to_recipe
from glsk_o3d.recipes.catalogue import BUILTIN, catalogue, known_pipelines, named_pipeline

POINTS = samples.y_junction(n=800).points
SCRIPT = """<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="Generate Curve Skeleton (GLSkeleton)">
  <Param type="RichString" name="pipeline" value="coarse"/>
  <Param type="RichAbsPerc" name="voxel_size" value="2%"/>
  <Param type="RichInt" name="solvecount_count" value="5"/>
 </filter>
</FilterScript>
"""


# ---- entry points


@pytest.mark.usefixtures("example")
def test_plugins_follow_the_built_in_ones():
    filters = [name for name, cls in BUILTIN.items() if issubclass(cls, Filter)]
    rules = [name for name in BUILTIN if name not in filters]
    assert list(catalogue()) == [*filters, "Voxel", "RadiusFloor", *rules, "SolveCount"]
    assert list(known_pipelines()) == [*PIPELINES, "coarse"]
    assert [type(stage).__name__ for stage in named_pipeline("coarse").stages][::5] == ["Voxel", "RadiusFloor"]


@pytest.mark.usefixtures("example")
def test_plugins_on_the_command_line_and_in_a_script(tmp_path, monkeypatch):
    from glsk_o3d.cli.main import app

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("glsk_o3d.apps.meshlab.steps.verbs", verbs.__wrapped__)  # not those of other tests
    np.savetxt("scan.xyz", POINTS)
    (tmp_path / "s.mlx").write_text(SCRIPT)

    def invoke(*words):
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
        return result.stdout

    listed = invoke("filters")
    assert "Voxel  cloud -> cloud, from glsk_example\n" in listed
    assert "SolveCount  stopping rule, from glsk_example\n" in listed
    assert "coarse  pipeline, from glsk_example\n" in listed
    settings = ("--set", "Voxel.size=4%", "--set", "SolveCount.count=5")
    invoke("skeletonize", "scan.xyz", "--pipeline", "coarse", *settings, "-o", "s.json")
    invoke("run", "s.mlx", "scan.xyz", "-o", "t.json")
    set_by_option, scripted = (glsk.read_skeleton(name).report for name in ("s.json", "t.json"))
    assert set_by_option.stages[0] == "Voxel(size='4%')"
    assert set_by_option.stop_reason == scripted.stop_reason == "5 solves are done"
    assert set_by_option.n_input < scripted.n_input < len(POINTS)


# ---- what a filter may do


def test_filters_of_clouds_stand_in_front_and_in_a_row(example, assert_sound):
    import glsk_example

    voxel, *others = named_pipeline("coarse").stages
    thinned, skeleton = voxel(POINTS), skeletonize(POINTS, "coarse")
    np.testing.assert_array_equal(skeleton.points, thinned)  # the points of a skeleton are those that RingBuilder took
    assert_sound(skeleton, len(thinned))
    by_hand = Pipeline(*others)(thinned)
    np.testing.assert_array_equal(skeleton.vertices, by_hand.vertices)
    assert skeleton.report.stages == (repr(voxel), *by_hand.report.stages)
    assert skeleton.report.recipe == to_recipe(named_pipeline("coarse"))
    voxels = glsk_example.Voxel(size="1%") | glsk_example.Voxel(size="3%")
    assert voxels(POINTS).shape[1] == 3  # a pipeline of nothing else gives a cloud too
    with pytest.raises(InvalidParameterError, match=r"Voxel.*RingBuilder"):
        glsk.RingBuilder() | glsk_example.Voxel()
    with pytest.raises(StageError, match="Voxel"):
        glsk_example.Voxel()(glsk.RingBuilder()(POINTS))
    with pytest.raises(InvalidCloudError):  # errors of this package pass through
        glsk_example.Voxel()("no cloud")


@pytest.mark.parametrize(
    ("produces", "run", "error", "message"),
    [
        (Skeleton, lambda *_: POINTS, StageError, "Made.*ndarray"),
        (Cloud, lambda *_: POINTS[:0], InvalidCloudError, "^Made"),
        (Cloud, lambda *_: {}["inside"], StageError, f"^Made of {__name__} failed: KeyError: 'inside'$"),
    ],
)
def test_a_filter_with_a_wrong_result_or_an_error_is_named(produces, run, error, message):
    made = type("Made", (Filter,), {"produces": produces, "run": run, "check": lambda self: None})()
    with pytest.raises(error, match=message):
        made(POINTS)


def test_a_recipe_names_the_plugin_that_is_missing():
    with pytest.raises(RecipeError, match=r"^pipeline\[0\]\.filter: .*'Voxel'.*install glsk_example"):
        from_recipe({"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "Voxel", "from": "glsk_example"}]})


# ---- broken ones

HEAD = """
from dataclasses import dataclass
from glsk_o3d import Cloud, Filter, Pipeline, Refiner, Skeleton, pipelines
from glsk_o3d.parameters import Parameters, parameter
"""
FROZEN = "@dataclass(frozen=True, kw_only=True)\nclass Thing({}):\n    {}\n    {}"


BROKEN_FILTERS = [
    ("def", "SyntaxError: "),
    ("raise SystemExit(3)", "SystemExit: 3"),
    ("class Panic(BaseException): pass\nraise Panic('rust')", "Panic: rust"),
    ("", "has no attribute 'Thing'"),
    ("@dataclass\nclass Thing(Filter): run = print", "it is no frozen dataclass"),
    ("@dataclass(frozen=True)\nclass Other(Filter): run = print\nThing = Other", "the name of the class, 'Other'"),
    (FROZEN.format("Filter", "a: int = 3", "run = print"), "its field 'a' is not made by glsk_o3d.parameters"),
    (FROZEN.format("Filter", "rule: int = parameter(3, 'A.')", "run = print"), "its field 'rule' is not made by"),
    (FROZEN.format("Filter", "a: int = parameter(3, 'A.', low=4)", "run = print"), "Thing.a = 3: must be at least 4"),
    (FROZEN.format("Filter", "consumes = 'mesh'", "run = print"), "there is no filter from mesh to "),
    (FROZEN.format("Filter", "pass", ""), "it has no method run"),
    (FROZEN.format("Parameters", "pass", ""), "a stopping rule must be callable"),
]
BROKEN_PIPELINES = [
    ("def Thing(): raise OSError('no disk')", "OSError: no disk"),
    ("def Thing(): return 3", "it must be a callable that returns a Pipeline, and gives a int"),
    ("Thing = pipelines.default()", "TypeError: "),  # a pipeline wants a cloud to be called with
]


def only_warning(function):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        function()
        function()  # once in a process
    (warning,) = caught
    assert (warning.category, warning.filename) == (PluginWarning, __file__)
    return str(warning.message)


@pytest.mark.usefixtures("example")
@pytest.mark.parametrize(
    ("group", "code", "cause"),
    [*(("filters", *case) for case in BROKEN_FILTERS), *(("pipelines", *case) for case in BROKEN_PIPELINES)],
)
def test_a_broken_plugin_warns_and_the_others_stay(install, group, code, cause):
    install("glsk-broken", "1.5", HEAD + code, f"[glsk_o3d.{group}]\nThing = glsk_broken:Thing\n")
    message = only_warning(lambda: (catalogue(), known_pipelines()))
    assert message.startswith("plugin 'Thing' (glsk_broken:Thing) of glsk-broken 1.5 left out: ")
    assert cause in message
    assert {*BUILTIN, "Voxel", "SolveCount"} <= catalogue().keys()
    assert known_pipelines().keys() == {*PIPELINES, "coarse"}


@pytest.mark.parametrize(("name", "owner"), [("Refiner", "the built-in one"), ("Voxel", "one of another plugin")])
@pytest.mark.usefixtures("example")
def test_a_name_belongs_to_the_first_plugin(install, name, owner):
    before = catalogue().get(name)
    code = HEAD + FROZEN.format("Filter", "run = print", "").replace("Thing", name)
    install("zz-later", "1", code, f"[glsk_o3d.filters]\n{name} = zz_later:{name}\n")
    assert only_warning(catalogue).endswith(f" left out: the name is that of {owner}")
    assert catalogue()[name] is before


def test_a_run_of_a_built_in_pipeline_loads_no_plugin(example, root):
    """Neither the import nor a run asks the installed distributions anything; the command's warning is one line."""
    entries = example / "glsk_example-0.3.dist-info" / "entry_points.txt"
    entries.write_text(entries.read_text() + "[glsk_o3d.filters]\nThing = nowhere:Thing\n")
    code = (
        "import sys, glsk_o3d, glsk_o3d.samples as s; glsk_o3d.skeletonize(s.torus(n=300).points);"
        "glsk_o3d.to_recipe(glsk_o3d.pipelines.default());"
        "print('glsk_example' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(example), str(root)])}

    def python(*words):
        return subprocess.run([sys.executable, *words], capture_output=True, text=True, env=environment)

    assert python("-W", "error", "-c", code).stdout == "False\n"
    run = python("-m", "glsk_o3d.cli.main", "filters", "Voxel")
    assert run.returncode == 0
    assert "Voxel  cloud -> cloud" in run.stdout
    assert run.stderr.startswith("glsk: warning: plugin 'Thing' (nowhere:Thing) of glsk-example 0.3 left out: ")
    assert run.stderr.count("\n") == 1
