"""`glsk tree`: the numbers, the file, the units."""

import csv
import json

import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton, samples
from glsk_o3d.analysis import cylinders, tree_measures


def test_lines_file_and_json_agree(invoke, tmp_path, y):
    result = invoke("tree", y, "-o", "c.csv", "--root", "0,0,-0.5")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton = read_skeleton(tmp_path / y)
    measures, table = tree_measures(skeleton, (0, 0, -0.5)), cylinders(skeleton, (0, 0, -0.5))
    lines = result.stdout.splitlines()
    assert lines[0] == f"height: {measures.height:.4g} m"
    assert lines[-1] == "wrote c.csv"
    told = [line.split() for line in lines if line.strip()[:1].isdigit()]
    assert [row[0] for row in told] == ["0", "1"]
    np.testing.assert_allclose([float(row[3]) for row in told], measures.volume, rtol=1e-3)
    with (tmp_path / "c.csv").open(newline="") as stream:
        assert [int(row["parent"]) for row in csv.DictReader(stream)] == table.parent.tolist()
    facts = json.loads(invoke("tree", y, "--json", "--root", "0,0,-0.5").stdout)
    assert facts["volume"] == list(measures.volume)
    assert facts["stem_diameter"] is None  # it is not so high
    assert invoke("tree", y, "-q").stdout == ""


def test_units_and_what_is_up(invoke, y):
    metres, millimetres = (
        json.loads(invoke("tree", y, "--json", "--up", "z", "--unit", unit).stdout) for unit in ("1", "0.001")
    )
    assert metres["height"] == pytest.approx(1000 * millimetres["height"])
    assert json.loads(invoke("tree", y, "--json", "--up", "-z").stdout)["height"] != metres["height"]


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ["y.ply", "--root", "trunk"], "--root trunk: write the number of a vertex, or a point"),
        (2, ["y.ply", "--up", "w"], "up = 'w': must be"),
        (2, ["y.ply", "--unit", "0"], "unit = 0.0: must be metres"),
        (2, ["ring.json"], "1 loops: cylinders are of trees"),
        (2, ["y.ply", "-o", "c.txt"], "CSV"),
    ],
)
def test_refuses(invoke, tmp_path, y, code, words, message):
    ring = samples.torus(100)
    Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()).save(tmp_path / "ring.json")
    result = invoke("tree", *words)
    assert result.exit_code == code
    assert message in " ".join(result.stderr.split())
    assert len(result.stderr.splitlines()) == 1 or code == 2
