"""Which side is inside, and inscribed balls."""

import numpy as np
import pytest

from glsk_o3d import pipelines, samples
from glsk_o3d.geometry.inscribed_balls import inscribed_balls, mean_places, outward_normals


def on_capsule(n, seed=0):
    """Points on a tube of radius 0.1 along x without ends, and their outward normals."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * rng.random(n)
    out = np.column_stack([0 * turn, np.cos(turn), np.sin(turn)])
    return 0.1 * out + rng.random((n, 1)) * [1.5, 0, 0], out


def test_balls_in_a_tube_have_its_radius():
    points, out = on_capsule(4000)
    radius, contacts = inscribed_balls(points, out)
    middle = np.abs(points[:, 0] - 0.75) < 0.6
    assert np.quantile(np.abs(radius[middle] / 0.1 - 1), 0.95) < 0.05
    assert 0 < contacts.min() <= contacts.max() <= 1
    away = np.min(np.linalg.norm((points - radius[:, None] * out)[:50, None] - points, axis=2), axis=1)
    assert (away > 0.998 * radius[:50]).all()  # they are empty


def test_balls_outside_of_a_tube_touch_nothing():
    points, out = on_capsule(1000)
    radius, contacts = inscribed_balls(points, -out)
    assert (contacts == 0).all()
    assert (radius == 0.8).all()


@pytest.mark.parametrize("name", ["torus", "y_junction", "two_rings"])
@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_normals_point_outward_and_places_are_inside(name, noise):
    """Also of several parts, and of a hole's wall: half of a torus is bent like that."""
    sample = getattr(samples, name)(3000, noise=noise)
    state = pipelines.rings()(sample.points)
    rng, at = np.random.default_rng(1), state.positions
    normals = state.normals[state.survivors] * rng.choice([-1, 1], (len(state), 1))
    out = outward_normals(at, normals, state.rings)
    places, trust = mean_places(at, out, state.rings, *inscribed_balls(at, out))

    def depth(moved):
        return -samples.signed_distance(state.frame.out_of(moved), sample.nodes, sample.edges, sample.radii)

    assert np.mean(depth(at - 0.01 * out) > depth(at)) > 0.95
    assert np.mean(depth(places) > 0) > 0.97
    assert np.median(depth(places)) > (0.2 if noise else 0.85) * np.median(sample.radii)  # balls in noise are too small
    assert 0.05 < np.median(trust) < 0.5  # around a tube contacts are anywhere, and the nearest one counts
