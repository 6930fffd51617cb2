"""Colours of things that belong to branches and vertices."""

import numpy as np
import pytest

from glsk_o3d import samples, skeletonize
from glsk_o3d.analysis import branch_table
from glsk_o3d.analysis.segmentation import thickness_of_points
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.colors import COLOR_NAMES, UNKNOWN_GREY, shades, thickness_shades

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


def test_thickness_is_teal_where_it_is_one_and_of_a_vertex_the_median_of_its_points():
    shown = thickness_shades(np.array([0.0, 0.25, 1.0, 4.0, np.inf, np.nan]))
    np.testing.assert_array_equal(shown[[0, 4, 5]], [shown[1], shown[3], UNKNOWN_GREY])
    np.testing.assert_allclose(shown[2], [0.128, 0.567, 0.551], atol=0.01)
    skeleton = skeletonize(samples.torus(500).points)
    of_points = thickness_of_points(skeleton, skeleton.points, skeleton.vertex_of_point)
    count = np.bincount(skeleton.vertex_of_point)
    vertex = int(np.argmax(count % 2))
    median = np.median(of_points[skeleton.vertex_of_point == vertex])
    shown = shades(skeleton, "thickness", np.zeros(1, int), np.array([vertex]))
    np.testing.assert_allclose(shown, thickness_shades(np.array([median])), atol=1e-9)


def test_one_colour_for_all_and_what_is_none(tree):
    np.testing.assert_array_equal(shades(tree, (0, 0.5, 1), BRANCH, VERTICES), [[0, 0.5, 1]] * 3)
    for wrong in ("size", (1, 0), (0, 0, 2), ("a", 0, 0), np.nan):
        with pytest.raises(InvalidParameterError, match=r"color = .*'radius'"):
            shades(tree, wrong, BRANCH, VERTICES)
