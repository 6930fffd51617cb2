"""Radii from planes and from points, by hand."""

import numpy as np
import pytest

from glsk_o3d.geometry.radii import plane_distance_radii, robust_radii, supporting_points


def fan(opening, n=4000):
    """Normals across the x axis, evenly over an angle."""
    angle = (np.arange(n) + 0.5) / n * opening
    return np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("normals", "flatness"),
    [(fan(2 * np.pi), 0), (fan(np.pi), 0), (fan(np.pi / 2), 2 / np.pi), (fan(1e-9), 1)],
    ids=["tube", "half", "quarter", "sheet"],
)
@pytest.mark.parametrize("doubt", [0, 0.25, 1])
def test_robust_radii_lie_between_planes_and_points(normals, flatness, doubt):
    """A quarter of a tube: the shares are 1/2 + 1/pi and 1/2 - 1/pi."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    owner = np.zeros(len(normals), int)
    distance = np.linspace(2, 4, len(normals))
    radii = robust_radii(np.array([1.0, 7.0]), distance, np.array([doubt, 1.0]), normals @ turn, owner)
    np.testing.assert_allclose(radii, [1 + np.sqrt(doubt) * (1 - flatness) * (3 - 1), 7], rtol=1e-6)


def test_planes_of_a_tube_have_its_radius_wherever_along_it():
    normals = fan(2 * np.pi, 12)
    points = 0.1 * normals + np.linspace(-1, 1, 12)[:, None] * [1, 0, 0]
    owner = np.array([0] * 6 + [1] * 5 + [-1])
    normals[0] = np.nan
    assert supporting_points(owner, normals).tolist() == list(range(1, 11))
    radii = plane_distance_radii(np.zeros((3, 3)), owner, points, normals, otherwise=np.array([9.0, 9.0, 0.5]))
    np.testing.assert_allclose(radii, [0.1, 0.1, 0.5])
