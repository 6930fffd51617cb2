"""`glsk branches` and `glsk tree`: the numbers, the files, the units, the root."""

import csv
import json
import re

import numpy as np
import pytest

from glsk_o3d import read_skeleton
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
    result = invoke("tree", y, "-o", "c.csv", "--root", "0,0,-0.5")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton = read_skeleton(tmp_path / y)
    measures, table = tree_measures(skeleton, (0, 0, -0.5)), cylinders(skeleton, (0, 0, -0.5))
    reported = dict(re.split("  +", line.strip(), maxsplit=1) for line in result.stdout.splitlines() if "  " in line)
    assert float(reported["height"]) == pytest.approx(measures.height, rel=1e-5)
    assert reported["stem diameter"] == reported["traced"] == "not known"
    np.testing.assert_allclose([float(word) for word in reported["volume"].split()], measures.volume, rtol=1e-5)
    assert result.stdout.endswith("wrote c.csv\n")
    with (tmp_path / "c.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["parent"]) for row in rows] == table.parent.tolist()
    np.testing.assert_allclose([float(row["volume"]) for row in rows], table.volume)
    facts = json.loads(invoke("tree", y, "--json", "--root", "0,0,-0.5").stdout)
    assert (facts["volume"], facts["stem_diameter"]) == (list(measures.volume), None)  # it is not so high
    assert (facts["unit"], facts["up"]) == (1, "z")
    assert invoke("tree", y, "-q").stdout == ""


def test_units_what_is_up_and_cylinders_in_the_units_of_the_file(invoke, tmp_path, y):
    metres, turned = (
        json.loads(invoke("tree", y, "--json", "--root", "z", "--up", up).stdout)["height"] for up in ("z", "-z")
    )
    assert turned != metres
    facts = json.loads(invoke("tree", y, "-o", "c.csv", "--unit", "0.001", "--root", "z", "--json").stdout)
    assert (facts["height"], facts["files"]) == (pytest.approx(0.001 * metres), ["c.csv"])
    tall = invoke("tree", y, "--unit", "1000", "--up", "z", "--root", "z").stderr
    assert "is a unit of the cloud 1000 m? give its metres" in tall
    cylinders(read_skeleton(tmp_path / y), "z").to_csv(tmp_path / "expected.csv")
    assert (tmp_path / "c.csv").read_bytes() == (tmp_path / "expected.csv").read_bytes()
