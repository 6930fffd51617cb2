"""Scans that break off, or promise what they do not hold."""

import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_cloud

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


@pytest.mark.parametrize("face", ["3 0 1 3", "3 0 1 -1", "3 0 1", "0.5 0 1 2", "-3 0 1 2", "3 0 1 1e9"])
def test_corners_of_faces_that_are_no_vertices_are_refused(tmp_path, face):
    """Open3D would look for them in memory."""
    path = tmp_path / "m.off"
    path.write_text(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{face}\n")
    with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
        read_cloud(path)
    path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    read_cloud(path)
