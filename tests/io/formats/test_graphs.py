import numpy as np

from glsk_o3d.io.formats.graphs import graph_skeleton

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_edges_are_sorted_and_each_is_there_once():
    skeleton = graph_skeleton(SQUARE, [[3, 2], [1, 0], [0, 1], [2, 2]])
    np.testing.assert_array_equal(skeleton.edges, [[0, 1], [2, 3]])
    assert np.isnan(skeleton.radii).all()
    assert len(skeleton.points) == len(skeleton.normals) == len(skeleton.vertex_of_point) == 0
    assert graph_skeleton([], []).vertices.shape == (0, 3)
