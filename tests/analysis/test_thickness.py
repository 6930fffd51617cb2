"""Thickness: radius over the distance to the eighth nearest point."""

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton
from glsk_o3d.analysis import thickness


def line(points, vertex, radius=2.0):
    return Skeleton([[0, 0, 0], [9, 0, 0]], [(0, 1)], [radius, radius / 2], vertex, points, np.zeros_like(points))


def test_points_a_unit_apart():
    points = np.column_stack([np.arange(40.0), np.zeros((40, 2))])
    found = thickness(line(points, np.repeat([0, 1], 20)))
    np.testing.assert_allclose(found[4:20], 2 / 4)  # four on each side
    np.testing.assert_allclose(found[20:36], 1 / 4)
    np.testing.assert_allclose(found[0], 2 / 8)


def test_copies_and_points_that_are_not_finite():
    points = np.concatenate([np.zeros((9, 3)), [[np.nan, 0, 0]]])
    found = thickness(line(points, np.append(np.zeros(9, int), -1)))
    assert np.isinf(found[:9]).all()
    assert np.isnan(found[9])


def test_another_cloud_counts_by_its_own_points():
    points = np.column_stack([np.arange(40.0), np.zeros((40, 2))])
    skeleton = line(points, np.zeros(40, int))
    np.testing.assert_allclose(thickness(skeleton, points[::2])[4:16], 2 / 8)


def test_no_vertices():
    nothing = np.empty((0, 3))
    with pytest.raises(InvalidParameterError, match="empty"):
        thickness(Skeleton(nothing, np.empty((0, 2), int), [], [], nothing, nothing), np.zeros((3, 3)))
