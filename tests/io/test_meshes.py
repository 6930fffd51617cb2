"""Triangle meshes from files."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_mesh, read_scan


def centres(mesh):
    """The middles of the triangles, sorted along each axis."""
    return np.sort(np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].mean(axis=1), axis=0)


@pytest.mark.parametrize("ending", ["off", "obj", "stl", "ply"])
@pytest.mark.parametrize(("resolution", "coarse"), [(5, True), (40, False)])
def test_meshes_give_their_vertices(tmp_path, caplog, ending, resolution, coarse):
    mesh, path = (
        o3d.geometry.TriangleMesh.create_sphere(2.0, resolution).translate((10, 0, 0)),
        tmp_path / f"m.{ending}",
    )
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(path), mesh)
    np.testing.assert_allclose(centres(read_mesh(path)), centres(mesh), atol=1e-3)
    read_scan(path)
    assert ("sample_points_uniformly" in caplog.text) == coarse


@pytest.mark.parametrize("ending", ["stl", "off"])
def test_files_that_break_off(tmp_path, capfd, ending):
    mesh, path = o3d.geometry.TriangleMesh.create_sphere(1.0, 6), tmp_path / f"m.{ending}"
    if ending == "stl":
        mesh.compute_triangle_normals()
    o3d.io.write_triangle_mesh(str(path), mesh)
    whole = path.read_bytes()
    for cut in range(1, len(whole) - 1, len(whole) // 50):
        path.write_bytes(whole[:cut])
        with pytest.raises(FileFormatError, match=rf"m\.{ending}"):
            read_scan(path)
    assert capfd.readouterr() == ("", "")


def test_what_is_no_mesh(cloud, tmp_path):
    o3d.io.write_point_cloud(str(tmp_path / "c.ply"), cloud)
    with pytest.raises(FileFormatError, match=r"c\.ply.* cloud"):
        read_mesh(tmp_path / "c.ply")
    with pytest.raises(FileFormatError, match=r"m\.xyz.*\.ply.*\.stl"):
        read_mesh(tmp_path / "m.xyz")


@pytest.mark.parametrize(("head", "more"), [("OFF", ""), ("CNOFF", " 0 0 1 10 20 30 255")])
@pytest.mark.parametrize(
    ("vertex", "face"),
    [("2 0", "3 0 1 2"), ("2 0 1_0", "3 0 1 2"), ("2 0 five", "3 0 1 2")]
    + [("2 0 0", face) for face in ("3 0 1 3", "3 0 1 -1", "3 0 1", "0.5 0 1 2", "-3 0 1 2", "3 0 1 1e9")],
)
def test_off_files_that_make_no_sense(tmp_path, head, more, vertex, face):
    """Open3D would return uninitialised memory, or look for corners in it."""
    path = tmp_path / "m.off"
    path.write_text(f"{head}\n# by hand\n3 1 0\n0 0 0{more}\n1 0 1{more}\n2 0 0{more}\n3 0 1 2\n")
    np.testing.assert_array_equal(read_scan(path).positions, [[i, 0, i % 2] for i in range(3)])
    path.write_text(f"{head}\n3 1 0\n0 0 0{more}\n1 0 1{more}\n{vertex}{more if vertex == '2 0 0' else ''}\n{face}\n")
    with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
        read_scan(path)
