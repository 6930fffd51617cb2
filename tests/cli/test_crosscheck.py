"""`glsk crosscheck`: whether another way to the skeleton of a scan gives the same."""

import json
import os

import numpy as np
import open3d as o3d

from glsk_o3d import read_tensor_cloud
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.samples import torus


def test_output_and_files(invoke, scans, tmp_path):
    check = cross_check(torus(1000).points)
    scan = tmp_path / os.fsdecode(b"bad\xffname.ply")
    scan.write_bytes((scans / "ring.ply").read_bytes())
    facts = json.loads(invoke("crosscheck", scan, "--json").stdout)
    files = ("--labelled", "marked.ply", "--preview", "both.png", "--report", "page.html")
    run = invoke("crosscheck", scan, *files)
    assert (run.exit_code, run.stderr) == (0, "")
    assert facts.pop("scan").endswith("/bad?name.ply")
    assert facts == json.loads(json.dumps(check.to_dict())) | {"files": []}
    first, *lines = run.stdout.splitlines()
    assert first.endswith("name.ply: agrees")
    assert "loops 1 and 1" in " ".join(run.stdout.split())
    assert "eigenvalues" not in run.stdout  # which JSON has
    assert lines[-3:] == ["wrote marked.ply", "wrote both.png", "wrote page.html"]
    marked = read_tensor_cloud(tmp_path / "marked.ply")
    np.testing.assert_array_equal(marked.point.angle.numpy()[:, 0], check.angle)
    assert "colors" in marked.point
    assert "<tr><td>verdict</td><td>agrees</td></tr>" in (tmp_path / "page.html").read_text("utf-8")


def test_a_mesh_of_the_users(invoke, scans, tmp_path):
    mesh = o3d.geometry.TriangleMesh.create_torus(0.4, 0.1, 60, 30)
    o3d.io.write_triangle_mesh(str(tmp_path / "mesh.ply"), mesh)
    facts = json.loads(invoke("crosscheck", scans / "ring.ply", "--mesh", "mesh.ply", "--json").stdout)
    assert (facts["verdict"], facts["mesh"]["made_by"], facts["mesh"]["genus"]) == ("agrees", "given", 1)
    result = invoke("crosscheck", scans / "ring.ply", "--mesh", scans / "ring.ply")
    assert result.exit_code == 1
    assert "no triangles could be read" in result.stderr


def test_another_verdict_is_no_error_and_points_may_be_dropped(invoke, scans, tmp_path, write_scan):
    write_scan(tmp_path / "ring.ply", torus(1024, noise=0.08).points)
    result = invoke("crosscheck", "ring.ply", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["verdict"] != "agrees"
    facts = json.loads(invoke("crosscheck", scans / "nan.ply", "--drop-invalid", "--json").stdout)
    assert facts["points"]["given"] == 1000
