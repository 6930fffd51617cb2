"""Links between near points: lengths, pieces, growth and slices against what is known of lines, planes and balls."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components, dijkstra

from glsk_o3d.numerics.near_links import join_pieces, link_growth, linked, near_links, slice_centres

RNG = np.random.default_rng(0)
LINE = np.column_stack([np.arange(40.0), np.zeros((40, 2))])
GRID = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [0.0]), axis=-1).reshape(-1, 3)


def test_links_are_symmetric_lengths_and_each_counts_once():
    links = linked(LINE, np.array([[0, 1], [1, 0], [0, 1], [3, 7], [5, 5]]))
    assert links.nnz == 4
    assert (links[0, 1], links[1, 0], links[3, 7], links[7, 3]) == (1, 1, 4, 4)


def test_points_in_one_place_stay_linked():
    links = linked(np.zeros((3, 3)), np.array([[0, 1], [1, 2]]))
    assert connected_components(links)[0] == 1


def test_links_end_at_twice_the_spacing():
    links = near_links(LINE)  # the third nearest point is two steps away, or three
    assert links[20, 24] == 4
    assert links[20, 25] == 0


def test_lines_farther_apart_than_that_are_apart():
    both = np.concatenate([LINE, LINE + [0, 4.5, 0]])
    assert connected_components(near_links(both))[0] == 2
    assert connected_components(near_links(both * [1, 0.5, 1]))[0] == 1


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_few_points(n):
    assert near_links(LINE[:n]).shape == (n, n)


def test_growth_along_curves_on_surfaces_and_in_space():
    growth = [np.median(link_growth(near_links(RNG.random((3000, 3)) * size))) for size in ([1, 0, 0], [1, 1, 0], 1)]
    np.testing.assert_allclose(growth, [5 / 3, 2.55, 4.1], atol=0.15)


def test_pieces_are_joined_where_they_are_nearest():
    lines = np.concatenate([LINE, LINE + [45, 0, 0], LINE + [0, 9, 1]])
    links, added = join_pieces(lines, near_links(lines), np.full(120, np.inf))
    assert connected_components(links)[0] == 1
    assert len(added) == 2
    lengths = np.sort(np.linalg.norm(lines[added[:, 0]] - lines[added[:, 1]], axis=1))
    assert lengths[0] == 6
    assert 82**0.5 <= lengths[1] < 1.2 * 82**0.5  # one that its end points along


def test_only_as_far_as_an_end_may_reach():
    lines = np.concatenate([LINE, LINE + [45, 0, 0], LINE + [0, 9, 1]])
    reach = np.repeat([7.0, 0.0, 0.0], 40)
    links, added = join_pieces(lines, near_links(lines), reach)
    assert connected_components(links)[0] == 2
    np.testing.assert_array_equal(np.sort(added), [[39, 40]])


def test_slices_of_a_strip_lie_in_its_middle():
    strip = np.column_stack([RNG.random((4000, 2)) * [20, 1], np.zeros(4000)])
    links, _ = join_pieces(strip, near_links(strip), np.full(4000, np.inf))
    centre = slice_centres(strip, links, dijkstra(links, indices=strip[:, 0].argmin()), 1.0)
    inner = (strip[:, 0] > 3) & (strip[:, 0] < 17)
    np.testing.assert_allclose(centre[inner, 1], 0.5, atol=0.15)
    np.testing.assert_allclose(centre[inner, 0], strip[inner, 0], atol=1)


def test_a_gap_ahead_is_joined_before_a_narrower_one_to_the_side():
    lines = np.concatenate([LINE, LINE + [45, 0, 0], LINE + [20, 5, 0]])
    _, added = join_pieces(lines, near_links(lines), np.full(120, np.inf))
    assert [39, 40] in np.sort(added).tolist()
    assert (np.abs(lines[added[:, 0], 1] - lines[added[:, 1], 1]) > 4).sum() == 1


def test_a_join_within_reach_is_made_where_a_shorter_one_is_not():
    """Two long pieces with no reach are nearer to each other than to a third one that has some."""
    lines = np.concatenate([LINE, LINE + [0, 5, 0], LINE + [0, 2.5, 5.45]])
    reach = np.repeat([0.0, 0.0, 7.0], 40)
    links, added = join_pieces(lines, near_links(lines), reach)
    assert connected_components(links)[0] == 1
    assert len(added) == 2
