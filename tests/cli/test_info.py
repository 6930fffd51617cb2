"""`glsk info` and `glsk view`: what is in a file."""

import json
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Decision, read_skeleton, save_skeleton
from glsk_o3d.io import streaming
from glsk_o3d.io.scans import read_blocks


@pytest.fixture
def reported(invoke):
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


def test_numbers_of_a_cloud(reported, tmp_path, write_scan):
    rows = [[x, 2 * y, 0] for x in range(3) for y in range(2)]
    write_scan(tmp_path / "grid.ply", [*rows, rows[0], [np.nan, 0, 0]])
    facts = reported("grid.ply")
    assert (facts["kind"], facts["points"], facts["not_finite"]) == ("cloud", 8, 1)
    assert (facts["duplicates"], facts["median_spacing"]) == (1, 1)
    assert (facts["lowest"], facts["highest"]) == ([0, 0, 0], [2, 2, 0])
    assert facts["diagonal"] == pytest.approx(np.sqrt(8))
    assert (facts["colours"], facts["normals"]) == (False, False)
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    facts = reported("m.obj")
    assert (facts["kind"], facts["points"], facts["triangles"]) == ("mesh", 3, 1)
    write_scan(tmp_path / "bad.ply", np.full((3, 3), np.nan))
    facts = reported("bad.ply")
    assert (facts["not_finite"], facts["diagonal"], facts["median_spacing"]) == (3, None, None)


@pytest.fixture
def skeleton(invoke, scans, tmp_path):
    names = ("s.json", "s.npz", "s.ply", "s.obj", "s.swc")
    words = [word for name in names for word in ("-o", name)]
    result = invoke("skeletonize", scans / "sample.ply", *words, "--cut-loops", "--set", "Connector.radius=4%")
    assert result.exit_code == 0
    return {name: read_skeleton(tmp_path / name) for name in names}


def test_skeletons_of_every_format_and_the_report_of_the_run(reported, skeleton, invoke, tmp_path):
    for name, item in skeleton.items():
        facts = reported(name)
        assert facts["kind"] == "skeleton"
        assert (facts["vertices"], facts["edges"], facts["loops"]) == (
            len(item.vertices),
            len(item.edges),
            item.n_loops,
        )
        assert (facts["leaves"], facts["junctions"]) == (len(item.leaves), len(item.junctions))
        assert facts["length"] == pytest.approx(item.length)
        assert (facts["radii"] is None) == bool(np.isnan(item.radii).all())
    facts, report = reported("s.npz"), skeleton["s.npz"].report
    assert (facts["stop_reason"], facts["on_medial_axis"]) == (report.stop_reason, False)
    assert facts["stages"] == list(report.stages)
    assert [item["n_points"] for item in facts["iterations"]] == [item.n_points for item in report.iterations]
    assert all(f"{item.explained:.4f}" in invoke("info", "s.npz").stdout for item in report.iterations)
    call = Decision("gap", (1.0, 2.0, 3.0), 0.45, changed=False)
    save_skeleton(replace(skeleton["s.json"], report=replace(report, decisions=(call,))), tmp_path / "close.json")
    assert reported("close.json")["uncertain"] == [str(call)]


def test_attributes_and_conditions_on_them(invoke, reported, refused, tmp_path):
    rows = [f"{i},{i * i},0,{i % 3},{i / 7}" for i in range(30)]
    (tmp_path / "c.csv").write_text("\n".join(["x,y,z,Tree ID,intensity", *rows]))
    facts = reported("c.csv")["attributes"]
    assert facts["Tree_ID"] == {"lowest": 0, "highest": 2, "counts": {"0": 10, "1": 10, "2": 10}}
    assert facts["intensity"] == {"lowest": 0.0, "highest": 29 / 7}
    text = invoke("info", "c.csv").stdout
    assert "Tree_ID 0 (10 points), 1 (10 points), 2 (10 points)" in text
    assert "intensity 0 to 4.142857143\n" in text
    assert json.loads(invoke("info", "c.csv", "--where", "Tree_ID == 2 and x > 4", "--json").stdout)["points"] == 9
    assert "did you mean 'Tree_ID'" in refused(2, "info", "c.csv", "--where", "treeid == 2")
    assert refused(1, "info", "c.csv", "--where", "x > 99") == "there is no point with x > 99"


def test_a_large_cloud_is_read_in_blocks(reported, tmp_path, monkeypatch):
    random = np.random.default_rng(2)
    places = random.normal(size=(500, 3))
    places[77] = np.nan
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(places))
    cloud.point.label = o3d.core.Tensor(random.integers(0, 9, (500, 1)).astype(np.int32))
    cloud.point.time = o3d.core.Tensor(random.random((500, 1)))
    o3d.t.io.write_point_cloud(str(tmp_path / "c.ply"), cloud)
    whole = reported(tmp_path / "c.ply")
    monkeypatch.setattr(streaming, "LARGE_CLOUD", 499)
    monkeypatch.setitem(read_blocks.__kwdefaults__, "rows", 60)
    actual = reported(tmp_path / "c.ply")
    assert actual == {name: whole[name] for name in whole if name not in ("duplicates", "median_spacing", "triangles")}


# -------------------------------------------------------------------------------------------------------------- to look


@pytest.fixture
def shown(monkeypatch):
    """What would be shown, instead of a window."""
    calls = []
    monkeypatch.setattr("glsk_o3d.viewing.window.show", lambda *words, **options: calls.append((*words, options)))
    return calls


def test_a_window_shows_a_skeleton_or_a_scan(invoke, scans, tmp_path, y, shown):
    for file in (y, scans / "sample.ply"):
        assert invoke("view", file).exit_code == 0
    (skeleton, none, options), (empty, cloud, _) = shown
    assert none is None
    assert repr(skeleton) == repr(read_skeleton(tmp_path / y))
    assert options == {"title": "y.ply"}
    assert (len(empty.vertices), len(cloud.points), len(empty.points)) == (0, 1100, 1100)


def test_files_instead_of_a_window(invoke, scans, shown, tmp_path, y):
    for file in (tmp_path / y, scans / "nan.ply"):
        result = invoke("view", file, "--report", "r.html", "--preview", "p.png")
        assert (result.exit_code, result.stdout) == (0, "wrote p.png\nwrote r.html\n")
        assert f"<title>{file.name}</title>" in (tmp_path / "r.html").read_text("utf-8")
        assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert shown == []
