"""What `glsk skeletonize` takes, refuses and says."""

import json
import re

import numpy as np
import pytest

from glsk_o3d import annotate, load_recipe, read_skeleton, read_tensor_cloud, samples, save_recipe, to_recipe, to_tubes
from glsk_o3d.io import streaming
from glsk_o3d.io.scans import read_blocks, read_mesh


def test_settings_reach_the_run_and_points_are_dropped(invoke, scans, tmp_path):
    settings = ("--set", "stop=RingSizeRatio", "--set", "Connector.radius=5%", "--set", "max_iterations=1")
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.npz", "--drop-invalid", *settings, "--json")
    facts, skeleton = json.loads(result.stdout), read_skeleton(tmp_path / "s.npz")
    assert (facts["points"], facts["dropped"], facts["files"]) == (1000, 2, ["s.npz"])
    assert (facts["converged"], facts["stop_reason"]) == (False, "reached max_iterations = 1")
    assert (skeleton.vertex_of_point < 0).nonzero()[0].tolist() == [3, 8]
    assert any("stop=RingSizeRatio(" in stage for stage in skeleton.report.stages)
    assert any("Connector(radius='5%'" in stage for stage in skeleton.report.stages)


def test_meshes_are_sampled(invoke, tmp_path):
    box = "".join(f"v {x} {y} {z}\n" for x in (0, 10) for y in (0, 1) for z in (0, 1))
    quads = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    (tmp_path / "bar.obj").write_text(box + "".join(f"f {quad}\n" for quad in quads))
    result = invoke("skeletonize", "bar.obj", "-o", "s.json", "--report", "r.html", "--labelled", "l.ply")
    assert re.search(r"^by area +25,?000$", result.stdout, re.MULTILINE)
    actual = read_skeleton(tmp_path / "s.json")
    assert (actual.report.n_input, actual.report.n_by_area, len(actual.vertex_of_point)) == (8, 25000, 8)
    assert abs(actual.length - 10) < 1  # half a width at either end
    assert np.abs(actual.vertices[:, 1:] - 0.5).max() < 0.1
    assert "25000 by area" in (tmp_path / "r.html").read_text("utf-8")
    assert len(read_tensor_cloud(tmp_path / "l.ply").point.branch) == 8
    facts = json.loads(invoke("skeletonize", "bar.obj", "-o", "s.ply", "--sample", "3000", "--json").stdout)
    assert (facts["points"], facts["by_area"], facts["leaves"]) == (8, 3000, 2)
    invoke("batch", "bar.obj", "-o", "out", "--format", "json", "--sample", "2000")
    assert read_skeleton(tmp_path / "out" / "bar.json").report.n_by_area == 2000


def test_one_file_that_cannot_be_written_does_not_cost_the_others(invoke, scans, tmp_path, monkeypatch):
    words = ("skeletonize", scans / "ring.ply", "-o", "s.swc", "-o", "s.json")
    with monkeypatch.context() as patch:
        patch.setattr("glsk_o3d.save_preview", lambda *_, **__: 1 / 0)
        result = invoke(*words, "--preview", "s.png")
    assert result.exit_code == 1
    assert "s.swc: this format holds trees only" in result.stderr
    assert result.stderr.endswith("; s.png: cannot be written: ZeroDivisionError: division by zero\n")
    assert [path.name for path in tmp_path.iterdir()] == ["s.json"]  # the run was not for nothing
    assert "wrote s.json\n" in result.stdout
    assert read_skeleton(tmp_path / "s.json").n_loops == 1
    assert invoke(*words, "--cut-loops").exit_code == 0
    assert read_skeleton(tmp_path / "s.swc").n_loops == 0


def test_warnings_json_and_quiet(invoke, scans, tmp_path):
    words = ("skeletonize", scans / "ball.ply", "-o", "s.ply")
    result = invoke(*words, "--json")
    facts, lines = json.loads(result.stdout), result.stderr.splitlines()
    assert result.exit_code == 0
    assert all(line.startswith("glsk: warning: ") for line in lines)
    assert len(set(lines)) == len(lines) == len(facts["warnings"]) > 0
    assert any("sphere-like" in line for line in lines)
    assert (facts["points"], facts["files"]) == (1000, ["s.ply"])
    assert facts["components"] - facts["vertices"] + facts["edges"] == facts["loops"]
    assert {"loops_closed", "cuts", "bridges", "uncertain", "stop_reason"} <= set(facts)
    (tmp_path / "s.ply").unlink()
    result = invoke(*words, "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "s.ply").is_file()


def test_a_doubtful_verdict_is_printed_with_its_reasons(invoke, scans, tmp_path, monkeypatch):
    monkeypatch.setattr("glsk_o3d.data.verdict.GOOD_SCORE", 1.0)
    words = ("skeletonize", scans / "ring.ply", "-o", "s.ply")
    (reason,) = json.loads(invoke(*words, "--json", "--report", "r.html").stdout)["reasons"]
    assert reason.startswith("low score")
    assert f"<li>{reason}</li>" in (tmp_path / "r.html").read_text("utf-8")
    printed = invoke(*words).stdout
    assert re.search(rf"^reasons +{re.escape(reason)}$", printed, re.MULTILINE)
    assert re.search(r"^verdict +doubtful: low score$", printed, re.MULTILINE)
    printed = invoke("skeletonize", scans / "ball.ply", "-o", "s.ply").stdout
    assert re.search(r"^verdict +no curve skeleton: sphere, low score$", printed, re.MULTILINE)
    assert "sphere-like" not in printed  # it is on stderr


# ------------------------------------------------------------------------------------------------ results as recipes


@pytest.fixture
def created(invoke, scans, tmp_path):
    """A result, beside the recipe of its run."""
    words = ("--set", "Connector.radius=4%", "--drop-invalid")
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.json", *words)
    assert result.exit_code == 0, result.output
    save_recipe(load_recipe(tmp_path / "s.json"), tmp_path / "r.json")
    return read_skeleton(tmp_path / "s.json")


@pytest.mark.parametrize("recipe", ["r.json", "s.json"])
def test_a_run_is_repeated_by_its_recipe_or_that_in_its_result(invoke, scans, tmp_path, created, recipe):
    words = ("skeletonize", scans / "nan.ply", "--pipeline", recipe, "-o", "again.json")
    assert json.loads(invoke(*words, "--json").stdout)["files"] == ["again.json"]
    again = read_skeleton(tmp_path / "again.json")
    for name in ("vertices", "edges", "radii", "points", "vertex_of_point"):
        np.testing.assert_array_equal(getattr(again, name), getattr(created, name))
    assert again.report.recipe == created.report.recipe == to_recipe(load_recipe(tmp_path / "r.json"))
    assert invoke(*words, "--set", "Connector.radius=5%").exit_code == 0
    assert read_skeleton(tmp_path / "again.json").report.stages[6].startswith("Connector(radius='5%'")


def test_refused_before_anything_runs(refused, scans, tmp_path, created, no_run):
    data = json.loads((tmp_path / "s.json").read_text())
    data["report"]["recipe"]["pipeline"] = [{"filter": "Slab"}]
    (tmp_path / "gone.json").write_text(json.dumps(data))
    recipe = {"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "RingBuilder", "k": 9}]}
    (tmp_path / "part.json").write_text(json.dumps(recipe))
    for code, words, message in (
        (1, "--pipeline gone.json -o a.ply", "gone.json: pipeline[0].filter: no filter is"),
        (2, "--pipeline s.json -o ./s.json", "is an input"),
        (1, "--pipeline none.json -o a.ply", "none.json: no such file"),
        (2, "--pipeline part.json -o a.ply", "not lead from a cloud to a skeleton"),
    ):
        assert message in refused(code, "skeletonize", scans / "sample.ply", *words.split())


# --------------------------------------------------------------------------------------------------- labels and tubes

MAP = np.array([471234.5, 5612345.25, 123.0])


@pytest.fixture
def las(tmp_path):
    """A ring on a map, on a table, with what a LAS file says of its points."""
    laspy = pytest.importorskip("laspy")
    ring, n = samples.torus(1000).points, 1000
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.offsets, header.scales = MAP, [1e-5] * 3
    header.add_extra_dim(laspy.ExtraBytesParams("treeID", type="uint32"))
    data = laspy.LasData(header)
    table = np.column_stack([ring[:200, :2], np.full(200, -2.0)])
    data.x, data.y, data.z = (np.concatenate([ring, table]) + MAP).T
    data.classification = np.repeat([5, 2], [n, 200])
    data.intensity, data.treeID = np.arange(n + 200), np.arange(n + 200) // 7
    data.red = np.repeat([65535, 0], [n, 200])
    data.write(tmp_path / "ring.las")
    return "ring.las"


def test_a_scan_with_labels_has_all_that_it_had_and_tubes_are_those_of_the_skeleton(invoke, las, tmp_path):
    words = ("skeletonize", las, "--where", "classification == 5", "--labelled", "l.ply", "--tubes", "t.ply")
    result = invoke(*words, "-o", "s.npz")
    assert (result.exit_code, result.stderr) == (0, "")
    scan = read_tensor_cloud(tmp_path / las, where="classification == 5")
    skeleton, tubes = read_skeleton(tmp_path / "s.npz"), read_mesh(tmp_path / "t.ply")
    np.testing.assert_array_equal(np.asarray(tubes.vertices), np.asarray(to_tubes(skeleton).vertices))
    assert tubes.has_vertex_colors()
    back = read_tensor_cloud(tmp_path / "l.ply").point
    assert len(skeleton.points) == 1000
    for name in ("positions", "classification", "intensity", "treeID"):
        np.testing.assert_array_equal(back[name].numpy(), scan.point[name].numpy(), err_msg=name)
    assert (back.scan_red.numpy() == 255).all()
    expected = annotate(skeleton, color="branch").point
    for name in ("skeleton_vertex", "branch", "order", "radius", "confidence", "colors"):
        np.testing.assert_array_equal(back[name].numpy(), expected[name].numpy(), err_msg=name)


def test_a_large_scan_is_read_in_blocks(invoke, tmp_path, write_scan, monkeypatch):
    scan, n = tmp_path / "scan.ply", 9000
    write_scan(scan, samples.torus(n).points)
    monkeypatch.setitem(read_blocks.__kwdefaults__, "rows", 2000)
    words = ("skeletonize", scan, "-o", "s.json", "--set", "size=4000", "--set", "thin_to=2000")
    assert invoke(*words).stderr == ""
    whole = read_skeleton("s.json")
    monkeypatch.setattr(streaming, "LARGE_CLOUD", n - 1)
    result = invoke(*words, "--labelled", "l.ply", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert (facts["points"], facts["loops"]) == (n, 1)
    assert 0 < facts["sampled"] < n
    np.testing.assert_allclose(read_skeleton("s.json").vertices, whole.vertices, atol=1e-9)
    assert len(read_tensor_cloud("l.ply").point.branch) == n


# -------------------------------------------------------------------------------------------------- doubts about a run


def test_support_is_printed_and_shown(invoke, scans, tmp_path):
    result = invoke("skeletonize", scans / "ring.ply", "-o", "r.json", "--report", "r.html", "--support", "2")
    assert result.exit_code == 0
    assert re.search(r"^samples +2 of 2 have the same graph$", result.stdout, re.M)
    skeleton = read_skeleton(tmp_path / "r.json")
    assert (skeleton.support.min(), skeleton.report.n_agreeing) == (1, 2)
    assert "2 of 2 samples of the cloud have the same graph" in (tmp_path / "r.html").read_text()
    reported = json.loads(invoke("skeletonize", scans / "ring.ply", "-o", "s.json", "--support", "2", "--json").stdout)
    assert (reported["samples"], reported["agreeing"], reported["unsupported"]) == (2, 2, [])
    assert invoke("skeletonize", scans / "ring.ply", "-o", "u.json", "--support", "1").exit_code == 2
