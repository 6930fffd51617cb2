"""Files that promise what they do not hold, unfold to more than memory, or name others: all are refused."""

import json
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
REFUSAL = r"(promises|its \d+ bytes would take|may be cut|stands in two|nested|elements inside|DOCTYPE|names another)"
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


def refused(path, says=REFUSAL):
    """In a process that may take 3 GB of memory and 60 seconds, and that nothing hangs or kills."""
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, path], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") == 1
    assert path.name in done.stdout
    assert re.search(says, done.stdout), done.stdout


def test_one_rule():
    check_promised(5, 5)
    with pytest.raises(ValueError, match="it promises 6 rows and holds 5: it is truncated"):
        check_promised(6, 5, "rows")
    check_budget(ALWAYS_TAKEN, 1)
    check_budget(3 * ALWAYS_TAKEN, ALWAYS_TAKEN, 3)
    with pytest.raises(ValueError, match=r"at most 67108864 are allowed, 200 times as many"):
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


@pytest.mark.parametrize("format", [3, 7])
def test_points_that_a_laz_file_does_not_hold(tmp_path, format):
    laspy = pytest.importorskip("laspy")
    scan = laspy.LasData(laspy.LasHeader(point_format=format, version="1.2" if format == 3 else "1.4"))
    scan.x, scan.y, scan.z = POINTS.T
    scan.write(tmp_path / "s.laz")
    assert len(read_scan(tmp_path / "s.laz")) == 400
    data, at = bytearray((tmp_path / "s.laz").read_bytes()), 107 if format == 3 else 247
    data[at : at + 4] = (401).to_bytes(4, "little")
    (tmp_path / "s.laz").write_bytes(data)
    with pytest.raises(FileFormatError, match=r"s\.laz: not a valid \.laz file"):
        read_scan(tmp_path / "s.laz")


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


@pytest.mark.parametrize(
    ("place", "key"), [("accessors", "count"), ("bufferViews", "byteLength"), ("buffers", "byteLength")]
)
@pytest.mark.parametrize("more", [1, 10**6])
def test_rows_that_a_gltf_file_does_not_hold(mesh, place, key, more):
    tree = json.loads(mesh.read_bytes())
    for i, held in [*enumerate(tree[place])][-1 if place != "accessors" else 0 :]:  # of others there is more behind
        wrong = json.loads(mesh.read_bytes())
        wrong[place][i][key] = held[key] + more
        mesh.with_name("w.gltf").write_text(json.dumps(wrong))
        with pytest.raises(FileFormatError, match=r"promises|its vertices are"):
            read_scan(mesh.with_name("w.gltf"))


def test_a_vertex_too_many_does_not_take_the_bytes_of_a_face(tmp_path):
    o3d.io.write_triangle_mesh(str(tmp_path / "m.ply"), o3d.geometry.TriangleMesh.create_torus(1, 0.3, 6, 5))
    whole = (tmp_path / "m.ply").read_bytes()
    for n in (29, 31, 35):
        (tmp_path / "m.ply").write_bytes(whole.replace(b"vertex 30", b"vertex %d" % n))
        with pytest.raises(FileFormatError, match=r"m\.ply"):
            read_mesh(tmp_path / "m.ply")


# --------------------------------------------------------------------------------------------------------------- bombs


@pytest.fixture
def mesh(tmp_path):
    path = tmp_path / "m.gltf"
    o3d.io.write_triangle_mesh(str(path), o3d.geometry.TriangleMesh.create_torus(1, 0.3, 6, 5))
    return path


@pytest.mark.parametrize(("children", "deep"), [(2, 30), (1, 200000)])
def test_nodes_that_repeat_or_are_nested(mesh, children, deep):
    tree = json.loads(mesh.read_bytes())
    tree["nodes"] = [{"mesh": 0}, *({"children": [i] * children} for i in range(deep))]
    tree["scenes"][0]["nodes"] = [deep]
    mesh.write_text(json.dumps(tree))
    refused(mesh)


def test_nodes_without_a_mesh_may_be_as_deep_as_an_armature(mesh):
    before = read_scan(mesh)
    tree = json.loads(mesh.read_bytes())
    tree["nodes"] += [{"children": [i]} for i in range(2, 5000)] + [{}]
    tree["scenes"][0]["nodes"] = [0, 1]
    mesh.write_text(json.dumps(tree))
    np.testing.assert_array_equal(read_scan(mesh).positions, before.positions)


def test_meshes_that_are_placed_too_often(mesh):
    tree = json.loads(mesh.read_bytes())
    tree["nodes"] = [{"mesh": 0} for _ in range(100000)]
    tree["scenes"][0]["nodes"] = list(range(100000))
    mesh.write_text(json.dumps(tree))
    refused(mesh, r"its \d+ bytes would take \d+, and at most \d+ are allowed, 16 times as many")


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


def test_a_width_and_a_number_of_points(tmp_path):
    head = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nPOINTS 2\n"
    (tmp_path / "c.pcd").write_text(f"{head}DATA ascii\n1 2 3\n4 5 6\n")
    with pytest.raises(FileFormatError, match="promises 2 points, and another width"):
        read_scan(tmp_path / "c.pcd")


@pytest.mark.parametrize("what", ["cloud .e57 deep", "cloud .e57 entities", "cloud .e57 constant", "cloud .xyz wide"])
def test_what_no_scanner_writes(lies, tmp_path, what):
    pytest.importorskip("pye57")
    path = tmp_path / f"c{what.split()[1]}"
    path.write_bytes(lies.BOMBS[what](10**6))
    refused(path, f"{REFUSAL}|a line has 3000000 numbers")


# --------------------------------------------------------------------------------------------------------------- named


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("name", ["cloud .obj mtllib", "cloud .obj goes on", "cloud .obj map", "cloud .gltf image"])
@pytest.mark.parametrize("other", ["pipe", "/dev/zero", "none"])
def test_looks_are_not_read(lies, tmp_path, name, other):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "given.mtl").write_text(f"newmtl a\nmap_Kd {other}\n")
    path = tmp_path / f"m{name.split()[1]}"
    path.write_bytes(lies.NAMING[name](other))
    assert len(read_scan(path)) in (3, 30)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_only_files_are_read_that_a_file_names(lies, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for other, says in (
        ("pipe", "pipe or a device"),
        ("/dev/zero", "device"),
        ("folder", "folder"),
        ("loop", ""),
        ("none", "no such"),
    ):
        (tmp_path / "m.gltf").write_bytes(lies.NAMING["cloud .gltf buffer"](other))
        with pytest.raises(FileFormatError, match=rf"m\.gltf.*{says}"):
            read_scan(tmp_path / "m.gltf")


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
