"""Layers: read from files, written to them, and seen through pymeshlab."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import samples, save_skeleton
from glsk_o3d.meshlab.layers import Layer


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "stl", "xyz"])
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
    if ending in ("stl", "obj"):  # in the reader's own order
        assert (back.vertices.shape, back.faces.shape) == (points.shape, faces.shape)
        corners, its = (np.sort(each.vertices[each.faces].mean(axis=1), axis=0) for each in (layer, back))
        np.testing.assert_allclose(its, corners, atol=1e-5)  # six digits
        return
    np.testing.assert_allclose(back.vertices, points, atol=0 if ending in ("ply", "xyz") else 1e-5)
    if ending == "xyz":
        assert back.faces is None
    else:
        np.testing.assert_array_equal(back.faces, faces)
    if ending == "ply":
        np.testing.assert_allclose(back.normals, normals, atol=1e-6)
        np.testing.assert_allclose(back.colors, colors)
    if ending == "ply":
        np.testing.assert_array_equal(back.scalars, layer.scalars)


@pytest.mark.parametrize("ending", ["ply", "obj", "json"])
def test_a_skeleton_is_read_with_its_edges(tmp_path, tree, ending):
    save_skeleton(tree, tmp_path / f"s.{ending}")
    back = Layer.read(tmp_path / f"s.{ending}")
    np.testing.assert_array_equal(back.vertices, tree.vertices)
    np.testing.assert_array_equal(back.edges, tree.edges)
    assert back.is_skeleton


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


def test_coordinates_near_the_end_of_float64():
    points = samples.torus(100).points
    assert Layer.of(1e200 * points).diagonal == pytest.approx(1e200 * Layer.of(points).diagonal)
    assert Layer.of(np.full((3, 3), np.nan)).diagonal == 0
