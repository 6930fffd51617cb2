"""Weak loops, across which the surface hardly goes on or with little confidence, are cut; true ones stay."""

from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton
from glsk_o3d.numerics.cycles import minimum_cycle_basis
from glsk_o3d.refinement.weak_loops import BOND_NEIGHBOURS, bonds, crossings, cut_weak_loops

TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
WEAK, SURE = 0.1, 0.65


def circle(n, radius=1.0, at=(0, 0, 0)):
    angle = np.arange(n) * 2 * np.pi / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + at


def ring_edges(n, first=0):
    return [(first + i, first + (i + 1) % n) for i in range(n)]


def sorted_edges(edges):
    return sorted(tuple(sorted(edge)) for edge in edges)


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


def sure(skeleton, confidence=1.0):
    return replace(skeleton, confidence=np.full(len(skeleton.vertices), confidence))


@pytest.fixture
def torn(around):
    """A ring of even tube; along one edge there is nothing, or one point in the middle."""

    def make(missing, bridged=False):
        ring, edges = circle(24), sorted_edges(ring_edges(24))
        points, normals = pipe([ring[list(edge)] for k, edge in enumerate(edges) if k != missing])
        if missing is not None:
            middle, up = ring[list(edges[missing])].mean(axis=0, keepdims=True), np.array([[0.0, 0, 1]])
            points, normals = (np.concatenate([a, b[:bridged]]) for a, b in ((points, middle), (normals, up)))
        return sure(around(ring, edges, points, normals))

    return make


# ---- bonds


def slow_bonds(skeleton):
    """Summed over every point and each of its nearest, by pair of vertices."""
    owned = skeleton.supporting_points
    points, normals, owner = skeleton.points[owned], skeleton.normals[owned], skeleton.vertex_of_point[owned]
    found = {}
    for p in range(len(owned)):
        order = np.argsort(np.linalg.norm(points - points[p], axis=1), kind="stable")
        for q in [q for q in order if q != p][: BOND_NEIGHBOURS - 1]:
            if owner[p] == owner[q]:
                continue
            line = (points[q] - points[p]) / np.linalg.norm(points[q] - points[p])
            upright = [np.linalg.norm(np.cross(normals[end], line)) ** 2 for end in (p, q)]
            pair = tuple(sorted((int(owner[p]), int(owner[q]))))
            found[pair] = found.get(pair, 0) + (normals[p] @ normals[q]) ** 2 * upright[0] * upright[1]
    return found


@settings(max_examples=50)
@given(st.integers(0, 10**6), st.integers(2, 8), st.integers(4, 60))
def test_bonds_by_their_definition(random_skeleton, seed, m, n):
    skeleton = random_skeleton(seed, m, n=max(n, m))
    pairs, weight = bonds(skeleton)
    expected = slow_bonds(skeleton)
    assert list(map(tuple, pairs.tolist())) == sorted(expected)
    np.testing.assert_allclose(weight, [expected[pair] for pair in sorted(expected)], atol=1e-9)


def halves(points, normals, cut=0.0):
    """Two vertices that own the points on either side of x = cut."""
    owner = (points[:, 0] > cut).astype(int)
    return Skeleton([[-1, 0, 0], [1, 0, 0]], [(0, 1)], [1, 1], owner, points, normals)


def grid(n=20):
    x = (np.arange(n) + 0.5) / n - 0.5
    return np.stack(np.meshgrid(x, x * 1.01, [0.0]), -1).reshape(-1, 3)


def foreign(skeleton):
    """Near points of different vertices, counted from every point."""
    points, owner = skeleton.points, skeleton.vertex_of_point
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    return sum(
        (owner[np.argsort(row)[:BOND_NEIGHBOURS]] != own).sum() for row, own in zip(distance, owner, strict=True)
    )


@pytest.mark.parametrize("turn", [np.eye(3), TURN])
def test_every_near_pair_of_a_plane_is_a_whole_bond(turn):
    points, rng = grid(), np.random.default_rng(0)
    points[:, :2] += 0.005 * rng.normal(size=(400, 2))
    normals = rng.choice([-1, 1], (400, 1)) * [0, 0, 1.0]  # known up to their sign
    plane = halves(points, normals)
    pairs, weight = bonds(replace(plane, points=points @ turn, normals=normals @ turn))
    assert pairs.tolist() == [[0, 1]]
    assert foreign(plane) > 40
    assert weight[0] == pytest.approx(foreign(plane), rel=1e-9)


@pytest.mark.parametrize("opposite", [1, -1])
@pytest.mark.parametrize("gap", [1.1, 1.3])
def test_sheets_that_face_each_other_have_no_bond(gap, opposite):
    """Each point of either has the one opposite among its near ones, nearer than those beside that."""
    sheet = grid()[:, [2, 0, 1]]
    points = np.concatenate([sheet - [gap / 40, 0, 0], sheet + [gap / 40, 0, 0]])  # 1 / 20 lies between two of a sheet
    facing = halves(points, np.repeat([[1.0, 0, 0], [opposite, 0, 0]], 400, axis=0))
    assert foreign(facing) >= 800
    across = bonds(facing)[1].sum()
    # points at the rim have a few more near ones in the other; as one surface, all of them would bond
    assert across < 0.05 * foreign(facing)


@pytest.mark.parametrize("angle", [0, 30, 60, 90])
def test_bond_of_two_points_by_the_angles_of_their_normals(angle):
    """Tilted towards each other, cos^2 of twice the angle between them and sin^2 with the line, twice."""
    t = np.deg2rad(angle)
    normals = [[np.sin(t), 0, np.cos(t)], [-np.sin(t), 0, np.cos(t)]]
    weight = bonds(halves(np.array([[-0.1, 0, 0], [0.1, 0, 0]]), np.array(normals)))[1]
    np.testing.assert_allclose(weight, 2 * np.cos(2 * t) ** 2 * np.cos(t) ** 4, atol=1e-12)


@pytest.mark.parametrize("copies", [2, BOND_NEIGHBOURS, 20])
def test_copies_of_a_point_are_one_point(torn, copies):
    """Wherever they are: a cloud that came together from two has some."""
    raw = torn(None)
    twice = np.concatenate([np.arange(len(raw.points)), np.repeat(np.flatnonzero(raw.points[:, 0] > 0.8), copies - 1)])
    many = replace(
        raw, points=raw.points[twice], normals=raw.normals[twice], vertex_of_point=raw.vertex_of_point[twice]
    )
    assert len(twice) > len(raw.points)
    assert cut_weak_loops(many, WEAK, SURE).n_loops == 1
    (pairs, weight), (expected, sound) = bonds(many), bonds(raw)
    np.testing.assert_array_equal(pairs, expected)
    np.testing.assert_allclose(weight, sound)


def test_points_without_a_say_have_no_bonds(torn):
    raw = torn(None)
    rng = np.random.default_rng(0)
    silent, lost = rng.choice(len(raw.points), (2, 100), replace=False)
    normals, owner = raw.normals.copy(), raw.vertex_of_point.copy()
    normals[silent], owner[lost] = np.nan, -1
    rest = np.setdiff1d(np.arange(len(owner)), np.concatenate([silent, lost]))
    less = replace(raw, points=raw.points[rest], normals=raw.normals[rest], vertex_of_point=owner[rest])
    for got, expected in zip(bonds(replace(raw, normals=normals, vertex_of_point=owner)), bonds(less), strict=True):
        np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_bonds_of_hardly_any_points(n):
    points, normals = np.array([[-0.1, 0, 0], [0.1, 0, 0]])[:n], np.tile([0.0, 0, 1], (n, 1))
    pairs, weight = bonds(halves(points.reshape(-1, 3), normals))
    assert (pairs.shape, weight.tolist()) == (((1, 2), [2.0]) if n == 2 else ((0, 2), []))


# ---- crossings


def slow_crossings(cycle, pairs, weight):
    """Every bond between vertices of the cycle walks the shorter way: forward from the first, if both are as long."""
    n, place = len(cycle), {vertex: i for i, vertex in enumerate(cycle)}
    across = np.zeros(n)
    for (a, b), w in zip(pairs, weight, strict=True):
        if a in place and b in place:
            first, last = sorted((place[a], place[b]))
            way = range(first, last) if last - first <= n / 2 else [*range(last, n), *range(first)]
            across[list(way)] += w
    return across


@settings(max_examples=60)
@given(st.integers(3, 12), st.integers(0, 5), st.integers(0, 40), st.integers(0, 10**6))
def test_crossings_against_a_walk(n, others, count, seed):
    rng = np.random.default_rng(seed)
    m = n + others
    cycle = rng.permutation(m)[:n]
    pairs = np.array([sorted(rng.choice(m, 2, replace=False)) for _ in range(count)], int).reshape(-1, 2)
    weight = rng.random(count)
    across = crossings(cycle, m, pairs, weight)
    assert across.shape == (n,)
    np.testing.assert_allclose(across, slow_crossings(cycle.tolist(), pairs.tolist(), weight), atol=1e-12)


@pytest.mark.parametrize("n", [3, 4, 9])
def test_bonds_along_edges_cross_these(n):
    weight = np.arange(1.0, n + 1)
    edges = np.sort(np.column_stack([np.arange(n), (np.arange(n) + 1) % n]), axis=1)
    np.testing.assert_allclose(crossings(np.arange(n), n, edges, weight), weight)


@pytest.mark.parametrize("seed", range(5))
def test_crossings_are_never_less_than_nothing(seed):
    """Not by rounding either."""
    rng = np.random.default_rng(seed)
    pairs = np.array([(a, a + step) for a in range(20) for step in (1, 2, 3) if a < 10 <= 13 - step or a + step < 20])
    pairs = pairs[(pairs[:, 0] >= 10) | (pairs[:, 1] < 10)]  # not from 9 to 10, and not from 19 to 0
    across = crossings(np.arange(20), 20, pairs, rng.random(len(pairs)))
    assert (across >= 0).all()
    np.testing.assert_array_equal(across > 1e-12, ~np.isin(np.arange(20), [9, 19]))


def test_crossings_turn_with_the_cycle():
    rng = np.random.default_rng(0)
    pairs, weight = np.array([(a, b) for b in range(9) for a in range(b)]), rng.random(36)
    across = crossings(np.arange(9), 9, pairs, weight)  # of an odd number there is always a shorter way
    for turn in range(9):
        np.testing.assert_allclose(crossings(np.roll(np.arange(9), turn), 9, pairs, weight), np.roll(across, turn))
    np.testing.assert_allclose(crossings(np.arange(9)[::-1], 9, pairs, weight), np.roll(across[::-1], -1))


# ---- loops across which the surface hardly goes on


@pytest.mark.parametrize("missing", [0, 1, 13, 23])
@pytest.mark.parametrize("bridged", [False, True])
def test_a_tube_that_touches_itself_by_a_thread_is_cut_there(torn, missing, bridged):
    raw = torn(missing, bridged)
    skeleton = cut_weak_loops(raw, WEAK, SURE)
    np.testing.assert_array_equal(skeleton.edges, np.delete(raw.edges, missing, axis=0))
    for name in ("vertices", "vertex_of_point", "radii", "confidence", "normals"):
        np.testing.assert_array_equal(getattr(skeleton, name), getattr(raw, name))
    assert cut_weak_loops(raw, 0, SURE) is raw
    # where is what matters, not the numbers
    assert (skeleton.n_loops, skeleton.n_components) == (0, 1)


@pytest.mark.parametrize("weak", [WEAK, 0.5])
def test_a_ring_of_even_tube_is_not_cut(torn, weak):
    raw = torn(None)
    assert cut_weak_loops(raw, weak, SURE) is raw


@pytest.mark.parametrize("big", [0.4, 0.6, 1.0])
@pytest.mark.parametrize("n", [1000, 4000])
def test_a_torus_with_points_anywhere_on_it_is_not_cut(around, big, n):
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 2 * np.pi, (2, n))
    out = np.column_stack([np.cos(a), np.sin(a), 0 * a])
    normals = np.cos(b)[:, None] * out + np.sin(b)[:, None] * [0, 0, 1]
    signs = rng.choice([-1, 1], (n, 1))
    raw = sure(around(circle(24, big), sorted_edges(ring_edges(24)), big * out + 0.1 * normals, signs * normals))
    assert raw.n_loops == 1
    assert cut_weak_loops(raw, WEAK, SURE) is raw


def arms(gap):
    """Two arms from one stem, bent until their tips are `gap` apart: vertices, edges of the stem, and of the arms."""
    left = np.array([[0, 0, 0], [-0.5, 0.3, 0], [-0.7, 0.8, 0], [-0.5, 1.3, 0], [-gap / 2, 1.5, 0]])
    vertices = np.concatenate([[[0, -0.5, 0], [0, -1, 0]], left, left[1:] * [-1, 1, 1]])
    return vertices, [(0, 1), (0, 2)], [(2, 3), (3, 4), (4, 5), (5, 6), (2, 7), (7, 8), (8, 9), (9, 10)]


def test_where_tips_touch_by_one_point_the_loop_is_cut(around):
    vertices, stem, sides = arms(0.3)
    points, normals = pipe([vertices[list(edge)] for edge in stem + sides])
    points, normals = np.concatenate([points, [[0, 1.51, 0]]]), np.concatenate([normals, [[0, 0, 1]]])
    raw = sure(around(vertices, sorted([*stem, *sides, (6, 10)]), points, normals))
    assert raw.n_loops == 1
    skeleton = cut_weak_loops(raw, WEAK, SURE)
    assert skeleton.edges.tolist() == [list(edge) for edge in sorted(stem + sides)]


@pytest.mark.parametrize("gap", [0.05, 0.08])
def test_where_flanks_touch_the_loop_is_cut(around, gap):
    """Two parallel tubes with one end in common, and an edge from one to the other where they touch all along."""
    x = np.linspace(0, 2, 11)
    y = np.where(x == 0, 0, 0.1 + gap / 2 + 0.8 * np.sin(np.minimum(x, 1.4) / 1.4 * np.pi))
    sides = [np.column_stack([x, sign * y, 0 * x]) for sign in (1, -1)]
    vertices = np.concatenate([sides[0], sides[1][1:]])
    tubes = [*pairwise(range(11)), (0, 11), *pairwise(range(11, 21))]
    points, normals = pipe([vertices[list(edge)] for edge in tubes])
    raw = sure(around(vertices, sorted([*tubes, (8, 18)]), points, normals))
    assert raw.n_loops == 1
    skeleton = cut_weak_loops(raw, WEAK, 0)
    assert skeleton.edges.tolist() == [list(edge) for edge in sorted(tubes)]


# ---- loops that are hardly supported


@pytest.mark.parametrize("least", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("confidence", [0.3, 1.0])
@pytest.mark.parametrize(("share", "loops"), [(0.97, 0), (1.03, 1)])
def test_opening_over_thickness_times_confidence(ringed, least, confidence, share, loops):
    n = 60
    tube = np.full(n, np.cos(np.pi / n) * confidence / (least * share))
    tube[:20] *= 10  # the median over the loop does not mind
    mixed = confidence * np.where(np.arange(n) % 2, 0.5, 1.5)  # whose mean is meant
    raw = replace(ringed(circle(n), ring_edges(n), radius=tube), confidence=mixed)
    skeleton = cut_weak_loops(raw, 0, least)
    assert skeleton.n_loops == loops
    assert skeleton.n_components == 1
    assert len(skeleton.edges) == n - 1 + loops


def test_a_narrow_loop_without_confidence_is_cut_where_the_fewest_bonds_cross(torn):
    raw = torn(7, bridged=True)
    doubtful = sure(raw, 0.01)
    np.testing.assert_array_equal(cut_weak_loops(doubtful, 0, SURE).edges, np.delete(raw.edges, 7, axis=0))
    assert cut_weak_loops(raw, 0, SURE) is raw


def test_wide_loops_stay_where_narrow_ones_go(ringed):
    """With the same tubes and confidence."""
    rings = np.concatenate([circle(24), circle(24, 0.2, (3, 0, 0))])
    raw = ringed(rings, ring_edges(24) + ring_edges(24, 24), radius=0.1)
    skeleton = cut_weak_loops(sure(raw, 0.25), 0, 1)
    assert (skeleton.n_loops, skeleton.n_components) == (1, 2)
    assert (skeleton.edges < 24).all(axis=1).sum() == 24


def test_loops_of_no_thickness_are_sure(ringed):
    raw = sure(ringed(circle(12), ring_edges(12), radius=0.0))
    assert cut_weak_loops(raw, 0, 1e9) is raw
    assert cut_weak_loops(sure(raw, 0.0), 0, 1e9).n_loops == 1  # nothing is less than nothing


def test_zero_keeps_all(torn, ringed):
    for raw in (torn(3), sure(torn(3), 0.0), sure(ringed(circle(9), ring_edges(9), radius=9.0), 0.0)):
        assert cut_weak_loops(raw, 0, 0) is raw


def test_trees_and_skeletons_without_supporting_points_are_left(ringed):
    tree = sure(ringed(circle(9), ring_edges(9)[:-1]), 0)
    assert cut_weak_loops(tree, 9, 9) is tree
    ring = sure(ringed(circle(9), ring_edges(9)))
    silent = replace(ring, normals=np.full_like(ring.normals, np.nan))
    assert cut_weak_loops(silent, 9, 9) is silent  # no bond is weaker than the others, no tube is thick


# ---- several loops


@pytest.mark.parametrize("seed", range(6))
def test_cutting_what_two_loops_share_takes_one_edge(around, seed):
    """Two loops share a strand with two empty edges: it is cut once, in any numbering."""
    x = np.linspace(-1, 1, 9)
    strands = [np.column_stack([x, y * (1 - x**2), 0 * x]) for y in (1, 0, -1)]
    vertices = np.concatenate([strands[0][[0, -1]], *(strand[1:-1] for strand in strands)])
    chains = [[0, *range(first, first + 7), 1] for first in (2, 9, 16)]
    edges = [edge for chain in chains for edge in pairwise(chain)]
    empty = [edge for k, edge in enumerate(pairwise(chains[1])) if k in (2, 5)]
    points, normals = pipe([vertices[list(edge)] for edge in edges if edge not in empty])
    name = np.random.default_rng(seed).permutation(len(vertices))
    raw = sure(around(vertices[np.argsort(name)], sorted_edges(name[edges].tolist()), points, normals))
    skeleton = cut_weak_loops(raw, WEAK, 0)
    assert (skeleton.n_components, skeleton.n_loops) == (1, 1)
    (cut,) = {tuple(edge) for edge in raw.edges.tolist()} - {tuple(edge) for edge in skeleton.edges.tolist()}
    assert cut in sorted_edges(name[empty].tolist())


@settings(max_examples=30)
@given(
    st.integers(0, 10**6), st.integers(3, 9), st.floats(0.3, 1.0), st.booleans(),
    st.sampled_from([0, 0.03, 1.0, 100.0]), st.sampled_from([0, 0.65, 100.0]),
)  # fmt: skip
def test_never_tears_a_component_and_leaves_no_false_loop(random_skeleton, seed, m, reach, every, weak, least):
    raw = random_skeleton(seed, m, reach, n=4 * m, every=every)
    raw = replace(raw, confidence=np.random.default_rng(seed).random(m))
    skeleton = cut_weak_loops(raw, weak, least)
    np.testing.assert_array_equal(skeleton.component_of_vertex, raw.component_of_vertex)
    np.testing.assert_array_equal(skeleton.vertices, raw.vertices)
    assert {tuple(e) for e in skeleton.edges.tolist()} <= {tuple(e) for e in raw.edges.tolist()}
    assert skeleton.edges.tolist() == sorted(skeleton.edges.tolist())
    # what is left would not be cut again
    assert cut_weak_loops(skeleton, weak, least) is skeleton
    if weak == least == 0:
        assert skeleton is raw
    # and each edge that went was on a loop
    bridges = set(map(frozenset, nx.bridges(nx.Graph(raw.edges.tolist())))) if len(raw.edges) else set()
    assert bridges <= set(map(frozenset, skeleton.edges.tolist()))


@settings(max_examples=10)
@given(st.integers(0, 10**6), st.integers(4, 9), st.floats(0.3, 1.0), st.sampled_from([1, 1e4]))
def test_what_nothing_supports_becomes_a_forest(random_skeleton, seed, m, reach, size):
    raw = random_skeleton(seed, m, reach, n=4 * m)
    raw = replace(raw, vertices=size * raw.vertices, points=size * raw.points)
    owner = np.arange(4 * m) % m  # each vertex has points at some distance
    skeleton = cut_weak_loops(replace(raw, vertex_of_point=owner, confidence=np.zeros(m)), 0, 1)
    assert skeleton.n_loops == 0
    assert skeleton.n_components == raw.n_components


@pytest.mark.parametrize("seed", range(4))
def test_goes_with_the_cloud_and_does_not_mind_the_order_of_points(torn, seed):
    raw, rng = torn(5, bridged=True), np.random.default_rng(seed)
    turn, order = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.permutation(len(raw.points))
    moved = replace(
        raw, vertices=7 * raw.vertices @ turn - 3, points=(7 * raw.points @ turn - 3)[order],
        normals=(raw.normals @ turn)[order], vertex_of_point=raw.vertex_of_point[order],
    )  # fmt: skip
    np.testing.assert_array_equal(cut_weak_loops(moved, WEAK, SURE).edges, np.delete(raw.edges, 5, axis=0))


def test_a_loop_with_the_median_of_its_crossings_as_limit(torn):
    """`weak` is a share of the median, below which the least is cut."""
    raw = torn(None)
    (cycle,) = minimum_cycle_basis(24, raw.edges, raw.edge_lengths)
    across = crossings(cycle, 24, *bonds(raw))
    share = across.min() / np.median(across)
    assert 0 < share < 1
    assert cut_weak_loops(raw, 0.99 * share, 0) is raw
    skeleton = cut_weak_loops(raw, 1.01 * share, 0)
    assert skeleton.n_loops == 0
