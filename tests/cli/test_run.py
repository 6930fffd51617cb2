"""What `glsk run` runs, refuses and says."""

import json
import sys

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import read_cloud, read_skeleton
from glsk_o3d.interop.meshlab.plan import scripts

OURS = '<FilterScript>\n<filter name="{}">\n{}\n</filter>\n</FilterScript>\n'


@pytest.fixture
def script(tmp_path):
    """Write a script of one filter."""

    def write(name, *params):
        (tmp_path / "s.mlx").write_text(OURS.format(name, "\n".join(params)))
        return "s.mlx"

    return write


def test_a_script_of_ours_is_the_pipeline(invoke, scans, script, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    scan = scans / "sample.ply"
    name = script(
        "Generate Curve Skeleton (GLSkeleton)", '<Param type="RichAbsPerc" name="connector_radius" value="2%"/>'
    )
    result = invoke("run", name, scan, "-o", "s.json", "-o", "s.ply")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("1. Generate Curve Skeleton (GLSkeleton): layer 1, vertices ")
    assert result.stdout.endswith("wrote s.json\nwrote s.ply\n")
    contractor = glsk_o3d.Contractor(reducer=glsk_o3d.LPRReducer())
    pipeline = glsk_o3d.RingBuilder() | contractor | glsk_o3d.Connector(radius="2%") | glsk_o3d.Refiner()
    expected = pipeline(read_cloud(scan))
    back = read_skeleton(tmp_path / "s.json")
    np.testing.assert_array_equal(back.vertices, expected.vertices)
    assert back.report.stages == expected.report.stages
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.ply").edges, expected.edges)


@pytest.mark.parametrize("name", ["glskeleton", "cao2010"])
def test_the_scripts_of_ours_by_name(invoke, scans, tmp_path, name, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    assert invoke("run", name, scans / "sample.ply", "-o", "s.json", "-q").exit_code == 0
    pipeline = "default" if name == "glskeleton" else name
    expected = glsk_o3d.skeletonize(read_cloud(scans / "sample.ply"), pipeline)
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.json").vertices, expected.vertices)


def test_a_mixed_script_is_what_meshset_does(invoke, scans, tmp_path):
    pytest.importorskip("pymeshlab")
    result = invoke("run", "scan_cleanup_then_skeleton", scans / "sample.ply", "-o", "s.json", "--json")
    assert result.exit_code == 0, result.stderr
    told = json.loads(result.stdout)
    assert [step["filter"] for step in told["steps"]][1:] == [
        "Select Outliers",
        "Delete Selected Vertices",
        "Generate Curve Skeleton (GLSkeleton)",
    ]
    meshes = glsk_o3d.MeshSet()
    meshes.load_new_mesh(str(scans / "sample.ply"))
    meshes.load_filter_script(scripts()["scan_cleanup_then_skeleton"])
    meshes.apply_filter_script()
    back, expected = read_skeleton(tmp_path / "s.json"), meshes.current_skeleton()
    np.testing.assert_array_equal(back.vertices, expected.vertices)
    np.testing.assert_array_equal(back.edges, expected.edges)
    assert told["steps"][-1]["result"]["vertices"] == len(expected.vertices)
    assert len(back.points) < 1000


def test_the_cross_check_measures_and_writes_nothing(invoke, scans, tmp_path):
    pytest.importorskip("pymeshlab")
    result = invoke("run", "mesh_crosscheck", scans / "ring.ply", "--json")
    assert result.exit_code == 0, result.stderr
    steps = json.loads(result.stdout)["steps"]
    assert [steps[i]["result"]["loops"] for i in (2, 3)] == [1, 1]
    diagonal = np.linalg.norm([1.0, 1.0, 0.2])
    assert all(0 < step["result"]["mean"] < 0.03 * diagonal for step in steps[4:])
    assert not list(tmp_path.iterdir())


def test_points_are_written_with_labels_and_colours(invoke, scans, script, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    name = script("Generate Segmented Cloud (GLSkeleton)")
    for ending in ("ply", "pcd", "xyz"):
        result = invoke("run", name, scans / "sample.ply", "-o", f"c.{ending}", "-q")
        assert result.exit_code == 0, result.stderr
        back = read_cloud(tmp_path / f"c.{ending}")
        original = np.asarray(read_cloud(scans / "sample.ply").points)
        np.testing.assert_allclose(np.asarray(back.points), original, rtol=1e-6 if ending == "pcd" else 1e-15)
    o3d = pytest.importorskip("open3d")
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "c.ply"))
    labels, colours = cloud.point.quality.numpy().ravel(), cloud.point.colors.numpy()
    assert len(np.unique(labels)) == len(np.unique(np.column_stack([labels, colours]), axis=0)) > 1


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ["run"], "a SCRIPT and a SCAN are needed"),
        (2, ["run", "glskeleton", "SCAN"], "nothing to write"),
        (2, ["run", "glskeletn", "SCAN", "-o", "s.ply"], "no filter script is called 'glskeletn': did you mean"),
        (1, ["run", "none.mlx", "SCAN", "-o", "s.ply"], "none.mlx: no such file"),
        (1, ["run", "bad.mlx", "SCAN", "-o", "s.ply"], "bad.mlx, line 2: no filter is called 'Generate Skeletn'"),
        (2, ["run", "glskeleton", "SCAN", "-o", "s.stl"], "s.stl: unknown ending; known are .ply"),
        (2, ["run", "points.mlx", "SCAN", "-o", "s.json"], "s.json: unknown ending for points; known are .ply, .pcd"),
        (2, ["run", "glskeleton", "SCAN", "-o", "SCAN"], "is the scan itself"),
        (1, ["run", "glskeleton", "SCAN", "-o", "no/s.ply"], "no: no such folder"),
        (1, ["run", "glskeleton", "nowhere.ply", "-o", "s.ply"], "nowhere.ply: no such file"),
    ],
)
def test_mistakes_cost_no_run(refused, scans, tmp_path, monkeypatch, code, words, message):
    def run(self, data, on_iteration):
        pytest.fail("computed before everything was checked")

    monkeypatch.setattr(glsk_o3d.RingBuilder, "_run", run)
    (tmp_path / "bad.mlx").write_text('<FilterScript>\n<filter name="Generate Skeletn"/></FilterScript>')
    (tmp_path / "points.mlx").write_text(OURS.format("Generate One Rings (GLSkeleton)", ""))
    scan = str(scans / "sample.ply")
    assert message in refused(code, *(scan if word == "SCAN" else word for word in words))


def test_scans_that_meshlab_cannot_read(refused, tmp_path, scans):
    pytest.importorskip("pymeshlab")
    (tmp_path / "torn.ply").write_bytes((scans / "sample.ply").read_bytes()[:2000])
    (tmp_path / "odd.obj").write_text("nothing")
    assert "torn.ply: promises 1000 points" in refused(1, "run", "scan_cleanup", "torn.ply", "-o", "c.ply")
    assert "odd.obj: " in refused(1, "run", "scan_cleanup", "odd.obj", "-o", "c.ply")
    assert "a.zzz: " in refused(1, "run", "scan_cleanup", "a.zzz", "-o", "c.ply")


def test_the_list_says_what_each_script_does(invoke):
    result = invoke("run", "--list", "--json")
    assert result.exit_code == 0
    told = {each["name"]: each["doc"] for each in json.loads(result.stdout)}
    assert set(told) == set(scripts()) >= {"glskeleton", "cao2010", "scan_cleanup", "scan_cleanup_then_skeleton"}
    assert all(len(doc) > 40 for doc in told.values())
    assert "scan_cleanup" in invoke("run", "--list").stdout
