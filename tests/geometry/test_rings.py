"""Rings against slow loops."""

from itertools import pairwise

import numpy as np
import pytest

from glsk_o3d.geometry import rings as module
from glsk_o3d.geometry.neighbourhoods import nearest_neighbours, plane_axes
from glsk_o3d.geometry.rings import Rings, star_rings


def rings_of(lists, closed):
    indptr = np.concatenate([[0], np.cumsum([len(row) for row in lists])]).astype(int)
    return Rings(indptr, np.array([j for row in lists for j in row], int), np.array(closed, bool))


def lists_of(rings):
    return [rings[i].tolist() for i in range(len(rings))]


def random_rings(n=40, seed=0):
    rng = np.random.default_rng(seed)
    lists = [rng.permutation(n)[: rng.integers(1, 9)].tolist() for _ in range(n)]
    return lists, [len(row) > 2 and bool(rng.random() < 0.7) for row in lists]


@pytest.fixture(params=[0, 1])
def case(request):
    """Lists, closed flags, and the Rings made of them."""
    lists, closed = random_rings(seed=request.param)
    return lists, closed, rings_of(lists, closed)


def test_rows_triangles_and_lengths_are_those_of_loops(case):
    lists, closed, rings = case
    assert (lists_of(rings), rings.closed.tolist()) == (lists, closed)
    assert rings.sizes.tolist() == [len(row) for row in lists]
    assert rings.centres.tolist() == [i for i, row in enumerate(lists) for _ in row]
    triangles = []
    for i, (row, is_closed) in enumerate(zip(lists, closed, strict=True)):
        triangles += [[i, a, b] for a, b in pairwise(row + row[:1] * is_closed)]
    assert sorted(rings.triangles.tolist()) == sorted(triangles)
    points = np.random.default_rng(9).normal(size=(40, 3))
    slow = [np.linalg.norm(points[row] - points[i], axis=1) for i, row in enumerate(lists)]
    np.testing.assert_allclose(rings.edge_lengths(points), np.concatenate(slow), rtol=1e-14)
    np.testing.assert_allclose(rings.mean_lengths(points), [np.mean(row) for row in slow], rtol=1e-13)
    np.testing.assert_allclose(rings.mean_over(points), [points[row].mean(axis=0) for row in lists], atol=1e-13)
    neighbour, distance = rings.nearest(points)
    assert neighbour.tolist() == [row[int(np.argmin(far))] for row, far in zip(lists, slow, strict=True)]
    np.testing.assert_allclose(distance, [min(row) for row in slow], rtol=1e-14)


def test_rings_are_taken_replaced_padded_and_concatenated_row_by_row(case):
    lists, closed, rings = case
    rows = np.array([7, 3, 3, 39, 0])
    taken = rings.take(rows)
    assert lists_of(taken) == [lists[i] for i in rows]
    assert taken.closed.tolist() == [closed[i] for i in rows]

    width = max(len(lists[i]) for i in rows)
    assert rings.padded(rows).tolist() == [lists[i] + [-1] * (width - len(lists[i])) for i in rows]
    back = Rings.from_padded(rings.padded(rows), taken.closed)
    assert lists_of(back) == lists_of(taken)

    others, others_closed = random_rings(n=3, seed=8)
    swapped = rings.replace(np.array([5, 0, 20]), rings_of(others, others_closed))
    expected = dict(enumerate(zip(lists, closed, strict=True)))
    expected |= dict(zip([5, 0, 20], zip(others, others_closed, strict=True), strict=True))
    assert [*zip(lists_of(swapped), swapped.closed.tolist(), strict=True)] == [expected[i] for i in range(40)]
    assert lists_of(rings) == lists

    both = Rings.concatenate([rings, taken])
    assert lists_of(both) == lists + lists_of(taken)
    assert both.closed.tolist() == closed + taken.closed.tolist()


@pytest.mark.parametrize(
    ("row", "closed", "index", "expected"),
    [
        ([1, 2, 3, 4], True, {2: 1}, [1, 3, 4]),
        ([1, 2, 3, 4], False, {3: 1}, [1, 2, 1, 4]),  # not side by side: both stay
        ([1, 2, 3, 4], True, {4: 1}, [1, 2, 3]),  # around the corner
        ([1, 2, 3, 4], False, {4: 1}, [1, 2, 3, 1]),
        ([1, 2, 3], True, {2: 1, 3: 1}, [1]),
        ([], False, {}, []),
    ],
)
def test_rename_merges_neighbours_that_fall_together(row, closed, index, expected):
    names = np.array([index.get(j, j) for j in range(6)])
    assert lists_of(rings_of([row, [5]], [closed, False]).rename(names)) == [expected, [5]]


@pytest.mark.parametrize(
    ("order", "closed", "folded"),
    [
        ([1, 2, 3, 4, 5], True, False),
        ([5, 4, 3, 2, 1], True, False),
        ([1, 3, 5, 2, 4], True, True),  # twice around
        ([1, 2, 1, 2, 3], True, True),  # to and fro
        ([1, 3, 5, 2, 4], False, False),
    ],
)
def test_a_closed_ring_that_does_not_turn_once_around_its_point_is_folded(order, closed, folded):
    angle = np.arange(5) * 0.4 * np.pi
    points = np.concatenate([np.zeros((1, 3)), np.column_stack([np.cos(angle), np.sin(angle), 0.3 * np.sin(angle)])])
    rings = rings_of([order, *[[]] * 5], [closed, *[False] * 5])
    normals = np.tile([0.0, 0, 1], (6, 1))
    assert rings.folded(points, normals)[0] == rings.folded(points, -normals)[0] == folded


# ---- stars in space


def test_star_rings_of_a_tilted_plane_are_those_of_the_flat_one(monkeypatch):
    rng = np.random.default_rng(4)
    flat = np.column_stack([rng.uniform(size=(300, 2)), np.zeros(300)])
    _, neighbours = nearest_neighbours(flat, 12)
    up = np.tile([0.0, 0, 1], (300, 1))
    rings = star_rings(flat, np.arange(300), neighbours[:, 1:], plane_axes(up))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    monkeypatch.setattr(module, "STAR_CHUNK", 64)
    tilted = star_rings(flat @ turn.T + 5, np.arange(300), neighbours[:, 1:], plane_axes(up @ turn.T))
    for a, b in zip(lists_of(rings), lists_of(tilted), strict=True):
        assert set(a) == set(b)
    np.testing.assert_array_equal(rings.closed, tilted.closed)
    assert 200 < rings.closed.sum() < 300
