"""Triangle meshes from files and from Open3D."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.io.meshes import mesh_arrays, read_mesh

OCTAHEDRON = o3d.geometry.TriangleMesh.create_octahedron()


@pytest.mark.parametrize("ending", ["ply", "off", "obj", "gltf"])
def test_meshes_that_open3d_writes(tmp_path, ending):
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), OCTAHEDRON)
    vertices, faces = mesh_arrays(read_mesh(tmp_path / f"m.{ending}"))
    assert vertices.shape == (6, 3)
    assert faces.shape == (8, 3)


def test_what_is_no_mesh(cloud, tmp_path):
    o3d.io.write_point_cloud(str(tmp_path / "c.ply"), cloud)
    with pytest.raises(FileFormatError, match=r"c\.ply.* cloud"):
        read_mesh(tmp_path / "c.ply")
    with pytest.raises(FileFormatError, match=r"m\.xyz.*\.ply.*\.glb"):
        read_mesh(tmp_path / "m.xyz")
    with pytest.raises(FileNotFoundError, match=r"none\.off"):
        read_mesh(tmp_path / "none.off")


def test_every_kind_of_mesh_gives_the_same_arrays():
    vertices, faces = np.asarray(OCTAHEDRON.vertices), np.asarray(OCTAHEDRON.triangles)
    for mesh in (OCTAHEDRON, o3d.t.geometry.TriangleMesh.from_legacy(OCTAHEDRON), (vertices, faces)):
        found = mesh_arrays(mesh)
        assert [array.dtype for array in found] == [np.float64, np.int64]
        np.testing.assert_array_equal(found[0], vertices)
        np.testing.assert_array_equal(found[1], faces)
        assert not np.shares_memory(found[0], vertices)


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        (7, "int"),
        ((np.eye(3), np.zeros((0, 3), int)), r"\(F, 3\)"),
        ((np.eye(3), [[0, 1, 3]]), "triangle.*vertex"),
        ((np.eye(3) * np.nan, [[0, 1, 2]]), "not finite"),
    ],
)
def test_useless_meshes(mesh, says):
    with pytest.raises(InvalidParameterError, match=says):
        mesh_arrays(mesh)
