"""Outliers, among themselves too."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d import Denoiser, OutlierRemover, RingBuilder, Sampler, StageError, samples
from glsk_o3d.filters.outlier_remover import inliers
from glsk_o3d.geometry.grid_sampling import sample_grid
from glsk_o3d.geometry.neighbourhoods import mean_distances, nearest_neighbours

K, N = 16, 12000
SURFACE = samples.torus(N, ring_radius=0.4, radius=0.1).points


def inlying(points, weight=None):
    weight = np.ones(len(points)) if weight is None else weight
    neighbours = nearest_neighbours(points, K)[1]
    distance = mean_distances(points, neighbours)
    return inliers(points, weight, neighbours, distance, np.zeros(len(points), bool), 2.5, 8)[0]


def floating(n, seed=0, reach=0.6):
    """Points anywhere in a box, but for those near to the surface."""
    points = np.random.default_rng(seed).uniform(-reach, reach, (4 * n, 3))
    return points[cKDTree(SURFACE).query(points)[0] > 0.05][:n]


@pytest.mark.parametrize("n", [1, 5, 200])
def test_points_that_float_around_a_surface_or_far_away_go_and_sparse_parts_stay(n):
    """Whether they stand out alone, or have each other for neighbours."""
    island = [3, 0, 0] + np.random.default_rng(1).uniform(-0.3, 0.3, (n, 3))
    for others in (floating(n), island):
        np.testing.assert_array_equal(inlying(np.concatenate([SURFACE, others])), np.arange(N))
    part = samples.torus(800, ring_radius=0.2, radius=0.05).points + [0.7, 0, 0]  # a quarter of the points for its area
    assert len(inlying(np.concatenate([SURFACE, part]))) == N + 800


def test_weights_of_a_sample_tell_a_surface_from_floating_points():
    """A sample evens out the density that tells a surface from what floats around it; the weight knows it."""
    dense = samples.torus(60000, ring_radius=0.4, radius=0.1).points
    gas = floating(2500)
    kept, _, counts = sample_grid(np.concatenate([dense, gas]), 12000)
    points, true = np.concatenate([dense, gas])[kept], kept < len(dense)
    actual = np.ones(len(kept), bool)
    actual[inlying(points, counts)] = False
    assert not actual[true].any()
    assert actual[~true].mean() > 0.99


def test_outliers_do_not_depend_on_pose_scale_and_order():
    points = np.concatenate([SURFACE, floating(300), [3, 0, 0] + floating(40)])
    kept = inlying(points)
    rng = np.random.default_rng(0)
    turned = 7 * points @ Rotation.random(random_state=rng).as_matrix().T + [1, 2, 3]
    np.testing.assert_array_equal(inlying(turned), kept)
    order = rng.permutation(len(points))
    np.testing.assert_array_equal(np.sort(order[inlying(points[order])]), kept)


TORUS = samples.torus(n=600).points
ALL, STRICT = Sampler(), Sampler() | OutlierRemover()


def group(n, wide, seed=4):
    """Points beside the torus."""
    return [1.5, 0, 1] + wide * np.random.default_rng(seed).normal(size=(n, 3))


@pytest.mark.parametrize("seed", [2, 9])
def test_a_group_of_outliers_that_hide_each_other_is_found_in_rounds(seed):
    """At first most of ten have others among their neighbours that are as far off."""
    points = np.concatenate([TORUS, group(10, 0.4, seed)])
    state = (STRICT | RingBuilder())(points)
    np.testing.assert_array_equal(state.outlier, np.arange(610) >= 600)
    assert (state.report.n_outliers, state.report.n_distinct) == (10, 600)
    assert not STRICT(points[~state.outlier]).outlier.any()  # nothing more is found
    assert not (ALL | OutlierRemover(outlier_factor=0))(points).outlier.any()


@pytest.mark.parametrize("outliers", [np.outer([1, 2, 4, 8, 16], [1, 0.3, 1]), group(6, 0.01), group(10, 0.4)])
def test_a_cloud_without_its_outliers_is_the_clean_one(outliers):
    order = np.random.default_rng(0).permutation(600 + len(outliers))
    mixed = np.concatenate([TORUS, outliers])[order]
    state, clean = STRICT(mixed), STRICT(TORUS)
    np.testing.assert_array_equal(state.outlier, order >= 600)
    np.testing.assert_allclose(state.cloud, clean.cloud, atol=1e-15)  # sums in another order
    np.testing.assert_array_equal(state.neighbours, clean.neighbours)
    assert state.frame.diagonal == pytest.approx(clean.frame.diagonal, rel=1e-15)
    kept = order < 600
    np.testing.assert_array_equal(state.map.row_of_point[kept], clean.map.row_of_point[order[kept]])
    # outliers go with the nearest point that is none
    nearest = cKDTree(TORUS).query(mixed[~kept])[1]
    np.testing.assert_array_equal(state.map.row_of_point[~kept], clean.map.row_of_point[nearest])


def veiled(points, share, seed=0, reach=0.3, across=0.01):
    """A cloud seen from above, and after it mixed pixels: a veil below its outline, down to the ground."""
    rng = np.random.default_rng(seed)
    hull = points[np.argsort(-np.linalg.norm(points[:, :2], axis=1))[: len(points) // 8]]  # near the outer outline
    veil = hull[rng.choice(len(hull), round(share * len(points)), replace=False)].copy()
    veil[:, :2] += rng.normal(0, across, (len(veil), 2))
    veil[:, 2] -= rng.uniform(0.12, 0.12 + reach, len(veil))
    return np.concatenate([points, veil])


RING = samples.torus(4000, ring_radius=0.4, radius=0.1).points


@pytest.mark.parametrize("share", [0.03, 0.05, 0.08])
def test_a_veil_of_mixed_pixels_goes(share):
    points = veiled(RING, share)
    state = STRICT(points)
    assert state.report.n_mixed > 0
    assert state.outlier[4000:].mean() > 0.85
    assert state.outlier[:4000].mean() < 0.01


def test_twigs_and_noise_are_no_mixed_pixels():
    """Where little of a cloud is a surface, sparse points are parts of it."""
    for shape in (samples.tree(4096, forks=6, seed=1), samples.torus(4000, noise=0.03)):
        assert STRICT(shape.points).report.n_mixed == 0


def test_points_that_were_moved_are_refused():
    """Their places would come back: neighbourhoods are measured anew where the points were."""
    tube = samples.tube(2000, noise=0.02).points
    with pytest.raises(StageError, match="OutlierRemover comes before Denoiser"):
        (Sampler(size="all") | Denoiser() | OutlierRemover(outlier_factor=1.5))(tube)
