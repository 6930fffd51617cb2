"""`glsk branches`: the table, the file, the root."""

import csv
import json
import re
from dataclasses import fields

import pytest

from glsk_o3d import Skeleton, read_skeleton, samples
from glsk_o3d.analysis import BranchTable
from glsk_o3d.analysis.branches import PRINTED_COLUMNS


def test_table_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("branches", y, "-o", "y.csv")
    assert result.exit_code == 0
    assert result.stderr == ""
    assert result.stdout.splitlines() == ["3 branches, 2 orders, length 1.5", "wrote y.csv, in the units of y.ply"]
    lines = invoke("branches", y).stdout.splitlines()
    rows = list(read_skeleton(tmp_path / y).branch_table())
    with (tmp_path / "y.csv").open(newline="") as stream:
        assert [row["kind"] for row in csv.DictReader(stream)] == [row["kind"] for row in rows]
    names = ["branch", *(field.name for field in fields(BranchTable))]
    heads = [head.replace(" ", "_") for head in re.split(r"  +", next(filter(None, lines)).strip())]
    assert heads == [name for name in PRINTED_COLUMNS if name in names and name != "support"]  # nobody measured it
    told = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert [words[:7] for words in told] == [
        ["0", "tip", "-", "0", "0", "0", "0.5"],
        ["1", "tip", "0", "1", "0", "0", "0.5"],
        ["2", "tip", "0", "1", "2", "1", "0.5"],
    ]
    assert [words[-3] for words in told] == ["-", "40.0", "40.0"]
    facts = json.loads(invoke("branches", y, "--json").stdout)
    assert facts["branches"][0]["angle"] is None
    assert [row["length"] for row in facts["branches"]] == [row["length"] for row in rows]
    assert invoke("branches", y, "-q").stdout == ""


def test_a_closed_branch_in_json_and_csv(invoke, tmp_path):
    ring = samples.torus(100)
    Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()).save(tmp_path / "ring.json")
    (row,) = json.loads(invoke("branches", "ring.json", "-o", "ring.csv", "--json").stdout)["branches"]
    assert row["start"] == row["end"]
    with (tmp_path / "ring.csv").open(newline="") as stream:
        (line,) = csv.DictReader(stream)
    assert (row["tortuosity"], line["tortuosity"]) == (None, "")
    assert {name for name in row if row[name] is None} == {name for name in line if line[name] == ""}


@pytest.mark.parametrize(
    ("root", "start"), [("2", 2), ("-0.3,0,0.4", 2), ("0.4, 0, 1", 3), ("z", 1), ("x", 2), ("-x", 3)]
)
def test_root(invoke, y, root, start):
    facts = json.loads(invoke("branches", y, "--json", "--root", root).stdout)
    assert [row["start"] for row in facts["branches"] if row["level"] == 0] == [start]


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ["y.ply", "--root", "trunk"], "root = 'trunk': must be an axis, x to -z, 'thickest', a vertex, or a point"),
        (2, ["y.ply", "--root", "1,2"], "root = '1,2': must be an axis, x to -z, 'thickest', a vertex, or a point"),
        (2, ["y.ply", "--root", "4"], "root = 4: there are vertices 0 to 3"),
        (2, ["y.ply", "-o", "y.txt"], "y.txt: the table is CSV"),
        (1, ["y.ply", "-o", "no/y.csv"], "no: no such folder"),
        (1, ["z.ply"], "z.ply: no such file"),
        (1, ["empty.json"], "empty.json: the skeleton is empty"),
    ],
)
def test_refuses(invoke, tmp_path, y, code, words, message):
    Skeleton((), (), (), (), (), ()).save(tmp_path / "empty.json")
    result = invoke("branches", *words)
    assert result.exit_code == code
    assert result.stdout == ""
    assert result.stderr.startswith(f"glsk: error: {message}")
    assert result.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty.json", "y.ply"]
