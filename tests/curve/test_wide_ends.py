"""Wide ends: the curve goes straight through a disc, whatever way it took, and other ends stay as they are."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton
from glsk_o3d.curve.axis.fit import fit_axis
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.shape.wide_ends import level_wide_ends
from glsk_o3d.curve.surface import Surface


def paddle(n=4000, disc=0.25, handle=0.04, thick=0.03, seed=0):
    """Points and normals of a disc around the origin and a bar along -x, both two faces and a rim thick."""
    rng = np.random.default_rng(seed)
    outline = max(int(n * thick / disc), 1)  # as dense as the faces
    turn = rng.uniform(0.2, 2 * np.pi - 0.2, outline) + np.pi
    rim = disc * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    r, turn = disc * np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    face = np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * r])
    many = int(n * handle / disc)
    bar = np.column_stack([rng.uniform(-0.7, -disc, many), rng.uniform(-handle, handle, many), np.zeros(many)])
    side = np.column_stack([bar[:, 0], handle * np.sign(bar[:, 1]), bar[:, 2]])
    up = np.tile([0.0, 0, 1], (len(face) + len(bar), 1))
    points, normals = (
        np.concatenate([face, bar, rim, side]),
        np.concatenate([up, rim / disc, np.sign(side) * [0, 1, 0]]),
    )
    level = np.concatenate([rng.choice([-thick, thick], len(up)), rng.uniform(-thick, thick, len(rim) + len(side))])
    return points + level[:, None] * [0, 0, 1], normals


def led(curve, points, normals):
    """A skeleton fitted from this polyline on, and the same with its wide ends levelled."""
    m = len(curve)
    edges = np.column_stack([np.arange(m - 1), np.arange(1, m)])
    given = Skeleton(curve, edges, np.full(m, 0.03), cKDTree(curve).query(points)[1], points, normals)
    given = Curve.of(given)
    surface = Surface.of(given)
    given = fit_axis(given, 1, surface)
    return given, level_wide_ends(given, surface)


@pytest.mark.parametrize("wander", [lambda t: 0 * t, lambda t: 0.14 * t, lambda t: 0.1 * np.sin(2 * np.pi * t)])
@pytest.mark.parametrize("backward", [False, True])
def test_the_curve_goes_straight_through_a_disc(wander, backward):
    x = np.linspace(-0.68, 0.2, 40)
    curve = np.column_stack([x, wander(np.clip((x + 0.25) / 0.45, 0, 1)), 0 * x])
    given, levelled = led(curve[::-1] if backward else curve, *paddle())
    inside, handle = given.vertices[:, 0] > -0.15, given.vertices[:, 0] < -0.4
    assert np.abs(levelled.vertices[inside, 1]).mean() < 0.015
    assert levelled.vertices[:, 0].max() > 0.2  # as far as the rim
    np.testing.assert_array_equal(levelled.vertices[handle], given.vertices[handle])
    np.testing.assert_array_equal(levelled.edges, given.edges)
    of_handle = handle[given.vertex_of_point]
    np.testing.assert_array_equal(levelled.vertex_of_point[of_handle], given.vertex_of_point[of_handle])


def test_bars_and_long_limbs_are_no_wide_ends():
    """A bar has no neck, and what is far longer than wide behind one is a limb of its own."""
    x = np.linspace(-0.68, 0.2, 40)
    given, levelled = led(np.column_stack([x, 0 * x, 0 * x]), *paddle(disc=0.06, handle=0.05))
    assert levelled is given
    points, normals = paddle(handle=0.02)
    given, levelled = led(np.column_stack([6 * x, 0 * x, 0 * x]), points * [6, 1, 1], normals)
    assert levelled is given


def test_both_ends_of_a_dumbbell_are_wide():
    """A dumbbell of two discs, the second as far behind the handle's end as the first before it."""
    points, normals = paddle()
    own = points[:, 0] > -0.5
    points, normals = points[own], normals[own]
    x = np.linspace(-1.15, 0.15, 60)
    both = np.concatenate([points, points * [-1, 1, 1] - [1, 0, 0]]), np.concatenate([normals, normals * [-1, 1, 1]])
    given, levelled = led(np.column_stack([x, 0 * x, 0 * x]), *both)
    moved = np.linalg.norm(levelled.vertices - given.vertices, axis=1) > 0
    np.testing.assert_array_equal(
        moved, np.abs(given.vertices[:, 0] + 0.5) > np.abs(given.vertices[~moved, 0] + 0.5).max()
    )
    assert np.ptp(levelled.vertices[:, 0]) > 1.4  # both reach their rims
