"""Noisy points come to the ridge of their density, clean ones stay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Denoiser, OutlierRemover, RingBuilder, Sampler, samples
from glsk_o3d.data.points import noise_share
from glsk_o3d.filters.denoiser import subspace_mean_shift, to_ridges

PREPARED = Sampler() | OutlierRemover() | Denoiser()

TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]


def thread(noise=0.2, n=400):
    """A noisy line along x."""
    rng = np.random.default_rng(2)
    x = rng.uniform(-5, 5, n)
    return np.column_stack([x, 0 * x, 0 * x]) + noise * rng.normal(size=(n, 3))


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(1, 30), st.integers(1, 9))
def test_the_noise_share_is_that_of_its_definition(seed, n, k):
    rng = np.random.default_rng(seed)
    spread, neighbours = np.sort(rng.random((n, 3)), axis=1), rng.integers(0, n, (n, k))
    spread[:: n // 2 + 1] = 0  # points in one place
    ratio = [s[0] / s[2] if s[2] else 0.0 for s in spread]
    middle = np.array([np.median([ratio[j] for j in row]) for row in neighbours])
    expected = np.interp(middle, [0.2, 0.35], [0, 1])
    np.testing.assert_allclose(noise_share(spread, neighbours), expected, atol=1e-12)


@pytest.mark.parametrize("share", [1, 0.25])
def test_one_pass_is_that_of_its_definition(share):
    """A share of the way to the mean of the neighbours in a Gaussian, but for that along their main direction."""
    points = thread(n=60)
    moved = subspace_mean_shift(points, np.full(60, share), 1)
    for x, after in zip(points, moved, strict=True):
        distance = np.linalg.norm(points - x, axis=1)
        near = points[np.argsort(distance)[:32]]
        squared = np.sort(distance)[:32] ** 2
        weight = np.exp(-squared / (2 * squared.mean()))
        way = np.average(near, axis=0, weights=weight) - x
        along = np.linalg.eigh(np.cov(near, rowvar=False, aweights=weight))[1][:, 2]
        np.testing.assert_allclose(after, x + share * (way - along * (along @ way)), atol=1e-10)


def in_order(points):
    """The working cloud in the user's order and units."""
    return points.frame.out_of(points.cloud)[points.map.row_of_point]


@pytest.mark.parametrize("noise", [0.04, 0.06])
def test_noisy_points_move_to_their_ridge(noise):
    """Points that stand alone there are outliers too."""
    points = samples.tube(n=2000, radius=0.1, noise=noise, seed=2).points
    plain, state = Sampler()(points), (Sampler() | Denoiser())(points)
    np.testing.assert_allclose(in_order(plain), points, atol=1e-15)
    middle = (np.abs(points[:, 0]) < 0.4) & ~state.outlier
    before, after = (np.hypot(*in_order(each)[middle, 1:].T).std() for each in (plain, state))
    assert after < 0.8 * before
    np.testing.assert_array_equal(state.points, points)
    strict = PREPARED(points)
    assert strict.outlier.sum() == 2000 - len(strict) > (Sampler() | OutlierRemover())(points).outlier.sum()


@pytest.mark.parametrize("points", [samples.torus(600).points, samples.sheet(500, bend=0).points])
def test_clean_clouds_are_not_denoised(points):
    plain, denoised = Sampler()(points), (Sampler() | Denoiser(denoise=9))(points)
    np.testing.assert_array_equal(denoised.cloud, plain.cloud)
    np.testing.assert_array_equal(denoised.neighbours, plain.neighbours)


@pytest.mark.slow
def test_dense_noisy_clouds_are_averaged():
    """Neighbourhoods as wide as those of 4096 to 8192 points, and less noise in them the more points there are."""
    noise = 0.01
    sample = samples.torus(20000, noise=noise)
    state = (PREPARED | RingBuilder())(sample.points)
    assert 4096 <= len(state.cloud) < 8192 + 400
    assert state.report.n_distinct == state.report.n_input - state.report.n_outliers == state.map.sampled.sum()
    assert state.mass.mean() == pytest.approx(1, rel=1e-12)
    alone = to_ridges(OutlierRemover()(sample.points), 4)

    def off(cloud):
        x, y, z = cloud.T
        return np.hypot(np.hypot(x, y) - 0.4, z).std()

    assert off(in_order(state)) < 0.8 * off(in_order(alone))
    # every point has its place near it
    away = np.linalg.norm(in_order(state) - sample.points, axis=1)
    assert np.quantile(away, 0.99) < 6 * noise * np.linalg.norm(np.ptp(sample.points, axis=0))
