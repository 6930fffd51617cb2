"""RingBuilder: cloud -> rings."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from glsk_o3d import (
    Connector,
    Contraction,
    Contractor,
    InvalidCloudError,
    InvalidParameterError,
    LPRReducer,
    Refiner,
    RingBuilder,
    samples,
)
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
from glsk_o3d.pipelines import default
from glsk_o3d.ring_builder import default_k, default_size, published_k

TORUS = samples.torus(n=600).points
SHEET = samples.sheet(n=500, bend=0).points


def named_rings(state):
    """For every distinct input point, by its first index: (ring in such indices, closed), from its least entry on."""
    name = state.point_of_survivor
    rings = {}
    for i, point in enumerate(name.tolist()):
        row = name[state.rings[i]].tolist()
        ways = [row, row[::-1]]
        if state.rings.closed[i]:
            ways = [way[way.index(min(way)) :] + way[: way.index(min(way))] for way in ways]
        rings[point] = (min(ways), bool(state.rings.closed[i]))
    return rings


def in_order(state):
    """The working cloud in the user's order and units."""
    return state.frame.out_of(state.cloud)[state.representative_of_point]


NUMBERS = {
    published_k: [(8, 8), (708, 8), (709, 9), (1024, 12), (1987, 24), (2458, 29), (2459, 30), (10**6, 30)],
    default_k: [(8, 8), (614, 8), (615, 9), (2048, 13), (3723, 15), (3724, 16), (4096, 16), (10**8, 16)],
    default_size: [(8, 8), (25000, 25000), (25001, 25000), (152588, 25000), (160000, 25600), (10**6, 64000)],
}


@pytest.mark.parametrize("rule", NUMBERS, ids=lambda rule: rule.__name__)
def test_numbers_by_the_number_of_points(rule):
    assert [(n, rule(n)) for n, _ in NUMBERS[rule]] == NUMBERS[rule]


@pytest.mark.parametrize(("word", "number"), [("auto", default_k), ("published", published_k)])
@pytest.mark.parametrize("n", [20, 900])
def test_words_for_numbers_of_neighbours(word, number, n):
    points = samples.torus(n=n).points
    assert named_rings(RingBuilder(k=word, around=0)(points)) == named_rings(RingBuilder(k=number(n), around=0)(points))


@pytest.mark.parametrize("k", ["auto", 5, 20])
@pytest.mark.parametrize("points", [TORUS, SHEET], ids=["torus", "sheet"])
def test_rings_are_delaunay_stars_in_the_principal_plane(points, k):
    state = RingBuilder(k=k)(points)
    cloud = state.cloud
    _, neighbours = nearest_neighbours(cloud, 8 if k == "auto" else k)
    for i, patch in enumerate(neighbours):
        assert patch[0] == i
        plane = np.linalg.svd(cloud[patch] - cloud[patch].mean(axis=0))[2][:2]
        triangulation = Delaunay((cloud[patch] - cloud[i]) @ plane.T)
        triangles = triangulation.simplices[(triangulation.simplices == 0).any(axis=1)]
        opposite = {frozenset(patch[list(set(triangle) - {0})].tolist()) for triangle in triangles.tolist()}
        ring = state.rings[i].tolist()
        following = ring[1:] + (ring[:1] if state.rings.closed[i] else [])
        assert {frozenset(pair) for pair in zip(ring, following, strict=False)} == opposite
        assert state.rings.closed[i] == (0 not in triangulation.convex_hull)


def test_state_says_what_it_is():
    state = RingBuilder()(TORUS)
    np.testing.assert_allclose(np.sort(state.to_point_cloud().points, axis=0), np.sort(TORUS, axis=0), atol=1e-15)
    n = len(TORUS)
    assert isinstance(state, Contraction)
    assert len(state) == state.report.n_input == state.report.n_distinct == n
    np.testing.assert_array_equal(state.points, TORUS)
    np.testing.assert_array_equal(np.sort(state.representative_of_point), np.arange(n))
    np.testing.assert_array_equal(state.survivor_of_point, state.representative_of_point)
    np.testing.assert_array_equal(state.representative_of_point[state.point_of_survivor], np.arange(n))
    np.testing.assert_allclose(state.contracted[state.survivor_of_point], TORUS, atol=1e-15)
    np.testing.assert_array_equal(state.mass, 1)
    assert state.ring_ratio == 1
    distance = np.linalg.norm(state.cloud[state.rings.indices] - state.cloud[state.rings.centres], axis=1)
    np.testing.assert_allclose(state.ring_size, [d.min() for d in np.split(distance, state.rings.indptr[1:-1])])
    edges = np.mean([d.mean() for d in np.split(distance, state.rings.indptr[1:-1])])
    assert state.mean_ring_edge == pytest.approx(edges, rel=1e-12)
    assert state.report.iterations == ()
    assert "not contracted" in state.report.stop_reason
    assert list(state.report.seconds) == ["RingBuilder"]


def test_order_place_size_and_rotation_do_not_matter():
    """Coordinates are rounded so that offset and factor are exact: then all rings are the same."""
    points, rng = np.round(TORUS * 2**20) / 2**20, np.random.default_rng(0)
    rings = named_rings(RingBuilder()(points))
    turn, order = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.permutation(len(points))
    for moved in (points + 2**20, points * 2.0**40, points * [1, -1, 1], points[:, [2, 0, 1]], points @ turn):
        assert named_rings(RingBuilder()(moved)) == rings
    for i, (row, closed) in named_rings(RingBuilder()(points[order])).items():
        expected, is_closed = rings[order[i]]
        assert ({*order[row].tolist()}, closed) == ({*expected}, is_closed)


def test_duplicates_are_one_point():
    single = RingBuilder()(TORUS)
    order = np.random.default_rng(2).permutation(np.repeat(np.arange(600), 3))
    state = RingBuilder()(TORUS[order])
    assert (state.report.n_input, state.report.n_distinct, len(state)) == (1800, 600, 600)
    np.testing.assert_allclose(state.cloud, single.cloud, atol=1e-15)
    np.testing.assert_array_equal(state.representative_of_point, single.representative_of_point[order])
    np.testing.assert_array_equal(state.rings.indices, single.rings.indices)
    np.testing.assert_array_equal(order[state.point_of_survivor], single.point_of_survivor)
    first = np.unique(order, return_index=True)[1]
    np.testing.assert_array_equal(np.sort(state.point_of_survivor), np.sort(first))


def test_invalid_points_are_counted_and_dropped_only_when_asked():
    points = TORUS.copy()
    points[[5, 70, 599]] = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]]
    with pytest.raises(InvalidCloudError, match=r"index 5.*drop_invalid=True"):
        RingBuilder()(points)
    state = RingBuilder(drop_invalid=True)(points)
    assert (state.report.n_input, state.report.n_dropped, state.report.n_distinct) == (600, 3, 597)
    np.testing.assert_array_equal(np.flatnonzero(state.representative_of_point < 0), [5, 70, 599])
    np.testing.assert_array_equal(np.flatnonzero(state.survivor_of_point < 0), [5, 70, 599])
    valid = np.delete(TORUS, [5, 70, 599], axis=0)
    np.testing.assert_array_equal(state.cloud, RingBuilder()(valid).cloud)
    assert 599 not in state.point_of_survivor


# ---- outliers


STRICT = RingBuilder(k=16, outlier_factor=2.5)


def group(n, wide, seed=4):
    """Points beside the torus."""
    return [1.5, 0, 1] + wide * np.random.default_rng(seed).normal(size=(n, 3))


@pytest.mark.parametrize("seed", [2, 9])
def test_a_group_of_outliers_that_hide_each_other_is_found_in_rounds(seed):
    """At first most of ten have others among their neighbours that are as far off."""
    points = np.concatenate([TORUS, group(10, 0.4, seed)])
    state = STRICT(points)
    np.testing.assert_array_equal(state.outlier, np.arange(610) >= 600)
    assert (state.report.n_outliers, state.report.n_distinct) == (10, 600)
    assert STRICT(points[~state.outlier]).report.n_outliers == 0  # nothing more is found
    assert replace(STRICT, outlier_factor=0)(points).report.n_outliers == 0


@pytest.mark.parametrize("outliers", [np.outer([1, 2, 4, 8, 16], [1, 0.3, 1]), group(6, 0.01), group(10, 0.4)])
def test_what_is_left_is_the_cloud_without_them(outliers):
    order = np.random.default_rng(0).permutation(600 + len(outliers))
    mixed = np.concatenate([TORUS, outliers])[order]
    state, clean = STRICT(mixed), STRICT(TORUS)
    np.testing.assert_array_equal(state.outlier, order >= 600)
    np.testing.assert_allclose(state.cloud, clean.cloud, atol=1e-15)  # sums in another order
    np.testing.assert_array_equal(state.rings.indices, clean.rings.indices)
    assert state.frame.diagonal == pytest.approx(clean.frame.diagonal, rel=1e-15)
    kept = order < 600
    np.testing.assert_array_equal(state.representative_of_point[kept], clean.representative_of_point[order[kept]])
    # outliers go with the nearest point that is none
    nearest = cKDTree(TORUS).query(mixed[~kept])[1]
    np.testing.assert_array_equal(state.representative_of_point[~kept], clean.representative_of_point[nearest])


# ---- noise


@pytest.mark.parametrize(("noise", "alone"), [(0.04, False), (0.06, True)])
def test_denoising_moves_noisy_points_to_their_ridge_before_the_rings(noise, alone):
    """Points that stand alone there are outliers too."""
    points = samples.tube(n=800, radius=0.1, noise=noise, seed=2).points
    builder = RingBuilder(k=16, outlier_factor=0)
    plain, state = replace(builder, denoise=0)(points), builder(points)
    np.testing.assert_allclose(in_order(plain), points, atol=1e-15)
    middle = np.abs(points[:, 0]) < 0.4
    before, after = (np.hypot(*in_order(each)[middle, 1:].T).std() for each in (plain, state))
    assert after < 0.8 * before
    np.testing.assert_array_equal(state.points, points)
    np.testing.assert_array_equal(state.normals, plain.normals)  # a ridge has none, and is not noisy any more
    np.testing.assert_array_equal(state.noise, plain.noise)
    np.testing.assert_array_equal(state.ring_size, state.rings.nearest(state.cloud)[1])
    strict, known = RingBuilder(k=16)(points), RingBuilder(k=16, denoise=0)(points).outlier
    assert strict.outlier[known].all()
    assert strict.report.n_outliers == strict.outlier.sum() == 800 - len(strict)
    assert (strict.outlier.sum() > known.sum()) >= alone
    assert sorted(strict.point_of_survivor.tolist()) == np.flatnonzero(~strict.outlier).tolist()


@pytest.mark.parametrize("points", [TORUS, SHEET], ids=["torus", "sheet"])
def test_clean_clouds_are_not_denoised(points):
    plain, denoised = RingBuilder(denoise=0)(points), RingBuilder(denoise=9)(points)
    np.testing.assert_array_equal(denoised.cloud, plain.cloud)
    np.testing.assert_array_equal(denoised.rings.indices, plain.rings.indices)


# ---- averaging where noise is wider than neighbourhoods


@pytest.mark.slow
def test_dense_noisy_clouds_are_averaged():
    """Neighbourhoods as wide as those of 4096 to 8192 points, and less noise in them the more points there are."""
    noise = 0.01
    sample = samples.torus(20000, noise=noise)
    state = RingBuilder()(sample.points)
    assert 4096 <= len(state.cloud) < 8192 + 400
    assert state.report.n_distinct == state.report.n_input - state.report.n_outliers == state.sampled.sum()
    assert state.mass.mean() == pytest.approx(1, rel=1e-12)
    alone = RingBuilder(thin_to="all")(sample.points)

    def off(cloud):
        x, y, z = cloud.T
        return np.hypot(np.hypot(x, y) - 0.4, z).std()

    assert off(in_order(state)) < 0.8 * off(in_order(alone))
    # every point has its place near it
    away = np.linalg.norm(in_order(state) - sample.points, axis=1)
    assert np.quantile(away, 0.99) < 6 * noise * np.linalg.norm(np.ptp(sample.points, axis=0))


@pytest.mark.parametrize("settings", [dict(denoise=0), dict(radius=0.1), dict(thin_to="all")])
def test_clouds_are_not_averaged_where_points_shall_stay(settings):
    points = samples.torus(9000, noise=0.01).points
    state = RingBuilder(**settings)(points)
    assert len(state.cloud) == state.report.n_distinct


# ------------------------------------------------------------------------------------------ Open3D's search parameters


def test_open3d_search_parameters_are_plain_numbers_inside():
    search = pytest.importorskip("open3d").geometry
    cases = [
        (RingBuilder(k=search.KDTreeSearchParamKNN(12)), RingBuilder(k=12)),
        (RingBuilder(k=search.KDTreeSearchParamHybrid(0.5, 20)), RingBuilder(k=20, radius=0.5)),
        (RingBuilder(k=search.KDTreeSearchParamRadius(0.25)), RingBuilder(k=30, radius=0.25)),
    ]
    for given, plain in cases:
        given.check()
        assert given == plain
        assert hash(given) == hash(plain)
        assert eval(repr(given)) == plain
    for k, name in (
        (search.KDTreeSearchParamKNN(2), "k = 2"),
        (search.KDTreeSearchParamHybrid(-0.5, 20), "radius = -0.5"),
        (search.KDTreeSearchParam, "k = "),
        (search.KDTreeFlann(), "k = "),
    ):
        with pytest.raises(InvalidParameterError, match=name):
            RingBuilder(k=k)(TORUS)
    hybrid = search.KDTreeSearchParamHybrid(0.5, 20)
    with pytest.raises(InvalidParameterError, match="radius=None"):  # one of two radii would be lost unsaid
        RingBuilder(k=hybrid, radius=0.2)
    assert replace(RingBuilder(k=20), k=hybrid) == replace(RingBuilder(k=hybrid), k=hybrid) == RingBuilder(k=hybrid)


def test_radius_limits_the_rings():
    free, wide = RingBuilder(k=16)(TORUS), RingBuilder(k=16, radius=10.0)(TORUS)
    np.testing.assert_array_equal(free.rings.indices, wide.rings.indices)
    radius = 0.09
    near = RingBuilder(k=16, radius=radius)(TORUS)
    assert len(near.rings.indices) < len(free.rings.indices)
    scale = near.frame.scale
    third = cKDTree(near.cloud).query(near.cloud, 4)[0][:, 3] * scale
    length = near.rings.edge_lengths(near.cloud) * scale
    assert (length <= np.maximum(radius, third[near.rings.centres]) * (1 + 1e-9)).all()
    percent = RingBuilder(k=16, radius="5%")(TORUS)
    absolute = RingBuilder(k=16, radius=0.05 * near.frame.diagonal * scale)(TORUS)
    np.testing.assert_array_equal(percent.rings.indices, absolute.rings.indices)
    with pytest.raises(InvalidParameterError, match="radius"):  # in the wrong units
        RingBuilder(radius=1e-6)(TORUS)


# ---- thinning


def test_thinned_clouds_keep_all_points_and_their_mass():
    points, n = samples.torus(2000).points, 500
    state, whole = RingBuilder(around=0, thin_to=n)(points), RingBuilder(thin_to="all")(points)
    assert len(state) == n == state.report.n_contracted < len(whole) == 2000
    assert state.report.n_sampled == state.report.n_distinct == 2000
    assert state.sampled.all()
    np.testing.assert_array_equal(state.cloud, whole.cloud)
    np.testing.assert_array_equal(state.normals, whole.normals)
    np.testing.assert_array_equal(state.positions, state.cloud[state.survivors])
    np.testing.assert_array_equal(state.representative[state.survivors], np.arange(n))
    np.testing.assert_allclose(state.mass, np.bincount(state.representative) * n / 2000, rtol=1e-14)
    skeleton = (Contractor(reducer=LPRReducer()) | Connector() | Refiner())(state)
    assert len(skeleton.vertex_of_point) == 2000
    assert skeleton.n_loops == 1


@pytest.mark.slow
@pytest.mark.parametrize("n", [4000, 16000])
def test_a_tube_is_contracted_with_as_many_points_around_it_as_are_enough(n):
    """Whatever their number: the points contracted have the spacing of a tube with `around` points around it."""
    sample = samples.torus(n, radius=0.1)
    builder = RingBuilder()
    state = builder(sample.points)
    area = 4 * np.pi**2 * 0.4 * 0.1
    around = 2 * np.pi * 0.1 / np.sqrt(area / len(state))
    assert 18 < around < 45
    assert len(state) < 0.9 * n
    assert state.mass.mean() == pytest.approx(1, rel=1e-12)
    if n > 4000:  # of fewer all of the surface has no more than its share
        finer = replace(builder, around=45)(sample.points)
        assert len(finer) > len(state)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # normals are those of the lines
def test_scan_lines_much_denser_than_they_are_apart_are_a_surface():
    """The nearest points of each are of its own line, and show no plane; among those that are left they do."""
    height, turn = np.meshgrid(np.linspace(0, 3, 44), np.linspace(0, 2 * np.pi, 450, endpoint=False))
    turn = turn + 6 * np.random.default_rng(0).random(44)
    found = default()(np.column_stack([0.3 * np.cos(turn).ravel(), 0.3 * np.sin(turn).ravel(), height.ravel()]))
    assert found.report.n_contracted < 3000
    assert (found.n_components, found.n_loops, len(found.leaves)) == (1, 0, 2)


@pytest.mark.parametrize("around", [1e-310, 1, 1000])
def test_any_number_around_is_taken_on_curves_and_surfaces(around):
    t = np.linspace(0, 6, 3000)
    for points in (np.column_stack([np.cos(t), np.sin(t), 0.3 * t]), samples.torus(3000).points):
        assert 100 < len(RingBuilder(around=around)(points)) <= 3000


def test_thin_parts_keep_their_points():
    """A thick and a thin tube, equally dense: the thick one is merged, the thin one stays."""
    thick, thin = samples.tube(9000, radius=0.3, length=1.5).points, samples.tube(600, radius=0.02, length=1.5).points
    state = RingBuilder()(np.concatenate([thick, thin + [0, 1, 0]]))
    kept = state.point_of_survivor
    assert (kept < 9000).sum() < 0.5 * 9000
    assert (kept >= 9000).sum() > 0.7 * 600  # not those that are nearer than a twentieth of the way around
    gone = np.setdiff1d(np.arange(9000, 9600), kept) - 9000
    nearest = np.linalg.norm(thin[gone, None] - thin[kept[kept >= 9000] - 9000], axis=2).min(axis=1)
    assert np.quantile(nearest, 0.8) < np.sqrt(2 * np.pi * 0.02 * 1.5 / 600)  # their spacing


# ---- large clouds


def test_a_large_cloud_is_sampled_and_every_point_has_its_place():
    points = samples.torus(8000, noise=0.001).points
    points[17] = [np.nan, 0, 0]
    points[4000] = [0, 0, 3]
    state = RingBuilder(thin_to=800, drop_invalid=True)(points)
    assert 800 < state.report.n_sampled < 3 * 1600
    assert state.report.n_contracted <= 800
    assert state.sampled.sum() == state.report.n_distinct
    assert (state.representative_of_point[17], state.outlier[4000]) == (-1, True)
    assert not state.sampled[[17, 4000]].any()
    away = np.linalg.norm(in_order(state) - points, axis=1)
    assert away[state.sampled].max() < 1e-12
    assert np.delete(away, [17, *np.flatnonzero(state.outlier)]).max() < 0.1
    skeleton = (Contractor(reducer=LPRReducer()) | Connector() | Refiner())(state)
    assert skeleton.n_loops == 1
    assert (skeleton.vertex_of_point >= 0).sum() == 7999
    assert len(skeleton.supporting_points) == state.sampled.sum()
    # who says where the surface is has a normal, nobody else
    np.testing.assert_array_equal(np.isfinite(skeleton.normals[:, 0]), state.sampled)
