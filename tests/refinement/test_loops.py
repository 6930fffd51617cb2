"""False loops are zipped up or cut, true ones stay."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.refinement import loops
from glsk_o3d.refinement.loops import NEAR, THREAD, close_loops, links, surface_distance, zip_pairs


def circle(n, radius=1.0, at=(0, 0, 0)):
    angle = np.arange(n) * 2 * np.pi / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + at


def ring_edges(n, first=0):
    return [(first + i, first + (i + 1) % n) for i in range(n)]


def sorted_edges(edges):
    return sorted(tuple(sorted(edge)) for edge in edges)


def strands(n=21, gap=0.03):
    """Two parallel strands that meet at both ends: vertices of the loop in order."""
    x = np.linspace(-1, 1, n)
    sides = [np.column_stack([x, np.full(n, y), 0 * x]) for y in (gap, -gap)]
    return np.concatenate([[[-1.1, 0, 0]], sides[0], [[1.1, 0, 0]], sides[1][::-1]])


def test_two_strands_in_one_tube_become_a_path(ringed):
    vertices = strands()
    skeleton = close_loops(ringed(vertices, ring_edges(len(vertices)), radius=0.1), 1, 0)
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
    assert close_loops(raw, 1, 0) is raw


def test_true_and_false_loop_in_one_graph(ringed):
    """A ring, and a stretch of it twice: joined at both ends, 0.04 apart."""
    n = 48
    ring = circle(n)
    inner = ring[4:13] * 0.96
    chain = [3, *range(n, n + 9), 13]
    edges = ring_edges(n) + list(pairwise(chain))
    raw = ringed(np.concatenate([ring, inner]), edges, radius=0.1)
    assert raw.n_loops == 2
    skeleton = close_loops(raw, 1, 0)
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
    skeleton = close_loops(raw, 1, 0)
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
    skeleton = close_loops(ringed(circle(n), ring_edges(n), radius=tube), opening, 0)
    assert skeleton.n_loops == loops


def test_zero_opening_keeps_all(ringed):
    vertices = strands()
    raw = ringed(vertices, ring_edges(len(vertices)), radius=10.0)
    assert close_loops(raw, 0, 0) is raw


# ---- loops that hang by a thread


def pipe(paths, per=16, step=0.04, radius=0.1):
    """Points and outward normals of circles along polylines: (start, stop) of every stretch."""
    angle = np.arange(per) * 2 * np.pi / per
    points, normals = [], []
    for start, stop in paths:
        along = np.subtract(stop, start)
        side = np.cross(along, [0, 0, 1]) / np.linalg.norm(along)
        out = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * [0, 0, 1]
        n = round(np.linalg.norm(along) / step)
        middle = start + (np.arange(n)[:, None] + 0.5) / n * along
        points.append((middle[:, None] + radius * out).reshape(-1, 3))
        normals.append(np.tile(out, (n, 1)))
    return np.concatenate(points), np.concatenate(normals)


@pytest.fixture
def torn(around):
    """A ring of even tube; along one edge there is nothing, or one point in the middle."""

    def make(missing, bridged):
        ring, edges = circle(24), sorted_edges(ring_edges(24))
        points, normals = pipe([ring[list(edge)] for k, edge in enumerate(edges) if k != missing])
        middle, up = ring[list(edges[missing])].mean(axis=0, keepdims=True), np.array([[0.0, 0, 1]])
        points, normals = (np.concatenate([a, b[:bridged]]) for a, b in ((points, middle), (normals, up)))
        return around(ring, edges, points, normals)

    return make


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 8), st.integers(4, 60))
def test_links_are_counted_from_every_point_to_its_near_ones(random_skeleton, seed, m, n):
    skeleton = random_skeleton(seed, m, n=max(n, m))
    owned = skeleton.witnesses
    points, owner = skeleton.points[owned], skeleton.vertex_of_point[owned]
    expected = {tuple(edge): 0 for edge in skeleton.edges.tolist()}
    for point, vertex in zip(points, owner, strict=True):
        for near in np.argsort(np.linalg.norm(points - point, axis=1))[:NEAR]:
            pair = tuple(sorted((int(vertex), int(owner[near]))))
            if pair in expected:
                expected[pair] += 1
    assert links(skeleton).tolist() == list(expected.values())


def test_links_without_edges_or_witnesses_across_them(ringed):
    assert links(ringed([[0, 0, 0], [1, 0, 0]], [])).tolist() == []
    apart = ringed([[0, 0, 0], [1, 0, 0]], [(0, 1)], radius=0.1)
    assert links(apart).tolist() == [0]


@pytest.mark.parametrize("missing", [0, 1, 13, 23])
@pytest.mark.parametrize("bridged", [False, True])
def test_a_tube_that_touches_itself_by_a_thread_is_cut_there(torn, missing, bridged):
    raw = torn(missing, bridged)
    count = links(raw)
    assert count[missing] < THREAD < 0.25 * np.median(count)
    assert (count[missing] > 0) == bridged
    skeleton = close_loops(raw, 1, 0.25)
    assert skeleton.n_loops == 0
    np.testing.assert_array_equal(skeleton.edges, np.delete(raw.edges, missing, axis=0))
    np.testing.assert_array_equal(skeleton.vertices, raw.vertices)
    np.testing.assert_array_equal(skeleton.vertex_of_point, raw.vertex_of_point)
    assert close_loops(raw, 1, 0) is raw


@pytest.mark.parametrize("weak", [0.25, 1.0, 100.0])
def test_a_ring_of_even_tube_is_not_cut(around, weak):
    ring = circle(24)
    edges = sorted_edges(ring_edges(24))
    raw = around(ring, edges, *pipe([ring[list(edge)] for edge in edges]))
    assert close_loops(raw, 1, weak) is raw


def test_where_two_tubes_touch_the_loop_is_cut(around):
    """Two arms from one stem, bent until their tips touch: one point lies between these."""
    left = np.array([[0, 0, 0], [-0.5, 0.3, 0], [-0.7, 0.8, 0], [-0.5, 1.3, 0], [-0.15, 1.5, 0]])
    right = left * [-1, 1, 1]
    vertices = np.concatenate([[[0, -0.5, 0], [0, -1, 0]], left, right[1:]])
    stem, arms = [(0, 1), (0, 2)], [(2, 3), (3, 4), (4, 5), (5, 6), (2, 7), (7, 8), (8, 9), (9, 10)]
    points, normals = pipe([vertices[list(edge)] for edge in stem + arms])
    points, normals = np.concatenate([points, [[0, 1.51, 0]]]), np.concatenate([normals, [[0, 0, 1]]])
    raw = around(vertices, sorted([*stem, *arms, (6, 10)]), points, normals)
    assert raw.n_loops == 1
    skeleton = close_loops(raw, 1, 0.25)
    assert skeleton.edges.tolist() == [list(edge) for edge in sorted(stem + arms)]


@pytest.mark.parametrize(
    ("count", "weak", "cut"),
    [
        (0, 0.1, True),
        (0, 0, False),
        (THREAD - 1, 1, True),
        (THREAD, 1, False),  # more than a thread, whatever the others have
        (1, 0.011, True),
        (1, 0.01, False),  # as strong as it has to be
    ],
)
def test_weak_over_the_median_and_few(ringed, monkeypatch, count, weak, cut):
    raw = ringed(circle(24), ring_edges(24))
    monkeypatch.setattr(loops, "links", lambda skeleton: np.where((skeleton.edges == [6, 7]).all(axis=1), count, 100))
    skeleton = close_loops(raw, 1, weak)
    assert skeleton.edges.tolist() == [edge for edge in raw.edges.tolist() if not (cut and edge == [6, 7])]


def test_narrow_loops_are_zipped_up_even_if_they_hang_by_a_thread(ringed, monkeypatch):
    vertices = strands()
    raw = ringed(vertices, ring_edges(len(vertices)), radius=0.1)
    monkeypatch.setattr(loops, "links", lambda skeleton: np.where(np.arange(len(skeleton.edges)) == 5, 0, 100))
    zipped, plain = close_loops(raw, 1, 0.25), close_loops(raw, 1, 0)
    np.testing.assert_array_equal(zipped.vertices, plain.vertices)
    np.testing.assert_array_equal(zipped.edges, plain.edges)
    assert zipped.n_loops == 0


@pytest.mark.parametrize("seed", range(6))
def test_cutting_never_tears_a_component(around, seed):
    """Two loops share a strand with two empty edges: both lose the same one, in any numbering."""
    x = np.linspace(-1, 1, 9)
    strands = [np.column_stack([x, y * (1 - x**2), 0 * x]) for y in (1, 0, -1)]
    vertices = np.concatenate([strands[0][[0, -1]], *(strand[1:-1] for strand in strands)])
    chains = [[0, *range(first, first + 7), 1] for first in (2, 9, 16)]
    edges = [edge for chain in chains for edge in pairwise(chain)]
    empty = [edge for k, edge in enumerate(pairwise(chains[1])) if k in (2, 5)]
    points, normals = pipe([vertices[list(edge)] for edge in edges if edge not in empty])
    name = np.random.default_rng(seed).permutation(len(vertices))
    edges = sorted_edges(name[edges].tolist())
    raw = around(vertices[np.argsort(name)], edges, points, normals)
    assert (links(raw) == 0).sum() == 2
    skeleton = close_loops(raw, 1, 0.25)
    assert skeleton.n_components == 1
    assert skeleton.n_loops == 1


def test_surface_distance_is_the_median_over_the_owned_witnesses(ringed):
    raw = ringed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)], per=5)
    points, normals, owner = raw.points.copy(), raw.normals.copy(), raw.vertex_of_point.copy()
    points[:5] = np.outer([1, 2, 3, 4, 100], [0, 0, 1])
    normals[4] = np.nan
    owner[10:] = -1
    skeleton = replace(raw, points=points, normals=normals, vertex_of_point=owner)
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
