"""`glsk crosscheck`: whether a scan is dense and clean enough."""

import json
import os

import numpy as np
import open3d as o3d
import pytest
from matplotlib.image import imread

from glsk_o3d.crosscheck import cross_check
from glsk_o3d.samples import torus


@pytest.fixture(scope="module")
def check():
    return cross_check(torus(1000).points)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory, check):
    """Meshes of the ring and of a part of it."""
    folder = tmp_path_factory.mktemp("meshes")
    corners = o3d.utility.Vector3dVector(check.vertices)
    part = np.abs(check.vertices[check.faces[:, 0], 0]) > 0.2
    for name, faces in (("ring.ply", check.faces), ("ring.off", check.faces), ("half.ply", check.faces[part])):
        mesh = o3d.geometry.TriangleMesh(corners, o3d.utility.Vector3iVector(faces))
        o3d.io.write_triangle_mesh(str(folder / name), mesh)
    return folder


def test_what_it_says_and_writes(invoke, scans, tmp_path, check):
    scan = tmp_path / os.fsdecode(b"bad\xffname.ply")
    scan.write_bytes((scans / "ring.ply").read_bytes())
    run = invoke("crosscheck", scan, "-o", "r.json", "--picture", "p.png")
    assert (run.exit_code, run.stderr) == (0, "")
    told = json.loads((tmp_path / "r.json").read_text())
    assert told.pop("scan").endswith("/bad?name.ply")
    assert told.pop("given_mesh") is None
    assert told == json.loads(json.dumps(check.to_dict()))
    first, *lines = run.stdout.splitlines()
    assert first.endswith("name.ply: agrees")
    words = " ".join(run.stdout.split())
    assert f"compared {check.rows.compared}, " in words
    assert "loops 1 1" in words
    assert "which is as of clean, dense clouds;" in words
    assert lines[-2:] == ["wrote r.json", "wrote p.png"]
    assert imread(tmp_path / "p.png").shape[:2] == (860, 1800)


def test_a_mesh_of_the_users_and_its_own(invoke, scans, meshes, check):
    result = invoke("crosscheck", scans / "ring.ply", "--mesh", meshes / "ring.ply", "--json", "--quiet")
    told = json.loads(result.stdout)
    assert (told["verdict"], told["surface"], told["files"]) == ("agrees", "given", [])
    assert told["given_mesh"] == str(meshes / "ring.ply")
    assert told["rows"]["same_rings"] == pytest.approx(check.rows.same_rings)
    told = json.loads(invoke("crosscheck", meshes / "ring.off", "--mesh", meshes / "ring.off", "--json").stdout)
    assert told["rows"]["one_to_one"]  # its own triangles


def test_a_mesh_at_fault_is_not_held_against_the_cloud(invoke, scans, meshes, tmp_path, write_scan):
    write_scan(tmp_path / "ring.ply", torus(1024, noise=0.08).points)
    result = invoke("crosscheck", "ring.ply", "-o", "r.json", "--json")
    assert json.loads(result.stdout)["verdict"] == "cannot tell"
    assert result.exit_code == 1
    assert "glsk: error: ring.ply: the check says nothing about the skeleton: the mesh does not" in result.stderr
    assert result.stderr.endswith("give a mesh of its surface with --mesh\n")
    assert json.loads((tmp_path / "r.json").read_text())["verdict"] == "cannot tell"
    result = invoke("crosscheck", scans / "ring.ply", "--mesh", meshes / "half.ply")
    assert result.stderr.endswith("; give another mesh\n")
    assert "because" in result.stdout


def test_points_that_are_not_finite(invoke, scans):
    told = json.loads(invoke("crosscheck", scans / "nan.ply", "--drop-invalid", "--json").stdout)
    assert told["points"]["given"] == told["points"]["used"] == 1000
