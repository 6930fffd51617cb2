"""Layers: read from files, written to them, and seen through pymeshlab."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.apps.meshlab.layers import Layer


@pytest.mark.parametrize("ending", ["ply", "xyz"])
def test_a_mesh_is_read_as_it_was_written(tmp_path, ending):
    mesh = o3d.geometry.TriangleMesh.create_torus()
    mesh.compute_vertex_normals()
    points, faces, normals = (np.array(each) for each in (mesh.vertices, mesh.triangles, mesh.vertex_normals))
    bytes = np.random.default_rng(0).integers(256, size=(len(points), 3))
    colors = np.column_stack([bytes / 255, np.ones(len(points))])
    layer = Layer(points, faces=faces, normals=normals, colors=colors, scalars=np.arange(len(points)) / 3)
    layer.save(tmp_path / f"m.{ending}")
    back = Layer.read(tmp_path / f"m.{ending}")
    assert back.label == f"m.{ending}"
    np.testing.assert_array_equal(back.vertices, points)
    if ending == "xyz":
        assert back.faces is None
        return
    np.testing.assert_array_equal(back.faces, faces)
    np.testing.assert_array_equal(back.normals, normals)
    np.testing.assert_allclose(back.colors, colors)
    np.testing.assert_array_equal(back.scalars, layer.scalars)


def test_normals_turn_with_the_matrix_of_a_layer():
    pymeshlab = pytest.importorskip("pymeshlab")
    points, normals = np.random.default_rng(0).normal(size=(2, 50, 3))
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals))
    turn = np.eye(4)[[1, 0, 2, 3]] * [-1, 1, 1, 1]
    meshes.set_matrix(transformmatrix=turn, freeze=False)
    layer = Layer.of_mesh(meshes.current_mesh())
    np.testing.assert_allclose(layer.vertices, points @ turn[:3, :3].T)
    np.testing.assert_allclose(layer.normals, normals @ turn[:3, :3].T)
