"""`glsk crosscheck`: whether a scan is dense and clean enough."""

import json
import os

import numpy as np
import pytest

from glsk_o3d import read_tensor_cloud
from glsk_o3d.crosscheck import cross_check
from glsk_o3d.samples import torus


@pytest.fixture(scope="module")
def check():
    return cross_check(torus(1000).points)


def test_what_it_says_and_writes(invoke, scans, tmp_path, check):
    scan = tmp_path / os.fsdecode(b"bad\xffname.ply")
    scan.write_bytes((scans / "ring.ply").read_bytes())
    told = json.loads(invoke("crosscheck", scan, "--json").stdout)
    run = invoke("crosscheck", scan, "--labelled", "marked.ply")
    assert (run.exit_code, run.stderr) == (0, "")
    assert told.pop("scan").endswith("/bad?name.ply")
    assert told == json.loads(json.dumps(check.to_dict())) | {"files": []}
    first, *lines = run.stdout.splitlines()
    assert first.endswith("name.ply: agrees")
    words = " ".join(run.stdout.split())
    assert f"compared {check.rows.compared}, " in words
    assert "loops 1 1" in words
    assert "which is as of clean, dense clouds;" in words
    assert lines[-1] == "wrote marked.ply"
    marked = read_tensor_cloud(tmp_path / "marked.ply")
    np.testing.assert_array_equal(marked.point.angle.numpy()[:, 0], check.angle)
    assert "colors" in marked.point


def test_a_mesh_at_fault_is_not_held_against_the_cloud(invoke, tmp_path, write_scan):
    write_scan(tmp_path / "ring.ply", torus(1024, noise=0.08).points)
    result = invoke("crosscheck", "ring.ply", "--json")
    told = json.loads(result.stdout)
    assert (told["verdict"], result.exit_code) == ("cannot tell", 1)
    assert told["rows"]["covered"] < 0.7
    assert "glsk: error: ring.ply: the check says nothing about the skeleton: the mesh" in result.stderr


def test_points_that_are_not_finite(invoke, scans):
    told = json.loads(invoke("crosscheck", scans / "nan.ply", "--drop-invalid", "--json").stdout)
    assert told["points"]["given"] == told["points"]["used"] == 1000
