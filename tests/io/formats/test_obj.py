import numpy as np
import pytest

from glsk_o3d.io.skeletons import read_skeleton


def test_meshlab_opens_it(skeleton, tmp_path):
    pymeshlab = pytest.importorskip("pymeshlab")
    skeleton.save(tmp_path / "s.obj")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / "s.obj"))
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)


def test_obj_as_others_write_it(tmp_path):
    (tmp_path / "s.obj").write_text(
        "# x\no name\nv 0 0 0 1\nv 1 0 0\nvn 0 0 1\nv 2 0 0\nl 1/1 2/1 3/2 # c\nl -1 -3\ng\n"
    )
    back = read_skeleton(tmp_path / "s.obj")
    np.testing.assert_array_equal(back.vertices, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2], [1, 2]])
