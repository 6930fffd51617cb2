"""Triangle meshes from files and from Open3D."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, samples
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.io.meshes import WRITTEN_MESH_ENDINGS, mesh_arrays, read_mesh, save_mesh

OCTAHEDRON = o3d.geometry.TriangleMesh.create_octahedron()


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


# ------------------------------------------------------------------------------------------------------------- writing

FAR = np.array([471234.56789012, 5612345.67890123, 123.456789])


@pytest.fixture(scope="module")
def tubes():
    ring = samples.torus(60)
    return Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()).to_tubes()


def moved(mesh, offset):
    return o3d.geometry.TriangleMesh(mesh).translate(offset)


@pytest.mark.parametrize("ending", [*WRITTEN_MESH_ENDINGS, ".PLY", ".GLB"])
def test_written_meshes_have_their_triangles_and_colours(tmp_path, capfd, tubes, ending):
    save_mesh(tubes, tmp_path / f"t{ending}")
    assert capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == [f"t{ending}"]
    back = read_mesh(tmp_path / f"t{ending}")
    corners = [np.asarray(mesh.vertices)[np.asarray(mesh.triangles)] for mesh in (back, tubes)]
    np.testing.assert_allclose(*(np.sort(each.mean(axis=1), axis=0) for each in corners), atol=1e-6)
    assert back.has_vertex_colors() == (ending != ".stl")


@pytest.mark.parametrize("ending", ["ply", "obj", "off"])
def test_coordinates_on_a_map_keep_their_digits(tmp_path, tubes, ending):
    trimesh = pytest.importorskip("trimesh")
    there = moved(tubes, FAR)
    save_mesh(there, tmp_path / f"t.{ending}")
    back = trimesh.load(tmp_path / f"t.{ending}", process=False, maintain_order=True)
    np.testing.assert_array_equal(back.vertices, np.asarray(there.vertices))
    np.testing.assert_array_equal(back.faces, np.asarray(there.triangles))


@pytest.mark.parametrize("ending", ["stl", "glb", "gltf"])
def test_too_few_digits_are_refused(tmp_path, tubes, ending):
    with pytest.raises(FileFormatError, match=rf"t\.{ending}: \.{ending} has too few digits .* write ply"):
        save_mesh(moved(tubes, FAR), tmp_path / f"t.{ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ["ply", "stl", "gltf"])
def test_a_mesh_that_breaks_off_is_no_file(tmp_path, monkeypatch, tubes, ending):
    write = o3d.io.write_triangle_mesh

    def full(path, mesh):
        done = write(path, mesh)
        with open(path, "rb+") as stream:
            stream.truncate(20000)
        return done

    monkeypatch.setattr(o3d.io, "write_triangle_mesh", full)
    with pytest.raises(OSError, match="could not write all of it"):
        save_mesh(tubes, tmp_path / f"t.{ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "stl", "glb", "gltf"])
@pytest.mark.parametrize("coloured", [False, True])
def test_any_mesh_of_open3d_is_written(tmp_path, ending, coloured):
    mesh = o3d.geometry.TriangleMesh.create_sphere(1.0, 8)
    if coloured:
        mesh.paint_uniform_color([0.5, 0.25, 0])
    save_mesh(mesh, tmp_path / f"m.{ending}")
    back = read_mesh(tmp_path / f"m.{ending}")
    assert len(back.triangles) == len(mesh.triangles)
    assert not mesh.has_vertex_normals()  # what was given is as it was


def test_a_damaged_mesh_does_not_crash(tmp_path):
    face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    for corners in ("0", "4 0 1 99 98", "3 -1 0 1"):
        (tmp_path / "m.ply").write_text(head + face + corners + "\n")
        with pytest.raises(FileFormatError, match="no triangles"):
            read_mesh(tmp_path / "m.ply")
