"""RingBuilder: cloud -> rings."""

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from glsk_o3d import InvalidParameterError, RingBuilder, samples
from glsk_o3d.data.points import default_k
from glsk_o3d.filters.ring_builder import published_k
from glsk_o3d.geometry.neighbourhoods import nearest_neighbours

TORUS = samples.torus(n=600).points
SHEET = samples.sheet(n=500, bend=0).points


def named_rings(state):
    """For every distinct input point, by its first index: (ring in such indices, closed), from its least entry on."""
    name = state.map.point_of_survivor
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
}


@pytest.mark.parametrize("rule", NUMBERS, ids=lambda rule: rule.__name__)
def test_the_number_of_neighbours_follows_from_that_of_points(rule):
    assert [(n, rule(n)) for n, _ in NUMBERS[rule]] == NUMBERS[rule]


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


def test_rings_do_not_depend_on_order_place_size_and_rotation():
    """Coordinates are rounded so that offset and factor are exact: then all rings are the same."""
    points, rng = np.round(TORUS * 2**20) / 2**20, np.random.default_rng(0)
    rings = named_rings(RingBuilder()(points))
    turn, order = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.permutation(len(points))
    for moved in (points + 2**20, points * 2.0**40, points * [1, -1, 1], points[:, [2, 0, 1]], points @ turn):
        assert named_rings(RingBuilder()(moved)) == rings
    for i, (row, closed) in named_rings(RingBuilder()(points[order])).items():
        expected, is_closed = rings[order[i]]
        assert ({*order[row].tolist()}, closed) == ({*expected}, is_closed)


def test_a_radius_limits_the_rings():
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
