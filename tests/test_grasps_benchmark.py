"""The benchmark of grasps: what is inside its objects, how it judges, and its command on one of them."""

import json

import numpy as np
import pytest

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis import Gripper, grasp_candidates


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("grasps") as module:
        yield module


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


def test_clouds_of_a_mug(tool):
    mug = tool.built("mug", 0)
    clean, noisy, seen = (mug.cloud(2000, condition, 0) for condition in tool.CONDITIONS)
    assert clean.shape == noisy.shape == seen.shape == (2000, 3)
    np.testing.assert_array_equal(clean, mug.cloud(2000, "clean", 0))
    np.testing.assert_allclose((noisy - clean).std(), 0.005 * np.linalg.norm(np.ptp(clean, axis=0)), rtol=0.05)
    distance = [scene.compute_distance(clean.astype(np.float32)).numpy() for scene in mug.scenes]
    assert np.min(distance, axis=0).max() < 1e-5
    below = [(points[:, 2] < 1e-6).mean() for points in (clean, seen)]
    assert below[0] > 0.05
    assert below[1] < 0.002  # the cameras are above; they see the very edge


@pytest.mark.parametrize("name", ["tree", "helix"])
def test_points_are_on_the_shape_that_judges(tool, name):
    thing = tool.built(name, 1)
    distance = samples.signed_distance(thing.cloud(300, "clean", 1), thing.nodes, thing.edges, thing.radii)
    np.testing.assert_allclose(distance, 0, atol=1e-3)  # the helix is drawn smooth, and judged by its chords


@pytest.mark.parametrize(("opening", "bad"), [(0.19, True), (0.201, False)])
def test_fingers_in_a_rod(tool, opening, bad):
    rod = samples.tube(100, length=1.0, radius=0.1)
    axis = Skeleton(rod.nodes, rod.edges, [opening / 2] * 2, (), (), (), confidence=[1, 1])
    grasps = grasp_candidates(axis, Gripper(0.4), cloud=(), clearance=0.0, around=4)

    def inside(places):
        return samples.signed_distance(places, rod.nodes, rod.edges, rod.radii) < 0

    assert len(grasps) == 4 * grasps.places
    assert (tool.pierces(grasps, inside, 0.5) == bad).all()


def test_what_is_only_on_the_way_in(tool):
    rod = samples.tube(100, length=1.0, radius=0.1)
    axis = Skeleton(rod.nodes, rod.edges, rod.radii, (), (), (), confidence=[1, 1])
    grasps = grasp_candidates(axis, Gripper(0.4), cloud=(), around=1)
    found = tool.pierces(grasps, lambda places: places[:, 2] > 0.8, 1.0)
    np.testing.assert_array_equal(found, np.tile([False, True], (len(grasps), 1)))


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
