"""Colours of things that belong to branches and vertices."""

import numpy as np
import pytest

from glsk_o3d import samples, skeletonize
from glsk_o3d.analysis.segmentation import thickness
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.colors import COLOR_NAMES, UNKNOWN_GREY, shades, thickness_shades

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


def test_orders_are_those_of_the_table(tree):
    order = tree.branch_table().order
    assert set(order) == {0, 1}
    shown = shades(tree, "order", np.arange(len(order)), np.zeros(len(order), int))
    assert len(np.unique(shown[order == 0], axis=0)) == len(np.unique(shown[order == 1], axis=0)) == 1
    dark, light = shown[order == 0][0], shown[order == 1][0]
    assert dark.sum() < light.sum()


def test_thickness_is_teal_where_it_is_one():
    shown = thickness_shades(np.array([0.0, 0.25, 1.0, 4.0, np.inf, np.nan]))
    np.testing.assert_array_equal(shown[[0, 4, 5]], [shown[1], shown[3], UNKNOWN_GREY])
    np.testing.assert_allclose(shown[2], [0.128, 0.567, 0.551], atol=0.01)


def test_thickness_of_vertices_is_the_median_of_their_points():
    skeleton = skeletonize(samples.torus(500).points)
    of_points, count = thickness(skeleton), np.bincount(skeleton.vertex_of_point)
    vertex = int(np.argmax(count % 2))
    median = np.median(of_points[skeleton.vertex_of_point == vertex])
    shown = shades(skeleton, "thickness", np.zeros(1, int), np.array([vertex]))
    np.testing.assert_allclose(shown, thickness_shades(np.array([median])), atol=1e-9)


def test_one_colour_for_all_and_what_is_none(tree):
    np.testing.assert_array_equal(shades(tree, (0, 0.5, 1), BRANCH, VERTICES), [[0, 0.5, 1]] * 3)
    for wrong in ("size", (1, 0), (0, 0, 2), ("a", 0, 0), np.nan):
        with pytest.raises(InvalidParameterError, match=r"color = .*'radius'"):
            shades(tree, wrong, BRANCH, VERTICES)
