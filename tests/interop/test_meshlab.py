import sys

import numpy as np
import pytest

from glsk_o3d.errors import MissingPackageError


def test_mesh_of_vertices_and_edges(skeleton):
    pymeshlab = pytest.importorskip("pymeshlab")
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(skeleton.to_pymeshlab())
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)


def test_obj_of_meshlab_keeps_the_edges(tree, tmp_path):
    pymeshlab = pytest.importorskip("pymeshlab")
    from glsk_o3d.interop.files import read_skeleton

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(tree.to_pymeshlab())
    meshes.save_current_mesh(str(tmp_path / "m.obj"))
    back = read_skeleton(tmp_path / "m.obj")
    np.testing.assert_allclose(back.vertices, tree.vertices, atol=1e-6)
    np.testing.assert_array_equal(back.edges, tree.edges)


def test_without_pymeshlab_the_extra_is_named(tree, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingPackageError, match=r"pymeshlab.*glsk-o3d\[meshlab\]"):
        tree.to_pymeshlab()
