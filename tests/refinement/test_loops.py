"""False loops collapse, handles stay."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from glsk_o3d.numerics.cycles import minimum_cycle_basis, opens_wider
from glsk_o3d.refinement.evidence import Evidence, SurfaceGraph
from glsk_o3d.refinement.loops import close_loops, collapse_narrow_loops, facing_pairs, loop_facts
from glsk_o3d.refinement.sections import VertexPoints

X, Y, Z = np.eye(3)
LADDER = [[(-0.8, y, 0), (0, y, 0), (0.8, y, 0)] for y in (0, 0.5)] + [[(x, 0, 0), (x, 0.5, 0)] for x in (-0.8, 0, 0.8)]
TORUS = [[(np.cos(t), np.sin(t), 0) for t in np.arange(25) * np.pi / 12]]


def closed(skeleton, least=0.5):
    return close_loops(skeleton, Evidence.of(skeleton), least)


def strands(piped, gap=0.06, **options):
    """A tube with two strands in it, that meet at both ends."""
    axis = piped([[(-1, 0, 0), (1, 0, 0)]], **options)
    n = len(axis.vertices)
    inner = np.arange(5, n - 5)
    vertices = np.concatenate([axis.vertices, axis.vertices[inner] - gap / 2 * Y])
    vertices[inner] += gap / 2 * Y
    chain = [4, *range(n, n + len(inner)), n - 5]
    edges = np.concatenate([axis.edges, np.sort(list(pairwise(chain)), axis=1)])
    edges = edges[np.lexsort(edges.T[::-1])]
    owner = np.argmin(np.linalg.norm(axis.points[:, None] - vertices, axis=2), axis=1)
    m = len(vertices)
    return replace(
        axis, vertices=vertices, edges=edges, radii=np.full(m, 0.1), confidence=np.full(m, 0.9), vertex_of_point=owner
    )


@pytest.mark.parametrize("side", [None, Z], ids=["whole", "one side"])
@pytest.mark.parametrize(("lines", "loops"), [(LADDER, 2), (TORUS, 1)], ids=["ladder", "torus"])
def test_handles_stay(piped, lines, loops, side):
    raw = piped(lines, side=side)
    skeleton, judgements = closed(raw)
    assert skeleton is raw
    assert [(it.about, it.changed) for it in judgements] == loops * [("loop", False)]
    assert min(it.probability for it in judgements) > 0.9
    if loops == 1:
        np.testing.assert_allclose(judgements[0].place, 0, atol=0.05)


@pytest.mark.parametrize("side", [None, Z], ids=["whole", "one side"])
def test_two_strands_in_one_tube_become_a_path(piped, side):
    raw = strands(piped, side=side)
    skeleton, judgements = closed(raw)
    assert raw.n_loops == 1
    assert (skeleton.n_loops, skeleton.n_components, len(skeleton.leaves), len(skeleton.junctions)) == (0, 1, 2, 0)
    ((about, probability, changed),) = [(it.about, it.probability, it.changed) for it in judgements]
    assert (about, changed) == ("loop", True)
    assert probability < 0.25
    np.testing.assert_allclose(skeleton.vertices[:, 1:], 0, atol=0.02)
    assert (np.diff(np.sort(skeleton.vertices[:, 0])) < 0.06).all()


@pytest.mark.parametrize(("gap", "collapsed"), [(0.06, True), (0.12, True), (0.24, False)])
def test_raw_loops_are_collapsed_that_open_less_than_their_tube_is_thick(piped, gap, collapsed):
    """The largest circle between two strands has half their distance for its radius."""
    raw = strands(piped, gap=gap)
    reach = np.median(VertexPoints(raw).distance)
    assert (gap / 2 < reach) == collapsed
    assert collapse_narrow_loops(raw, SurfaceGraph.of(raw)).n_loops == (0 if collapsed else 1)


def test_a_raw_loop_around_a_hole_stays_however_narrow(piped):
    """A ring of which the hole is half as wide as its tube, and the contraction has gone too far."""
    angle = np.linspace(0, 2 * np.pi, 25)
    circle = 0.15 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    ring = piped([tuple(map(tuple, pair)) for pair in pairwise(circle)])
    raw = replace(ring, vertices=0.62 * ring.vertices)
    assert raw.n_loops == 1
    assert not opens_wider(
        raw.vertices[np.argsort(np.arctan2(*raw.vertices[:, 1::-1].T))], np.median(VertexPoints(raw).distance)
    )
    assert collapse_narrow_loops(raw, SurfaceGraph.of(raw)).n_loops == 1


def test_a_wide_loop_is_cut_where_fewest_bonds_cross(piped):
    """A ring of which an eighth is in air, joined by hand."""
    angle = np.arange(4, 29) * np.pi / 16
    arc = [(np.cos(t), np.sin(t), 0) for t in angle]
    raw = piped([arc])
    ends = np.argsort(raw.vertices @ X)[-2:]
    raw = replace(raw, edges=np.unique(np.concatenate([raw.edges, [np.sort(ends)]]), axis=0))
    assert raw.n_loops == 1
    skeleton, (judgement,) = closed(raw, least=1.01)
    assert judgement.changed
    assert (skeleton.n_loops, skeleton.n_components) == (0, 1)
    assert sorted(skeleton.leaves.tolist()) == sorted(ends.tolist())


def test_a_least_probability_of_none_keeps_all(piped):
    raw = strands(piped)
    skeleton, (judgement,) = closed(raw, least=0)
    assert skeleton is raw
    assert not judgement.changed


def test_true_and_false_loop_in_one_graph(piped):
    """A ring, and a stretch of it twice."""
    ring = piped(TORUS)
    around = np.argsort(np.arctan2(ring.vertices[:, 1], ring.vertices[:, 0]))
    m, stretch = len(ring.vertices), around[20:40]
    chain = [around[19], *range(m, m + 20), around[40]]
    vertices = np.concatenate([ring.vertices, 0.95 * ring.vertices[stretch]])
    edges = np.concatenate([ring.edges, np.sort(list(pairwise(chain)), axis=1)])
    owner = np.argmin(np.linalg.norm(ring.points[:, None] - vertices, axis=2), axis=1)
    n = len(vertices)
    raw = replace(
        ring, vertices=vertices, edges=edges[np.lexsort(edges.T[::-1])], radii=np.full(n, 0.1),
        confidence=np.full(n, 0.95), vertex_of_point=owner,
    )  # fmt: skip
    assert raw.n_loops == 2
    skeleton, judgements = closed(raw)
    assert (skeleton.n_loops, skeleton.n_components) == (1, 1)
    assert (skeleton.degree == 2).all()
    assert sorted(it.changed for it in judgements) == [False, True]
    np.testing.assert_allclose(np.linalg.norm(skeleton.vertices, axis=1), 1, atol=0.05)


def facts_of(skeleton):
    cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
    return loop_facts(skeleton, cycles, Evidence.of(skeleton))


def test_the_facts_of_a_ring_and_of_two_strands(piped):
    ((ring, _, centre, _),) = facts_of(piped(TORUS, confidence=0.8))
    assert ring["opening"] > np.log(3)
    assert ring["winding"] == pytest.approx(0, abs=0.05)
    assert ring["confidence"] == pytest.approx(0.8)
    np.testing.assert_allclose(centre, 0, atol=0.05)
    ((false, *_),) = facts_of(strands(piped))
    assert false["opening"] < np.log(0.6)
    assert false["winding"] == pytest.approx(1, abs=0.15)


def test_a_loop_of_a_tube_without_thickness_opens_wide(piped):
    """Its points lie on it: how many times the tube it opens is no number."""
    ring = piped(TORUS)
    vertices = 1e6 * ring.vertices
    ((facts, *_),) = facts_of(replace(ring, vertices=vertices, points=vertices[ring.vertex_of_point]))
    assert facts["opening"] == pytest.approx(np.log(3.1))


def test_what_nobody_measured_counts_as_no_confidence(piped):
    ((facts, *_),) = facts_of(replace(piped(TORUS), confidence=np.empty(0)))
    assert facts["confidence"] == 0


def test_no_loops_no_facts(piped):
    assert facts_of(piped([[(-1, 0, 0), (1, 0, 0)]])) == []


def test_surface_distance_is_the_median_over_the_owned_supporting_points(ringed):
    raw = ringed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)], per=5)
    points, normals, vertex = raw.points.copy(), raw.normals.copy(), raw.vertex_of_point.copy()
    points[:5] = np.outer([1, 2, 3, 4, 100], [0, 0, 1])
    normals[4] = np.nan
    vertex[10:] = -1
    skeleton = replace(raw, points=points, normals=normals, vertex_of_point=vertex)
    np.testing.assert_allclose(VertexPoints(skeleton).distance, [2.5, 0.1, 0])


@pytest.mark.parametrize("turn", range(6))
def test_facing_pairs_join_what_is_as_far_along(turn):
    """The ends are 10 and 13, whichever vertex comes first."""
    points = np.array([[0, 0, 0], [1, 0.1, 0], [2, 0.1, 0], [3, 0, 0], [2, -0.1, 0], [1, -0.1, 0]])
    labels = np.arange(10, 16)
    pairs = facing_pairs(np.roll(points, turn, axis=0), np.roll(labels, turn))
    assert {frozenset(pair) for pair in pairs.tolist()} == {frozenset({11, 15}), frozenset({12, 14})}


@pytest.mark.parametrize("turn", range(6))
def test_facing_pairs_of_uneven_sides(turn):
    points = np.array([[0, 0, 0], [0.4, 0.1, 0], [2, 0.1, 0], [3.6, 0.1, 0], [4, 0, 0], [2, -0.1, 0]])
    pairs = facing_pairs(np.roll(points, turn, axis=0), np.roll(np.arange(6), turn))
    # those near an end meet the end
    assert {frozenset(pair) for pair in pairs.tolist()} == {frozenset({0, 1}), frozenset({2, 5}), frozenset({3, 4})}


def test_facing_pairs_of_a_loop_in_one_place():
    assert facing_pairs(np.zeros((4, 3)), np.arange(4)).tolist() == [[0, 1], [0, 2], [0, 3]]


def test_every_inner_vertex_is_in_a_pair():
    rng = np.random.default_rng(0)
    for n in range(4, 20):
        points = rng.normal(size=(n, 3))
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        ends = set(np.unravel_index(np.argmax(distance), (n, n)))
        pairs = facing_pairs(points, np.arange(n))
        assert set(range(n)) - ends <= set(pairs.ravel().tolist())
        # the two ends stay apart
        assert not any(set(pair) == ends for pair in pairs.tolist())
