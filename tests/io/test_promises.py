"""Files that promise what they do not hold, unfold to more than memory, or name others: all are refused."""

import os

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io import scans
from glsk_o3d.io.scans import read_mesh, read_scan

POINTS = np.random.default_rng(0).normal(size=(400, 3)).round(3)


@pytest.mark.parametrize("name", ["c.ply", "c.pcd"])
def test_numbers_that_text_cuts(tmp_path, name):
    path = tmp_path / name
    o3d.io.write_point_cloud(str(path), o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS)), write_ascii=True)
    whole = path.read_bytes().rstrip(b"\n")
    for cut in (1, 2):
        path.write_bytes(whole[:-cut])
        with pytest.raises(FileFormatError, match=rf"{name}.* cut inside a number: end it with a line break"):
            read_scan(path)
    path.write_bytes(whole + b"\n")
    assert len(read_scan(path)) == 400


def test_a_vertex_too_many_does_not_take_the_bytes_of_a_face(tmp_path):
    o3d.io.write_triangle_mesh(str(tmp_path / "m.ply"), o3d.geometry.TriangleMesh.create_torus(1, 0.3, 6, 5))
    whole = (tmp_path / "m.ply").read_bytes()
    for n in (29, 31, 35):
        (tmp_path / "m.ply").write_bytes(whole.replace(b"vertex 30", b"vertex %d" % n))
        with pytest.raises(FileFormatError, match=r"m\.ply"):
            read_mesh(tmp_path / "m.ply")


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("c.xyz", b"1 " * 3000 + b"\n", "a line has 3000 numbers"),
        ("c.e57", b"ASTM-E57" + bytes(32) + (1024).to_bytes(8, "little") + bytes(3000), "not a valid"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_no_scanner_writes(tmp_path, name, data, says):
    if name == "c.e57":
        pytest.importorskip("pye57")
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileFormatError, match=says) as caught:
        read_scan(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("keyword", ["mtllib", "mt\\\nllib"])
@pytest.mark.parametrize("other", ["pipe", "/dev/zero", "none", "given.mtl"])
def test_looks_are_not_read(tmp_path, keyword, other):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "given.mtl").write_text("newmtl a\nmap_Kd pipe\n")
    (tmp_path / "m.obj").write_text(f"{keyword} {other}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    assert len(read_scan(tmp_path / "m.obj")) == 3


def test_errors_of_the_system_name_the_file(tmp_path, monkeypatch):
    (tmp_path / "c.xyz").write_text("1 2 3\n")

    def full(*_):
        raise OSError(27, "File too large")

    monkeypatch.setitem(scans._SCAN_READERS, ".xyz", full)
    with pytest.raises(OSError, match=r"\[Errno 27\] .*c\.xyz"):
        read_scan(tmp_path / "c.xyz")
