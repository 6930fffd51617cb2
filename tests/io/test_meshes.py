"""Triangle meshes from files, to files, and from Open3D."""

import json
import os

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, read_cloud, samples, to_tubes
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.meshes import WRITTEN_MESH_ENDINGS, save_mesh
from glsk_o3d.io.scans import read_mesh, read_scan

# ------------------------------------------------------------------------------------------------------------- reading


@pytest.mark.parametrize("ending", ["off", "obj", "stl", "gltf", "ply"])
@pytest.mark.parametrize(("resolution", "coarse"), [(5, True), (40, False)])
def test_meshes_give_their_vertices(tmp_path, caplog, ending, resolution, coarse):
    mesh = o3d.geometry.TriangleMesh.create_sphere(2.0, resolution).translate((10, 0, 0))
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), mesh)
    scan = read_scan(tmp_path / f"m.{ending}")
    assert len(scan.triangles) == len(mesh.triangles)
    corners = [
        points[faces].mean(axis=1)
        for points, faces in (
            (scan.positions, scan.triangles),
            (np.asarray(mesh.vertices), np.asarray(mesh.triangles)),
        )
    ]
    np.testing.assert_allclose(*(np.sort(each, axis=0) for each in corners), atol=1e-3)
    assert ("sample_points_uniformly" in caplog.text) == coarse


def test_what_is_no_mesh(cloud, tmp_path):
    o3d.io.write_point_cloud(str(tmp_path / "c.ply"), cloud)
    with pytest.raises(FileFormatError, match=r"c\.ply.* cloud"):
        read_mesh(tmp_path / "c.ply")
    with pytest.raises(FileFormatError, match=r"m\.xyz.*\.ply.*\.glb"):
        read_mesh(tmp_path / "m.xyz")


@pytest.mark.parametrize("comment", ["", "# made by hand\n"])
def test_off_files_that_break_off(tmp_path, comment):
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
def test_vertices_of_off_files_that_lack_numbers_are_refused(tmp_path, head):
    """Open3D would stop at the first, and return uninitialised memory for the rest."""
    more = " 0 0 1" * ("N" in head) + " 10 20 30 255" * ("C" in head)
    rows = [f"{i} 0 {i % 2}{more}" for i in range(4)]
    path = tmp_path / "m.off"
    path.write_text(f"{head}\n4 1 0\n" + "\n".join([*rows, "3 0 1 2\n"]))
    np.testing.assert_array_equal(read_scan(path).positions, [[i, 0, i % 2] for i in range(4)])
    for wrong in ("", "1_0", "five"):
        rows[2] = f"{rows[2].rpartition(' ')[0]} {wrong}"
        path.write_text(f"{head}\n4 1 0\n" + "\n".join([*rows, "3 0 1 2\n"]))
        with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
            read_scan(path)


@pytest.mark.parametrize("face", ["3 0 1 3", "3 0 1 -1", "3 0 1", "0.5 0 1 2", "-3 0 1 2", "3 0 1 1e9"])
def test_corners_of_off_files_that_are_no_vertices_are_refused(tmp_path, face):
    """Open3D would look for them in memory."""
    path = tmp_path / "m.off"
    path.write_text(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{face}\n")
    with pytest.raises(FileFormatError, match=r"m\.off: not a valid \.off file"):
        read_cloud(path)


def test_a_glb_file_that_promises_more_than_it_has_is_refused_before_memory_is_taken(tmp_path, tubes):
    path = tmp_path / "m.glb"
    save_mesh(tubes, path)
    whole = path.read_bytes()
    for length in (10**6, 2**32 - 1):
        path.write_bytes(whole[:12] + length.to_bytes(4, "little") + whole[16:])
        with pytest.raises(FileFormatError, match=rf"m\.glb.*promises {length} bytes"):
            read_scan(path)


# ------------------------------------------------------------------------------------------------------------- writing

FAR = np.array([471234.56789012, 5612345.67890123, 123.456789])


@pytest.fixture(scope="module")
def tubes():
    ring = samples.torus(60)
    return to_tubes(Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()))


@pytest.mark.parametrize("ending", [*WRITTEN_MESH_ENDINGS, ".GLB"])
@pytest.mark.parametrize("coloured", [False, True])
def test_written_meshes_have_their_triangles_and_colours(tmp_path, capfd, tubes, ending, coloured):
    mesh = tubes
    if not coloured:
        mesh = o3d.geometry.TriangleMesh(tubes.vertices, tubes.triangles)
    save_mesh(mesh, tmp_path / f"t{ending}")
    assert capfd.readouterr() == ("", "")
    assert mesh.has_vertex_normals() == coloured  # what was given is as it was
    assert [path.name for path in tmp_path.iterdir()] == [f"t{ending}"]
    back = read_mesh(tmp_path / f"t{ending}")
    corners = [np.asarray(each.vertices)[np.asarray(each.triangles)] for each in (back, mesh)]
    np.testing.assert_allclose(*(np.sort(each.mean(axis=1), axis=0) for each in corners), atol=1e-6)
    assert back.has_vertex_colors() == (coloured and ending != ".stl")


@pytest.mark.parametrize("ending", WRITTEN_MESH_ENDINGS)
def test_coordinates_on_a_map_keep_their_digits_or_are_refused(tmp_path, tubes, ending):
    trimesh = pytest.importorskip("trimesh")
    there, path = o3d.geometry.TriangleMesh(tubes).translate(FAR), tmp_path / f"t{ending}"
    if ending in (".stl", ".glb", ".gltf"):
        with pytest.raises(FileFormatError, match=rf"t\{ending}: \{ending} has too few digits .* write ply"):
            save_mesh(there, path)
        assert not list(tmp_path.iterdir())
        return
    save_mesh(there, path)
    back = trimesh.load(path, process=False, maintain_order=True)
    np.testing.assert_array_equal(back.vertices, np.asarray(there.vertices))
    np.testing.assert_array_equal(back.faces, np.asarray(there.triangles))


@pytest.mark.parametrize("ending", ["ply", "stl", "gltf"])
def test_a_mesh_that_breaks_off_is_no_file(tmp_path, monkeypatch, tubes, ending):
    write = o3d.io.write_triangle_mesh

    def full(path, mesh):
        done = write(path, mesh)
        os.truncate(path, 20000)
        return done

    monkeypatch.setattr(o3d.io, "write_triangle_mesh", full)
    with pytest.raises(OSError, match="could not write all of it"):
        save_mesh(tubes, tmp_path / f"t.{ending}")
    with pytest.raises(FileFormatError, match="tubes are a mesh: unknown ending"):
        save_mesh(tubes, tmp_path / "t.json")
    assert not list(tmp_path.iterdir())


def test_a_mesh_of_nothing_is_not_written(tmp_path):
    with pytest.raises(FileFormatError, match=r"m\.ply: the mesh is empty: there is nothing to write"):
        save_mesh(to_tubes(Skeleton((), (), (), (), (), ())), tmp_path / "m.ply")


def test_nodes_that_overflow_are_refused(tmp_path):
    save_mesh(o3d.geometry.TriangleMesh.create_tetrahedron(), tmp_path / "m.gltf")
    tree = json.loads((tmp_path / "m.gltf").read_text())
    tree["nodes"][0]["scale"] = [1e308] * 3
    (tmp_path / "m.gltf").write_text(json.dumps(tree))
    with pytest.raises(FileFormatError, match="beyond finite coordinates"):
        read_cloud(tmp_path / "m.gltf")
