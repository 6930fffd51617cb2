"""`glsk branches` and `glsk tree`: the numbers, the files, the units, the root."""

import csv
import json
import re
from dataclasses import fields, replace

import numpy as np
import pytest

from glsk_o3d import Skeleton, pipelines, read_skeleton, samples, save_skeleton
from glsk_o3d.analysis import BranchTable, branch_table, cylinders, tree_measures
from glsk_o3d.analysis.branches import PRINTED_COLUMNS


def test_branches_table_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("branches", y, "-o", "y.csv", "-o", "z.csv")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = ["3 branches, 2 orders, length 1.5", *(f"wrote {name}.csv, in the units of y.ply" for name in "yz")]
    assert result.stdout.splitlines() == lines
    assert (tmp_path / "y.csv").read_bytes() == (tmp_path / "z.csv").read_bytes()
    lines = invoke("branches", y).stdout.splitlines()
    rows = list(branch_table(read_skeleton(tmp_path / y)))
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


def test_a_closed_branch(invoke, tmp_path, ring_file):
    (row,) = json.loads(invoke("branches", ring_file, "-o", "ring.csv", "--json").stdout)["branches"]
    assert row["start"] == row["end"]
    with (tmp_path / "ring.csv").open(newline="") as stream:
        (line,) = csv.DictReader(stream)
    assert (row["tortuosity"], line["tortuosity"]) == (None, "")
    assert {name for name in row if row[name] is None} == {name for name in line if line[name] == ""}


@pytest.mark.parametrize(
    ("root", "start"), [("2", 2), ("-0.3,0,0.4", 2), ("0.4, 0, 1", 3), ("z", 1), ("x", 2), ("-x", 3)]
)
def test_a_root_of_branches(invoke, y, root, start):
    facts = json.loads(invoke("branches", y, "--json", "--root", root).stdout)
    assert [row["start"] for row in facts["branches"] if row["level"] == 0] == [start]


def test_tree_lines_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("tree", y, "-o", "c.csv", "--root", "0,0,-0.5")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton = read_skeleton(tmp_path / y)
    measures, table = tree_measures(skeleton, (0, 0, -0.5)), cylinders(skeleton, (0, 0, -0.5))
    lines = result.stdout.splitlines()
    assert lines[0] == f"height: {measures.height:.4g} m"
    assert "stem diameter: not known: the tree is lower than 1.3 m, if a unit of the file is 1 m (--unit)" in lines
    assert "traced: not known: the file has no confidence: JSON and npz files of a run do" in lines
    assert lines[-1] == "wrote c.csv, in the units of y.ply"
    told = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert [row[0] for row in told] == ["0", "1"]
    np.testing.assert_allclose([float(row[3]) for row in told], measures.volume, rtol=1e-3)
    with (tmp_path / "c.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["parent"]) for row in rows] == table.parent.tolist()
    np.testing.assert_allclose([float(row["volume"]) for row in rows], table.volume)
    facts = json.loads(invoke("tree", y, "--json", "--root", "0,0,-0.5").stdout)
    assert (facts["volume"], facts["stem_diameter"]) == (list(measures.volume), None)  # it is not so high
    assert (facts["unit"], facts["up"]) == (1, "z")
    np.testing.assert_allclose(facts["root"], measures.root)
    assert invoke("tree", y, "-q").stdout == ""


def test_why_a_stem_has_no_diameter(invoke, tmp_path):
    points = [[0, 0, 0], [0, 0, 1], [3, 0, 1], [0, 0, 2.5]]
    bent = Skeleton(points, [[0, 1], [1, 2], [1, 3]], [0.2, 0.2, 0.2, 0.01], (), (), ())
    save_skeleton(bent, tmp_path / "t.json")
    result = invoke("tree", "t.json", "--root", "z", "--up", "x")
    cause = "see the warning; x was taken to point up (--up), and 0, 0, 0 for the root (--root)"
    assert f"stem diameter: not known: {cause}" in result.stdout.splitlines()
    why = "the diameter of the stem at 1.3 m is not known: the stem does not pass 1.3 m above its foot"
    assert result.stderr.splitlines()[-1].endswith(why)
    assert json.loads(invoke("tree", "t.json", "--root", "z", "--up", "x", "--json").stdout)["doubts"][-1] == why
    save_skeleton(Skeleton(points[:2], [[0, 1]], [0.2, 0.2], (), (), ()), tmp_path / "s.json")
    assert "crown base: not known: no branch leaves the stem" in invoke("tree", "s.json", "--root", "z").stdout


def test_a_stem_and_how_well_it_is_known(invoke, tmp_path):
    save_skeleton(pipelines.tree()(samples.tree(4000, forks=2, length=2, seed=1).points), tmp_path / "t.json")
    found = tree_measures(read_skeleton(tmp_path / "t.json"))
    low, high = found.stem_interval
    lines = invoke("tree", "t.json").stdout.splitlines()
    (line,) = (line for line in lines if line.startswith("stem diameter"))
    assert f"{found.stem_diameter:.4g} m (95 %: {low:.4g} to {high:.4g}; {found.stem_points} points on" in line
    (line,) = (line for line in lines if line.startswith("volume:"))
    assert line == f"volume: {sum(found.volume):.4g} m3 (95 %%: %.4g to %.4g)" % found.volume_interval
    facts = json.loads(invoke("tree", "t.json", "--json").stdout)
    assert facts["stem_interval"] == [low, high]
    assert (facts["stem_arc"], facts["stem_rms"], facts["doubts"]) == (found.stem_arc, found.stem_rms, [])


def test_units_and_what_is_up(invoke, tmp_path, y):
    metres = json.loads(invoke("tree", y, "--json", "--up", "z").stdout)
    for unit, factor in {"0.001": 0.001, "mm": 0.001, "ft": 0.3048, "m": 1}.items():
        facts = json.loads(invoke("tree", y, "--json", "--up", "z", "--unit", unit).stdout)
        assert facts["height"] == pytest.approx(factor * metres["height"])
        assert facts["unit"] == factor
    assert json.loads(invoke("tree", y, "--json", "--up", "-z").stdout)["height"] != metres["height"]
    save_skeleton(pipelines.tree("-y")(samples.y_junction(2000).points), tmp_path / "t.json")
    for words, up in (((), "-y"), (("--root", "x"), "x"), (("--up", "z"), "z")):  # as the tree was grown, or as asked
        assert json.loads(invoke("tree", "t.json", "--json", *words).stdout)["up"] == up


def test_cylinders_are_in_the_units_of_the_file(invoke, tmp_path, y):
    result = invoke("tree", y, "-o", "c.csv", "--unit", "mm", "--root", "z")
    assert result.stdout.splitlines()[-1] == "wrote c.csv, in the units of y.ply"
    cylinders(read_skeleton(tmp_path / y), "z").to_csv(tmp_path / "expected.csv")
    assert (tmp_path / "c.csv").read_bytes() == (tmp_path / "expected.csv").read_bytes()


def test_a_tree_taller_than_any_is_in_doubt(invoke, tmp_path, y):
    skeleton = read_skeleton(tmp_path / y)
    save_skeleton(
        replace(skeleton, vertices=1000 * skeleton.vertices, radii=1000 * skeleton.radii), tmp_path / "mm.ply"
    )
    first, second = invoke("tree", "mm.ply", "--up", "z", "--root", "z").stderr.splitlines()
    assert second.endswith("the skeleton has no points: .json and .npz files keep them")
    assert first.endswith("none is known above 116 m: is a unit of the cloud 1 m? name it: unit='mm', --unit mm")
    assert invoke("tree", "mm.ply", "--unit", "mm", "--up", "z", "--root", "z").stderr == ""
