"""What `glsk skeletonize` takes, refuses and says."""

import json
import logging
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d import Judgement, read_skeleton, read_tensor_cloud, samples
from glsk_o3d.cli import skeletonize as module
from glsk_o3d.cli.options import PipelineName
from glsk_o3d.io.meshes import read_mesh
from glsk_o3d.pipelines import PIPELINES


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, [], "nothing to write"),
        (2, ["-o", "s.stl"], "s.stl: the file is a skeleton and its name ends in .ply or .obj"),
        (2, ["-o", "s"], "s: the file is a skeleton"),
        (2, ["-o", "s.ply", "--preview", "s.jpg"], "s.jpg: the picture is a PNG and its name ends in .png"),
        (2, ["--report", "s.pdf"], "s.pdf: the report is a page and its name ends in .html"),
        (2, ["-o", "s.ply", "-o", "./s.ply"], "s.ply: is named twice"),
        (2, ["-o", "SCAN"], "is an input"),
        (1, ["-o", "no/where/s.ply"], "no/where: no such folder"),
        (1, ["-o", "s.ply", "--preview", "no/s.png"], "no: no such folder"),
        (1, ["--report", "no/s.html"], "no: no such folder"),
        (1, ["-o", "/proc/s.ply"], "/proc/s.ply: no file can be made in this folder"),
        (2, ["--tubes", "s.xyz"], "s.xyz: the tubes are a mesh and its name ends in .ply or .obj"),
        (2, ["--labelled", "s.xyz"], "s.xyz: the file is a cloud with labels and its name ends in .ply"),
        (2, ["-o", "s.ply", "--tubes", "s.ply"], "s.ply: is named twice"),
        (2, ["--labelled", "SCAN"], "is an input"),
        (1, ["--tubes", "no/s.ply"], "no: no such folder"),
        (2, ["-o", "s.ply", "--pipeline", "wen2042"], "no pipeline is called 'wen2042': did you mean 'wen2024'?"),
        (2, ["-o", "s.ply", "--set", "Connector.radius=-1"], "Connector.radius = -1.0: must be above 0"),
        (2, ["-o", "s.ply", "--set", "RingSizeRatio.threshold=1"], "RingSizeRatio is not in the pipeline"),
    ],
)
def test_typos_cost_no_run(refused, scans, code, words, message):
    scan = str(scans / "sample.ply")
    before = Path(scan).read_bytes()
    assert message in refused(code, "skeletonize", scan, *(scan if word == "SCAN" else word for word in words))
    assert Path(scan).read_bytes() == before


def test_an_output_that_is_a_folder(invoke, scans, tmp_path):
    (tmp_path / "s.ply").mkdir()
    result = invoke("skeletonize", scans / "sample.ply", "-o", "s.ply")
    assert result.exit_code == 1
    assert result.stderr == "glsk: error: s.ply: is a folder or a device, not a file to write to\n"


@pytest.mark.parametrize(
    ("name", "message"),
    [("none.ply", "no such file"), ("empty.ply", "the file is empty"), (".", "folder"), ("a.txt", "no such")],
)
def test_scans_that_cannot_be_read(refused, scans, name, message):
    assert message in refused(1, "skeletonize", scans / name, "-o", "s.ply")


def test_loops_and_formats_without(invoke, scans, tmp_path):
    words = ("skeletonize", scans / "ring.ply", "-o", "s.swc", "-o", "s.json")
    result = invoke(*words)
    assert result.exit_code == 1
    assert "s.swc: this format holds trees only" in result.stderr
    assert result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["s.json"]  # the run was not for nothing
    assert "wrote s.json\n" in result.stdout
    assert read_skeleton(tmp_path / "s.json").n_loops == 1
    assert invoke(*words, "--cut-loops").exit_code == 0
    assert read_skeleton(tmp_path / "s.swc").n_loops == 0


def test_a_report(invoke, write_scan, scans, tmp_path):
    name = "<b>'&.ply"
    write_scan(tmp_path / name, samples.sample_object(1200).points)
    result = invoke("skeletonize", name, "--report", "r.html")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "wrote r.html\n" in result.stdout
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "<title>&lt;b&gt;&#x27;&amp;.ply</title>" in text
    solves = int(re.search(r"^contraction +converged after (\d+) solves$", result.stdout, re.MULTILINE)[1])
    assert text.count("After solve") == solves > 0


def test_the_end_of_the_contraction_in_a_line(invoke, scans):
    words = ("skeletonize", scans / "sample.ply", "-o", "s.ply", "--set", "Contractor.max_iterations=1")
    result = invoke(*words)
    assert "contraction  not converged after 1 solve: reached max_iterations = 1\n" in result.stdout
    assert not re.search(r"^(iterations|stop reason|converged|sampled) ", result.stdout, re.MULTILINE)
    facts = json.loads(invoke(*words, "--json").stdout)
    assert (facts["iterations"], facts["converged"], facts["stop_reason"]) == (1, False, "reached max_iterations = 1")


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


@pytest.mark.parametrize("ending", ["ply", "pcd"])
def test_a_scan_with_labels_has_all_that_it_had(invoke, las, tmp_path, ending):
    result = invoke("skeletonize", las, "--where", "classification == 5", "--labelled", f"l.{ending}", "-o", "s.npz")
    assert (result.exit_code, result.stderr) == (0, "")
    assert f"wrote l.{ending}\n" in result.stdout
    scan = read_tensor_cloud(tmp_path / las, where="classification == 5")
    skeleton = read_skeleton(tmp_path / "s.npz")
    back = read_tensor_cloud(tmp_path / f"l.{ending}").point
    assert len(skeleton.points) == 1000
    for name in ("positions", "classification", "intensity", "treeID"):
        np.testing.assert_array_equal(back[name].numpy(), scan.point[name].numpy(), err_msg=name)
    assert (back.scan_red.numpy() == 255).all()
    expected = skeleton.annotate(color="branch").point
    for name in ("skeleton_vertex", "branch", "order", "radius", "confidence", "thickness", "colors"):
        np.testing.assert_array_equal(back[name].numpy(), expected[name].numpy(), err_msg=name)


def test_tubes_are_those_of_the_skeleton_and_one_file_does_not_cost_the_others(invoke, las, tmp_path):
    words = ("skeletonize", las, "--where", "z > 122", "-o", "s.npz", "--labelled", "l.ply")
    result = invoke(*words, "--tubes", "t.stl")
    assert result.exit_code == 1
    assert result.stderr.startswith("glsk: error: t.stl: .stl has too few digits for coordinates as large as 5.61e+06")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["l.ply", "ring.las", "s.npz"]
    assert invoke(*words, "--tubes", "t.ply").exit_code == 0
    tubes, skeleton = read_mesh(tmp_path / "t.ply"), read_skeleton(tmp_path / "s.npz")
    np.testing.assert_array_equal(np.asarray(tubes.vertices), np.asarray(skeleton.to_tubes().vertices))
    assert tubes.has_vertex_colors()


def test_settings_reach_the_run(invoke, scans, tmp_path):
    settings = ("Contractor.stop=RingSizeRatio", "RingSizeRatio.threshold=0.2", "Connector.radius=5%")
    words = [word for setting in settings for word in ("--set", setting)]
    assert invoke("skeletonize", scans / "sample.ply", "-o", "s.json", *words).exit_code == 0
    report = read_skeleton(tmp_path / "s.json").report
    assert any("stop=RingSizeRatio(threshold=0.2)" in stage for stage in report.stages)
    assert any("Connector(radius='5%'" in stage for stage in report.stages)


@pytest.mark.parametrize("name", PIPELINES)
def test_every_named_pipeline(invoke, scans, tmp_path, name):
    assert invoke("skeletonize", scans / "sample.ply", "-o", "s.json", "--pipeline", name).exit_code == 0
    report = read_skeleton(tmp_path / "s.json").report
    assert set(report.stages) >= {repr(stage) for stage in PIPELINES[name]().stages}


def test_a_root_makes_one_tree(invoke, scans, tmp_path):
    result = invoke("skeletonize", scans / "ring.ply", "-o", "r.json", "--root", "-x")
    assert result.exit_code == 0, result.stderr
    tree = read_skeleton(tmp_path / "r.json")
    assert (tree.n_loops, tree.n_components) == (0, 1)
    assert tree.vertices[0].tolist() == list(tree.report.root)
    assert tree.vertices[0, 0] == tree.vertices[:, 0].max()
    assert tree.report.recipe["pipeline"][-1]["root"] == "-x"


def test_the_help_names_every_pipeline():
    assert all(name in PipelineName.__metadata__[0].help for name in PIPELINES)


def test_warnings_are_lines(invoke, scans):
    result = invoke("skeletonize", scans / "ball.ply", "-o", "s.ply")
    assert result.exit_code == 0
    lines = result.stderr.splitlines()
    assert all(line.startswith("glsk: warning: ") for line in lines)
    assert len(set(lines)) == len(lines) > 0
    assert any("sphere-like" in line for line in lines)


def test_quiet(invoke, scans, tmp_path):
    result = invoke("skeletonize", scans / "ball.ply", "-o", "s.ply", "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "s.ply").is_file()


def test_verbose(invoke, scans):
    level = logging.getLogger("glsk_o3d").level
    result = invoke("skeletonize", scans / "sample.ply", "-o", "s.ply", "--verbose")
    assert "glsk: Connector took" in result.stderr
    assert "glsk: solve 1: 1100 points" in result.stderr
    assert "ring" in result.stderr
    assert "merged" not in result.stdout
    assert logging.getLogger("glsk_o3d").level == level
    assert not logging.getLogger("glsk_o3d").handlers


def test_verbose_shows_where_an_error_comes_from(invoke, scans):
    result = invoke("skeletonize", scans / "nan.ply", "-o", "s.ply", "--verbose")
    assert result.exit_code == 1
    assert "Traceback" in result.stderr
    assert result.stderr.splitlines()[-1].startswith(f"glsk: error: {scans / 'nan.ply'}: 2 of 1000 points")


def test_json_is_all_there_is_on_stdout(invoke, scans):
    result = invoke("skeletonize", scans / "ball.ply", "-o", "s.ply", "--json")
    facts = json.loads(result.stdout)
    assert facts["points"] == 1000
    assert facts["files"] == ["s.ply"]
    assert len(facts["warnings"]) == result.stderr.count("glsk: warning: ")
    assert facts["components"] - facts["vertices"] + facts["edges"] == facts["loops"]
    assert {"loops_closed", "cuts", "bridges", "uncertain"} <= set(facts)


def test_names_are_printed_as_they_are(invoke, scans):
    name = "[red]s :smile: 'x'.ply"
    assert f"wrote {name}\n" in invoke("skeletonize", scans / "sample.ply", "-o", name).stdout


def test_demo_refuses(refused, invoke, tmp_path):
    assert "there are default" in refused(2, "demo", "--pipeline", "best")
    (tmp_path / "file").touch()
    result = invoke("demo", "-o", "file")
    assert (result.exit_code, result.stderr) == (1, "glsk: error: file: is a file, not a folder\n")
    assert invoke("demo", "--points", "0").exit_code == 2


needs_bytes = pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="file names are Unicode there")


@needs_bytes
def test_a_name_that_is_no_unicode(invoke, scans, tmp_path):
    scan = tmp_path / os.fsdecode(b"bad\xff\xfename.ply")
    scan.write_bytes((scans / "ring.ply").read_bytes())
    result = invoke("skeletonize", scan, "-o", "s.json", "--preview", "s.png", "--report", "s.html")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "<title>bad??name.ply</title>" in (tmp_path / "s.html").read_text("utf-8")
    assert (tmp_path / "s.png").stat().st_size > 1000


def test_a_writer_that_breaks_does_not_keep_the_others_from_it(invoke, scans, tmp_path, monkeypatch):
    monkeypatch.setattr("glsk_o3d.save_preview", lambda *_, **__: 1 / 0)
    result = invoke("skeletonize", scans / "ring.ply", "--preview", "s.png", "--report", "s.html")
    assert result.exit_code == 1
    assert result.stderr == "glsk: error: s.png: cannot be written: ZeroDivisionError: division by zero\n"
    assert [path.name for path in tmp_path.iterdir()] == ["s.html"]


def test_a_large_scan_is_read_in_blocks(invoke, tmp_path, monkeypatch):
    import open3d as o3d

    from glsk_o3d import save_tensor_cloud
    from glsk_o3d.io import streaming
    from glsk_o3d.io.clouds import blocks

    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(samples.torus(120000).points))
    save_tensor_cloud(cloud, tmp_path / "scan.ply")
    monkeypatch.setitem(blocks.read_blocks.__kwdefaults__, "rows", 30000)
    whole = invoke("skeletonize", tmp_path / "scan.ply", "-o", "whole.json")
    assert whole.stderr == ""
    monkeypatch.setattr(streaming, "LARGE_CLOUD", 100000)
    result = invoke("skeletonize", tmp_path / "scan.ply", "-o", "s.json", "--labelled", "l.ply", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert (facts["points"], facts["loops"]) == (120000, 1)
    assert f"read in blocks: the skeleton is that of a sample of {facts['sampled']} of 120000 points" in result.stderr
    np.testing.assert_allclose(read_skeleton("s.json").vertices, read_skeleton("whole.json").vertices, atol=1e-9)
    assert len(read_tensor_cloud("l.ply").point.branch) == 120000
    again = invoke("rerun", "s.json", "--json")
    assert "it holds a sample of a large cloud, and not how many points each stands for: give the scan" in again.stderr
    assert json.loads(invoke("rerun", "s.json", tmp_path / "scan.ply", "--json").stdout)["identical"]
    few = invoke("skeletonize", tmp_path / "scan.ply", "-o", "s.json", "--stream", "--where", "x > 0.2")
    assert re.search(r"scan\.ply: read in blocks: all \d+ points are taken\n", few.stderr)
    assert invoke("skeletonize", tmp_path / "scan.ply", "-o", "s.json", "--quiet").stderr == ""
    assert invoke("skeletonize", tmp_path / "scan.ply", "-o", "s.json", "--no-stream").stderr == ""


def test_labels_do_not_change_the_skeleton(invoke, tmp_path):
    import open3d as o3d

    from glsk_o3d import save_tensor_cloud

    points = samples.torus(1000).points
    points[[3, 8], 0] = np.nan
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    cloud.point.sample_count = o3d.core.Tensor((1 + np.arange(1000) % 7)[:, None].astype(np.int32))
    save_tensor_cloud(cloud, tmp_path / "scan.ply")
    words = ("skeletonize", tmp_path / "scan.ply", "--drop-invalid")
    assert invoke(*words, "-o", "a.json").exit_code == 0
    assert invoke(*words, "-o", "b.json", "--labelled", "l.npz", "--tubes", "t.stl").exit_code == 0
    a, b = read_skeleton("a.json"), read_skeleton("b.json")
    assert a.report.n_input == b.report.n_input == 1000
    np.testing.assert_array_equal(a.vertices, b.vertices)
    with np.load("l.npz") as labels:
        np.testing.assert_array_equal(labels["sample_count"], cloud.point.sample_count.numpy())
        np.testing.assert_array_equal(labels["skeleton_vertex"][:, 0], a.vertex_of_point)
        assert np.flatnonzero(labels["branch"] < 0).tolist() == [3, 8]


def test_a_sample_that_cannot_be_taken(refused, scans):
    words = ("skeletonize", scans / "sample.ply", "--stream", "-o", "s.json")
    assert "this pipeline takes all points of a cloud" in refused(2, *words, "--pipeline", "wen2024")
    assert "--stream writes a cloud with labels as .ply alone" in refused(2, *words, "--labelled", "l.npz")


def test_a_close_call_comes_with_the_option_that_answers_otherwise():
    call = Judgement("gap", (1.0, 2.0, 3.0), 0.42, changed=False)
    told = "the object goes on across the gap at (1, 2, 3): 0.42, gap left; if that is wrong: --set Refiner.bridge=0.41"
    assert module._close_call(call) == told


def test_support_is_told_and_shown(invoke, scans, tmp_path):
    result = invoke("skeletonize", scans / "ring.ply", "-o", "r.json", "--report", "r.html", "--support", "2")
    assert result.exit_code == 0
    assert re.search(r"^samples +2 of 2 have the same graph$", result.stdout, re.M)
    skeleton = read_skeleton(tmp_path / "r.json")
    assert (skeleton.support.min(), skeleton.report.n_agreeing) == (1, 2)
    assert "2 of 2 samples of the cloud have the same graph" in (tmp_path / "r.html").read_text()
    told = json.loads(invoke("skeletonize", scans / "ring.ply", "-o", "s.json", "--support", "2", "--json").stdout)
    assert (told["samples"], told["agreeing"], told["unsupported"]) == (2, 2, [])
    told = json.loads(invoke("skeletonize", scans / "ring.ply", "-o", "t.json", "--json").stdout)
    assert not {"samples", "agreeing", "unsupported"} & told.keys()
    assert invoke("skeletonize", scans / "ring.ply", "-o", "u.json", "--support", "1").exit_code == 2
