"""Curvature and torsion: closed forms, invariance, and what has none."""

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, samples, skeletonize
from glsk_o3d.analysis import curvature_torsion
from glsk_o3d.analysis.curves import bend

RNG = np.random.default_rng(0)
TURN = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
TURN *= np.linalg.det(TURN)


def helix(a, b, turns=3, n=2001):
    t = np.linspace(0, 2 * np.pi * turns, n)
    return np.stack([a * np.cos(t), a * np.sin(t), b * t], axis=1), a / (a * a + b * b), b / (a * a + b * b)


def circle(n, radius=1.0):
    t = np.arange(n + 1) % n * 2 * np.pi / n
    return radius * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)


def chain(curve, radius=0.1, closed=False):
    m = len(curve) - closed
    edges = [sorted((i, (i + 1) % m)) for i in range(len(curve) - 1)]
    return Skeleton(curve[:m], sorted(edges), np.full(m, radius), (), (), ())


@pytest.mark.parametrize("half", [0.01, 0.3, None])
def test_a_straight_line_has_none(half):
    curvature, torsion = bend(np.outer(np.linspace(0, 5, 30) ** 2, [1, 2, 3]) + 7, half)
    assert np.abs(curvature).max() < 1e-12
    assert np.isnan(torsion).all()


@pytest.mark.parametrize("half", [0.4, 0.8, 1.2])
def test_a_circle_as_exact_as_stated(half):
    curvature, torsion = bend(circle(400), half, closed=True)
    assert np.abs(curvature - 1).max() < 0.0006 * half**4
    np.testing.assert_allclose(torsion, 0, atol=1e-9)
    assert np.ptp(curvature) < 1e-9  # it goes on across the seam


@pytest.mark.parametrize(("a", "b"), [(0.8, 0.4), (0.5, 0.5), (1.0, 0.1), (0.8, -0.4)])
@pytest.mark.parametrize("x", [0.4, 1.2])
def test_a_helix_as_exact_as_stated(a, b, x):
    curve, kappa, tau = helix(a, b)
    curvature, torsion = bend(curve, x / np.hypot(kappa, tau))
    assert np.abs(curvature / kappa - 1).max() < 0.0006 * x**4  # the ends, too
    assert np.abs(torsion / tau - 1).max() < 0.03 * x**2  # also its sign


def test_uneven_and_coarse_sampling():
    t = np.sort(np.r_[0, RNG.uniform(0, 2 * np.pi, 58)])
    ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    curvature, _ = bend(np.r_[ring, ring[:1]], 0.8, closed=True)
    assert np.abs(curvature - 1).max() < 0.01
    assert np.abs(bend(circle(30), 0.4, closed=True)[0] - 1).max() < 2e-4


def test_moves_turns_mirrors_and_scales_with_the_curve():
    curve = helix(0.8, 0.4, n=300)[0] + 0.01 * np.sin(np.arange(900)).reshape(300, 3)
    curvature, torsion = bend(curve, 0.6)
    for other, scale, sign in (
        (curve @ TURN + 5, 1, 1),
        (curve * [1, 1, -1], 1, -1),
        (curve * 1e3, 1e3, 1),
        (curve * 1e-9, 1e-9, 1),
    ):
        k, t = bend(other, 0.6 * scale)
        np.testing.assert_allclose(k * scale, curvature, rtol=1e-6)
        np.testing.assert_allclose(t * scale, sign * torsion, rtol=1e-5)
    k, t = bend(curve[::-1], 0.6)
    np.testing.assert_allclose(k[::-1], curvature, rtol=1e-6)
    np.testing.assert_allclose(t[::-1], torsion, rtol=1e-5)


def test_per_vertex_of_a_skeleton():
    vertices = np.concatenate([circle(40)[:-1], [[2, 0, 0], [3, 0, 0], [9, 9, 9], [8, 8, 8], [8, 8, 8]]])
    edges = [sorted((i, (i + 1) % 40)) for i in range(40)] + [[0, 40], [40, 41], [43, 44]]
    curvature, torsion = curvature_torsion(Skeleton(vertices, sorted(edges), np.full(45, 0.1), (), (), ()), window=0.5)
    assert np.isnan(curvature[[0, 42, 43, 44]]).all()  # a junction, a vertex alone, an edge without a length
    np.testing.assert_allclose(curvature[1:40], 1, rtol=1e-3)
    np.testing.assert_allclose(curvature[[40, 41]], 0, atol=1e-12)
    assert np.isnan(torsion[[0, 40, 41, 42, 43, 44]]).all()


def test_the_window_follows_the_radii():
    curve, kappa, _ = helix(0.8, 0.4)
    given = [curvature_torsion(chain(curve, r), w)[0] for r, w in ((0.08, None), (0.5, 0.4), (np.nan, 0.4))]
    np.testing.assert_array_equal(given[0], given[1])
    np.testing.assert_array_equal(given[0], given[2])
    np.testing.assert_allclose(curvature_torsion(chain(curve, np.nan))[0], kappa, rtol=0.9)  # a quarter of its length


@pytest.mark.parametrize("window", [0, -1, np.nan, np.inf])
def test_refuses(window):
    with pytest.raises(InvalidParameterError, match="window"):
        curvature_torsion(chain(circle(9)), window)


def test_of_a_computed_skeleton():
    spring = skeletonize(samples.helix(4096).points)
    curvature, torsion = curvature_torsion(spring)
    climb = 0.35 / 2 / np.pi
    assert np.median(curvature) == pytest.approx(0.3 / (0.3**2 + climb**2), rel=0.03)
    assert np.median(torsion) == pytest.approx(climb / (0.3**2 + climb**2), rel=0.15)
