"""`glsk grasps`: the lines, the files, the points from a file, and what it says when something is wrong."""

import csv
import json

import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton, samples, save_skeleton
from glsk_o3d.analysis import Gripper, grasp_candidates

UNSEARCHED = "places not searched"


@pytest.fixture
def rod(tmp_path):
    """The axis of a tube, with its points."""
    sample = samples.tube(3000, length=1.0, radius=0.1)
    skeleton = Skeleton(sample.nodes, sample.edges, sample.radii, [0] * 3000, sample.points, (), confidence=[1, 1])
    save_skeleton(skeleton, tmp_path / "rod.npz")
    return "rod.npz"


def test_lines_files_and_json_agree(invoke, tmp_path, rod):
    actual = grasp_candidates(read_skeleton(tmp_path / rod), 0.4, plane=(0, 0, 1, 0.25))
    words = ("grasps", rod, "--opening", 0.4, "--plane", "0,0,1,0.25", "-n", 5)
    result = invoke(*words, "-o", "g.json")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0].startswith(f"{len(actual)} grasps at 10 places, ")
    assert lines[1] == f"left out: {9 * 10} ways in behind the plane"
    rows = [line for line in lines if line.endswith(" 0") and "left out" not in line]
    assert len(rows) == len({row.split()[0] for row in rows}) == 5  # places
    reported, printed = json.loads((tmp_path / "g.json").read_text()), json.loads(invoke(*words, "--json").stdout)
    assert printed == {"skeleton": rod, "found": len(actual), **reported, "files": []}
    assert reported["gripper"]["finger"] == list(Gripper(0.4).finger)
    np.testing.assert_allclose([row["pose"] for row in reported["grasps"]], actual[:5].poses)
    invoke(*words, "-o", "g.csv")
    with (tmp_path / "g.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    np.testing.assert_allclose([float(row["opening"]) for row in table], actual[:5].opening)
    assert invoke(*words, "-q").stdout == ""


def test_the_points_come_from_a_file(invoke, tmp_path, rod, write_scan):
    skeleton = read_skeleton(tmp_path / rod)
    save_skeleton(skeleton, tmp_path / "axis.ply")
    wall = np.stack(np.meshgrid(np.arange(-1, 1, 0.02), [0.3], np.arange(-1, 1, 0.02)), axis=-1).reshape(-1, 3)
    write_scan(tmp_path / "rod.ply", np.concatenate([skeleton.points, wall]))
    other = ("grasps", "axis.ply", "--cloud", "rod.ply", "--min-confidence", 0, "-n", 99)
    facts = json.loads(invoke(*other, "--opening", 0.4, "--json").stdout)
    assert any(reason.endswith("touch points") for reason in facts["left_out"])
    assert facts["found"] == len(facts["grasps"]) > 9
    assert min(row["approach"][1] for row in facts["grasps"]) > -1e-9
    assert {row["confidence"] for row in facts["grasps"]} == {None}


def test_the_budget_and_the_verdict_are_those_of_python(invoke, tmp_path, rod):
    skeleton = read_skeleton(tmp_path / rod)
    words = ("grasps", rod, "--opening", 0.4, "--json")
    few = json.loads(invoke(*words, "--max-places", 3).stdout)
    assert (few["found"], few["left_out"]) == (len(grasp_candidates(skeleton, 0.4, max_places=3)), {UNSEARCHED: 7})
    lines = invoke(*words[:-1], "--max-places", 3).stdout.splitlines()
    assert (lines[0][:21], lines[1]) == ("36 grasps at 3 places", "left out: 7 places not searched")
    first = json.loads(invoke(*words, "--seconds", 0).stdout)
    assert (first["found"], first["left_out"]) == (12, {UNSEARCHED: 9})
    assert json.loads(invoke(*words, "--seconds", 1e3).stdout)["found"] == 120

    flat = skeleton.with_report(skeleton.report.with_reason("sheet", "this is a sheet"))
    save_skeleton(flat, tmp_path / rod)
    refused = invoke(*words)
    assert json.loads(refused.stdout)["found"] == 0
    assert "this is a sheet" in refused.stderr
    assert "accept" in refused.stderr
    assert json.loads(invoke(*words, "--accept", "no curve skeleton").stdout)["found"] == 120


@pytest.mark.parametrize(
    ("words", "why"),
    [(("--accept", "any"), "must be one of"), (("--max-places", 0), "max-places"), (("--seconds", -1), "seconds")],
)
def test_wrong_budgets_and_verdicts_are_refused(invoke, rod, words, why):
    result = invoke("grasps", rod, "--opening", 0.4, *words)
    assert result.exit_code == 2
    assert why in result.stderr
