from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d.io.skeletons import read_skeleton


def test_ply_in_open3d(skeleton, tmp_path):
    import open3d as o3d

    if not len(skeleton.edges):
        pytest.skip("Open3D reads no line set without lines")
    skeleton.save(tmp_path / "s.ply")
    lines = o3d.io.read_line_set(str(tmp_path / "s.ply"))
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines), skeleton.edges)
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "s.ply"))
    np.testing.assert_array_equal(cloud.point["radius"].numpy().ravel(), skeleton.radii)


def test_meshlab_opens_it(skeleton, tmp_path):
    pymeshlab = pytest.importorskip("pymeshlab")
    skeleton.save(tmp_path / "s.ply")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / "s.ply"))
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)  # by which it colours


def test_the_half_axes_come_back(tree, tmp_path):
    flat = replace(tree, half_width=2 * tree.radii, half_thickness=tree.radii / 2)
    flat.save(tmp_path / "s.ply")
    back = read_skeleton(tmp_path / "s.ply")
    for name in ("radii", "half_width", "half_thickness"):
        np.testing.assert_array_equal(getattr(back, name), getattr(flat, name))
    (tmp_path / "s.ply").write_bytes((tmp_path / "s.ply").read_bytes().replace(b" half_", b" some_"))
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.ply").half_width, tree.radii)


def test_ply_written_by_open3d(tree, tmp_path):
    import open3d as o3d

    for text in (True, False):
        o3d.io.write_line_set(str(tmp_path / "s.ply"), tree.to_line_set(), write_ascii=text)
        back = read_skeleton(tmp_path / "s.ply")
        np.testing.assert_allclose(back.vertices, tree.vertices, rtol=1e-5 if text else 0)
        np.testing.assert_array_equal(back.edges, tree.edges)
        assert np.isnan(back.radii).all()


def test_ply_of_all_byte_orders_gives_the_same(tmp_path):
    header = "ply\r\nformat {} 1.0\r\ncomment x\r\nelement vertex 2\r\nproperty double x\r\nproperty double y\r\n"
    header += (
        "property double z\r\nproperty float radius\r\nelement face 0\r\nproperty list uchar int vertex_indices\r\n"
    )
    header += "element edge 1\r\nproperty ushort vertex1\r\nproperty int vertex2\r\nend_header\r\n"
    bodies = {"ascii": b"0 0.5 1 2\n3 4 5 6\n1 0\n"}
    for name, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        kinds = [(c, order + k) for c, k in zip("xyzr", ("f8", "f8", "f8", "f4"), strict=True)]
        rows = np.array([(0, 0.5, 1, 2), (3, 4, 5, 6)], kinds)
        bodies[name] = rows.tobytes() + np.array((1, 0), [("a", order + "u2"), ("b", order + "i4")]).tobytes()
    for name, body in bodies.items():
        (tmp_path / "s.ply").write_bytes(header.format(name).encode() + body)
        back = read_skeleton(tmp_path / "s.ply")
        np.testing.assert_array_equal(back.vertices, [[0, 0.5, 1], [3, 4, 5]])
        np.testing.assert_array_equal(back.edges, [[0, 1]])
        np.testing.assert_array_equal(back.radii, [2, 6])
