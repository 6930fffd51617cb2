"""How much of a surface faces its own curve: nothing beside an axis, patches where the curve is in the wrong place."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, samples, skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.surface import Surface
from glsk_o3d.data.verdict import graph_score


def straight(points, normals, places):
    """Upright lines through places in the plane, with the points that are nearest to them."""
    height = np.linspace(0, 2, 21)
    vertices = np.concatenate([np.column_stack([0 * height + x, 0 * height, height]) for x in places])
    row = np.arange(len(vertices)).reshape(len(places), -1)
    edges = np.stack([row[:, :-1], row[:, 1:]], axis=2).reshape(-1, 2)
    owner = np.linalg.norm(points[:, None] - vertices, axis=2).argmin(axis=1)
    return Curve.of(Skeleton(vertices, edges, [0.1] * len(vertices), owner, points, normals))


@pytest.mark.parametrize("gap", [0.2, 0.4, 0.8])
@pytest.mark.parametrize("n", [500, 1000, 4000])
def test_two_bars_face_a_curve_between_them_and_not_their_axes(gap, n):
    """A hole between two upright bars, as it is and closed."""
    rng = np.random.default_rng(n)
    turn, height, side = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 2, n), rng.choice([-1, 1], n)
    normals = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    points = 0.1 * normals + np.column_stack([gap * side, 0 * side, height])
    closed, right = (straight(points, normals, places) for places in ([0.0], [-gap, gap]))
    patch, share = Surface.of(closed).facing(closed)
    assert patch > 5
    assert 0.02 < share < 0.5
    patch, share = Surface.of(right).facing(right)
    assert patch <= 1
    assert share < 0.01


@pytest.mark.parametrize("make", [samples.torus, samples.y_junction, samples.helix, samples.tube])
@pytest.mark.parametrize("scale", [1, 1e-9])
def test_whole_tubes_face_away_from_their_skeletons(make, scale):
    report = skeletonize(scale * make(1500).points).report
    assert report.n_facing <= 1
    assert report.facing < 0.005


def test_a_patch_lowers_the_score_and_noise_less():
    sure = graph_score([], np.ones(3))
    scores = [graph_score([], np.ones(3), n, share) for n, share in ((100, 0.02), (10, 0.02), (10, 0.04), (10, 0.2))]
    assert scores == sorted(scores)
    assert (scores[1] < scores[2], scores[3]) == (True, sure)
