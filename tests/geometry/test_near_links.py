"""Links between near points: lengths, pieces, growth and slices against what is known of lines, planes and balls."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components, dijkstra

from glsk_o3d.geometry.near_links import join_pieces, link_growth, near_links, slice_centres

RNG = np.random.default_rng(0)
LINE = np.column_stack([np.arange(40.0), np.zeros((40, 2))])


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_few_points_have_a_matrix_of_links(n):
    assert near_links(LINE[:n]).shape == (n, n)


def test_links_grow_as_the_dimension_of_a_cloud():
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


@pytest.mark.parametrize(("near", "far", "joined"), [(6, 0, 1), (0, 6, 1), (5.9, 5.9, 0)])
def test_a_gap_is_joined_if_it_is_short_enough_for_one_of_its_ends(near, far, joined):
    lines = np.concatenate([LINE, LINE + [45, 0, 0]])
    _, added = join_pieces(lines, near_links(lines), np.repeat([near, far], 40))
    assert len(added) == joined
