"""Colours of things that belong to branches and vertices."""

import numpy as np
import pytest

from glsk_o3d.analysis import branch_table
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.colors import COLOR_NAMES, UNKNOWN_GREY, shades

BRANCH, VERTICES = np.array([0, 1, -1]), np.array([0, 5, -1])


@pytest.mark.parametrize("color", COLOR_NAMES)
def test_what_belongs_to_nothing_is_grey(tree, color):
    shown = shades(tree, color, BRANCH, VERTICES)
    assert shown.shape == (3, 3)
    np.testing.assert_array_equal(shown[2], UNKNOWN_GREY)
    assert ((shown >= 0) & (shown <= 1)).all()


def test_branches_differ_orders_go_up_and_values_are_means_over_vertices(tree):
    assert len(np.unique(shades(tree, "branch", np.arange(18), np.zeros(18, int)), axis=0)) == 18
    pairs = np.array([[0, 0], [5, 5]])
    by_radius = [shades(tree, "radius", BRANCH[:2], vertices) for vertices in (pairs, VERTICES[:2])]
    np.testing.assert_array_equal(*by_radius)
    order = branch_table(tree).order
    shown = shades(tree, "order", np.arange(len(order)), np.zeros(len(order), int))
    dark, light = (np.unique(shown[order == each], axis=0) for each in (0, 1))
    assert len(dark) == len(light) == 1
    assert dark.sum() < light.sum()


def test_one_colour_for_all_and_what_is_none(tree):
    np.testing.assert_array_equal(shades(tree, (0, 0.5, 1), BRANCH, VERTICES), [[0, 0.5, 1]] * 3)
    for wrong in ("size", (1, 0), (0, 0, 2), ("a", 0, 0), np.nan):
        with pytest.raises(InvalidParameterError, match=r"color = .*'radius'"):
            shades(tree, wrong, BRANCH, VERTICES)
