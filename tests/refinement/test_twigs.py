"""Twigs are cut by their length over the thickness where they begin."""

import numpy as np
import pytest

from glsk_o3d.refinement.twigs import cut_twigs

N = 21  # vertices of the trunk


def tree(ringed, *twigs, radius=0.1):
    """A trunk along x from -1 to 1; twigs (vertex, length) grow from it in two edges each, along z."""
    x = np.linspace(-1, 1, N)
    vertices = list(np.column_stack([x, 0 * x, 0 * x]))
    edges = [(i, i + 1) for i in range(N - 1)]
    for at, length in twigs:
        edges += [(at, len(vertices)), (len(vertices), len(vertices) + 1)]
        vertices += [vertices[at] + [0, 0, length * share] for share in (0.4, 1)]
    return ringed(vertices, edges, radius)


def test_short_is_cut_long_stays(ringed):
    raw = tree(ringed, (5, 0.07), (12, 0.5))
    skeleton = cut_twigs(raw, 0.8)
    assert len(skeleton.vertices) == N + 2
    np.testing.assert_array_equal(skeleton.junctions, [12])
    np.testing.assert_allclose(skeleton.vertices[:N], raw.vertices[:N], atol=1e-15)
    np.testing.assert_allclose(skeleton.vertices[N:], raw.vertices[N + 2 :], atol=1e-15)
    # the junction stays in its place and takes the points
    count = np.bincount(skeleton.vertex_of_point)
    assert count[5] == 36
    assert (np.delete(count, 5) == 12).all()
    owner = raw.vertex_of_point
    assert (skeleton.vertex_of_point[(owner == N) | (owner == N + 1)] == 5).all()


@pytest.mark.parametrize("share", [0.4, 0.8, 2.0])
@pytest.mark.parametrize(("length", "cut"), [(1 - 1e-6, True), (1 + 1e-6, False)])
def test_threshold_is_exact(ringed, share, length, cut):
    radius = np.full(N + 2, 0.3)
    radius[10] = 0.1  # at the junction, and nowhere else
    skeleton = cut_twigs(tree(ringed, (10, share * 0.1 * length), radius=radius), share)
    assert (len(skeleton.vertices) == N) == cut


def test_ends_of_the_trunk_stay(ringed):
    """Only what leaves a junction is a twig: a path shorter than it is thick is all there is."""
    raw = tree(ringed, radius=50.0)
    assert cut_twigs(raw, 0.8) is raw


def test_zero_keeps_all(ringed):
    raw = tree(ringed, (5, 0.07))
    assert cut_twigs(raw, 0) is raw


def test_shortest_first_until_it_is_no_junction(ringed):
    """Of three short branches the longest two remain as a path."""
    tips = np.array([[0.06, 0, 0], [-0.02, 0.05, 0], [-0.02, -0.07, 0]])
    raw = ringed(np.concatenate([[[0, 0, 0]], tips]), [(0, 1), (0, 2), (0, 3)])
    skeleton = cut_twigs(raw, 0.8)
    assert skeleton.edges.tolist() == [[0, 1], [0, 2]]
    np.testing.assert_allclose(skeleton.vertices, [[0, 0, 0], tips[0], tips[2]], atol=1e-15)


def test_several_at_one_junction_and_in_any_numbering(ringed):
    raw = tree(ringed, (5, 0.03), (5, 0.07), (9, 0.05), (12, 0.5))
    turn = np.random.default_rng(1).permutation(len(raw.vertices))
    back = np.argsort(turn)
    for case in (raw, ringed(raw.vertices[turn], back[raw.edges])):
        skeleton = cut_twigs(case, 0.8)
        assert len(skeleton.vertices) == N + 2
        assert len(skeleton.junctions) == 1
        expected = raw.vertices[[*range(N), N + 6, N + 7]]
        gap = np.linalg.norm(skeleton.vertices[:, None] - expected[None], axis=2).min(axis=1)
        assert gap.max() < 1e-12


def test_loops_at_a_junction_and_bridges_are_no_twigs(ringed):
    """A tiny ring on a stem, and a short link between two junctions: no leaf, no twig."""
    tiny = [[0, 0, 0.02], [0.01, 0, 0.03], [0, 0, 0.04], [-0.01, 0, 0.03]]
    line = [[x, 0, 0] for x in (-1, 0, 1)]
    edges = [(0, 1), (1, 2), (1, 3), (3, 4), (4, 5), (5, 6), (3, 6)]
    raw = ringed(line + tiny, edges)
    assert cut_twigs(raw, 0.8) is raw
