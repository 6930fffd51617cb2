"""One-rings of meshes, manifold or not."""

import numpy as np
import pytest

from glsk_o3d.crosscheck.mesh_rings import clean_faces, common_share, umbrellas
from glsk_o3d.numerics.rings import Rings

OCTAHEDRON = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def rings_of(*lists, closed=True):
    indptr = np.concatenate([[0], np.cumsum([len(row) for row in lists])]).astype(int)
    return Rings(indptr, np.array([j for row in lists for j in row], int), np.full(len(lists), closed))


def octahedron_rings(first=(2, 4, 3, 5)):
    return rings_of(first, [2, 5, 3, 4], [0, 5, 1, 4], [0, 4, 1, 5], [0, 2, 1, 3], [0, 3, 1, 2])


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


@pytest.mark.parametrize("first", [(2, 4, 3, 5), (3, 5, 2, 4), (5, 3, 4, 2)])
def test_a_ring_is_the_same_wherever_it_starts_and_whichever_way_it_runs(first):
    assert common_share(octahedron_rings(first), OCTAHEDRON).tolist() == [1] * 6


def test_the_same_neighbours_in_another_order_are_another_ring():
    # 2-3-4-5 shares the triangles (3, 4) and (5, 2) with 2-4-3-5; each has two more
    assert common_share(octahedron_rings((2, 3, 4, 5)), OCTAHEDRON).tolist() == [2 / 6, 1, 1, 1, 1, 1]


def test_missing_and_additional_neighbours():
    # without 5: the triangles (2, 4), (4, 3) of four, and (3, 2) that is not there
    assert common_share(octahedron_rings((2, 4, 3)), OCTAHEDRON)[0] == 2 / 5
    fan = octahedron_rings()
    open_fan = Rings(fan.indptr, fan.indices, np.array([False] + [True] * 5))
    assert common_share(open_fan, OCTAHEDRON)[0] == 3 / 4
    assert common_share(octahedron_rings(), OCTAHEDRON[:0]).tolist() == [0] * 6
    assert common_share(rings_of([], closed=False), OCTAHEDRON[:0]).tolist() == [0]
