"""One-rings of meshes, manifold or not."""

import numpy as np

from glsk_o3d.crosscheck.mesh import clean_faces, umbrellas

OCTAHEDRON = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def test_triangles_without_area_and_repeated_ones_go():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9]])
    faces = [[2, 1, 0], [0, 1, 1], [0, 1, 3], [0, 1, 2], [1, 3, 2]]
    cleaned = clean_faces(points, faces)
    assert cleaned.dtype == np.int64
    assert cleaned.tolist() == [[2, 1, 0], [1, 3, 2]]
    assert clean_faces(points, np.empty((0, 3))).shape == (0, 3)


def test_what_is_no_umbrella():
    assert umbrellas(6, OCTAHEDRON).all()
    opened = umbrellas(7, OCTAHEDRON[1:])  # the corners of the hole, and a vertex without a triangle
    assert np.flatnonzero(~opened).tolist() == [0, 2, 4, 6]
    fin = np.vstack([OCTAHEDRON, [0, 4, 6]])  # a third triangle on the edge 0 - 4
    assert np.flatnonzero(~umbrellas(7, fin)).tolist() == [0, 4, 6]
    twins = np.vstack([OCTAHEDRON, np.where(OCTAHEDRON == 4, 4, OCTAHEDRON + 6)])  # two of them that touch in vertex 4
    assert np.flatnonzero(~umbrellas(12, twins)).tolist() == [4, 10]
