"""The benchmark of trees: its clouds, its scores, the volume of its shapes, and its commands on a few trees."""

import json

import numpy as np
import open3d as o3d
import pytest
import typer
from glsk_studies import forest, trees
from scipy.io import savemat

from glsk_o3d import samples
from glsk_o3d.samples import Sample

STUDY = trees


class TestClouds:
    def test_volume_of_two_balls_with_a_cone_between_and_of_overlaps(self):
        capsule = Sample(np.zeros((1, 3)), np.array([[0, 0, 0], [2.0, 0, 0]]), np.array([[0, 1]]), np.ones(2), "one")
        expected = np.pi * (2 + 4 / 3)
        assert forest.volume(capsule, 400_000) == pytest.approx(expected, rel=0.01)
        twice = Sample(capsule.points, capsule.nodes, np.array([[0, 1], [0, 1]]), capsule.radii, "twice")
        assert forest.volume(twice, 400_000) == pytest.approx(expected, rel=0.01)


class TestScores:
    def test_half_of_a_line(self):
        """Its diagonal is 1: all of the half is right, and half of the line is there."""
        whole = forest.skeleton_of(np.array([[0, 0, 0], [1.0, 0, 0]]), np.array([[0, 1]]))
        half = forest.skeleton_of(np.array([[0, 0, 0], [0.5, 0, 0]]), np.array([[0, 1]]))
        found = forest.score(np.array([[0, 0, 0], [1.0, 0, 0]]), whole, half)
        assert found["precision"] == 1
        assert found["recall"] == pytest.approx(0.51, abs=0.003)
        assert found["completeness"] == pytest.approx(100 / 8, rel=0.01)


START = np.array([[0, 0, 0.5], [0, 0, 2.5], [0, 0, 2.5]])
END = np.array([[0, 0, 2.5], [0, 0, 4.5], [1.5, 0, 4.5]])
LENGTH, RADIUS, ORDER, PARENT = np.array([2, 2, 2.5]), np.array([0.2, 0.15, 0.1]), [0, 0, 1], [-1, 0, 0]
AXIS = (END - START) / LENGTH[:, None]
"""A stem of two cylinders, the lower one 1.3 m above the foot, and a branch."""


def written(path, names, columns, between=","):
    """A file with a line of names above columns of numbers."""
    rows = [between.join(names), *(between.join(map(str, row)) for row in np.column_stack(columns).tolist())]
    path.write_text("\n".join(rows))
    return path


class TestModels:
    @pytest.fixture(params=("TreeQSM text", "TreeQSM bare", "TreeQSM matrix", "SimpleForest", "aRchi"))
    def model(self, request, tmp_path):
        """The three cylinders as programs write them."""
        path, ends = tmp_path / "model.txt", [f"{end}{axis}" for end in ("start", "end") for axis in "XYZ"]
        if request.param == "TreeQSM text":
            names = ["radius (m)", "length (m)", "start_point", "axis_direction", "parent", "extension", "branch"]
            columns = [RADIUS, LENGTH, START, AXIS, PARENT, [2, 0, 0], [1, 1, 2], ORDER, [1, 2, 1], [0, 0, 0]]
            return written(path, [*names, "branch_order", "position_in_branch", "added"], columns, "\t")
        if request.param == "TreeQSM bare":  # fourteen columns, as it wrote until 2.3, and no line of names
            columns = [RADIUS, LENGTH, START, AXIS, PARENT, [2, 0, 0], [1, 1, 2], ORDER, [1, 2, 1], [0, 0, 0]]
            return written(path, ["# Cylinder data"], columns, "\t")
        if request.param == "TreeQSM matrix":
            cylinder = dict(radius=RADIUS[:, None], length=LENGTH[:, None], start=START, axis=AXIS, BranchOrder=ORDER)
            savemat(tmp_path / "model.mat", {"QSM": [{"cylinder": cylinder}, {"cylinder": dict(radius=[1.0])}]})
            return tmp_path / "model.mat"
        if request.param == "SimpleForest":
            names = ["ID", "parentID", *ends, "radius", "length", "branchOrder"]
            return written(path, names, [[0, 1, 2], PARENT, START, END, RADIUS, LENGTH, ORDER])
        names = [f'"{it}"' for it in (*ends, "cyl_ID", "parent_ID", "radius_cyl", "length", "branching_order")]
        columns = [[1, 2, 3], START, END, [1, 2, 3], [0, 1, 1], RADIUS, LENGTH, [1, 1, 2]]  # R numbers its rows
        return written(path, names, columns)

    def test_measures_are_those_of_the_cylinders(self, model):
        found = forest.read_cylinder_model(model)
        assert found.height == pytest.approx(4)
        assert found.stem_diameter == pytest.approx(0.4)
        assert found.volume == pytest.approx(np.pi * (0.04 * 2 + 0.0225 * 2 + 0.01 * 2.5))
        assert found.order.tolist() == [0, 0, 1]
        np.testing.assert_allclose(found.end, END)

    def test_a_table_without_names_has_those_that_are_given(self, tmp_path):
        names = (
            "ID",
            *(f"{end}{axis}" for end in ("start", "end") for axis in "XYZ"),
            "radius",
            "length",
            "branchOrder",
        )
        path = written(tmp_path / "bare.csv", ["# SimpleForest"], [[0, 1, 2], START, END, RADIUS, LENGTH, ORDER])
        assert forest.read_cylinder_model(path, names).length == pytest.approx(6.5)
        with pytest.raises(typer.BadParameter, match="no line of names"):
            forest.read_cylinder_model(path)


class TestCommands:
    def test_curves(self, call, tmp_path):
        page = tmp_path / "page.md"
        page.write_text("before\n<!-- trees -->\n<!-- end -->\n<!-- trees of a folder -->\n<!-- end -->\nafter\n")
        out = call("curves", "--trees", 1, "--tool", "levels", "--jobs", 0, "-o", tmp_path / "t.json", "--page", page)
        rows = json.loads((tmp_path / "t.json").read_text())["rows"]
        assert [row["condition"] for row in rows] == ["clean", "noise", "missing", "uneven"]
        assert all((row["components"], row["loops"]) == (1, 0) for row in rows)
        assert "4/4" in out
        assert "geodesic level sets" in page.read_text().split("<!-- trees of a folder -->")[0]

    def test_measures(self, call, tmp_path):
        out = call("measures", "--trees", 1, "--jobs", 0, "-o", tmp_path / "m.json")
        rows = json.loads((tmp_path / "m.json").read_text())["rows"]
        assert [row["condition"] for row in rows] == ["clean", "lidar"]
        assert all(abs(row["volume"]) < 0.05 for row in rows)
        assert "clean: stem diameter" in out

    def test_stems(self, call, tmp_path):
        out = call("stems", "--trees", 1, "--jobs", 0, "-o", tmp_path / "s.json")
        rows = json.loads((tmp_path / "s.json").read_text())["rows"]
        assert [(row["seeds"], row["tree"]) for row in rows] == [("chosen", 0), ("other", 100)]
        assert all(abs(row["stem_diameter"] / row["true_diameter"] - 1) < 0.03 for row in rows)
        assert "other seeds, all" in out
        ((_, _, (line, *_)),) = forest.stem_tables([rows[0], rows[1] | dict(failure="no")])
        assert line[1:3] == ["1", "1"]

    def test_leaves(self, call, tmp_path):
        out = call("leaves", "--trees", 2, "--jobs", 0, "-o", tmp_path / "l.json")
        bare, leafy = json.loads((tmp_path / "l.json").read_text())["rows"]
        assert bare["leaves"] == 0 < leafy["leaves"]
        assert "leaf-off" not in bare["asked"]
        assert "leaf-off" in leafy["asked"]
        assert "leaves have more" in out

    def test_a_scan_beside_its_model(self, call, tmp_path):
        drawn = samples.tree(8000, forks=2, length=4, radius=0.2, seed=3)
        scan = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(drawn.points))
        o3d.io.write_point_cloud(str(tmp_path / "scan.ply"), scan)
        names = ["ID", "parentID", *(f"{end}{axis}" for end in ("start", "end") for axis in "XYZ"), "radius", "length"]
        columns = [[0, 1, 2], PARENT, START, END, RADIUS, LENGTH, ORDER]
        model = written(tmp_path / "model.csv", [*names, "branchOrder"], columns)
        out = call("models", tmp_path / "scan.ply", model, "-o", tmp_path / "m.json")
        (row,) = json.loads((tmp_path / "m.json").read_text())["rows"]
        assert row["stem_diameter"] == pytest.approx(
            [2 * np.interp(1.1, drawn.nodes[:7, 2], drawn.radii[:7]), 0.4], rel=0.05
        )
        assert row["height"][1] == 4
        assert "scan" in out
        call("models", tmp_path / "scan.ply", code=2)
