"""`glsk crosscheck`: whether a scan is dense and clean enough."""

import json
import os
import sys

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.crosscheck import cross_check
from glsk_o3d.samples import torus

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.image import imread  # noqa: E402


@pytest.fixture(scope="module")
def check():
    return cross_check(torus(1000).points)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory, check):
    """Meshes of the ring and of something else, and one without triangles."""
    folder = tmp_path_factory.mktemp("meshes")
    corners, triangles = o3d.utility.Vector3dVector(check.vertices), o3d.utility.Vector3iVector(check.faces)
    mesh = o3d.geometry.TriangleMesh(corners, triangles)
    o3d.io.write_triangle_mesh(str(folder / "ring.ply"), mesh)
    o3d.io.write_triangle_mesh(str(folder / "ring.off"), mesh)
    o3d.io.write_triangle_mesh(str(folder / "away.ply"), mesh.translate((50, 0, 0)))
    o3d.io.write_triangle_mesh(
        str(folder / "bare.ply"), o3d.geometry.TriangleMesh(corners, o3d.utility.Vector3iVector())
    )
    return folder


def test_what_it_says_and_writes(glsk, scans, tmp_path, check):
    run = glsk("crosscheck", scans / "ring.ply", "-o", "r.json", "--picture", "p.png")
    assert (run.returncode, run.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["p.png", "r.json"]
    told = json.loads((tmp_path / "r.json").read_text())
    assert told.pop("scan") == str(scans / "ring.ply")
    assert told.pop("given_mesh") is None
    assert told == json.loads(json.dumps(check.to_dict()))
    first, *lines = run.stdout.splitlines()
    assert first == f"{scans / 'ring.ply'}: agrees"
    words = " ".join(run.stdout.split())
    assert f"rings compared {check.rows.compared} of {check.rows.closed} closed ones" in words
    assert "loops 1 and 1" in words
    assert "because" not in words
    assert "which is as of clean, dense clouds;" in words
    assert lines[-2:] == ["wrote r.json", "wrote p.png"]
    assert imread(tmp_path / "p.png").shape[:2] == (860, 1800)


def test_json_on_stdout_and_quiet(invoke, scans, tmp_path):
    result = invoke("crosscheck", scans / "ring.ply", "--json", "--quiet")
    told = json.loads(result.stdout)
    assert (told["verdict"], told["files"]) == ("agrees", [])
    assert (invoke("crosscheck", scans / "ring.ply", "--quiet").output, list(tmp_path.iterdir())) == ("", [])


@pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="file names are Unicode there")
def test_a_name_that_is_no_unicode(invoke, scans, tmp_path):
    scan = tmp_path / os.fsdecode(b"bad\xff\xfename.ply")
    scan.write_bytes((scans / "ring.ply").read_bytes())
    result = invoke("crosscheck", scan, "-o", "r.json", "--picture", "p.png")
    assert (result.exit_code, result.stderr) == (0, "")
    assert json.loads((tmp_path / "r.json").read_text("utf-8"))["scan"].endswith("/bad??name.ply")
    assert imread(tmp_path / "p.png").shape[:2] == (860, 1800)


@pytest.mark.parametrize("mesh", ["ring.ply", "ring.off"])
def test_a_mesh_of_the_users(invoke, scans, meshes, check, mesh):
    told = json.loads(invoke("crosscheck", scans / "ring.ply", "--mesh", meshes / mesh, "--json").stdout)
    assert told["surface"] == "given"
    assert told["given_mesh"] == str(meshes / mesh)
    assert told["rows"]["one_to_one"]
    assert told["rows"]["same_rings"] == pytest.approx(check.rows.same_rings)


def test_reasons_and_warnings(invoke, scans):
    result = invoke("crosscheck", scans / "ball.ply", "--method", "poisson", "--max-points", "500")
    assert result.exit_code == 0
    assert "glsk: warning: 500 of 1000 points are checked: raise max_points to use more" in result.stderr
    assert "because" in result.stdout
    assert "mesh poisson, " in " ".join(result.stdout.split())
    assert "same rings" not in result.stdout


def test_a_mesh_at_fault_is_not_held_against_the_cloud(invoke, write_scan, tmp_path):
    write_scan(tmp_path / "ring.ply", torus(1024, noise=0.08).points)
    result = invoke("crosscheck", "ring.ply", "-o", "r.json", "--json")
    assert json.loads(result.stdout)["verdict"] == "cannot tell"
    assert result.exit_code == 1
    assert "glsk: error: ring.ply: the check says nothing about the skeleton: the mesh does not" in result.stderr
    assert result.stderr.endswith("give a mesh of its surface with --mesh, or another --method\n")
    told = json.loads((tmp_path / "r.json").read_text())
    assert told["mesh"]["far"] > told["thresholds"]["far_or_open"]


def test_points_that_are_not_finite(invoke, refused, scans):
    assert "nan.ply: 2 of 1000 points" in refused(1, "crosscheck", scans / "nan.ply")
    told = json.loads(invoke("crosscheck", scans / "nan.ply", "--drop-invalid", "--json").stdout)
    assert told["points"]["given"] == told["points"]["used"] == 1000


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (1, ["no.ply"], "no.ply: no such file"),
        (1, ["empty.ply"], "the file is empty"),
        (1, ["ring.ply", "--mesh", "no.ply"], "no.ply: no such file"),
        (1, ["ring.ply", "--mesh", "no.xyz"], "unknown ending of a mesh"),
        (1, ["ring.ply", "--mesh", "bare.ply"], "bare.ply: no triangles could be read"),
        (1, ["ring.ply", "--mesh", "away.ply"], "ring.ply: no point of the cloud lies on the mesh"),
        (2, ["ring.ply", "--mesh", "ring.off", "--method", "poisson"], "--mesh gives a mesh"),
        (2, ["ring.ply", "--method", "alpha"], "mesh = 'alpha': must be 'auto', 'ball_pivoting', 'poisson'"),
        (2, ["ring.ply", "--max-points", "5"], "max_points = 5: must be None or a whole number of at least"),
        (2, ["ring.ply", "--pipeline", "no"], "no pipeline is called 'no'"),
        (2, ["ring.ply", "-o", "r.txt"], "r.txt: the report is JSON"),
        (2, ["ring.ply", "--picture", "p.jpg"], "p.jpg: the picture is a PNG"),
        (1, ["ring.ply", "-o", "no/r.json"], "no: no such folder"),
    ],
)
def test_refusals(refused, scans, meshes, code, words, message):
    first, *others = words
    places = [meshes / word if (meshes / word).exists() else word for word in others]
    assert message in refused(code, "crosscheck", scans / first, *places)


def test_the_input_is_not_overwritten(refused, tmp_path_factory, scans):
    scan = tmp_path_factory.mktemp("input") / "scan.json"
    scan.write_bytes((scans / "ring.ply").read_bytes())
    assert "is an input" in refused(2, "crosscheck", scan, "-o", scan)


def test_the_scan_may_be_a_mesh_too(invoke, meshes):
    told = json.loads(
        invoke("crosscheck", meshes / "ring.off", "--mesh", meshes / "ring.off", "--json").stdout
    )  # its own triangles
    assert told["rows"]["one_to_one"]
    assert np.isclose(told["rows"]["angle"]["median"], 0, atol=1)


def test_a_users_mesh_at_fault(invoke, scans, check, tmp_path):
    faces = o3d.utility.Vector3iVector(check.faces[np.abs(check.vertices[check.faces[:, 0], 0]) > 0.2])
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(check.vertices), faces)
    o3d.io.write_triangle_mesh(str(tmp_path / "half.ply"), mesh)
    result = invoke("crosscheck", scans / "ring.ply", "--mesh", "half.ply")
    assert result.exit_code == 1
    assert "ring.ply: cannot tell" in result.stdout
    assert result.stderr.rstrip().endswith("; give another mesh")
