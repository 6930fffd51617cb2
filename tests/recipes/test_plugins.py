"""Filters and pipelines of other distributions: found, merged, and left out where they are broken."""

import os
import shutil
import subprocess
import sys
import warnings

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import (
    Cloud,
    Contraction,
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
from glsk_o3d.meshlab.verbs import verbs
from glsk_o3d.pipeline import Filter
from glsk_o3d.pipelines import PIPELINES
from glsk_o3d.recipes import from_recipe, to_recipe
from glsk_o3d.recipes.catalogue import BUILTIN, catalogue, known_pipelines, named_pipeline
from glsk_o3d.recipes.plugins import forget_plugins

POINTS = samples.y_junction(n=800).points


# ---- found


@pytest.mark.usefixtures("example")
def test_are_merged_with_the_built_in_ones():
    filters = [name for name, cls in BUILTIN.items() if issubclass(cls, Filter)]
    rules = [name for name in BUILTIN if name not in filters]
    assert list(catalogue()) == [*filters, "Voxel", "RadiusFloor", *rules, "SolveCount"]
    assert list(known_pipelines()) == [*PIPELINES, "coarse"]
    assert [type(stage).__name__ for stage in named_pipeline("coarse").stages][::5] == ["Voxel", "RadiusFloor"]


def test_are_not_there_without_it():
    assert "Voxel" not in catalogue()
    with pytest.raises(InvalidParameterError, match="'coarse'"):
        named_pipeline("coarse")


@pytest.mark.usefixtures("example")
def test_on_the_command_line(invoke_anywhere, scan):
    listed = invoke_anywhere("filters").stdout
    assert "Voxel  cloud -> cloud, from glsk_example\n" in listed
    assert "SolveCount  stopping rule, from glsk_example\n" in listed
    assert "coarse  pipeline, from glsk_example\n" in listed
    settings = ("--set", "Voxel.size=4%", "--set", "SolveCount.count=5")
    result = invoke_anywhere("skeletonize", scan, "--pipeline", "coarse", *settings, "-o", "s.json")
    assert result.exit_code == 0, result.output
    report = glsk.read_skeleton("s.json").report
    assert report.stages[0] == "Voxel(size='4%')"
    assert report.stop_reason == "5 solves are done"


@pytest.fixture
def invoke_anywhere(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from glsk_o3d.cli.main import app

    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, list(map(str, words)))


@pytest.fixture
def scan(tmp_path):
    path = tmp_path / "scan.xyz"
    np.savetxt(path, POINTS)
    return path


ITERATING = """
from dataclasses import dataclass, replace
from typing import ClassVar
import numpy as np
from scipy.spatial import cKDTree
from glsk_o3d import Contraction, Filter
from glsk_o3d.parameters import documented, parameter
from glsk_o3d.report import IterationRecord

@documented
@dataclass(frozen=True, kw_only=True)
class Gather(Filter):
    \"\"\"Move points to the mean of their neighbours, again and again.\"\"\"

    consumes: ClassVar[type] = Contraction

    rounds: int = parameter(5, "Times.", type="int", low=1)

    def _run(self, state, watch):
        for i in range(self.rounds):
            positions = state.positions[cKDTree(state.positions).query(state.positions, 12)[1]].mean(axis=1)
            record = IterationRecord(i + 1, len(state), 0, 0, 0.5, 0.1, 1.0, 1.0, 0.0, 0.0)
            report = replace(state.report, iterations=(*state.report.iterations, record))
            state = replace(state, previous=state.positions, positions=positions, report=report)
            if watch is not None and watch(state) is False:
                break
        return state
"""


@pytest.mark.filterwarnings("ignore:uncertain topology:glsk_o3d.SkeletonWarning")
def test_a_filter_that_iterates(install):
    install("glsk-gather", "1", ITERATING, "[glsk_o3d.filters]\nGather = glsk_gather:Gather\n")
    gather = catalogue()["Gather"]
    records, states = [], []
    pipeline = glsk.RingBuilder() | gather() | glsk.Connector() | glsk.Refiner()
    skeleton = pipeline(POINTS, on_iteration=records.append, on_state=states.append)
    assert [record.iteration for record in records] == [1, 2, 3, 4, 5]
    assert tuple(records) == skeleton.report.iterations
    assert [state.report.iterations[-1] for state in states] == records
    stopped = pipeline(POINTS, on_iteration=lambda record: record.iteration < 3)
    assert len(stopped.report.iterations) == 3
    np.testing.assert_array_equal(gather()(glsk.RingBuilder()(POINTS)).positions, states[-1].positions)


# ---- in scripts


@pytest.fixture
def fresh_verbs(monkeypatch):
    monkeypatch.setattr("glsk_o3d.meshlab.steps.verbs", verbs.__wrapped__)  # not those of other tests


SCRIPT = """<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="Generate By Voxel (GLSkeleton)"><Param type="RichAbsPerc" name="size" value="4%"/></filter>
 <filter name="Generate Curve Skeleton (GLSkeleton)">
  <Param type="RichString" name="pipeline" value="coarse"/>
  <Param type="RichInt" name="solvecount_count" value="5"/>
 </filter>
</FilterScript>
"""


@pytest.mark.usefixtures("example", "fresh_verbs")
def test_in_a_script(invoke_anywhere, scan, tmp_path):
    (tmp_path / "s.mlx").write_text(SCRIPT)
    result = invoke_anywhere("run", "s.mlx", scan, "-o", "s.json")
    assert result.exit_code == 0, result.output
    report = glsk.read_skeleton(tmp_path / "s.json").report
    assert report.stages[0] == "Voxel(size='2%')"
    assert report.stop_reason == "5 solves are done"
    import glsk_example

    assert report.n_input == len(glsk_example.Voxel()(glsk_example.Voxel(size="4%")(POINTS)))


# ---- filters of clouds


@pytest.fixture
def coarse(example):
    return skeletonize(POINTS, "coarse")


def test_a_filter_of_clouds_gives_a_cloud_and_the_pipeline_tells_of_it(coarse, assert_sound):
    voxel, *others = named_pipeline("coarse").stages
    thinned = voxel(POINTS)
    assert isinstance(thinned, np.ndarray)
    np.testing.assert_array_equal(coarse.points, thinned)  # the points of a skeleton are those that RingBuilder took
    assert_sound(coarse, len(thinned))
    by_hand = Pipeline(*others)(thinned)
    np.testing.assert_array_equal(coarse.vertices, by_hand.vertices)
    assert coarse.report.stages == (repr(voxel), *by_hand.report.stages)
    assert list(coarse.report.seconds) == ["Voxel", *by_hand.report.seconds]
    assert coarse.report.seconds["Voxel"] > 0
    assert coarse.report.recipe == to_recipe(named_pipeline("coarse"))
    assert by_hand.report.recipe["pipeline"] == coarse.report.recipe["pipeline"][1:]


def test_a_rerun_does_not_thin_the_thinned_points_again(coarse, tmp_path):
    coarse.save(tmp_path / "s.npz")
    read = glsk.read_skeleton(tmp_path / "s.npz")
    for again in (glsk.rerun(read), glsk.rerun(read, POINTS), glsk.rerun(glsk.rerun(read))):
        np.testing.assert_array_equal(again.vertices, coarse.vertices)
        np.testing.assert_array_equal(again.radii, coarse.radii)
        assert again.report.recipe == coarse.report.recipe
        assert again.report.stages == coarse.report.stages


def test_filters_of_clouds_in_a_row(example):
    import glsk_example

    voxels = glsk_example.Voxel(size="1%") | glsk_example.Voxel(size="3%")
    assert voxels(POINTS).shape[1] == 3  # a pipeline of nothing else gives a cloud too
    skeleton = skeletonize(POINTS, voxels | glsk.pipelines.default())
    assert [stage["filter"] for stage in skeleton.report.recipe["pipeline"]][:3] == ["Voxel", "Voxel", "RingBuilder"]
    assert skeleton.report.stages[1] == "Voxel(size='3%')"


@pytest.mark.usefixtures("example")
def test_a_filter_of_clouds_belongs_in_front():
    import glsk_example

    with pytest.raises(InvalidParameterError, match=r"Voxel.*RingBuilder"):
        glsk.RingBuilder() | glsk_example.Voxel()
    with pytest.raises(StageError, match="Voxel"):
        glsk_example.Voxel()(glsk.RingBuilder()(POINTS))


@pytest.mark.parametrize(
    ("produces", "given", "what"),
    [(Cloud, None, "NoneType"), (Skeleton, POINTS, "ndarray"), (Contraction, None, "NoneType")],
)
def test_a_filter_that_breaks_its_promise(produces, given, what):
    wrong = type("Wrong", (Filter,), {"produces": produces, "_run": lambda *_: given, "check": lambda self: None})
    with pytest.raises(StageError, match=f"Wrong.*{what}"):
        wrong()(POINTS)


def test_a_filter_that_leaves_nothing_is_named():
    nothing = type("Crop", (Filter,), {"produces": Cloud, "_run": lambda *_: POINTS[:0], "check": lambda self: None})
    with pytest.raises(InvalidCloudError, match=r"^Crop"):
        nothing()(POINTS)


def test_a_filter_that_fails():
    fragile = type(
        "Fragile", (Filter,), {"produces": Cloud, "_run": lambda *_: {}["inside"], "check": lambda self: None}
    )
    with pytest.raises(StageError, match=f"^Fragile of {__name__} failed: KeyError: 'inside'$") as caught:
        fragile()(POINTS)
    assert isinstance(caught.value.__cause__, KeyError)


def test_errors_of_this_package_pass_through_a_filter(example):
    import glsk_example

    with pytest.raises(glsk.InvalidCloudError):
        glsk_example.Voxel()("no cloud")


@pytest.mark.usefixtures("example")
def test_a_recipe_whose_plugin_is_gone(monkeypatch):
    recipe = to_recipe(named_pipeline("coarse"))
    assert from_recipe(recipe) == named_pipeline("coarse")
    monkeypatch.setattr("glsk_o3d.recipes.plugins._found", {"glsk_o3d.filters": {}})
    with pytest.raises(RecipeError, match=r"^pipeline\[0\]\.filter: .*'Voxel'.*install glsk_example"):
        from_recipe(recipe)


# ---- broken ones

HEAD = """
from dataclasses import dataclass, field
from glsk_o3d import Cloud, Filter, Skeleton
from glsk_o3d.parameters import Parameters, documented, parameter
@dataclass(frozen=True, kw_only=True)
"""
BROKEN_FILTERS = {
    "syntax error": ("def", "SyntaxError: "),
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "no Exception, of its own": ("class Panic(BaseException): pass\nraise Panic('rust')", "Panic: rust"),
    "no such name": ("", "has no attribute 'Thing'"),
    "other class": ("class Thing: pass", "it is no frozen dataclass derived from glsk_o3d.Filter"),
    "not frozen": (
        "from dataclasses import dataclass\nfrom glsk_o3d import Filter\n@dataclass\nclass Thing(Filter): _run = print",
        "it is no frozen dataclass derived from glsk_o3d.Filter",
    ),
    "other name": (
        HEAD + "class Other(Filter): _run = print\nThing = Other",
        "the entry point must have the name of the class, 'Other'",
    ),
    "bare field": (
        HEAD + "class Thing(Filter):\n    size: int = 3\n    _run = print",
        "its field 'size' is not made by glsk_o3d.parameters.parameter",
    ),
    "reserved": (
        HEAD + "class Thing(Filter):\n    rule: int = parameter(3, 'A.', type='int')\n    _run = print",
        "recipes have another meaning for a parameter 'rule'",
    ),
    "strange type": (
        HEAD + "class Thing(Filter):\n    a: int = parameter(3, 'A.', type='strange')\n    _run = print",
        "its parameter 'a' has a type that is none of int, float, bool, length, point, choice, reducer, stop",
    ),
    "none": (
        HEAD + "class Thing(Filter):\n    a: str = parameter('none', 'A.', type='choice?', choices=('none',))\n"
        "    _run = print",
        "the choice 'none' of its parameter 'a' cannot be told from None",
    ),
    "wrong default": (
        HEAD + "class Thing(Filter):\n    size: int = parameter(3, 'A.', type='int', low=4)\n    _run = print",
        "InvalidParameterError: Thing.size = 3: must be at least 4",
    ),
    "unknown flow": (
        HEAD + "class Thing(Filter):\n    consumes = 'mesh'\n    _run = print",
        "there is no filter from 'mesh' to Contraction",
    ),
    "back to a cloud": (
        HEAD + "class Thing(Filter):\n    consumes, produces = Skeleton, Cloud\n    _run = print",
        "there is no filter from Skeleton to Cloud",
    ),
    "idle": (HEAD + "class Thing(Filter): pass", "it has no method _run"),
    "rule that is none": (HEAD + "class Thing(Parameters): pass", "a stopping rule must be callable"),
}
BROKEN_PIPELINES = {
    "raises": ("def Thing(): raise OSError('no disk')", "OSError: no disk"),
    "not callable": (
        "from glsk_o3d import pipelines\nThing = pipelines.default()",
        "TypeError: ",  # a pipeline wants a cloud to be called with
    ),
    "wrong parameter": (
        "from glsk_o3d import Pipeline, Refiner\ndef Thing(): return Pipeline(Refiner(recentre=-1))",
        "InvalidParameterError: Refiner.recentre = -1: must be at least 0",
    ),
}


def only_warning(ask):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ask()
        ask()  # once in a process
    (one,) = caught
    assert one.category is PluginWarning
    assert one.filename == __file__
    return str(one.message)


@pytest.mark.usefixtures("example")
@pytest.mark.parametrize(
    ("group", "code", "cause"),
    [pytest.param("filters", *case, id=name) for name, case in BROKEN_FILTERS.items()]
    + [pytest.param("pipelines", *case, id=name) for name, case in BROKEN_PIPELINES.items()],
)
def test_a_broken_one_warns_and_the_others_stay(install, group, code, cause):
    install("glsk-broken", "1.5", code, f"[glsk_o3d.{group}]\nThing = glsk_broken:Thing\n")
    said = only_warning(lambda: (catalogue(), known_pipelines()))
    assert said.startswith("plugin 'Thing' (glsk_broken:Thing) of glsk-broken 1.5 left out: ")
    assert cause in said
    assert {*BUILTIN, "Voxel", "SolveCount"} <= catalogue().keys()
    assert known_pipelines().keys() == {*PIPELINES, "coarse"}


GOOD = HEAD + "class {name}(Filter):\n    _run = print\n"


@pytest.mark.parametrize(("name", "owner"), [("Refiner", "the built-in one"), ("Voxel", "one of another plugin")])
@pytest.mark.usefixtures("example")
def test_names_that_are_taken(install, name, owner):
    before = catalogue().get(name)
    install("zz-later", "1", GOOD.format(name=name), f"[glsk_o3d.filters]\n{name} = zz_later:{name}\n")
    said = only_warning(catalogue)
    assert said.endswith(f" left out: the name is that of {owner}")
    assert {"Voxel", "RadiusFloor", "SolveCount"} <= catalogue().keys()
    if owner.startswith("the built-in"):
        assert catalogue()[name] is before


def test_names_of_pipelines_that_are_taken(install):
    code = "from glsk_o3d import pipelines\ncao2010 = pipelines.default"
    install("glsk-usurper", "1", code, "[glsk_o3d.pipelines]\ncao2010 = glsk_usurper:cao2010\n")
    assert named_pipeline("cao2010") == glsk.pipelines.cao2010()  # not even looked for
    assert only_warning(known_pipelines).endswith(" left out: the name is that of the built-in one")
    assert known_pipelines() == PIPELINES


@pytest.mark.usefixtures("example")
@pytest.mark.parametrize(
    "entries",
    [
        "[glsk_o3d.filters]\nno equals sign\n",
        "[glsk_o3d.filters\nThing = glsk_garbled:Thing\n",
        "[ glsk_o3d.filters ]\nThing = glsk_garbled:Thing\n",
    ],
)
def test_a_malformed_file_of_entry_points(install, entries):
    install("glsk-garbled", "1", "", entries)
    assert "the plugins of glsk-garbled left out: its entry_points.txt is malformed" in only_warning(catalogue)
    assert "Voxel" in catalogue()


def test_a_distribution_found_twice_is_one(example, tmp_path, monkeypatch):
    shutil.copytree(example, tmp_path / "again")
    monkeypatch.syspath_prepend(tmp_path / "again")
    forget_plugins()
    assert {"Voxel", "RadiusFloor", "SolveCount"} <= catalogue().keys()
    assert "coarse" in known_pipelines()  # a second one would be a warning, which is an error here


@pytest.mark.usefixtures("example")
def test_an_interrupt_leaves_nothing_half_done(install):
    code = HEAD + "class Thing(Filter):\n    _run = print\n"
    folder = install("zz-slow", "1", "raise KeyboardInterrupt", "[glsk_o3d.filters]\nThing = zz_slow:Thing\n")
    with pytest.raises(KeyboardInterrupt):
        catalogue()
    (folder / "zz_slow.py").write_text(code)
    assert {"Voxel", "Thing"} <= catalogue().keys()


def test_a_plugin_that_asks_for_plugins(install):
    code = "from glsk_o3d.recipes.catalogue import known_pipelines\ndef nested(): return known_pipelines()['default']()"
    install("glsk-nested", "1", code, "[glsk_o3d.pipelines]\nnested = glsk_nested:nested\n")
    assert named_pipeline("nested") == glsk.pipelines.default()


def test_a_run_of_a_built_in_pipeline_looks_for_none(example, root):
    """Neither the import nor a run asks the installed distributions anything; the command's warning is one line."""
    entries = example / "glsk_example-0.3.dist-info" / "entry_points.txt"
    entries.write_text(entries.read_text() + "[glsk_o3d.filters]\nThing = nowhere:Thing\n")
    paths = os.pathsep.join([str(example), str(root)])
    code = (
        "import sys, glsk_o3d, glsk_o3d.samples as s; glsk_o3d.skeletonize(s.torus(n=300).points);"
        "glsk_o3d.to_recipe(glsk_o3d.pipelines.default());"
        "print(glsk_o3d.recipes.plugins._found, 'glsk_example' in sys.modules)"
    )

    def python(*words):
        environment = {**os.environ, "PYTHONPATH": paths}
        return subprocess.run([sys.executable, *words], capture_output=True, text=True, env=environment)

    assert python("-W", "error", "-c", code).stdout == "{} False\n"
    run = python("-m", "glsk_o3d.cli.main", "filters", "Voxel")
    assert run.returncode == 0
    assert "Voxel  cloud -> cloud" in run.stdout
    assert run.stderr == (
        "glsk: warning: plugin 'Thing' (nowhere:Thing) of glsk-example 0.3 left out: "
        "ModuleNotFoundError: No module named 'nowhere'\n"
    )
