"""Scans from files."""

import numpy as np
import pytest

from glsk_o3d import save_mesh, skeletonize
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.paths import CLOUD_ENDINGS, MESH_ENDINGS
from glsk_o3d.io.scans import read_cloud, read_scan, read_tensor_cloud, save_tensor_cloud
from glsk_o3d.io.skeletons import READABLE
from glsk_o3d.samples import torus


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.xyz", "c.xyzn", "c.xyzrgb", "c.pts", "C.PLY", "c é.Pcd"])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=str)
def test_clouds_that_open3d_writes(cloud, xyz, tmp_path, name, options):
    import open3d as o3d

    plain = tmp_path / f"plain.{name.lower().split('.')[1]}"
    assert o3d.io.write_point_cloud(str(plain), cloud, **options)
    plain.rename(tmp_path / name)
    back = read_cloud(tmp_path / name)
    np.testing.assert_allclose(np.asarray(back.points), xyz, rtol=1e-5)  # six digits in text
    assert back.has_normals() == (name.lower().split(".")[1] in ("ply", "pcd", "xyzn"))
    assert back.has_colors() == (name.lower().split(".")[1] in ("ply", "pcd", "xyzrgb", "pts"))


@pytest.mark.parametrize("ending", ["off", "obj", "stl", "gltf", "ply"])
def test_meshes_give_their_vertices(tmp_path, ending):
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh.create_octahedron()
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), mesh)
    back = np.unique(np.asarray(read_cloud(tmp_path / f"m.{ending}").points).round(6), axis=0)
    np.testing.assert_array_equal(back, np.unique(np.asarray(mesh.vertices), axis=0))


@pytest.mark.parametrize("ending", READABLE)
def test_a_skeleton_is_no_scan(skeleton, tmp_path, ending):
    skeleton.save(tmp_path / f"s{ending}", **({"cut_loops": True} if ending == ".swc" else {}))
    with pytest.raises(FileFormatError, match=rf"s\{ending}: is a skeleton"):
        read_cloud(tmp_path / f"s{ending}")


@pytest.mark.parametrize("name", ["c.npz", "c.json", "c.md", "c.bin"])
def test_what_is_neither_scan_nor_skeleton(tmp_path, name):
    (tmp_path / name).write_text("{}")
    with pytest.raises(FileFormatError, match=rf"{name}.*\.ply.*\.pcd"):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize("ending", ["ply", "off", "obj", "stl", "gltf"])
@pytest.mark.parametrize(("resolution", "coarse"), [(5, True), (40, False)])
def test_a_mesh_with_few_vertices_is_told(tmp_path, caplog, ending, resolution, coarse):
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh.create_sphere(2.0, resolution).translate((1000, 0, 0))
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), mesh)
    scan = read_scan(tmp_path / f"m.{ending}")
    assert len(scan.triangles) == len(mesh.triangles)
    assert scan.triangles.max() < len(scan)
    assert ("sample_points_uniformly" in caplog.text) == coarse


@pytest.mark.parametrize("ending", CLOUD_ENDINGS + MESH_ENDINGS)
@pytest.mark.parametrize(
    "data",
    [b"", b"1 2\n4 5\n", b"hello world\nthis is text\n", bytes(range(256)) * 4, b"\0" * 500],
)
def test_files_without_a_cloud(tmp_path, capfd, ending, data):
    (tmp_path / f"c{ending}").write_bytes(data)
    with pytest.raises(FileFormatError, match=rf"c\{ending}"):
        read_cloud(tmp_path / f"c{ending}")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.npz", "C.PLY"])
def test_tensor_clouds_come_back_as_they_were(tmp_path, capfd, name):
    import open3d as o3d

    rng = np.random.default_rng(0)
    held = {
        "positions": rng.random((50, 3)) + [471234.5, 5612345.6, 123.4],
        "normals": rng.normal(size=(50, 3)),
        "colors": rng.integers(0, 256, (50, 3)).astype(np.uint8),
        "classification": rng.integers(0, 9, (50, 1)).astype(np.int32),
        "intensity": rng.random((50, 1)).astype(np.float32),
        "gps_time": 1e9 * rng.random((50, 1)),
    }
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(held["positions"]))
    for key, values in held.items():
        cloud.point[key] = o3d.core.Tensor(values)
    save_tensor_cloud(cloud, tmp_path / name)
    assert capfd.readouterr() == ("", "")
    path = str(tmp_path / name)
    back = o3d.t.io.read_point_cloud(path) if name.endswith("npz") else read_tensor_cloud(path)
    assert {*back.point} == held.keys()
    for key, values in held.items():
        assert back.point[key].numpy().dtype == values.dtype
        np.testing.assert_array_equal(back.point[key].numpy(), values, err_msg=key)


def test_a_cloud_that_breaks_off_is_no_file(tmp_path, monkeypatch):
    import open3d as o3d

    write = o3d.t.io.write_point_cloud

    def full(path, cloud):
        done = write(path, cloud)
        with open(path, "rb+") as stream:
            stream.truncate(400)
        return done

    monkeypatch.setattr(o3d.t.io, "write_point_cloud", full)
    with pytest.raises(OSError, match="could not write all of it"):
        save_tensor_cloud(o3d.t.geometry.PointCloud(np.eye(3).repeat(20, axis=0)), tmp_path / "c.ply")
    with pytest.raises(FileFormatError, match=r"c\.xyz.*\.npz"):
        save_tensor_cloud(o3d.t.geometry.PointCloud(np.eye(3)), tmp_path / "c.xyz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ["ply", "pcd"])
def test_clouds_whose_normals_are_of_another_type_are_written(tmp_path, ending):
    import open3d as o3d

    place = np.random.default_rng(0).random((50, 3))
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(place))
    cloud.point.normals = o3d.core.Tensor(np.float32(place))
    save_tensor_cloud(cloud, tmp_path / f"c.{ending}")
    scan = read_scan(tmp_path / f"c.{ending}")
    np.testing.assert_array_equal(scan.positions, place)
    np.testing.assert_array_equal(scan.normals, np.float32(place))


# ------------------------------------------------------------------------------------------------ files that break off

PLY = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize("ending", ["ply", "pcd", "pts"])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=str)
def test_clouds_that_break_off_are_refused_wherever(cloud, tmp_path, capfd, ending, options):
    import open3d as o3d

    path = tmp_path / f"c.{ending}"
    o3d.io.write_point_cloud(str(path), cloud, **options)
    whole = path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") if ending == "pts" or "write_ascii" in options else len(whole) - 1
    for cut in {*range(0, last, max(1, len(whole) // 80)), last}:
        path.write_bytes(whole[:cut])
        with pytest.raises(FileFormatError, match=path.name):
            read_cloud(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("c.ply", PLY + "end_header\n1 2 3\n4 five 6\n", "five"),
        (
            "c.ply",
            PLY.replace("vertex 2", "vertex 99999999999") + "end_header\n1 2 3\n",
            "promises 99999999999 points and",
        ),
        ("c.ply", PLY.replace("vertex 2", "vertex 0") + "end_header\n", "no points"),
        ("c.ply", PLY.replace("vertex 2", "face 2") + "end_header\n1 2 3\n4 5 6\n", "vertex"),
        ("c.pts", "1 2 3\n4 5 6\n", "number of points"),
        ("c.pts", "2\n1 2 3\n4 x 6\n", "promises 2 points and holds 1"),
        ("c.pts", "99999999999999\n1 2 3\n", "holds 1"),
        ("c.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 5\n", "DATA"),
        ("c.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS -5\nDATA ascii\n1 2 3\n", r"c\.pcd"),
        (
            "c.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 99999999999\nDATA binary\n1 2 3\n",
            "promises 99999999999",
        ),
    ],
)
def test_damaged_clouds(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileFormatError, match=says):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize("comment", ["", "# made by hand\n"])
def test_off_files_that_break_off(tmp_path, comment):
    import open3d as o3d

    path = tmp_path / "m.off"
    o3d.io.write_triangle_mesh(str(path), o3d.geometry.TriangleMesh.create_sphere(1.0, 6))
    lines = (comment + path.read_text()).splitlines(keepends=True)
    path.write_text("".join(lines))
    assert len(read_cloud(path).points) == 62
    for cut in range(1, len(lines)):
        path.write_text("".join(lines[:cut]))
        with pytest.raises(FileFormatError, match=r"m\.off"):
            read_cloud(path)


@pytest.mark.parametrize("head", ["OFF", "NOFF", "COFF", "CNOFF"])
@pytest.mark.parametrize("wrong", [None, "", "nan", "1e999", "1_0", "five"])
def test_vertices_that_lack_numbers_are_refused(tmp_path, head, wrong):
    """Open3D would stop at the first, and return uninitialised memory for the rest."""
    more = " 0 0 1" * ("N" in head) + " 10 20 30 255" * ("C" in head)
    rows = [f"{i} 0 {i % 2}{more}" for i in range(4)]
    if wrong is not None:
        rows[2] = f"{rows[2].rpartition(' ')[0]} {wrong}"
    (tmp_path / "m.off").write_text(f"{head}\n4 1 0\n" + "\n".join([*rows, "3 0 1 2"]))
    if wrong is None:
        np.testing.assert_array_equal(read_scan(tmp_path / "m.off").positions, [[i, 0, i % 2] for i in range(4)])
        return
    with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
        read_scan(tmp_path / "m.off")


@pytest.mark.parametrize("length", [10**6, 2**31, 2**32 - 1])
def test_a_glb_file_that_promises_more_than_it_has_is_refused_before_memory_is_taken(tmp_path, length):
    path = tmp_path / "m.glb"
    save_mesh(skeletonize(torus(1000).points).to_tubes(), path)
    assert len(read_scan(path)) > 100
    whole = path.read_bytes()
    path.write_bytes(whole[:12] + length.to_bytes(4, "little") + whole[16:])
    with pytest.raises(FileFormatError, match=rf"m\.glb.*its header promises {length} bytes"):
        read_scan(path)


@pytest.mark.parametrize("face", ["3 0 1 3", "3 0 1 -1", "3 0 1", "0.5 0 1 2", "-3 0 1 2", "3 0 1 1e9"])
def test_corners_of_faces_that_are_no_vertices_are_refused(tmp_path, face):
    """Open3D would look for them in memory."""
    path = tmp_path / "m.off"
    path.write_text(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{face}\n")
    with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
        read_cloud(path)
    path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    read_cloud(path)
