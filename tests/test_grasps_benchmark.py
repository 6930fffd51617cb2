"""The benchmark of grasps: what is inside its objects, how it judges, and its command on one of them."""

import json

import numpy as np
import pytest

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis import Gripper, grasp_candidates

TOOL = "grasps"


def test_what_is_inside_a_mug(tool):
    mug = tool.built("mug", 0)
    inside = [[0.038, 0, 0.05], [0, 0, 0.003], [-0.038, 0, 0.09], [0.068, 0, 0.0475], [0.068, 0.005, 0.0475]]
    outside = [
        [0, 0, 0.05],
        [0.05, 0, 0.0475],
        [0.041, 0, 0.09],
        [0, 0, -0.001],
        [0.038, 0, 0.096],
        [0.068, 0.007, 0.05],
    ]
    assert mug.inside(np.array(inside + outside)).tolist() == [True] * 5 + [False] * 6


@pytest.mark.parametrize(("opening", "bad"), [(0.19, True), (0.201, False)])
def test_fingers_in_a_rod(tool, opening, bad):
    rod = samples.tube(100, length=1.0, radius=0.1)
    axis = Skeleton(rod.nodes, rod.edges, [opening / 2] * 2, (), (), (), confidence=[1, 1])
    grasps = grasp_candidates(axis, Gripper(0.4), cloud=(), clearance=0.0, around=4)

    def inside(places):
        return samples.signed_distance(places, rod.nodes, rod.edges, rod.radii) < 0

    assert len(grasps) == 4 * grasps.places
    assert (tool.pierces(grasps, inside, 0.5) == bad).all()


def test_the_command(tool, call, tmp_path, monkeypatch):
    monkeypatch.setattr(tool, "STEPS", (5, 5, 9))
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- pierced -->\n<!-- end -->\nafter\n")
    out = call("--shapes", "torus", "--points", 1000, "--jobs", 0, "-o", tmp_path / "t.json", "--page", page)
    rows = json.loads((tmp_path / "t.json").read_text())["rows"]
    assert [row["condition"] for row in rows] == ["clean", "noise", "two cameras"]
    assert [row["alone"]["best"] for row in rows] == [20, 20, 20]
    assert [row["checked"]["coming"] for row in rows[:2]] == [0, 0]
    assert "torus" in out
    assert "torus" in page.read_text()
