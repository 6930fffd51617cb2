"""Damaged scans: files that promise what they do not hold, make no sense, or name others; each has one clear error."""

import os

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_mesh, read_scan

POINTS = np.random.default_rng(0).normal(size=(400, 3)).round(3)
XYZ = "property float x\nproperty float y\nproperty float z\n"
FACES = "property list uchar int vertex_indices\n"
PLY_FORMAT = "ply\nformat binary_little_endian 1.0\n"
PLY = {  # the elements of a header, and what the error names
    "element vertex 2\nproperty float x\nproperty float x\nproperty float y\n": "two properties of one name",
    "element vertex 2\nproperty float x\nproperty float y\n": "no x, y and z",
    "element vertex 2\nproperty list float int x\n": "header",
    "element vertex 2\n": "properties",
    f"element vertex 1\n{XYZ}element face 40\n{FACES}": "40 rows of 'face'",
    f"element vertex 0\n{XYZ}": "no points",
    f"element face 1\n{FACES}": "no element 'vertex'",
    "comment \n" * 9999: "does not end",
    "comment " + "x" * 100_000 + "\n": "header",
}
PCD = "FIELDS x y z rgb _\nSIZE 4 4 8 4 1\nTYPE F F F F U\nCOUNT 1 1 1 1 3\nPOINTS 2\nDATA binary\n"
PCD_CHANGES = [
    ("DATA binary", "DATA zipped", "'zipped'"),
    ("TYPE F F F F", "TYPE F F F X", "types"),
    ("SIZE 4 4 8", "SIZE 4 4 3", "types"),
    ("COUNT 1 1", "COUNT 0 1", "negative"),
    ("POINTS 2", "POINTS -5", "negative"),
    ("POINTS 2", "POINTS 99999999999", "promises 99999999999"),
    ("DATA", "DATUM", "no DATA"),
    ("1 3\nPOINTS 2\nDATA binary", "1 200000000\nPOINTS 1\nDATA ascii", "promises 1 points and holds 0"),
    ("FIELDS x y", "FIELDS x w", "no x, y and z"),
    ("POINTS 2", "POINTS 3", "promises 3 points and holds 2"),
    ("COUNT 1 1 1 1", "COUNT 1 1 1", ""),
]
CUBE = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
CASES = [
    *(("c.ply", f"{PLY_FORMAT}{head}end_header\n" + "\1" * 64, noun) for head, noun in PLY.items()),
    *(("c.pcd", PCD.replace(old, new) + "\0" * 2 * 23, noun) for old, new, noun in PCD_CHANGES),
    *(("m.obj", f"{CUBE}f 1 2 3\n{face}\n", "") for face in ("f 1 2 9", "f 1 2 -9", "f 0 1 2", "f", "f 1 2 x")),
    ("c.xyz", "1 " * 3000 + "\n", "3000 numbers"),
    ("c.e57", "ASTM-E57" + "\0" * 33 + "\4" + "\0" * 3006, "not a valid"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "noun"), CASES, ids=[f"{case[0]} {case[2]}" for case in CASES])
def test_files_that_make_no_sense_have_one_clear_error(tmp_path, name, text, noun):
    if name == "c.e57":
        pytest.importorskip("pye57")
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    with pytest.raises(FileFormatError, match=f"{name}.*{noun}") as caught:
        read_scan(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["c.ply", "c.pcd"])
def test_numbers_that_text_cuts(tmp_path, name):
    path = tmp_path / name
    o3d.io.write_point_cloud(str(path), o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS)), write_ascii=True)
    whole = path.read_bytes().rstrip(b"\n")
    for cut in (1, 2):
        path.write_bytes(whole[:-cut])
        with pytest.raises(FileFormatError, match=f"{name}.* cut inside a number"):
            read_scan(path)
    path.write_bytes(whole + b"\n")
    assert len(read_scan(path)) == 400


def test_a_vertex_too_many_does_not_take_the_bytes_of_a_face(tmp_path):
    path = tmp_path / "m.ply"
    o3d.io.write_triangle_mesh(str(path), o3d.geometry.TriangleMesh.create_torus(1, 0.3, 6, 5))
    whole = path.read_bytes()
    for n in (29, 31, 35):
        path.write_bytes(whole.replace(b"vertex 30", b"vertex %d" % n))
        with pytest.raises(FileFormatError, match=r"m\.ply"):
            read_mesh(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("keyword", ["mtllib", "mt\\\nllib"])
@pytest.mark.parametrize("other", ["pipe", "/dev/zero", "none", "given.mtl"])
def test_looks_are_not_read(tmp_path, keyword, other):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "given.mtl").write_text("newmtl a\nmap_Kd pipe\n")
    (tmp_path / "m.obj").write_text(f"{keyword} {other}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    assert len(read_scan(tmp_path / "m.obj")) == 3


def test_errors_of_the_system_name_the_file(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(27, "File too large")

    (tmp_path / "c.xyz").write_text("1 2 3\n")
    monkeypatch.setattr(np, "loadtxt", full)
    with pytest.raises(OSError, match=r"\[Errno 27\] .*c\.xyz"):
        read_scan(tmp_path / "c.xyz")
