"""How much of the axis a cloud shows."""

import numpy as np
import pytest
from glsk_bench.clouds import cloud, coverage
from glsk_bench.shapes import Shape
from glsk_bench.shapes.axis import Axis, joined
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes.surface import surface

from glsk_o3d.errors import InvalidParameterError


def tubes(*offsets):
    """Straight tubes of length 1 and radius 0.05 along x, so far aside."""
    parts = []
    for y in offsets:
        part = Axis()
        part.path(np.array([[0, y, 0], [1, y, 0.0]]), 0.05)
        parts.append(part)
    whole = joined(parts)
    found = surface(whole.nodes, whole.edges, whole.radii, 20_000, generator("tubes"))
    facts = {"area": found.area}
    return Shape("tube_0", "tube", 0, whole.nodes, whole.edges, whole.radii, found.points, found.normals, facts)


@pytest.mark.parametrize("family", ["trees", "groups"])
def test_clouds_of_the_whole_surface_show_the_whole_axis(family, drawn):
    one = drawn(family, 0)
    assert coverage(one, one.points[::5]) == 1
    assert coverage(one, cloud(one, "clean")) == 1
    assert coverage(one, cloud(one, "noise05")) > 0.99


@pytest.mark.parametrize(("gap", "least", "most"), [(0.05, 1, 1), (0.15, 0.9, 0.96), (0.3, 0.7, 0.8)])
def test_long_gaps_count_more_than_their_length(gap, least, most):
    one = tubes(0)
    found = coverage(one, one.points[np.abs(one.points[:, 0] - 0.5) > gap / 2])
    assert least <= found <= most


def test_points_of_a_part_nearby_show_nothing_of_this_one():
    one = tubes(0, 0.14)
    assert coverage(one, one.points[one.points[:, 1] < 0.07]) == 0.5


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros(3), np.zeros((4, 2)), np.full((4, 3), np.nan)])
def test_what_is_no_cloud_is_refused(points):
    with pytest.raises(InvalidParameterError, match=r"points must be an \(n, 3\) array of finite numbers"):
        coverage(tubes(0), points)
