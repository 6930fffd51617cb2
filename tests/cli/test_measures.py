"""`glsk branches` and `glsk tree`: the numbers, the files, the units, the root."""

import csv
import json
import re

import numpy as np
import pytest

from glsk_o3d import pipelines, read_cloud, read_skeleton, samples
from glsk_o3d.analysis import branch_table, cylinders, tree_measures


def test_branches_table_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("branches", y, "-o", "y.csv", "-o", "z.csv")
    assert result.stdout.splitlines() == ["3 branches, 2 orders, length 1.5", "wrote y.csv", "wrote z.csv"]
    assert (tmp_path / "y.csv").read_bytes() == (tmp_path / "z.csv").read_bytes()
    rows = list(branch_table(read_skeleton(tmp_path / y)))
    with (tmp_path / "y.csv").open(newline="") as stream:
        assert [row["kind"] for row in csv.DictReader(stream)] == [row["kind"] for row in rows]
    lines = [line.split() for line in invoke("branches", y).stdout.splitlines() if line.strip()[:1].isdigit()]
    assert [line[0] for line in lines] == ["0", "1", "2"]
    assert all("0.5" in line for line in lines)
    facts = json.loads(invoke("branches", y, "--json").stdout)
    assert facts["branches"][0]["angle"] is None
    assert [row["length"] for row in facts["branches"]] == [row["length"] for row in rows]
    assert invoke("branches", y, "-q").stdout == ""


def test_tree_lines_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("tree", y, "--cylinders", "c.csv", "--root", "0,0,-0.5")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton = read_skeleton(tmp_path / y)
    measures, table = tree_measures(skeleton, (0, 0, -0.5)), cylinders(skeleton, (0, 0, -0.5))
    reported = dict(
        re.split("  +", line.strip(), maxsplit=1) for line in result.stdout.splitlines()[::-1] if "  " in line
    )
    assert float(reported["height"]) == pytest.approx(measures.height, rel=1e-5)
    assert reported["stem diameter"] == reported["traced"] == "not known"
    np.testing.assert_allclose([float(word) for word in reported["volume"].split()], measures.volume, rtol=1e-5)
    assert result.stdout.endswith("wrote c.csv\n")
    with (tmp_path / "c.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["parent"]) for row in rows] == table.parent.tolist()
    np.testing.assert_allclose([float(row["volume"]) for row in rows], table.volume)
    assert reported["reasons"].startswith("unknown score")
    (facts,) = json.loads(invoke("tree", y, "--json", "--root", "0,0,-0.5").stdout)["trees"]
    assert (facts["volume"], facts["stem_diameter"]) == (list(measures.volume), None)  # it is not so high
    assert (facts["unit"], facts["up"]) == (1, "z")
    assert invoke("tree", y, "-q").stdout == ""


def test_units_what_is_up_and_cylinders_in_the_units_of_the_file(invoke, tmp_path, y):
    metres, turned = (
        json.loads(invoke("tree", y, "--json", "--root", "z", "--up", up).stdout)["trees"][0]["height"]
        for up in ("z", "-z")
    )
    assert turned != metres
    facts = json.loads(invoke("tree", y, "--cylinders", "c.csv", "--unit", "0.001", "--root", "z", "--json").stdout)
    assert (facts["trees"][0]["height"], facts["files"]) == (pytest.approx(0.001 * metres), ["c.csv"])
    tall = invoke("tree", y, "--unit", "1000", "--up", "z", "--root", "z")
    assert "is a unit of the cloud 1000 m? give its metres" in tall.stdout
    assert tall.stderr == ""
    cylinders(read_skeleton(tmp_path / y), "z").to_csv(tmp_path / "expected.csv")
    assert (tmp_path / "c.csv").read_bytes() == (tmp_path / "expected.csv").read_bytes()


def test_a_table_of_trees_has_a_row_for_each_and_the_errors(invoke, tmp_path, y, write_scan):
    """Scans and skeletons alike; a tree that fails stops no other."""
    write_scan(tmp_path / "scan.ply", samples.tree(4000, forks=2, length=3, radius=0.2, seed=1).points)
    (tmp_path / "bad.json").write_text("no")
    result = invoke("tree", y, "bad.json", "scan.ply", "-o", "trees.csv")
    assert result.exit_code == 1
    assert "1 of 3 trees failed" in result.stderr
    with (tmp_path / "trees.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["tree"] for row in rows] == [y, "bad.json", "scan.ply"]
    assert [row["verdict"] for row in rows][::2] == [read_skeleton(tmp_path / y).verdict.value, "good"]
    assert [bool(row["error"]) for row in rows] == [False, True, False]
    skeleton = pipelines.tree()(read_cloud(tmp_path / "scan.ply"))
    measures = tree_measures(skeleton)
    for name in ("stem_diameter", "crown_area", "length_with_traced", "volume_without_traced"):
        assert float(rows[2][name]) == pytest.approx(getattr(measures, name))
    assert invoke("tree", y, "scan.ply", "--cylinders", "c.csv").exit_code == 2
    assert "--where chooses points of scans" in invoke("tree", y, "--where", "x > 0").stderr
    shown = invoke("tree", "scan.ply", "--where", "z > -9", "--report", "tree.html").stdout
    assert "length without traced" in shown
    page = (tmp_path / "tree.html").read_text("utf-8")
    for label in ("length with traced", "volume without traced", "Taper", "Diameter classes"):
        assert label in page
    write_scan(tmp_path / "ring.ply", samples.torus(1000).points)
    (ring,) = json.loads(invoke("tree", "ring.ply", "--json").stdout)["trees"]
    assert (ring["verdict"], ring["reasons"][0].split(":")[0]) == ("doubtful", "opened loops")
    (facts,) = json.loads(invoke("tree", "scan.ply", "--json").stdout)["trees"]
    several = json.loads(invoke("tree", "scan.ply", "bad.json", "--json").stdout)["trees"]
    assert several[0] == facts
    assert several[1].keys() == {"tree", "error"}
    doubtful = invoke("tree", y, y, "--unit", "1000", "--root", "z").stdout
    assert doubtful.count(f"{y}: the tree is") == 2
    assert len(facts["taper"]) == len(measures.taper)
    assert {"low", "high", "volume_with_traced"} <= facts["classes"][0].keys()
