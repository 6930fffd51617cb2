"""Colours of things that belong to branches and vertices."""

import numpy as np
import pytest

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.colors import COLOR_NAMES, UNKNOWN_GREY, shades

BRANCH, VERTICES = np.array([0, 1, -1]), np.array([0, 5, -1])


@pytest.mark.parametrize("color", COLOR_NAMES)
def test_what_belongs_to_nothing_is_grey(tree, color):
    shown = shades(tree, color, BRANCH, VERTICES)
    assert shown.shape == (3, 3)
    np.testing.assert_array_equal(shown[2], UNKNOWN_GREY)
    assert ((shown >= 0) & (shown <= 1)).all()


def test_branches_differ_and_values_are_means_over_vertices(tree):
    shown = shades(tree, "branch", np.arange(18), np.zeros(18, int))
    assert len(np.unique(shown, axis=0)) == 18
    pairs = np.array([[0, 0], [5, 5]])
    np.testing.assert_array_equal(
        shades(tree, "radius", BRANCH[:2], pairs), shades(tree, "radius", BRANCH[:2], VERTICES[:2])
    )


def test_one_colour_for_all_and_what_is_none(tree):
    np.testing.assert_array_equal(shades(tree, (0, 0.5, 1), BRANCH, VERTICES), [[0, 0.5, 1]] * 3)
    for wrong in ("thickness", (1, 0), (0, 0, 2), ("a", 0, 0), np.nan):
        with pytest.raises(InvalidParameterError, match=r"color = .*'radius'"):
            shades(tree, wrong, BRANCH, VERTICES)
