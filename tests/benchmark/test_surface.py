"""Points on the boundary of round cones, against distances and areas in closed form."""

import numpy as np
import pytest
from glsk_bench.shapes import FAMILIES
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes.surface import INSIDE, surface

from glsk_o3d.samples.capsules import signed_distance


@pytest.mark.parametrize("family", FAMILIES["v1"])
@pytest.mark.parametrize("seed", [0])
def test_all_points_are_on_the_surface_and_normals_point_outward(family, seed, drawn):
    one = drawn(family, seed)
    axis = one.nodes, one.edges, one.radii
    distance = signed_distance(one.points, *axis)
    assert distance.max() < 1e-12
    assert distance.min() >= -INSIDE
    assert np.mean(distance < -1e-9) < 0.1  # where cones bend by less than a degree
    np.testing.assert_allclose(np.linalg.norm(one.normals, axis=1), 1, atol=1e-12)
    points, normals = one.points[::20], one.normals[::20]
    assert signed_distance(points - 1e-4 * normals, *axis).max() < -0.99e-4
    outside = signed_distance(points + 1e-4 * normals, *axis)
    assert np.mean(outside > 0.9e-4) > 0.97  # but in creases


def cone(ra, rb, pieces=1):
    """A cone of length 1 along x, in so many pieces."""
    t = np.linspace(0, 1, pieces + 1)
    start = np.arange(pieces)
    return np.column_stack([t, 0 * t, 0 * t]), np.column_stack([start, start + 1]), ra + t * (rb - ra)


def hull_area(ra, rb):
    """Of the convex hull of two balls a length of 1 apart: the caps, and the cone between the circles of contact."""
    sine = ra - rb
    caps = 2 * np.pi * (ra**2 * (1 + sine) + rb**2 * (1 - sine))
    return caps + np.pi * (ra + rb) * (1 - sine**2)


@pytest.mark.parametrize("pieces", [1, 7])
@pytest.mark.parametrize(("ra", "rb"), [(0.2, 0.2), (0.3, 0.1), (0.05, 0.4)])
def test_points_are_uniform_by_area(ra, rb, pieces):
    found = surface(*cone(ra, rb, pieces), 40_000, generator("area", pieces))
    area, sine = hull_area(ra, rb), ra - rb
    assert found.area == pytest.approx(area, rel=0.02)
    # the caps end at the circles where the cone touches the balls
    x, low, high = found.points[:, 0], ra * sine, 1 + rb * sine
    for share, cap in ((x < low, ra**2 * (1 + sine)), (x > high, rb**2 * (1 - sine))):
        expected = 2 * np.pi * cap / area
        assert share.mean() == pytest.approx(expected, abs=5 * np.sqrt(expected / 40_000))
    # between them by radius, which changes from ra to rb, both times the cosine
    mean = low + (high - low) * (ra + 2 * rb) / (3 * (ra + rb))
    assert x[(x > low) & (x < high)].mean() == pytest.approx(mean, abs=0.01)
