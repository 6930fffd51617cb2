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
    Pipeline,
    Refiner,
    RingBuilder,
    samples,
)
from glsk_o3d.analysis import compare
from glsk_o3d.numerics.neighbourhoods import local_outlier_ratio, nearest_neighbours, principal
from glsk_o3d.pipelines import default
from glsk_o3d.preparation import surface
from glsk_o3d.preparation.denoising import DENOISED_NOISE, DENOISED_RATIO, MOST_IN_ONE, subspace_mean_shift
from glsk_o3d.preparation.frame import MIN_POINTS
from glsk_o3d.preparation.surface import noise_share
from glsk_o3d.ring_builder import default_k, default_size, published_k

TORUS = samples.torus(n=600).points
SHEET = samples.sheet(n=500, bend=0).points

DENOISING = "glsk_o3d.preparation.denoising"


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


NUMBERS = {
    published_k: [(8, 8), (708, 8), (709, 9), (1024, 12), (1987, 24), (2458, 29), (2459, 30), (10**6, 30)],
    default_k: [(8, 8), (614, 8), (615, 9), (2048, 13), (3723, 15), (3724, 16), (4096, 16), (10**8, 16)],
    default_size: [(8, 8), (25000, 25000), (25001, 25000), (152588, 25000), (160000, 25600), (10**6, 64000)],
}


@pytest.mark.parametrize("rule", NUMBERS, ids=lambda rule: rule.__name__)
def test_numbers_by_the_number_of_points(rule):
    assert [(n, rule(n)) for n, _ in NUMBERS[rule]] == NUMBERS[rule]


@pytest.mark.parametrize(("word", "number"), [("auto", default_k), ("published", published_k)])
@pytest.mark.parametrize("n", [20, 900, 2000])
def test_words_for_numbers_of_neighbours(word, number, n):
    points = samples.torus(n=n).points
    assert named_rings(RingBuilder(k=word, around=0)(points)) == named_rings(RingBuilder(k=number(n), around=0)(points))


@pytest.mark.parametrize("k", ["published", "auto", 5, 20])
@pytest.mark.parametrize("points", [TORUS, SHEET], ids=["torus", "sheet"])
def test_rings_are_delaunay_stars_in_the_principal_plane(points, k):
    state = RingBuilder(k=k)(points)
    cloud = state.cloud
    _, neighbours = nearest_neighbours(cloud, {"published": 8, "auto": 8}.get(k, k))
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


def test_normals_of_a_torus():
    sample = samples.torus(n=3000)
    state = RingBuilder(thin_to="all")(sample.points)
    p = sample.points[state.point_of_survivor]
    centre = p * [1, 1, 0]
    centre *= 0.4 / np.linalg.norm(centre, axis=1, keepdims=True)
    exact = (p - centre) / 0.1
    angle = np.rad2deg(np.arccos(np.minimum(np.abs(np.einsum("ij,ij->i", state.normals, exact)), 1)))
    assert np.median(angle) < 3
    np.testing.assert_allclose(np.linalg.norm(state.normals, axis=1), 1, atol=1e-14)


def test_border_points_have_fans():
    state = RingBuilder(k=30)(SHEET)  # with fewer, all neighbours of a point inside may lie on one side of it
    corner = SHEET[state.point_of_survivor]
    middle = (np.abs(corner[:, :2]) < [0.42, 0.27]).all(axis=1)
    assert state.rings.closed[middle].all()
    outermost = np.concatenate([corner[:, :2].argmin(axis=0), corner[:, :2].argmax(axis=0)])
    assert not state.rings.closed[outermost].any()
    assert RingBuilder(k=24)(TORUS).rings.closed.all()


def test_order_place_size_and_rotation_do_not_matter():
    """Coordinates are rounded so that offset and factor are exact: then all rings are the same."""
    points = np.round(TORUS * 2**20) / 2**20
    rings = named_rings(RingBuilder()(points))
    for moved in (points + 2**20, points * 2.0**-9, points * 2.0**40, points * [1, -1, 1], points[:, [2, 0, 1]]):
        assert named_rings(RingBuilder()(moved)) == rings
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    assert named_rings(RingBuilder()(points @ turn)) == rings
    order = np.random.default_rng(1).permutation(len(points))
    renamed = {
        order[i]: ([order[j] for j in row], closed)
        for i, (row, closed) in named_rings(RingBuilder()(points[order])).items()
    }
    assert {i: (set(row), closed) for i, (row, closed) in renamed.items()} == {
        i: (set(row), closed) for i, (row, closed) in rings.items()
    }


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


def stands_out(points):
    distance, neighbours = nearest_neighbours(points, STRICT.k)
    return local_outlier_ratio(distance[:, 1:].mean(axis=1), neighbours) > STRICT.outlier_factor


@pytest.mark.parametrize("seed", [2, 4, 9, 13])
def test_a_group_of_outliers_that_hide_each_other_is_found_in_rounds(seed):
    """At first most of ten have others among their neighbours that are as far off."""
    points = np.concatenate([TORUS, group(10, 0.4, seed)])
    first = stands_out(points)
    assert not first[:600].any()
    assert 0 < first.sum() < 5
    state = STRICT(points)
    np.testing.assert_array_equal(state.outlier, np.arange(610) >= 600)
    assert (state.report.n_outliers, state.report.n_distinct) == (10, 600)


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


@pytest.mark.parametrize("seed", range(8))
def test_nothing_stands_out_of_what_is_left(seed):
    """However patchy the cloud is: the rounds end when there is nothing more to find."""
    rng = np.random.default_rng(seed)
    points = np.concatenate([TORUS, *(rng.normal(size=(rng.integers(1, 15), 3)) * rng.uniform(0, 2) for _ in range(6))])
    state = STRICT(points)
    assert 0 < stands_out(points).sum() <= state.report.n_outliers
    assert state.outlier[stands_out(points)].all()
    again = STRICT(points[~state.outlier])
    assert again.report.n_outliers == 0
    np.testing.assert_array_equal(again.cloud, state.cloud)


def test_no_factor_no_outliers():
    points = np.concatenate([TORUS, group(10, 0.4)])
    state = RingBuilder(outlier_factor=0)(points)
    assert (state.report.n_outliers, state.report.n_distinct, state.outlier.any()) == (0, 610, False)


@pytest.mark.parametrize("copies", [1, 20])
def test_outliers_are_left_in_where_hardly_anything_would_be_left(copies):
    """Seven points in one place and three far away: without these there is no cloud."""
    near = 0.01 * np.random.default_rng(0).normal(size=(7, 3))
    far = [[5, 0, 0], [0, 6, 0], [0, 0, 7]]
    state = STRICT(np.concatenate([np.repeat(near, copies, axis=0), far]))
    assert (state.report.n_outliers, state.report.n_distinct) == (0, 10)


# ---- noise


def noisy_tube(n=800):
    return samples.tube(n=n, radius=0.1, noise=0.04).points


def in_order(state):
    """The working cloud in the user's order and units."""
    return state.frame.out_of(state.cloud)[state.representative_of_point]


BY_16 = RingBuilder(k=16)
RAW = replace(BY_16, denoise=0)


def test_no_denoising_leaves_the_points():
    points = noisy_tube()
    np.testing.assert_allclose(in_order(RAW(points)), points, atol=1e-15)
    assert np.abs(in_order(BY_16(points)) - points).max() > 0.02


@pytest.mark.parametrize("passes", [1, 4])
def test_denoising_moves_the_cloud_to_its_ridges_before_the_rings(passes):
    points = noisy_tube()
    plain, denoised = RAW(points), replace(BY_16, denoise=passes, outlier_factor=0)(points)
    spread, normals = principal(plain.cloud, nearest_neighbours(plain.cloud, 16)[1])
    noise = noise_share(spread, nearest_neighbours(plain.cloud, 16)[1])
    np.testing.assert_array_equal(denoised.cloud, subspace_mean_shift(plain.cloud, noise, passes))
    np.testing.assert_array_equal(denoised.positions, denoised.cloud)
    assert denoised.positions is denoised.previous
    np.testing.assert_array_equal(denoised.representative_of_point, plain.representative_of_point)
    np.testing.assert_array_equal(denoised.points, points)
    # a ridge has no normals, and is not noisy any more
    for state in (plain, denoised):
        np.testing.assert_array_equal(state.normals, normals)
        np.testing.assert_array_equal(state.noise, noise)
    # rings are those of the moved cloud
    np.testing.assert_array_equal(denoised.ring_size, denoised.rings.nearest(denoised.cloud)[1])
    near = nearest_neighbours(denoised.cloud, 16)[1]
    assert all(set(denoised.rings[i].tolist()) <= set(near[i].tolist()) for i in range(len(denoised)))


def test_denoised_tube_is_thinner():
    points = noisy_tube()
    middle = np.abs(points[:, 0]) < 0.4
    spread = [np.hypot(*in_order(RingBuilder(denoise=passes)(points))[middle, 1:].T).std() for passes in (0, 4)]
    assert spread[1] < 0.8 * spread[0]


@pytest.mark.parametrize("points", [TORUS, SHEET], ids=["torus", "sheet"])
def test_clean_clouds_are_not_denoised(points):
    plain, denoised = RingBuilder(denoise=0)(points), RingBuilder(denoise=9)(points)
    np.testing.assert_array_equal(denoised.cloud, plain.cloud)
    np.testing.assert_array_equal(denoised.rings.indices, plain.rings.indices)


# ---- averaging where noise is wider than neighbourhoods


@pytest.mark.parametrize("n", [20000, 40000])
@pytest.mark.parametrize("noise", [0.01, 0.02])
def test_dense_noisy_clouds_are_averaged(n, noise):
    """Neighbourhoods as wide as those of 4096 to 8192 points, and less noise in them the more points there are."""
    sample = samples.torus(n, noise=noise)
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


def test_a_dense_noisy_ring_stays_one():
    """With neighbourhoods narrower than the noise its axis was two radii off, and the ring broke."""
    sample = samples.torus(50000, noise=0.01)
    skeleton = default()(sample.points)
    found = compare(skeleton, sample)
    assert found.topology
    assert found.error < 0.1


@pytest.mark.parametrize("settings", [dict(denoise=0), dict(radius=0.1), dict(thin_to="all")])
def test_clouds_are_not_averaged_where_points_shall_stay(settings):
    points = samples.torus(9000, noise=0.01).points
    state = RingBuilder(**settings)(points)
    assert len(state.cloud) == state.report.n_distinct


def test_clean_parts_are_not_averaged():
    points = samples.torus(9000).points
    noisy = samples.torus(20000, noise=0.02).points + [0, 0, 1]
    state = RingBuilder(around=0)(np.concatenate([points, noisy]))
    assert len(np.unique(state.representative_of_point[:9000])) == 9000
    assert len(np.unique(state.representative_of_point[9000:][~state.outlier[9000:]])) < 20000 / 2
    # each counts for all that it is the mean of
    many = np.unique(state.representative_of_point[~state.outlier], return_counts=True)[1]
    np.testing.assert_allclose(state.mass, many / many.mean(), rtol=1e-12)


def test_noisy_points_stay_where_averaging_them_would_hardly_make_fewer(monkeypatch):
    """A noisy part of a cloud, next to a clean one with three and with six times as many points."""
    monkeypatch.setattr(f"{DENOISING}.ENOUGH_NOISY", 400)
    noisy = samples.torus(1000, noise=0.05).points + [0, 0, 1]
    for clean, stays in ((3000, False), (6000, True)):
        state = RingBuilder(outlier_factor=0)(np.concatenate([samples.torus(clean).points, noisy]))
        assert (len(state.cloud) == clean + 1000) == stays
        assert len(state.cloud) > clean + 400


# ---- points that stand alone after denoising


def denoised_outliers(plain, passes):
    """The denoised cloud and which of its points stand alone, by definition."""
    near = nearest_neighbours(plain.cloud, 16)[1]
    noise = noise_share(principal(plain.cloud, near)[0], near)
    denoised = subspace_mean_shift(plain.cloud, noise, passes)
    distance, near = nearest_neighbours(denoised, 16)
    alone = local_outlier_ratio(distance[:, 1:].mean(axis=1), near) > DENOISED_RATIO
    return denoised, alone & (noise > DENOISED_NOISE), noise


@pytest.mark.parametrize("passes", [1, 4])
@pytest.mark.parametrize(("noise", "seed"), [(0.05, 2), (0.05, 3), (0.06, 2), (0.06, 4)])
def test_denoised_points_that_stand_alone_are_set_aside(noise, seed, passes):
    points = samples.tube(n=800, radius=0.1, noise=noise, seed=seed).points
    plain, state = RAW(points), replace(BY_16, denoise=passes)(points)
    denoised, alone, share = denoised_outliers(plain, passes)
    assert 0 < alone.sum() < 20
    np.testing.assert_array_equal(state.cloud, denoised[~alone])
    np.testing.assert_array_equal(state.noise, share[~alone])
    np.testing.assert_array_equal(state.normals, plain.normals[~alone])
    # they are outliers, like those found before, and go with the nearest that is left
    np.testing.assert_array_equal(state.outlier, plain.outlier | alone[plain.representative_of_point])
    expected = cKDTree(state.cloud).query(denoised)[1]
    np.testing.assert_array_equal(state.representative_of_point, expected[plain.representative_of_point])
    assert state.report.n_outliers == state.outlier.sum() == plain.report.n_outliers + alone.sum()
    assert state.report.n_distinct == len(state) == 800 - state.report.n_outliers
    # nothing else of the state knows them
    near = nearest_neighbours(state.cloud, 16)[1]
    assert all(set(state.rings[i].tolist()) <= set(near[i].tolist()) for i in range(len(state)))
    assert sorted(state.point_of_survivor.tolist()) == np.flatnonzero(~state.outlier).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_copies_share_the_fate_of_their_point_and_dropped_ones_have_none(seed):
    points = samples.tube(n=800, radius=0.1, noise=0.06, seed=2).points
    rng, filter = np.random.default_rng(seed), replace(BY_16, frame="box", drop_invalid=True)
    order = rng.permutation(np.concatenate([np.repeat(np.arange(800), rng.integers(1, 4, 800)), np.full(30, 800)]))
    once, state = filter(points), filter(np.concatenate([points, [[0, np.nan, 0]]])[order])
    kept, source = order < 800, order[order < 800]
    assert once.report.n_outliers > RAW(points).report.n_outliers > 0
    np.testing.assert_array_equal(state.cloud, once.cloud)
    np.testing.assert_array_equal(state.representative_of_point[kept], once.representative_of_point[source])
    np.testing.assert_array_equal(state.outlier[kept], once.outlier[source])
    assert (state.representative_of_point[~kept] == -1).all()
    assert not state.outlier[~kept].any()
    report = state.report
    assert (report.n_input, report.n_dropped, report.n_distinct) == (len(order), 30, once.report.n_distinct)
    assert report.n_outliers == once.outlier[source].sum()


def test_no_factor_no_lonely_points():
    points = samples.tube(n=800, radius=0.1, noise=0.06, seed=2).points
    state = replace(BY_16, outlier_factor=0)(points)
    assert denoised_outliers(replace(RAW, outlier_factor=0)(points), 4)[1].any()
    assert (state.report.n_outliers, len(state), state.outlier.any()) == (0, 800, False)


@pytest.mark.parametrize(("left", "stays"), [(MIN_POINTS - 1, True), (MIN_POINTS, False)])
def test_lonely_points_are_left_in_where_hardly_anything_would_be_left(monkeypatch, left, stays):
    points = samples.tube(n=24, radius=0.1, noise=0.1).points
    filter, noise = RingBuilder(k=8, outlier_factor=100.0), np.ones(24)
    monkeypatch.setattr(surface, "noise_share", lambda spread, neighbours: noise)
    monkeypatch.setattr(f"{DENOISING}.subspace_mean_shift", lambda cloud, noise, passes, weight: cloud)
    found = np.where(np.arange(24) < left, 1.0, 2 * DENOISED_RATIO)
    monkeypatch.setattr(f"{DENOISING}.local_outlier_ratio", lambda mean, neighbours: found)
    assert len(filter(points)) == (24 if stays else left)


@pytest.mark.parametrize("frame", ["box", "spread"])
def test_frame_is_that_of_the_distinct_points(frame):
    """However often some of them came."""
    filter = RingBuilder(frame=frame)
    often = np.concatenate([TORUS, np.repeat(TORUS[:3], 500, axis=0)])
    once, state = filter(TORUS).frame, filter(often).frame
    assert state.scale == pytest.approx(once.scale, rel=1e-12)
    assert state.diagonal == pytest.approx(once.diagonal, rel=1e-12)


def test_more_neighbours_than_points_are_all_points():
    points = np.repeat(TORUS[:12], 5, axis=0)
    many, all_of_them = RingBuilder(k=20)(points), RingBuilder(k=12)(points)
    assert named_rings(many) == named_rings(all_of_them)
    assert len(many) == 12


def test_to_point_cloud():
    cloud = RingBuilder()(TORUS).to_point_cloud()
    np.testing.assert_allclose(np.sort(np.asarray(cloud.points), axis=0), np.sort(TORUS, axis=0), atol=1e-15)


# ------------------------------------------------------------------------------------------ Open3D's search parameters


@pytest.fixture(scope="module")
def search():
    import open3d

    return open3d.geometry


def test_open3d_search_parameters_are_plain_numbers_inside(search):
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
    same = RingBuilder(k=search.KDTreeSearchParamKNN(12))(TORUS)
    np.testing.assert_array_equal(same.rings.indices, RingBuilder(k=12)(TORUS).rings.indices)


def test_open3d_search_parameters_that_do_not_fit(search):
    for k, name in (
        (search.KDTreeSearchParamKNN(2), "k = 2"),
        (search.KDTreeSearchParamHybrid(-0.5, 20), "radius = -0.5"),
        (search.KDTreeSearchParam, "k = "),
        (search.KDTreeFlann(), "k = "),
    ):
        with pytest.raises(InvalidParameterError, match=name):
            RingBuilder(k=k)(TORUS)
    with pytest.raises(InvalidParameterError, match="radius=None"):
        RingBuilder(k=search.KDTreeSearchParamHybrid(0.5, 20), radius=0.2)


def test_open3d_search_parameters_in_place_of_others(search):
    first, second = search.KDTreeSearchParamHybrid(0.5, 20), search.KDTreeSearchParamHybrid(0.25, 12)
    builder = RingBuilder(k=first)
    assert replace(builder, k=first) == builder
    assert replace(builder, k=second, radius=None) == RingBuilder(k=12, radius=0.25)
    assert replace(builder, k=search.KDTreeSearchParamKNN(12)) == RingBuilder(k=12, radius=0.5)
    with pytest.raises(InvalidParameterError, match="radius=None"):  # one of two radii would be lost unsaid
        replace(builder, k=second)


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


def test_a_radius_in_the_wrong_units_is_refused():
    with pytest.raises(InvalidParameterError, match="radius"):
        RingBuilder(radius=1e-6)(TORUS)


# ---- thinning


@pytest.mark.parametrize("thin_to", [500, 1000, 2500])
def test_thinned_clouds_keep_all_points_and_their_mass(thin_to):
    points = samples.torus(2000).points
    state, whole = RingBuilder(around=0, thin_to=thin_to)(points), RingBuilder(thin_to="all")(points)
    n = min(thin_to, 2000)
    assert len(state) == n == state.report.n_contracted
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


@pytest.mark.parametrize("n", [4000, 16000, 64000])
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


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # normals are those of the lines
@pytest.mark.parametrize("rings", [40, 44, 60])
def test_scan_lines_much_denser_than_they_are_apart_are_a_surface(rings):
    """The nearest points of each are of its own line, and show no plane; among those that are left they do."""
    height, turn = np.meshgrid(np.linspace(0, 3, rings), np.linspace(0, 2 * np.pi, 20000 // rings, endpoint=False))
    turn = turn + 6 * np.random.default_rng(0).random(rings)
    cylinder = np.column_stack([0.3 * np.cos(turn).ravel(), 0.3 * np.sin(turn).ravel(), height.ravel()])
    found = default()(cylinder)
    assert found.report.n_contracted < 3000
    assert (found.n_components, found.n_loops, len(found.leaves)) == (1, 0, 2)


@pytest.mark.parametrize("power", [1, 3])
def test_merged_points_stay_near_whatever_way_the_density_grows(power):
    """Kept are those that others went into already: else one would sweep up a whole row of ever denser points."""
    turn, along = np.meshgrid(np.linspace(0, 2 * np.pi, 80, endpoint=False), np.linspace(-2, 0, 200))
    radius = np.exp(power * along)
    cone = np.column_stack([(radius * np.cos(turn)).ravel(), (radius * np.sin(turn)).ravel(), radius.ravel()])
    state = RingBuilder()(cone)
    cloud = state.cloud
    away = np.linalg.norm(cloud - cloud[state.survivors[state.representative]], axis=1)
    spacing = np.sqrt(2) * np.linalg.norm(cloud[:, :2] - cloud[:, :2].mean(axis=0), axis=1) * 2 * np.pi / 80
    assert len(state) < 0.8 * len(cone)
    assert state.mass.max() < 20 * state.mass.mean()
    assert np.quantile(away / spacing, 0.99) < 6


@pytest.mark.filterwarnings("error")
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


@pytest.mark.parametrize("around", [0, 20])
def test_all_are_contracted_if_asked_for(around):
    state = RingBuilder(around=around, thin_to="all")(samples.torus(3000).points)
    assert len(state) == 3000
    np.testing.assert_array_equal(state.mass, 1)


def test_small_clouds_are_not_thinned():
    points = samples.torus(999).points
    for name in ("positions", "mass", "ring_size"):
        np.testing.assert_array_equal(
            getattr(RingBuilder()(points), name), getattr(RingBuilder(thin_to="all")(points), name)
        )


# ---- large clouds


def test_a_large_cloud_is_sampled_and_every_point_has_its_place():
    points = samples.torus(8000, noise=0.001).points
    points[17] = [np.nan, 0, 0]
    points[4000] = [0, 0, 3]
    state = RingBuilder(thin_to=800, drop_invalid=True)(points)
    assert 800 < state.report.n_sampled < 3 * 1600
    assert state.report.n_contracted <= 800
    assert state.sampled.sum() == state.report.n_distinct
    assert state.representative_of_point[17] == -1
    assert state.outlier[4000]
    assert not state.sampled[[17, 4000]].any()
    np.testing.assert_allclose(
        state.frame.out_of(state.cloud[state.representative_of_point[state.sampled]]), points[state.sampled], atol=1e-12
    )
    others = np.flatnonzero(np.isfinite(points).all(axis=1) & ~state.outlier)
    away = np.linalg.norm(
        state.frame.out_of(state.cloud[state.representative_of_point[others]]) - points[others], axis=1
    )
    assert away.max() < 0.1
    skeleton = (Contractor(reducer=LPRReducer()) | Connector() | Refiner())(state)
    assert skeleton.n_loops == 1
    assert (skeleton.vertex_of_point >= 0).sum() == 7999
    assert len(skeleton.supporting_points) == state.sampled.sum()
    # who says where the surface is has a normal, nobody else
    np.testing.assert_array_equal(np.isfinite(skeleton.normals[:, 0]), state.sampled)


def test_a_sampled_cloud_has_the_skeleton_of_the_whole():
    sample = samples.y_junction(60000)
    whole = default()(sample.points)
    sampled = Pipeline(RingBuilder(thin_to=4096), *default().stages[1:])(sample.points)
    assert sampled.report.n_sampled < 12000 < whole.report.n_sampled
    assert len(sampled.leaves) == len(whole.leaves) == 3
    for skeleton in (whole, sampled):
        found = compare(skeleton, sample)
        assert found.topology
        assert found.error < 0.1
        assert found.inside == 1


def test_what_floats_around_a_sampled_surface_is_told_by_how_many_points_stand_behind_it():
    """The sample alone is hardly denser on the surface than beside it."""
    surface, rng = samples.torus(20000).points, np.random.default_rng(0)
    gas = rng.uniform(-0.6, 0.6, (3000, 3))
    gas = gas[cKDTree(surface).query(gas)[0] > 0.05][:800]
    state = RingBuilder(thin_to=2000)(np.concatenate([surface, gas]))
    assert state.report.n_sampled < 8000
    assert not state.outlier[:20000].any()
    assert state.outlier[20000:].mean() > 0.9


@pytest.fixture
def sampled():
    """A noisy cloud with points far off, and a RingBuilder that takes a sample of it."""
    points = np.concatenate([samples.torus(16000, noise=0.03).points, [[0, 0, z] for z in (1, 2, 4)]])
    return points, RingBuilder(thin_to=1500, k=16)


def test_a_sample_is_denoised_by_how_many_points_it_stands_for(sampled):
    points, filter = sampled
    plain, denoised = (replace(filter, denoise=passes)(points) for passes in (0, 4))
    near = nearest_neighbours(plain.cloud, 16)[1]
    noise = noise_share(principal(plain.cloud, near)[0], near)
    weight = np.bincount(plain.representative_of_point[~plain.outlier])
    assert plain.report.n_outliers >= 3
    assert weight.max() > 10
    ridge = subspace_mean_shift(plain.cloud, noise, 4, weight)
    np.testing.assert_array_equal(denoised.cloud, ridge[np.isin(ridge, denoised.cloud).all(axis=1)])
    assert len(denoised.cloud) > 0.9 * len(ridge)


def test_a_sample_is_averaged_by_how_many_points_it_stands_for(sampled, monkeypatch):
    """Round by round: a mean of means is that of all points."""
    points, filter = sampled
    plain = replace(filter, denoise=0)(points)
    monkeypatch.setattr(f"{DENOISING}.ENOUGH_NOISY", 200)
    monkeypatch.setattr(f"{DENOISING}.subspace_mean_shift", lambda cloud, noise, passes, weight: cloud)
    monkeypatch.setattr(f"{DENOISING}.DENOISED_RATIO", np.inf)
    state = filter(points)
    assert MOST_IN_ONE * len(state.cloud) < len(plain.cloud)
    counted = ~plain.outlier
    row, place = state.representative_of_point[counted], plain.cloud[plain.representative_of_point[counted]]
    mean = np.column_stack([np.bincount(row, axis) for axis in place.T]) / np.bincount(row)[:, None]
    np.testing.assert_allclose(state.cloud, mean, atol=1e-13)


def test_one_point_far_off_does_not_spoil_the_sample():
    points = samples.torus(8000).points
    points[17] = [1e7, 0, 0]
    state = RingBuilder(thin_to=800)(points)
    assert state.report.n_sampled < 5000
    assert state.outlier[17]


def test_a_radius_is_that_of_the_cloud_as_it_came():
    points = samples.torus(8000).points
    radius = float(np.median(nearest_neighbours(points, 17)[0][:, -1]))
    state = RingBuilder(radius=radius)(points)
    assert len(state) == 8000
    assert np.median(state.rings.sizes) == 6
