"""`glsk info`: what is in a file."""

import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Judgement, read_skeleton


@pytest.fixture
def told(invoke):
    """What `glsk info --json` says, and that the table says as much."""

    def info(path):
        result = invoke("info", path, "--json")
        assert result.exit_code == 0, result.output
        facts = json.loads(result.stdout)
        table = invoke("info", path).stdout
        assert table.startswith(f"{path}\n")
        for name in facts.keys() - {"file", "iterations"}:
            assert name.replace("_", " ") in table or facts[name] in (None, [])
        return facts

    return info


def test_cloud(told, scans):
    facts = told(scans / "nan.ply")
    assert facts["kind"] == "cloud"
    assert (facts["points"], facts["not_finite"], facts["duplicates"]) == (1000, 2, 0)
    assert (facts["colours"], facts["normals"]) == (False, False)
    assert 0.005 < facts["median_spacing"] < 0.05


def test_a_scan_is_no_skeleton_and_a_skeleton_no_scan(refused, invoke, scans, tmp_path):
    line = refused(1, "branches", scans / "ring.ply")
    assert line == f"{scans / 'ring.ply'}: is a cloud, not a skeleton: make one with glsk_o3d.skeletonize"
    invoke("skeletonize", scans / "ring.ply", "-o", "s.json", "-o", "s.obj")
    for words in (["skeletonize", "s.obj"], ["rerun", "s.json", "s.obj"]):
        assert refused(1, *words, "-o", "a.ply") == "s.obj: is a skeleton, not a scan"


def test_numbers_of_a_small_cloud(told, tmp_path):
    rows = [[x, 2 * y, 0] for x in range(3) for y in range(2)]
    np.savetxt(tmp_path / "grid.xyz", [*rows, rows[0]])
    facts = told("grid.xyz")
    assert (facts["points"], facts["duplicates"], facts["median_spacing"]) == (7, 1, 1)
    assert (facts["lowest"], facts["highest"]) == ([0, 0, 0], [2, 2, 0])
    assert facts["diagonal"] == pytest.approx(np.sqrt(8))


def test_a_cloud_without_a_finite_point(told, tmp_path, write_scan):
    write_scan(tmp_path / "bad.ply", np.full((3, 3), np.nan))
    facts = told("bad.ply")
    assert (facts["not_finite"], facts["diagonal"], facts["median_spacing"]) == (3, None, None)


@pytest.fixture
def skeleton(invoke, scans, tmp_path):
    names = ("s.json", "s.npz", "s.ply", "s.obj", "s.swc", "s.graphml", "s.cgal", "s.polylines.txt")
    words = [word for name in names for word in ("-o", name)]
    result = invoke("skeletonize", scans / "sample.ply", *words, "--cut-loops", "--set", "Connector.radius=4%")
    assert result.exit_code == 0
    return {name: read_skeleton(tmp_path / name) for name in names}


def test_skeletons_of_every_format(told, skeleton):
    for name, it in skeleton.items():
        facts = told(name)
        assert facts["kind"] == "skeleton"
        assert (facts["vertices"], facts["edges"], facts["loops"]) == (len(it.vertices), len(it.edges), it.n_loops)
        assert (facts["leaves"], facts["junctions"]) == (len(it.leaves), len(it.junctions))
        assert facts["length"] == pytest.approx(it.length)
        assert (facts["radii"] is None) == bool(np.isnan(it.radii).all())


def test_the_report_of_the_run(told, skeleton, invoke):
    facts, report = told("s.npz"), skeleton["s.npz"].report
    assert facts["stop_reason"] == report.stop_reason
    assert set(facts["stages"]) == set(report.stages)
    assert facts["repeatable"] is True
    assert [each["n_points"] for each in facts["iterations"]] == [each.n_points for each in report.iterations]
    table = invoke("info", "s.npz").stdout
    assert "Connector(radius='4%')\n" in table  # what is not the default of the filter
    assert re.search(r"^radii +[\d.]+ to [\d.]+$", table, re.MULTILINE)
    assert re.search(r"^stages +RingBuilder\n +Contractor", table, re.MULTILINE)
    assert all(f"{each.explained:.4f}" in table for each in report.iterations)


def test_close_calls_are_told(told, skeleton, invoke, tmp_path):
    report = skeleton["s.json"].report
    assert told("s.json")["uncertain"] == list(map(str, report.uncertain))
    call = Judgement("gap", (1.0, 2.0, 3.0), 0.45, changed=False)
    replace(skeleton["s.json"], report=replace(report, judgements=(call,))).save(tmp_path / "close.json")
    assert told("close.json")["uncertain"] == [str(call)]
    assert "gap left" in invoke("info", "close.json").stdout


def test_a_run_with_a_filter_that_is_not_installed_cannot_be_repeated(told, skeleton, tmp_path):
    data = json.loads((tmp_path / "s.json").read_text())
    data["report"]["recipe"]["pipeline"].insert(0, {"filter": "Slab"})
    (tmp_path / "s.json").write_text(json.dumps(data))
    assert told("s.json")["repeatable"] is False


def test_a_mesh_is_a_cloud(told, invoke, tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    facts = told("m.obj")
    assert (facts["kind"], facts["points"], facts["triangles"]) == ("cloud", 3, 1)
    result = invoke("info", "m.obj")
    assert "triangles" in result.stdout
    assert "m.obj: the 3 vertices of this mesh are far apart" in result.stderr
    assert invoke("info", "m.obj", "-q").output == ""
    assert json.loads(invoke("info", "m.obj", "-q", "--json").stdout)["points"] == 3


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", "", "a.ply: the file is empty"),
        ("a.json", "{}", "a.json: not a valid .json skeleton"),
        ("a.swc", "1 2", "a.swc: not a valid .swc skeleton"),
        ("a.docx", "x", "a.docx: unknown ending"),
        ("a.ply", None, "a.ply: no such file"),
    ],
)
def test_refuses(invoke, tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_text(content)
    result = invoke("info", name)
    assert result.exit_code == 1
    assert result.stderr.startswith(f"glsk: error: {message}")
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""


def test_coordinates_of_a_map_keep_their_digits(invoke, told, tmp_path):
    corner = np.array([471234.5678, 5612345.6789, 123.4567])
    np.savetxt(tmp_path / "far.xyz", corner + np.eye(3), fmt="%.4f")
    assert told("far.xyz")["lowest"] == corner.tolist()
    assert "471234.56780  5612345.67890  123.45670" in invoke("info", "far.xyz").stdout


def test_attributes_and_conditions_on_them(invoke, told, refused, tmp_path):
    rows = [f"{i},{i * i},0,{i % 3},{i / 7}" for i in range(30)]
    (tmp_path / "c.csv").write_text("\n".join(["x,y,z,Tree ID,intensity", *rows]))
    facts = told("c.csv")["attributes"]
    assert facts["Tree_ID"] == {"distinct": 3, "lowest": 0, "highest": 2, "counts": {"0": 10, "1": 10, "2": 10}}
    assert facts["intensity"] == {"distinct": 30, "lowest": 0.0, "highest": 29 / 7}
    text = invoke("info", "c.csv").stdout
    assert "Tree_ID 0 (10 points), 1 (10 points), 2 (10 points)" in text
    assert "intensity 0 to 4.142857143, 30 values" in text
    assert json.loads(invoke("info", "c.csv", "--where", "Tree_ID == 2 and x > 4", "--json").stdout)["points"] == 9
    assert "did you mean 'Tree_ID'" in refused(2, "info", "c.csv", "--where", "treeid == 2")
    assert refused(1, "info", "c.csv", "--where", "x > 99") == "there is no point with x > 99"


def test_without_a_file_it_lists_what_can_be_read(invoke):
    told = json.loads(invoke("info", "--json").stdout)
    assert {".las", ".laz", ".e57", ".csv", ".ply"} <= set(told["clouds"])
    assert ".swc" in told["skeletons"]
    assert ".vtp" in told["only_written"]
    text = invoke("info").stdout
    assert all(ending in text for endings in told.values() for ending in endings)


def test_without_a_package_it_says_which_files_cannot_be_read(invoke, monkeypatch):
    monkeypatch.setitem(sys.modules, "pye57", None)
    assert list(json.loads(invoke("info", "--json").stdout)["lacking"]) == [".e57"]
    assert ".e57 pye57 cannot be imported: pip install" in " ".join(invoke("info").stdout.split())


def test_a_large_cloud_is_told_block_by_block(told, scans, tmp_path, monkeypatch):
    import open3d as o3d

    from glsk_o3d import save_tensor_cloud
    from glsk_o3d.io import streaming
    from glsk_o3d.io.scans import read_blocks

    random = np.random.default_rng(2)
    places = random.normal(size=(500, 3))
    places[77] = np.nan
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(places))
    cloud.point.label = o3d.core.Tensor(random.integers(0, 9, (500, 1)).astype(np.int32))
    cloud.point.time = o3d.core.Tensor(random.random((500, 1)))
    save_tensor_cloud(cloud, tmp_path / "c.ply")
    whole = told(tmp_path / "c.ply")
    monkeypatch.setattr(streaming, "LARGE_CLOUD", 499)
    monkeypatch.setitem(read_blocks.__kwdefaults__, "rows", 60)
    found = told(tmp_path / "c.ply")
    assert whole["attributes"]["time"].pop("distinct") == 500
    assert found == {name: whole[name] for name in whole if name not in ("duplicates", "median_spacing", "triangles")}
