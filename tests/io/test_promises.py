"""Files that promise what they do not hold, unfold to more than memory, or name others: all are refused."""

import os
import re
import subprocess
import sys

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io import scans
from glsk_o3d.io.paths import ALWAYS_TAKEN, check_budget, check_promised
from glsk_o3d.io.scans import read_mesh, read_scan

POINTS = np.random.default_rng(0).normal(size=(400, 3)).round(3)
REFUSAL = r"(promises|its \d+ bytes would take|may be cut|a line has 3000000 numbers)"
LIMITED = """
import resource, sys
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_scan
resource.setrlimit(resource.RLIMIT_DATA, (3 << 30,) * 2)
try:
    print(len(read_scan(sys.argv[1])))
except FileFormatError as error:
    print(error)
"""


def refused(path):
    """In a process that may take 3 GB of memory and 60 seconds, and that nothing hangs or kills."""
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, path], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") == 1
    assert path.name in done.stdout
    assert re.search(REFUSAL, done.stdout), done.stdout


def test_one_rule():
    check_promised(5, 5)
    with pytest.raises(ValueError, match="it promises 6 rows and holds 5: it is truncated"):
        check_promised(6, 5, "rows")
    check_budget(ALWAYS_TAKEN, 1)
    with pytest.raises(ValueError, match=r"at most 67108864 are allowed"):
        check_budget(ALWAYS_TAKEN + 1, 1)


# -------------------------------------------------------------------------------------------------------------- points


@pytest.fixture(scope="module")
def lies(benchmark):
    with benchmark("fuzz"):
        import _fuzz_lies

        yield _fuzz_lies


@pytest.mark.parametrize("promised", ["401", "400000000"])
def test_points_that_an_e57_file_does_not_hold(lies, tmp_path, promised):
    pye57 = pytest.importorskip("pye57")
    with pye57.E57(str(tmp_path / "s.e57"), mode="w") as file:
        file.write_scan_raw(dict(zip(("cartesianX", "cartesianY", "cartesianZ"), POINTS.T.copy(), strict=True)))
    data = (tmp_path / "s.e57").read_bytes()
    content = b"".join(data[i : i + 1020] for i in range(0, len(data), 1024))
    assert lies.e57(content) == data
    (tmp_path / "s.e57").write_bytes(
        lies.e57(content.replace(b'recordCount="400"', f'recordCount="{promised}"'.encode()))
    )
    refused(tmp_path / "s.e57")


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.pts", "c.off"])
def test_numbers_that_text_cuts(tmp_path, name):
    path = tmp_path / name
    if name == "c.off":
        path.write_text("OFF\n400 1 0\n" + "1 2 3\n" * 400 + "3 0 1 200\n")
    else:
        o3d.io.write_point_cloud(
            str(path), o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS)), write_ascii=True
        )
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


# --------------------------------------------------------------------------------------------------------------- bombs


def test_values_that_a_pcd_file_does_not_hold(tmp_path):
    head = (
        "VERSION .7\nFIELDS x y z a\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 200000000\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
    )
    (tmp_path / "c.pcd").write_text(f"{head}DATA ascii\n1 2 3 4\n")
    refused(tmp_path / "c.pcd")


def test_faces_without_corners(lies, tmp_path):
    (tmp_path / "c.ply").write_bytes(lies._ply_of(2 * 10**8, b"\0"))
    refused(tmp_path / "c.ply")


def test_copies_are_unpacked_in_time(lies, tmp_path):
    (tmp_path / "c.pcd").write_bytes(lies._lzf(24 * 10**6))
    assert len(read_scan(tmp_path / "c.pcd")) == 6 * 10**6 + 1


@pytest.mark.parametrize("what", ["cloud .e57 constant", "cloud .xyz wide"])
def test_what_no_scanner_writes(lies, tmp_path, what):
    pytest.importorskip("pye57")
    path = tmp_path / f"c{what.split()[1]}"
    path.write_bytes(lies.BOMBS[what](10**6))
    refused(path)


# --------------------------------------------------------------------------------------------------------------- named


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("name", ["cloud .obj mtllib", "cloud .obj goes on", "cloud .obj map"])
@pytest.mark.parametrize("other", ["pipe", "/dev/zero", "none"])
def test_looks_are_not_read(lies, tmp_path, name, other):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "given.mtl").write_text(f"newmtl a\nmap_Kd {other}\n")
    path = tmp_path / f"m{name.split()[1]}"
    path.write_bytes(lies.NAMING[name](other))
    assert len(read_scan(path)) == 3


# -------------------------------------------------------------------------------------------------------------- errors


def test_errors_of_others_in_one_line(tmp_path):
    pytest.importorskip("pye57")
    (tmp_path / "s.e57").write_bytes(b"ASTM-E57" + bytes(32) + (1024).to_bytes(8, "little") + bytes(3000))
    with pytest.raises(FileFormatError) as caught:
        read_scan(tmp_path / "s.e57")
    assert "\n" not in str(caught.value)


def test_errors_of_the_system_name_the_file(tmp_path, monkeypatch):
    (tmp_path / "c.xyz").write_text("1 2 3\n")

    def full(*_):
        raise OSError(27, "File too large")

    monkeypatch.setitem(scans._SCAN_READERS, ".xyz", full)
    with pytest.raises(OSError, match=r"\[Errno 27\] .*c\.xyz"):
        read_scan(tmp_path / "c.xyz")
