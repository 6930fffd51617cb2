"""What type checkers say of a user's script: mistakes are found, and nothing else is."""

import re
import subprocess
import sys

import pytest

SCRIPT = """\
import numpy as np
import open3d as o3d

import glsk_o3d as glsk
from glsk_o3d import (
    Cloud,
    Connector,
    Contraction,
    Contractor,
    LPRReducer,
    Pipeline,
    Points,
    Refiner,
    RingBuilder,
    Sampler,
    Skeleton,
    Tracer,
    pipelines,
)
from glsk_o3d.filters.stopping import ExplainedScore

cloud = glsk.read_cloud("scan.ply")

skeleton: Skeleton = glsk.skeletonize(cloud)
skeleton = glsk.skeletonize(np.zeros((10, 3)), "wen2024", k=24, drop_invalid=True)
skeleton = glsk.skeletonize(cloud, {"RingBuilder.k": 24}, on_iteration=lambda record: record.n_points > 100)
skeleton = glsk.skeletonize(cloud, {"Connector.radius": "2%"}, k=24)
skeleton = glsk.skeletonize(cloud, k="auto", reducer=None, root=(0, 0, 1), links="nearest")
skeleton = glsk.skeletonize(cloud, "pipeline of a plugin", option_of_its=3)
start: Pipeline[Points, Contraction] = RingBuilder() | Contractor(reducer=LPRReducer(), stop=ExplainedScore(0.02))
state: Contraction = start(cloud)
whole: Pipeline[Points, Skeleton] = start | Connector(radius="2%", links="all") | Refiner()
skeleton = whole(cloud, on_stage=lambda stage: print(stage.kind))
prepared: Pipeline[Cloud, Skeleton] = Sampler() | (whole | Tracer())
skeleton = pipelines.default().with_options(k=24)(cloud)
RingBuilder(k=24, radius=0.1)
glsk.save_skeleton(skeleton, "tree.swc", cut_loops=True)
o3d.visualization.draw_geometries([cloud, skeleton.to_line_set(), glsk.to_tubes(skeleton, (0, 0, 1), sides=8)])
print(skeleton.vertices.shape, skeleton.report.iterations[-1].explained, skeleton.to_networkx().nodes)
table = glsk.analysis.branch_table(skeleton, root=0)
print(table.length, glsk.analysis.segment(skeleton).shape, glsk.Report.from_dict({}).to_dict()["n_input"])
glsk.save_recipe(whole, "plant.json")
again: Skeleton = glsk.load_recipe("plant.json")(cloud)

RingBuilder(k="twelve")  # wrong
RingBuilder(ks=12)  # wrong
Contractor(reducer="LPRReducer")  # wrong
LPRReducer(order="random")  # wrong
Connector(links="al")  # wrong
Refiner(recentre="3")  # wrong
RingBuilder() | 12  # wrong
RingBuilder() | Refiner()  # wrong
Connector() | Contractor()  # wrong
start | Tracer()  # wrong
Refiner() | whole  # wrong
skeletons: Pipeline[Points, Contraction] = whole  # wrong
glsk.save_skeleton(skeleton, "x.swc", cut_lops=True)  # wrong
glsk.to_line_set(skeleton, "brnch")  # wrong
skeleton.to_line_set().colours  # wrong
glsk.skeletonise(cloud)  # wrong
glsk.skeletonize(cloud, 12)  # wrong
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


def test_mistakes_are_found_and_nothing_else_is(script, root):
    pytest.importorskip("mypy")
    found = found_by_mypy(script, root)
    lines = dict(enumerate(SCRIPT.splitlines(), 1))
    wrong = {number for number, line in lines.items() if line.endswith("# wrong")}
    assert {number: lines[number] for number in wrong - set(found)} == {}
    assert {number: (lines[number], text) for number, text in found.items() if number not in wrong} == {}
