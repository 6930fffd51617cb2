"""What type checkers say of a user's script: mistakes are found, and nothing else is."""

import dataclasses
import importlib.util
import json
import re
import subprocess
import sys
from contextlib import suppress
from typing import get_type_hints

import pytest

from glsk_o3d.driver import Options
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.pipeline import parts
from glsk_o3d.pipelines import PIPELINES

SCRIPT = """\
import numpy as np
import open3d as o3d

import glsk_o3d as glsk
from glsk_o3d import Connector, Contraction, Contractor, LPRReducer, Pipeline, Refiner, RingBuilder, Skeleton, pipelines
from glsk_o3d.stopping import ExplainedScore

cloud = glsk.read_cloud("scan.ply")

skeleton: Skeleton = glsk.skeletonize(cloud)
skeleton = glsk.skeletonize(np.zeros((10, 3)), "wen2024", k=24, drop_invalid=True)
skeleton = glsk.skeletonize(cloud, {"RingBuilder.k": 24}, on_iteration=lambda record: record.n_points > 100)
skeleton = glsk.skeletonize(cloud, {"Connector.radius": "2%"}, k=24)
skeleton = glsk.skeletonize(cloud, k="auto", reducer=None, root=(0, 0, 1), links="nearest")
skeleton = glsk.skeletonize(cloud, "pipeline of a plugin", option_of_its=3)
start: Pipeline[Contraction] = RingBuilder(k="auto") | Contractor(reducer=LPRReducer(), stop=ExplainedScore(0.02))
state: Contraction = start(cloud)
whole: Pipeline[Skeleton] = start | Connector(radius="2%", links="all") | Refiner()
skeleton = whole(cloud, on_stage=lambda stage: print(stage.kind))
skeleton = pipelines.default().with_options(k=24)(cloud)
RingBuilder(k=24, radius=0.1)
glsk.save_skeleton(skeleton, "tree.swc", cut_loops=True)
o3d.visualization.draw_geometries([cloud, skeleton.to_line_set(), glsk.to_tubes(skeleton, (0, 0, 1), sides=8)])
print(skeleton.vertices.shape, skeleton.report.iterations[-1].explained, skeleton.to_networkx().nodes)
table = glsk.analysis.branch_table(skeleton, root=0)
print(table.length, glsk.analysis.segment(skeleton).shape, glsk.Report.from_dict({}).to_dict()["n_input"])
glsk.save_recipe(whole, "plant.toml")
again: Skeleton = glsk.load_recipe("plant.toml")(cloud)

RingBuilder(k="twelve")  # wrong
RingBuilder(ks=12)  # wrong
Contractor(reducer="LPRReducer")  # wrong
LPRReducer(order="random")  # wrong
Connector(links="al")  # wrong
Refiner(recentre="3")  # wrong
RingBuilder() | 12  # wrong
glsk.save_skeleton(skeleton, "x.swc", cut_lops=True)  # wrong
glsk.to_line_set(skeleton, "brnch")  # wrong
skeleton.to_line_set().colours  # wrong
glsk.skeletonise(cloud)  # wrong
glsk.skeletonize(cloud, 12)  # wrong
glsk.skeletonize(cloud, k="abc")  # wrong
glsk.skeletonize(cloud, handel=0.3)  # wrong
glsk.skeletonize(cloud, links="al")  # wrong
glsk.skeletonize(cloud, on_iteration=lambda record: record.n_point > 100)  # wrong
pipelines.default()(cloud).n_loop  # wrong
(RingBuilder() | Contractor())(cloud).vertices  # wrong
"""


@pytest.fixture
def script(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    return tmp_path / "script.py"


def found_by_mypy(script, root):
    """The lines that mypy finds fault with; faults in what the script imports are not the user's."""
    config = script.with_name("mypy.ini")
    config.write_text(
        f"[mypy]\nmypy_path = {root}\nfollow_imports = silent\n"
        "[mypy-igl.*,matplotlib.*,networkx.*,PIL.*,rich.*,scipy.*,typer.*]\nfollow_imports = skip\n"  # for speed alone
    )
    words = [sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", script.with_name("cache"), script]
    said = subprocess.run(words, capture_output=True, text=True, cwd=script.parent)
    assert said.returncode in (0, 1), said.stdout + said.stderr
    return {int(line): text for line, text in re.findall(r"^script\.py:(\d+): error: (.*)$", said.stdout, re.MULTILINE)}


def found_by_pyright(script, root):
    """The lines that pyright finds fault with."""
    config = {"include": [script.name], "extraPaths": [str(root)], "typeCheckingMode": "standard"}
    script.with_name("pyrightconfig.json").write_text(json.dumps(config))
    words = [sys.executable, "-m", "basedpyright", "--pythonpath", sys.executable, "--outputjson"]
    said = subprocess.run(words, capture_output=True, text=True, cwd=script.parent)
    assert said.returncode in (0, 1), said.stdout + said.stderr
    found = json.loads(said.stdout)["generalDiagnostics"]
    return {each["range"]["start"]["line"] + 1: each["message"] for each in found if each["severity"] == "error"}


CHECKERS = {"mypy": found_by_mypy, "basedpyright": found_by_pyright}  # the latter is pyright that brings its Node


@pytest.mark.parametrize("checker", CHECKERS)
def test_mistakes_are_found_and_nothing_else_is(checker, script, root):
    if importlib.util.find_spec(checker) is None:
        pytest.skip(f"needs {checker}: pip install {checker}")
    found = CHECKERS[checker](script, root)
    lines = dict(enumerate(SCRIPT.splitlines(), 1))
    wrong = {number for number, line in lines.items() if line.endswith("# wrong")}
    assert {number: lines[number] for number in wrong - set(found)} == {}
    assert {number: (lines[number], text) for number, text in found.items() if number not in wrong} == {}


def test_the_options_of_skeletonize_are_those_of_the_filters():
    found = {}
    for pipeline in (make() for make in PIPELINES.values()):
        for name in {field.name for part in parts(pipeline) for field in dataclasses.fields(part)}:
            with suppress(InvalidParameterError):  # more than one part has it
                found[name] = get_type_hints(pipeline.class_of_option(name)[0])[name]
    assert get_type_hints(Options) == found
