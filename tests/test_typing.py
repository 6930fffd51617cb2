"""Type checkers find the mistakes in a user's script, and nothing else."""

import re
import subprocess
import sys

import pytest

SCRIPT = """\
import numpy as np
import open3d as o3d

import glsk_o3d as glsk
from glsk_o3d import Connector, Contraction, Contractor, LPRReducer, Pipeline, Refiner, RingBuilder, Skeleton, pipelines
from glsk_o3d.filters.stopping import ExplainedScore

cloud = glsk.read_cloud("scan.ply")
skeleton: Skeleton = glsk.skeletonize(cloud, {"RingBuilder.k": 24}, on_iteration=lambda record: record.n_points > 100)
skeleton = glsk.skeletonize(np.zeros((10, 3)), "wen2024", k="auto", reducer=None, root=(0, 0, 1), drop_invalid=True)
start: Pipeline[Contraction] = RingBuilder(k="auto") | Contractor(reducer=LPRReducer(), stop=ExplainedScore(0.02))
state: Contraction = start(cloud)
whole: Pipeline[Skeleton] = start | Connector(radius="2%", links="all") | Refiner()
skeleton = whole(cloud, on_stage=lambda stage: print(stage.kind))
glsk.save_skeleton(skeleton, "tree.swc", cut_loops=True)
o3d.visualization.draw_geometries([cloud, skeleton.to_line_set(), glsk.to_tubes(skeleton, (0, 0, 1), sides=8)])
print(skeleton.report.iterations[-1].explained, skeleton.to_networkx().nodes, glsk.analysis.segment(skeleton).shape)
again: Skeleton = glsk.load_recipe("plant.json")(cloud)

RingBuilder(k="twelve")  # wrong
RingBuilder(ks=12)  # wrong
Contractor(reducer="LPRReducer")  # wrong
Connector(links="al")  # wrong
RingBuilder() | 12  # wrong
glsk.save_skeleton(skeleton, "x.swc", cut_lops=True)  # wrong
glsk.to_line_set(skeleton, "brnch")  # wrong
glsk.skeletonise(cloud)  # wrong
glsk.skeletonize(cloud, 12)  # wrong
glsk.skeletonize(cloud, on_iteration=lambda record: record.n_point > 100)  # wrong
pipelines.default()(cloud).n_loop  # wrong
(RingBuilder() | Contractor())(cloud).vertices  # wrong
"""


def test_mypy_finds_all_mistakes_and_nothing_else(tmp_path, root):
    pytest.importorskip("mypy")
    script, config = tmp_path / "script.py", tmp_path / "mypy.ini"
    script.write_text(SCRIPT)
    config.write_text(
        f"[mypy]\nmypy_path = {root}\nfollow_imports = silent\n"
        "[mypy-igl.*,matplotlib.*,networkx.*,PIL.*,rich.*,scipy.*,typer.*]\nfollow_imports = skip\n"  # for speed alone
    )
    words = [sys.executable, "-m", "mypy", "--config-file", config, "--cache-dir", tmp_path / "cache", script]
    run = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    wrong = {number for number, line in enumerate(SCRIPT.splitlines(), 1) if line.endswith("# wrong")}
    assert {int(line) for line in re.findall(r"^script\.py:(\d+): error", run.stdout, re.MULTILINE)} == wrong, (
        run.stdout
    )
