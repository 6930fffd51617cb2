"""Circles through points: exact ones, arcs and outliers."""

import numpy as np
import pytest

from glsk_o3d.analysis.forestry import fit_circle


def arc(degrees, n, noise, rng, radius=1.0, centre=(5.0, 7.0)):
    turn = np.radians(degrees) * (rng.random(n) - 0.5) + rng.uniform(0, 2 * np.pi)
    wide = radius + noise * rng.normal(size=n)
    return centre + wide[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])


@pytest.mark.parametrize("degrees", [360, 180, 90, 30])
def test_points_on_a_circle(degrees):
    fit = fit_circle(arc(degrees, 100, 0, np.random.default_rng(0), 0.2))
    assert fit.radius == pytest.approx(0.2, rel=1e-9)
    assert fit.arc == pytest.approx(degrees, abs=15)
    assert fit.points == 100


def test_outliers_have_no_say():
    rng = np.random.default_rng(1)
    wood = arc(200, 120, 0, rng)
    fit = fit_circle(np.concatenate([wood, wood.mean(axis=0) + rng.uniform(-3, 3, (60, 2))]))
    assert fit.radius == pytest.approx(1, rel=0.01)
    clump = wood.mean(axis=0) + [2, 0] + 0.1 * rng.normal(size=(80, 2))  # a shrub beside the stem
    assert fit_circle(np.concatenate([wood, clump])).radius == pytest.approx(1, rel=1e-6)


def test_a_few_points_on_the_other_side_have_no_say():
    """They would weigh most: two twigs hardly off the circle, opposite to an arc of 120 degrees."""
    rng = np.random.default_rng(4)
    wood = arc(120, 60, 0.02, rng, centre=(0, 0))
    middle = np.arctan2(*wood.mean(axis=0)[::-1])
    twigs = 1.09 * np.array([[np.cos(middle + turn), np.sin(middle + turn)] for turn in (2.9, 3.1)])
    alone, more = fit_circle(wood), fit_circle(np.concatenate([wood, twigs]))
    assert more.radius == pytest.approx(alone.radius, rel=1e-6)
    assert more.points == alone.points


def test_the_arc_is_what_has_points():
    rng = np.random.default_rng(2)
    sides = [[np.cos(a), np.sin(a)] for a in np.radians(np.r_[np.arange(0, 91), np.arange(180, 241)])]
    assert fit_circle(np.array(sides)).arc == pytest.approx(150, abs=1)
    assert fit_circle(arc(360, 40, 0.01, rng)).arc > 300  # few points all around


def test_there_may_be_none():
    line = np.column_stack([np.arange(50.0), 0 * np.arange(50.0)])
    for points in (np.eye(3)[:, :2], np.empty((0, 2)), np.ones((20, 2)), line):
        assert fit_circle(points) is None
