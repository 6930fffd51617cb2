"""`glsk tree`: the numbers, the file, the units."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

from glsk_o3d import Skeleton, pipelines, read_skeleton, samples
from glsk_o3d.analysis import cylinders, tree_measures
from glsk_o3d.io.cylinders import save_cylinders


def test_lines_file_and_json_agree(invoke, tmp_path, y):
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
    np.testing.assert_allclose([float(row["diameter"]) for row in rows], 2 * table.radius)
    facts = json.loads(invoke("tree", y, "--json", "--root", "0,0,-0.5").stdout)
    assert facts["volume"] == list(measures.volume)
    assert facts["stem_diameter"] is None  # it is not so high
    assert (facts["unit"], facts["up"]) == (1, "z")
    np.testing.assert_allclose(facts["root"], measures.root)
    assert invoke("tree", y, "-q").stdout == ""


def test_why_a_stem_has_no_diameter(invoke, tmp_path):
    points = [[0, 0, 0], [0, 0, 1], [3, 0, 1], [0, 0, 2.5]]
    bent = Skeleton(points, [[0, 1], [1, 2], [1, 3]], [0.2, 0.2, 0.2, 0.01], (), (), ())
    bent.save(tmp_path / "t.json")
    said = invoke("tree", "t.json", "--root", "z", "--up", "x").stdout.splitlines()
    cause = "if x points up (--up), and 0, 0, 0 is the root (--root)"
    assert f"stem diameter: not known: the stem does not pass 1.3 m above the root, {cause}" in said
    Skeleton(points[:2], [[0, 1]], [0.2, 0.2], (), (), ()).save(tmp_path / "s.json")
    assert "crown base: not known: no branch leaves the stem" in invoke("tree", "s.json", "--root", "z").stdout


def test_units_and_what_is_up(invoke, y):
    metres = json.loads(invoke("tree", y, "--json", "--up", "z").stdout)
    for unit, factor in {"1": 1, "0.001": 0.001, "mm": 0.001, "cm": 0.01, "in": 0.0254, "ft": 0.3048, "m": 1}.items():
        facts = json.loads(invoke("tree", y, "--json", "--up", "z", "--unit", unit).stdout)
        assert facts["height"] == pytest.approx(factor * metres["height"])
        assert facts["unit"] == factor
    assert json.loads(invoke("tree", y, "--json", "--up", "-z").stdout)["height"] != metres["height"]


@pytest.mark.parametrize("name", ["t.qsm.csv", "t.mat", "t.txt"])
def test_files_of_other_programs_are_in_metres(invoke, tmp_path, y, name):
    result = invoke("tree", y, "-o", name, "--unit", "mm", "--root", "z")
    assert result.stdout.splitlines()[-1] == f"wrote {name}, in metres"
    save_cylinders(cylinders(read_skeleton(tmp_path / y), "z"), tmp_path / f"expected-{name}", 0.001)
    if name != "t.mat":  # which says when it was written
        assert (tmp_path / name).read_bytes() == (tmp_path / f"expected-{name}").read_bytes()
    else:
        found, expected = (loadmat(tmp_path / f"{prefix}t.mat")["cylinder"][0, 0] for prefix in ("", "expected-"))
        assert all((found[field] == expected[field]).all() for field in expected.dtype.names)
        assert found["length"].sum() == pytest.approx(1.4e-3, rel=0.1)


def test_up_is_what_the_tree_was_grown_along(invoke, tmp_path):
    grown = pipelines.tree("-y")(samples.y_junction(2000).points)
    grown.save(tmp_path / "t.json")
    assert json.loads(invoke("tree", "t.json", "--json").stdout)["up"] == "-y"
    assert json.loads(invoke("tree", "t.json", "--json", "--root", "x").stdout)["up"] == "x"
    assert json.loads(invoke("tree", "t.json", "--json", "--up", "z").stdout)["up"] == "z"
    pipelines.tree("thickest")(samples.y_junction(2000).points).save(tmp_path / "u.json")
    assert json.loads(invoke("tree", "u.json", "--json").stdout)["up"] == "z"


def test_a_tree_taller_than_any_is_in_doubt(invoke, tmp_path, y):
    skeleton = read_skeleton(tmp_path / y)
    replace(skeleton, vertices=1000 * skeleton.vertices, radii=1000 * skeleton.radii).save(tmp_path / "mm.ply")
    (line,) = invoke("tree", "mm.ply", "--up", "z", "--root", "z").stderr.splitlines()
    assert line.endswith("none is known above 116 m: is a unit of the cloud 1 m? pass unit=, such as 'mm'")
    assert invoke("tree", "mm.ply", "--unit", "mm", "--up", "z", "--root", "z").stderr == ""


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ["y.ply", "--root", "trunk"], "root = 'trunk': must be an axis, x to -z, 'thickest', a vertex, or a point"),
        (2, ["y.ply", "--root", "a,b,c"], "root = 'a,b,c': must be an axis"),
        (2, ["y.ply", "--up", "w"], "up = 'w': must be"),
        (2, ["y.ply", "--unit", "0"], "unit = '0': must be metres, above 0, or one of m, cm, mm, in, ft"),
        (2, ["y.ply", "--unit", "yard"], "unit = 'yard': must be metres"),
        (2, ["ring.json"], "1 loops: cylinders are of trees; see pipelines.tree()"),
        (2, ["two.json"], "2 components: cylinders are of one tree; see pipelines.tree()"),
        (2, ["y.ply", "-o", "c.xlsx"], "its name ends in .qsm.csv or .mat or .txt or .csv"),
    ],
)
def test_refuses(invoke, tmp_path, y, code, words, message):
    ring = samples.torus(100)
    Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()).save(tmp_path / "ring.json")
    Skeleton(np.eye(3), [[0, 1]], np.ones(3), (), (), ()).save(tmp_path / "two.json")
    result = invoke("tree", *words)
    assert result.exit_code == code
    assert message in " ".join(result.stderr.split())
    assert len(result.stderr.splitlines()) == 1 or code == 2


def test_every_output_is_written(invoke, tmp_path):
    from glsk_o3d import pipelines
    from glsk_o3d.samples import y_junction

    pipelines.tree()(y_junction(2000).points).save(tmp_path / "y.json")
    names = ["c.csv", "c.txt", "c.mat", "c.qsm.csv"]
    result = invoke("tree", "y.json", *(word for name in names for word in ("-o", name)))
    assert result.exit_code == 0, result.output
    assert all((tmp_path / name).stat().st_size for name in names)
    assert invoke("branches", "y.json", "-o", "a.csv", "-o", "b.csv").exit_code == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert invoke("grasps", "y.json", "--opening", "1", "-o", "g.json", "-o", "g.csv").exit_code == 0
    assert (tmp_path / "g.csv").exists()
    assert invoke("rig", "y.json", "-o", "a.glb", "-o", "b.glb").exit_code == 2
