"""RingBuilder: cloud -> rings."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from glsk_o3d import Contraction, InvalidCloudError, RingBuilder, samples
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
from glsk_o3d.ring_builder import published_k

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


@pytest.mark.parametrize(
    ("n", "k"), [(8, 8), (708, 8), (709, 9), (1024, 12), (1987, 24), (2458, 29), (2459, 30), (10**6, 30)]
)
def test_published_number_of_neighbours(n, k):
    assert published_k(n) == k


@pytest.mark.parametrize("k", [None, 5, 20])
@pytest.mark.parametrize("points", [TORUS, SHEET], ids=["torus", "sheet"])
def test_rings_are_delaunay_stars_in_the_principal_plane(points, k):
    state = RingBuilder(k=k)(points)
    cloud = state.cloud
    _, neighbours = nearest_neighbours(cloud, k or published_k(len(points)))
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
    np.testing.assert_array_equal(np.sort(state.row_of_point), np.arange(n))
    np.testing.assert_array_equal(state.survivor_of_point, state.row_of_point)
    np.testing.assert_array_equal(state.row_of_point[state.point_of_survivor], np.arange(n))
    np.testing.assert_allclose(state.contracted[state.survivor_of_point], TORUS, atol=1e-15)
    np.testing.assert_array_equal(state.mass, 1)
    assert state.ring_ratio == 1
    distance = np.linalg.norm(state.cloud[state.rings.indices] - state.cloud[state.rings.owners], axis=1)
    np.testing.assert_allclose(state.ring_size, [d.min() for d in np.split(distance, state.rings.indptr[1:-1])])
    edges = np.mean([d.mean() for d in np.split(distance, state.rings.indptr[1:-1])])
    assert state.mean_ring_edge == pytest.approx(edges, rel=1e-12)
    assert state.report.iterations == ()
    assert "not contracted" in state.report.stop_reason
    assert list(state.report.seconds) == ["RingBuilder"]


def test_normals_of_a_torus():
    sample = samples.torus(n=3000)
    state = RingBuilder()(sample.points)
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
    np.testing.assert_array_equal(state.cloud, single.cloud)
    np.testing.assert_array_equal(state.row_of_point, single.row_of_point[order])
    np.testing.assert_array_equal(state.rings.indices, single.rings.indices)
    np.testing.assert_array_equal(order[state.point_of_survivor], single.point_of_survivor)
    first = np.unique(order, return_index=True)[1]
    np.testing.assert_array_equal(np.sort(state.point_of_survivor), np.sort(first))


def test_invalid_points_are_counted_and_dropped_only_when_asked():
    points = TORUS.copy()
    points[[5, 70, 599]] = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]]
    with pytest.raises(InvalidCloudError, match=r"^3 of 600 points .*at index 5.*drop_invalid=True"):
        RingBuilder()(points)
    state = RingBuilder(drop_invalid=True)(points)
    assert (state.report.n_input, state.report.n_dropped, state.report.n_distinct) == (600, 3, 597)
    np.testing.assert_array_equal(np.flatnonzero(state.row_of_point < 0), [5, 70, 599])
    np.testing.assert_array_equal(np.flatnonzero(state.survivor_of_point < 0), [5, 70, 599])
    valid = np.delete(TORUS, [5, 70, 599], axis=0)
    np.testing.assert_array_equal(state.cloud, RingBuilder()(valid).cloud)
    assert 599 not in state.point_of_survivor


def test_more_neighbours_than_points_are_all_points():
    points = np.repeat(TORUS[:12], 5, axis=0)
    many, all_of_them = RingBuilder(k=20)(points), RingBuilder(k=12)(points)
    assert named_rings(many) == named_rings(all_of_them)
    assert len(many) == 12


def test_to_point_cloud():
    cloud = RingBuilder()(TORUS).to_point_cloud()
    np.testing.assert_allclose(np.sort(np.asarray(cloud.points), axis=0), np.sort(TORUS, axis=0), atol=1e-15)
