"""Thinning: who is left, who speaks for whom, and that nothing else decides it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import samples
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours, principal
from glsk_o3d.preparation.denoising import MOST_IN_ONE, average_noisy
from glsk_o3d.preparation.sampling import sample_grid
from glsk_o3d.preparation.thinning import ENOUGH, spacing_enough, thin, thin_nearer


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


def test_grids_end_somewhere():
    """Where all distances are equal no two points may choose each other; more are left then, and it ends."""
    grid = np.stack(np.meshgrid(*[np.arange(12.0)] * 2, [0.0]), -1).reshape(-1, 3)
    into = thinned(grid, 10)
    assert 10 <= len(left(into)) < 144
    np.testing.assert_array_equal(into[into], into)


# ---- where there are more than enough


def evened(points, around, k=16):
    neighbours = nearest_neighbours(points, k)[1]
    apart = spacing_enough(points, neighbours, principal(points, neighbours)[0], around)
    return thin_nearer(points, neighbours, apart), apart


def tube(many, noise, seed=0):
    """Points of a tube of radius 1 with so many around it; noise in units of their spacing."""
    rng, spacing = np.random.default_rng(seed), 2 * np.pi / many
    n = int(2 * np.pi * 20 / spacing**2)
    turn = rng.uniform(0, 2 * np.pi, n)
    points = np.column_stack([np.cos(turn), np.sin(turn), rng.uniform(0, 20, n)])
    return points + rng.normal(0, noise * spacing, points.shape)


@pytest.mark.parametrize("noise", [0, 0.1, 0.2])
@pytest.mark.parametrize("around", [20, 40])
def test_dense_tubes_are_merged_as_far_as_allowed_and_sparse_ones_stay(around, noise):
    """A cylinder with 100 points around it, and one with half as many as are enough; twice the spacing at a time."""
    for many in (100, around / 2):
        points = tube(many, noise)
        into, apart = evened(points, around)
        np.testing.assert_array_equal(into[into], into)
        spacing, kept = 2 * np.pi / many, left(into)
        assert np.median(apart) <= 2.1 * spacing
        distance, other = (nearest[:, 1] for nearest in nearest_neighbours(points[kept], 2))
        asked, mutual = np.minimum(apart[kept], apart[kept[other]]), other[other] == np.arange(len(other))
        assert (distance >= asked)[mutual].mean() > 0.97  # of the rest fewer than one in a hundred would merge
        if many == 100:
            assert len(left(into)) < 0.3 * len(points)
        else:
            assert len(left(into)) > 0.7 * len(points)
            gone = np.flatnonzero(into != np.arange(len(points)))
            assert (np.linalg.norm(points[gone] - points[into[gone]], axis=1) < spacing).all()


def test_a_plane_has_its_share_of_the_points_that_are_enough():
    """No part of it is thin, so that only their number says how far apart they may be."""
    points = np.column_stack([np.random.default_rng(0).uniform(0, 1, (9000, 2)), np.zeros(9000)])
    apart = evened(points, 20)[1]
    inner = (np.abs(points[:, :2] - 0.5) < 0.3).all(axis=1)
    assert np.median(apart[inner]) == pytest.approx(np.sqrt(0.42 / ENOUGH), rel=0.1)
    assert len(left(evened(points, 20)[0])) == pytest.approx(ENOUGH, rel=0.1)


# ---- on a grid


@pytest.mark.parametrize("n", [100, 700, 2500])
def test_a_grid_keeps_about_so_many_each_the_nearest_to_the_middle_of_its_cell(surface, n):
    kept, into, counts = sample_grid(surface, n)
    np.testing.assert_array_equal(counts, np.bincount(into))
    assert 0.6 * n < len(kept) < 1.7 * n
    np.testing.assert_array_equal(into[kept], np.arange(len(kept)))
    for cell in range(len(kept)):
        members = np.flatnonzero(into == cell)
        away = np.linalg.norm(surface[members] - surface[members].mean(axis=0), axis=1)
        assert away[members == kept[cell]] <= away.min() * (1 + 1e-12)
    # cells are cubes of one size, anywhere along the axes
    spans = [np.ptp(surface[into == cell], axis=0).max() for cell in range(len(kept))]
    assert max(spans) < 3 * np.ptp(surface, axis=0).max() / np.sqrt(n)


def test_copies_on_a_grid_neither_count_nor_pull(surface):
    order = np.random.default_rng(0).permutation(np.append(np.arange(3000), np.repeat(np.arange(0, 3000, 50), 9)))
    kept, into, counts = sample_grid(surface[order], 500)
    for cell in range(len(kept)):
        members = np.unique(order[into == cell])
        away = np.linalg.norm(surface[members] - surface[members].mean(axis=0), axis=1)
        assert away[members == order[kept[cell]]] <= away.min() * (1 + 1e-12)
        assert counts[cell] == len(members)


def test_a_grid_that_is_too_coarse_keeps_all():
    """Half of the points so far off that the others would be in a few of the finest cells."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(size=(500, 3)), 1e9 + np.zeros((500, 3))])
    kept, into, counts = sample_grid(points, 100)
    np.testing.assert_array_equal(counts, 1)
    np.testing.assert_array_equal(kept, np.arange(1000))
    np.testing.assert_array_equal(into, np.arange(1000))


# ---- averaging


@pytest.mark.parametrize("n", [300, 700])
def test_means_of_noisy_points(surface, n):
    rng = np.random.default_rng(0)
    near = nearest_neighbours(surface, 16)[1]
    noise = np.where(surface[:, 0] > 0, rng.uniform(0.1, 1, 3000), 0)
    weight = rng.uniform(1, 9, 3000)
    into, mean, total = average_noisy(surface, near, noise, weight, n)
    size = np.bincount(into)
    assert size.max() == np.floor(min(MOST_IN_ONE, np.count_nonzero(noise) / n))
    assert n <= len(np.unique(into[noise > 0])) < np.count_nonzero(noise) / 1.5
    np.testing.assert_allclose(total, np.bincount(into, weight), rtol=1e-12)
    for group in (0, len(mean) // 2, int(np.argmax(size))):
        rows = np.flatnonzero(into == group)
        np.testing.assert_allclose(mean[group], np.average(surface[rows], axis=0, weights=weight[rows]), rtol=1e-12)
    clean = noise == 0
    assert (size[into[clean]] == 1).all()
    np.testing.assert_allclose(mean[into[clean]], surface[clean], rtol=1e-15)
