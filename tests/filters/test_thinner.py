"""Thinning: who is left, who speaks for whom, and that nothing else decides it."""

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.filters.thinner import default_size, spacing_enough, thin, thin_nearer
from glsk_o3d.geometry.neighbourhoods import nearest_neighbours, principal


def thinned(points, n, k=16):
    return thin(points, nearest_neighbours(points, min(k, len(points)))[1], n)


def remaining(into):
    return np.flatnonzero(into == np.arange(len(into)))


@pytest.fixture(scope="module")
def surface():
    return samples.torus(3000).points


@pytest.mark.parametrize("n", [1, 7, 750, 2999, 3000])
def test_exactly_n_points_remain_and_represent_the_others(surface, n):
    into = thinned(surface, n)
    assert len(remaining(into)) == n
    np.testing.assert_array_equal(into[into], into)


def test_the_nearest_pairs_are_merged_first():
    """Pairs 1, 2, 3, ... apart, far from each other: the n nearest ones are merged."""
    first = np.column_stack([100.0 * np.arange(10), np.zeros(10), np.zeros(10)])
    points = np.concatenate([first, first + np.outer(np.arange(1, 11), [0, 1, 0])])
    for merged in range(11):
        into = thinned(points, 20 - merged)
        np.testing.assert_array_equal(into[:merged] == into[10 : 10 + merged], True)
        assert len(remaining(into)) == 20 - merged
        assert (into[merged:10] == np.arange(merged, 10)).all()


def evened(points, around):
    neighbours = nearest_neighbours(points, 16)[1]
    spacing = spacing_enough(points, neighbours, principal(points, neighbours)[0], around)
    return thin_nearer(points, neighbours, spacing), spacing


@pytest.mark.parametrize("noise", [0, 0.2])
def test_dense_tubes_are_merged_as_far_as_allowed_and_sparse_ones_stay(noise):
    """A cylinder with 100 points around it, and one with half as many as are enough; noise in units of the spacing."""
    for many, around in ((100, 40), (20, 40)):
        rng, spacing = np.random.default_rng(0), 2 * np.pi / many
        n = int(2 * np.pi * 20 / spacing**2)
        turn = rng.uniform(0, 2 * np.pi, n)
        points = np.column_stack([np.cos(turn), np.sin(turn), rng.uniform(0, 20, n)])
        points += rng.normal(0, noise * spacing, points.shape)
        into, spacing_allowed = evened(points, around)
        np.testing.assert_array_equal(into[into], into)
        assert np.median(spacing_allowed) <= 2.1 * spacing  # twice the spacing at a time
        if many == 100:
            assert len(remaining(into)) < 0.3 * n
        else:
            assert len(remaining(into)) > 0.7 * n
            assert (np.linalg.norm(points - points[into], axis=1) < spacing).all()


@pytest.mark.parametrize(
    ("n", "size"), [(8, 8), (25000, 25000), (25001, 25000), (152588, 25000), (160000, 25600), (10**6, 64000)]
)
def test_the_number_of_points_to_contract_follows_from_that_of_points(n, size):
    assert default_size(n) == size


@pytest.mark.parametrize("late", [glsk.OutlierRemover(), glsk.Denoiser()])
def test_filters_of_every_point_come_before_a_thinner(late):
    with pytest.raises(glsk.StageError, match="before Thinner"):
        (glsk.Thinner() | late)(samples.torus(5000).points)


def test_thinned_clouds_keep_all_points_and_their_mass():
    points, n = samples.torus(2000).points, 500
    state, whole = (glsk.Thinner(around=0, thin_to=n) | glsk.RingBuilder())(points), glsk.RingBuilder()(points)
    assert len(state) == n == state.report.n_contracted < len(whole) == 2000
    assert state.report.n_sampled == state.report.n_distinct == 2000
    assert len(glsk.Thinner(thin_to="all")(points)) == 2000
    assert state.map.sampled.all()
    np.testing.assert_array_equal(state.cloud, whole.cloud)
    np.testing.assert_array_equal(state.normals, whole.normals)
    np.testing.assert_array_equal(state.positions, state.cloud[state.survivors])
    np.testing.assert_array_equal(state.map.survivor_of_row[state.survivors], np.arange(n))
    np.testing.assert_allclose(state.mass, np.bincount(state.map.survivor_of_row) * n / 2000, rtol=1e-14)
    skeleton = (glsk.Contractor(reducer=glsk.LPRReducer()) | glsk.Connector() | glsk.Refiner())(state)
    assert len(skeleton.vertex_of_point) == 2000
    assert skeleton.n_loops == 1
