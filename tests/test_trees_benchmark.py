"""The benchmark of trees: its clouds, its scores, the volume of its shapes, and its commands on a few trees."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import samples
from glsk_o3d.samples import Sample


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("trees") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    found = ((name.split("."), module) for name, module in sys.modules.items())
    return SimpleNamespace(**{name[1]: module for name, module in found if name[0] == "_trees" and name[1:]})


class TestClouds:
    @pytest.mark.parametrize(("condition", "low", "high"), [("clean", 4096, 4096), ("noise", 2048, 2048)])
    def test_sizes(self, parts, condition, low, high):
        points, nodes, edges = parts.clouds.builtin(1, condition)
        assert low <= len(points) <= high
        assert len(edges) == len(nodes) - 1

    def test_noise_is_what_the_page_says(self, parts):
        points, _, _ = parts.clouds.builtin(0, "noise")
        clean, _, _ = parts.clouds.builtin(0, "clean")
        off = (points - clean[::2]).std()
        np.testing.assert_allclose(off, 0.004 * np.linalg.norm(np.ptp(clean, axis=0)), rtol=0.05)

    def test_missing_has_gaps_and_uneven_is_thin_at_the_top(self, parts):
        clean, _, _ = parts.clouds.builtin(0, "clean")
        missing, _, _ = parts.clouds.builtin(0, "missing")
        assert 0.3 * len(clean) < len(missing) < 0.5 * len(clean)
        uneven, _, _ = parts.clouds.builtin(0, "uneven")
        height = clean[:, 2].max()
        share = [
            np.count_nonzero(uneven[:, 2] > at * height) / np.count_nonzero(clean[:, 2] > at * height)
            for at in (0, 0.8)
        ]
        assert share[1] < 0.2 < share[0]

    def test_twigs_are_thinner_than_points_are_apart(self, parts):
        drawn = samples.tree(seed=0, **parts.clouds.SPARSE)
        length = np.linalg.norm(np.diff(drawn.nodes[drawn.edges], axis=1)[:, 0], axis=1)
        area = (2 * np.pi * length * drawn.radii[drawn.edges].mean(axis=1)).sum()
        assert 0.3 < 2 * drawn.radii.min() / np.sqrt(area / len(drawn.points)) < 0.6

    def test_volume_of_two_balls_with_a_cone_between_and_of_overlaps(self, parts):
        capsule = Sample(np.zeros((1, 3)), np.array([[0, 0, 0], [2.0, 0, 0]]), np.array([[0, 1]]), np.ones(2), "one")
        expected = np.pi * (2 + 4 / 3)
        assert parts.clouds.volume(capsule, 400_000) == pytest.approx(expected, rel=0.01)
        twice = Sample(capsule.points, capsule.nodes, np.array([[0, 1], [0, 1]]), capsule.radii, "twice")
        assert parts.clouds.volume(twice, 400_000) == pytest.approx(expected, rel=0.01)


class TestScores:
    def test_an_axis_is_itself(self, parts):
        drawn = samples.tree(500, forks=3)
        axis = parts.curves.skeleton_of(drawn.nodes, drawn.edges)
        found = parts.curves.score(drawn.points, axis, axis)
        assert found == dict(f1=1, precision=1, recall=1, accuracy=0, completeness=0, tips=1, components=1, loops=0)

    def test_half_of_a_line(self, parts):
        """Its diagonal is 1: all of the half is right, and half of the line is there."""
        whole = parts.curves.skeleton_of(np.array([[0, 0, 0], [1.0, 0, 0]]), np.array([[0, 1]]))
        half = parts.curves.skeleton_of(np.array([[0, 0, 0], [0.5, 0, 0]]), np.array([[0, 1]]))
        found = parts.curves.score(np.array([[0, 0, 0], [1.0, 0, 0]]), whole, half)
        assert found["precision"] == 1
        assert found["recall"] == pytest.approx(0.51, abs=0.003)
        assert found["completeness"] == pytest.approx(100 / 8, rel=0.01)


class TestTools:
    def test_level_sets_make_one_tree(self, parts):
        points, nodes, edges = parts.clouds.builtin(0, "clean")
        axis = parts.curves.skeleton_of(nodes, edges)
        found = parts.curves.score(points, axis, parts.curves.skeleton_of(*parts.tools.level_sets(points)))
        assert (found["components"], found["loops"]) == (1, 0)
        assert found["f1"] > 0.9

    def test_pieces_are_joined_where_they_are_nearest(self, parts):
        line = np.column_stack([np.zeros((60, 2)), np.arange(60) * 0.1])
        points = np.concatenate([line, line + [0, 0, 9], line + [3, 0, 3]])
        vertices, edges = parts.tools.level_sets(points)
        assert len(edges) == len(vertices) - 1
        assert np.linalg.norm(np.diff(vertices[edges], axis=1)[:, 0], axis=1).max() < 3.5


class TestCommands:
    def test_curves(self, call, tmp_path):
        page = tmp_path / "page.md"
        page.write_text("before\n<!-- trees -->\n<!-- end -->\n<!-- trees of a folder -->\n<!-- end -->\nafter\n")
        out = call("curves", "--trees", 1, "--tool", "levels", "--jobs", 2, "-o", tmp_path / "t.json", "--page", page)
        rows = json.loads((tmp_path / "t.json").read_text())["rows"]
        assert [row["condition"] for row in rows] == ["clean", "noise", "missing", "uneven"]
        assert all((row["components"], row["loops"]) == (1, 0) for row in rows)
        assert "4/4" in out
        text = page.read_text()
        assert "geodesic level sets" in text.split("<!-- trees of a folder -->")[0]
        assert text.startswith("before")
        assert text.endswith("after\n")

    def test_a_folder_whose_trees_grow_along_y(self, call, parts, tmp_path):
        points, nodes, edges = parts.clouds.builtin(0, "clean")
        back = [1, 2, 0]
        np.savez(tmp_path / "one.npz", nodes=nodes[:, back], edges=edges, clean=points[:, back])
        out = call("curves", tmp_path, "--up", "y", "--tool", "levels", "--jobs", 0, "-o", tmp_path / "t.json")
        (row,) = json.loads((tmp_path / "t.json").read_text())["rows"]
        assert row["f1"] > 0.9
        assert "1/1" in out

    @pytest.mark.parametrize("wrong", [("--up", "w"), ("--tool", "nothing")])
    def test_refuses(self, call, wrong):
        call("curves", *wrong, code=2)

    def test_refuses_an_empty_folder(self, call, tmp_path):
        call("curves", tmp_path, "--tool", "levels", code=2)

    def test_measures(self, call, tmp_path):
        out = call("measures", "--trees", 1, "--jobs", 0, "-o", tmp_path / "m.json")
        rows = json.loads((tmp_path / "m.json").read_text())["rows"]
        assert [row["condition"] for row in rows] == ["clean", "lidar"]
        assert all(abs(row["volume"]) < 0.05 for row in rows)
        assert "clean: stem diameter" in out

    def test_large(self, call):
        out = call("large", "--sizes", "3000", "--forks", 2)
        assert all(name in out for name in ("default, untraced", "tree"))
        assert "failure" not in out
