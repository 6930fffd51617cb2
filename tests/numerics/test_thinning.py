"""Thinning: who is left, who speaks for whom, and that nothing else decides it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import samples
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
from glsk_o3d.numerics.thinning import thin


def thinned(points, n, k=16):
    return thin(points, nearest_neighbours(points, min(k, len(points)))[1], n)


def left(into):
    return np.flatnonzero(into == np.arange(len(into)))


@pytest.fixture(scope="module")
def surface():
    return samples.torus(3000).points


@pytest.mark.parametrize("n", [1, 2, 7, 100, 750, 1499, 2999])
def test_exactly_so_many_are_left_and_all_others_have_one_of_them(surface, n):
    into = thinned(surface, n)
    assert len(left(into)) == n
    np.testing.assert_array_equal(into[into], into)


@pytest.mark.parametrize("n", [3000, 3001, 10**9])
def test_few_enough_stay_as_they_are(surface, n):
    np.testing.assert_array_equal(thinned(surface, n), np.arange(3000))


def test_nearest_pairs_go_first():
    """Pairs 1, 2, 3, ... apart, far from each other: the n nearest ones are merged."""
    first = np.column_stack([100.0 * np.arange(10), np.zeros(10), np.zeros(10)])
    points = np.concatenate([first, first + np.outer(np.arange(1, 11), [0, 1, 0])])
    for merged in range(11):
        into = thinned(points, 20 - merged)
        np.testing.assert_array_equal(into[:merged] == into[10 : 10 + merged], True)
        assert len(left(into)) == 20 - merged
        assert (into[merged:10] == np.arange(merged, 10)).all()


@pytest.mark.parametrize("n", [150, 600, 1500])
def test_gaps_stay_small_and_dense_parts_dense(n):
    """One half of a sheet is eight times as dense as the other."""
    rng = np.random.default_rng(0)
    x = np.concatenate([rng.uniform(0, 1, 4000), rng.uniform(1, 2, 500)])
    points = np.column_stack([x, rng.uniform(0, 1, 4500), np.zeros(4500)])
    kept = points[left(thinned(points, n))]
    assert 0.8 < (kept[:, 0] < 1).mean() < 0.9
    gap = cKDTree(kept).query(points)[0].max()
    chance = [cKDTree(points[rng.choice(4500, n, replace=False)]).query(points)[0].max() for _ in range(5)]
    assert gap < 0.9 * min(chance)


def test_does_not_depend_on_order_turn_or_scale(surface):
    rng = np.random.default_rng(1)
    order, turn = rng.permutation(3000), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    into = thinned(surface, 800)
    again = thinned(1e3 * surface[order] @ turn + [5, 6, 7], 800)
    np.testing.assert_array_equal(order[again], into[order])


def test_grids_end_somewhere():
    """Where all distances are equal no two points may choose each other; more are left then, and it ends."""
    grid = np.stack(np.meshgrid(*[np.arange(12.0)] * 2, [0.0]), -1).reshape(-1, 3)
    into = thinned(grid, 10)
    assert 10 <= len(left(into)) < 144
    np.testing.assert_array_equal(into[into], into)
