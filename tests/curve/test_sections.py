"""Sections: closed forms, whatever was seen of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glsk_o3d.curve.curve import Curve


def measure_sections(skeleton):
    return Curve.of(skeleton).sections


def half_axes(sections):
    return np.column_stack([sections.half_width, sections.half_thickness])


@pytest.mark.parametrize("side", [None, [0, 1, 0]])
def test_a_tube_and_half_of_one_have_its_radius(piped, side):
    actual = measure_sections(piped([[(0, 0, 0), (1, 0, 0)]], radius=0.1, spacing=0.005, side=side))
    np.testing.assert_allclose(half_axes(actual), 0.1, rtol=1e-9)
    np.testing.assert_allclose(actual.radius, 0.1, rtol=1e-9)


@pytest.mark.parametrize("seen", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], ids=["whole", "one side", "from a corner"])
def test_a_bar_has_its_half_axes_however_it_is_turned(flat_bar, seen):
    size = 1e-9
    bar, turn = flat_bar(0.4, 0.2, seen), Rotation.random(random_state=1)
    vertices, points = (size * turn.apply(places) for places in (bar.vertices, bar.points))
    actual = measure_sections(replace(bar, vertices=vertices, points=points, normals=turn.apply(bar.normals)))
    np.testing.assert_allclose(half_axes(actual), np.tile([0.4 * size, 0.2 * size], (41, 1)), rtol=1e-6)
    np.testing.assert_allclose(np.abs(actual.across @ turn.apply([1, 0, 0])), 1)
    np.testing.assert_allclose(actual.radius, np.sqrt(0.08) * size, rtol=1e-6)


def test_an_unseen_half_axis_is_the_radius(flat_bar):
    bar = flat_bar(0.4, 0.2)
    top = (np.abs(bar.normals[:, [1]]) == 1) & (bar.points[:, [1]] > 0)
    face = measure_sections(replace(bar, normals=np.where(top, bar.normals, np.nan)))
    np.testing.assert_allclose(half_axes(face), np.tile([0.3, 0.2], (41, 1)))
    pointless = measure_sections(replace(bar, vertex_of_point=np.where(bar.vertex_of_point == 7, -1, 8)))
    np.testing.assert_array_equal(half_axes(pointless)[[0, 7, 40]], 0.3)
    np.testing.assert_allclose(half_axes(pointless)[8], [0.4, 0.2])
