"""False loops are zipped up, true ones stay."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from glsk_o3d.refinement.loops import close_loops, surface_distance, zip_pairs


def circle(n, radius=1.0, at=(0, 0, 0)):
    angle = np.arange(n) * 2 * np.pi / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + at


def ring_edges(n, first=0):
    return [(first + i, first + (i + 1) % n) for i in range(n)]


def strands(n=21, gap=0.03):
    """Two parallel strands that meet at both ends: vertices of the loop in order."""
    x = np.linspace(-1, 1, n)
    sides = [np.column_stack([x, np.full(n, y), 0 * x]) for y in (gap, -gap)]
    return np.concatenate([[[-1.1, 0, 0]], sides[0], [[1.1, 0, 0]], sides[1][::-1]])


def test_two_strands_in_one_tube_become_a_path(ringed):
    vertices = strands()
    skeleton = close_loops(ringed(vertices, ring_edges(len(vertices)), radius=0.1), 1)
    assert skeleton.n_loops == 0
    assert skeleton.n_components == 1
    assert len(skeleton.leaves) == 2
    assert len(skeleton.junctions) == 0
    assert len(skeleton.vertices) == 23
    np.testing.assert_allclose(skeleton.vertices[:, 1:], 0, atol=1e-12)
    np.testing.assert_allclose(np.sort(skeleton.vertices[:, 0]), [-1.1, *np.linspace(-1, 1, 21), 1.1], atol=1e-12)
    assert np.bincount(skeleton.vertex_of_point).tolist().count(24) == 21


def test_the_same_strands_around_a_gap_stay(ringed):
    vertices = strands()
    raw = ringed(vertices, ring_edges(len(vertices)), radius=0.02)
    assert close_loops(raw, 1) is raw


def test_true_and_false_loop_in_one_graph(ringed):
    """A ring, and a stretch of it twice: joined at both ends, 0.04 apart."""
    n = 48
    ring = circle(n)
    inner = ring[4:13] * 0.96
    chain = [3, *range(n, n + 9), 13]
    edges = ring_edges(n) + list(pairwise(chain))
    raw = ringed(np.concatenate([ring, inner]), edges, radius=0.1)
    assert raw.n_loops == 2
    skeleton = close_loops(raw, 1)
    assert skeleton.n_loops == 1
    assert skeleton.n_components == 1
    assert (skeleton.degree == 2).all()
    assert len(skeleton.vertices) == n
    radius = np.linalg.norm(skeleton.vertices, axis=1)
    np.testing.assert_allclose(radius, 1, atol=0.025)
    np.testing.assert_allclose(np.sort(radius)[9:], 1, atol=1e-12)


def test_separate_components_are_judged_apart(ringed):
    big, small = circle(24), circle(8, 0.05, (3, 0, 0))
    raw = ringed(np.concatenate([big, small]), ring_edges(24) + ring_edges(8, 24), radius=0.1)
    skeleton = close_loops(raw, 1)
    assert skeleton.n_components == 2
    assert skeleton.n_loops == 1
    left = skeleton.vertices[:, 0] < 2
    np.testing.assert_allclose(np.linalg.norm(skeleton.vertices[left], axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("opening", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("share", "loops"), [(0.97, 0), (1.03, 1)])
def test_opening_is_the_circle_inside_over_the_tube(ringed, opening, share, loops):
    n = 60
    inside = np.cos(np.pi / n)
    tube = np.full(n, inside / (opening * share))
    tube[:20] *= 10  # the median over the loop does not mind
    skeleton = close_loops(ringed(circle(n), ring_edges(n), radius=tube), opening)
    assert skeleton.n_loops == loops


def test_zero_opening_keeps_all(ringed):
    vertices = strands()
    raw = ringed(vertices, ring_edges(len(vertices)), radius=10.0)
    assert close_loops(raw, 0) is raw


def test_surface_distance_is_the_median_over_the_owned_supporting_points(ringed):
    raw = ringed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)], per=5)
    points, normals, vertex = raw.points.copy(), raw.normals.copy(), raw.vertex_of_point.copy()
    points[:5] = np.outer([1, 2, 3, 4, 100], [0, 0, 1])
    normals[4] = np.nan
    vertex[10:] = -1
    skeleton = replace(raw, points=points, normals=normals, vertex_of_point=vertex)
    np.testing.assert_allclose(surface_distance(skeleton), [2.5, 0.1, 0])


@pytest.mark.parametrize("turn", range(6))
def test_zip_pairs_join_what_is_as_far_along(turn):
    """The ends are 10 and 13, whichever vertex comes first."""
    points = np.array([[0, 0, 0], [1, 0.1, 0], [2, 0.1, 0], [3, 0, 0], [2, -0.1, 0], [1, -0.1, 0]])
    labels = np.arange(10, 16)
    pairs = zip_pairs(np.roll(points, turn, axis=0), np.roll(labels, turn))
    assert {frozenset(pair) for pair in pairs.tolist()} == {frozenset({11, 15}), frozenset({12, 14})}


@pytest.mark.parametrize("turn", range(6))
def test_zip_pairs_of_uneven_sides(turn):
    points = np.array([[0, 0, 0], [0.4, 0.1, 0], [2, 0.1, 0], [3.6, 0.1, 0], [4, 0, 0], [2, -0.1, 0]])
    pairs = zip_pairs(np.roll(points, turn, axis=0), np.roll(np.arange(6), turn))
    # those near an end meet the end
    assert {frozenset(pair) for pair in pairs.tolist()} == {frozenset({0, 1}), frozenset({2, 5}), frozenset({3, 4})}


def test_every_inner_vertex_is_in_a_pair():
    rng = np.random.default_rng(0)
    for n in range(4, 20):
        points = rng.normal(size=(n, 3))
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        ends = set(np.unravel_index(np.argmax(distance), (n, n)))
        pairs = zip_pairs(points, np.arange(n))
        assert set(range(n)) - ends <= set(pairs.ravel().tolist())
        # the two ends stay apart
        assert not any(set(pair) == ends for pair in pairs.tolist())
