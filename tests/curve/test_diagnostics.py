"""Warnings where a curve skeleton means little."""

import re
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Decision, Report, Skeleton, samples, skeletonize


def sheet(n):
    points = np.column_stack([*np.random.default_rng(0).uniform(-1, 1, (2, n)), np.zeros(n)])
    return points, np.tile([0.0, 0, 1], (n, 1)), [[-0.5, 0, 0], [0, 0, 0], [0.5, 0, 0]]


def ball(n):
    normals = np.random.default_rng(0).normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, normals, [[-0.3, 0, 0], [0, 0, 0], [0.3, 0, 0]]


def torus(n):
    a, b = np.random.default_rng(1).uniform(0, 2 * np.pi, (2, n))
    out = np.column_stack([np.cos(a), np.sin(a), 0 * a])
    normals = np.cos(b)[:, None] * out + np.sin(b)[:, None] * [0, 0, 1]
    t = np.arange(12) * np.pi / 6
    return out + 0.3 * normals, normals, np.column_stack([np.cos(t), np.sin(t), 0 * t])


def unsure(n):
    """A torus whose normals point anywhere across its axis."""
    points, _, vertices = torus(n)
    out = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    angle = np.random.default_rng(2).uniform(0, 2 * np.pi, (n, 1))
    return points, np.cos(angle) * out + np.sin(angle) * [0, 0, 1], vertices


def skeleton_of(*shapes, size=1.0, joined=True, report=None):
    """Shapes side by side, each a component: a path over its vertices."""
    vertices, edges, points, normals, owner = [], [], [], [], []
    for k, (p, n, v) in enumerate(shapes):
        first, shift = len(vertices), [10 * k, 0, 0]
        owner.append(first + np.linalg.norm(p[:, None] - np.array(v)[None], axis=2).argmin(axis=1))
        vertices += (np.array(v) + shift).tolist()
        points.append(p + shift)
        normals.append(n * np.random.default_rng(k).choice([-1, 1], (len(n), 1)))
        edges += [(i, i + 1) for i in range(first, len(vertices) - 1)] if joined else []
    cloud = np.concatenate(owner), size * np.concatenate(points), np.concatenate(normals)
    return Skeleton(size * np.array(vertices), edges, np.ones(len(vertices)), *cloud, report or Report())


@pytest.mark.parametrize(
    ("shapes", "start"),
    [
        ([sheet(400)], "sheet-like: around 100% of the points"),
        ([ball(400)], "sphere-like: the normals of parts with 100% of the points"),
        ([torus(1600)], None),
        ([sheet(600), torus(400)], "sheet-like: around 60% of the points"),
        ([sheet(400), torus(600)], "weakly supported: around 40% of the points"),
        ([ball(600), torus(400)], "sphere-like: the normals of parts with 60% of the points"),
        ([ball(400), torus(600)], None),
        ([unsure(600), torus(400)], "weakly supported: around 60% of the points"),
        ([torus(900), unsure(100)], None),
    ],
)
@pytest.mark.parametrize("size", [1e-3, 1, 1e3])
def test_sheets_balls_and_weak_support_are_warned_of(refine, shapes, start, size):
    messages = refine(skeleton_of(*shapes, size=size)).report.warnings
    assert len(messages) == (start is not None)
    assert not start or messages[0].startswith(start)


def test_a_warning_names_the_region_that_is_weakly_supported(refine):
    (message,) = refine(skeleton_of(torus(400), unsure(600), size=1000)).report.warnings
    reach, place = re.search(r"above all within (\S+) of \((.*?)\)", message).groups()
    assert float(reach) == pytest.approx(1000, rel=0.1)
    np.testing.assert_allclose([float(c) for c in place.split(",")], [10_000, 0, 0], atol=100)


CALLS = (
    Decision("loop", (0.0, 1.0, 2.0), 0.55, changed=False),
    Decision("air", (3.0, 4.0, 5.0), 0.7, changed=True),
    Decision("gap", (6.0, 7.0, 8.0), 0.9, changed=True),
    Decision("limb", (6.0, 7.0, 8.0), 0.5, changed=False),
)


def test_a_warning_names_the_closest_call(refine):
    judged, clear = (skeleton_of(torus(1600), report=Report(decisions=calls)) for calls in (CALLS, CALLS[2:]))
    assert refine(clear).report.warnings == ()
    (message,) = refine(judged).report.warnings
    for words in ("2 of 3", "(0, 1, 2)", "0.55", "Refiner.handle=0.56"):
        assert words in message


def test_a_tree_of_what_has_loops_is_doubted(refine):
    """Not if the loop was kept, the graph has one, it was a close call, which has a warning, or there are many ends."""
    path = skeleton_of(torus(1600))
    ring, star = (replace(path, edges=edges) for edges in ([*path.edges, [0, 11]], [[0, i] for i in range(1, 12)]))
    cases = [(path, 0.95, True, True), (path, 0.95, False, False), (ring, 0.95, True, False), (path, 0.7, True, False)]
    cases += [(star, 1.0, True, False), (path, 0.05, True, False)]
    for skeleton, probability, closed, doubted in cases:
        call = replace(CALLS[0], probability=probability, changed=closed)
        reasons = refine(skeleton.with_report(Report(decisions=(call,)))).reasons
        assert ("opened loops" in {reason.code for reason in reasons}) == doubted


@pytest.mark.filterwarnings("ignore:opened loops")
def test_loops_that_a_root_opens_are_doubted():
    grown = skeletonize(samples.torus(1500).points, root="x")
    assert (grown.n_loops, [reason.code for reason in grown.reasons]) == (0, ["opened loops"])


@pytest.mark.parametrize(
    ("about", "option", "cut_above"), [("loop", "handle", False), ("air", "air", True), ("gap", "bridge", True)]
)
@pytest.mark.parametrize("changed", [False, True])
def test_the_option_that_answers_otherwise_is_beyond_the_probability(refine, about, option, cut_above, changed):
    for probability in (0.25, 0.414, 0.57, 0.7499):
        call = replace(CALLS[0], about=about, probability=probability, changed=changed)
        (message,) = refine(skeleton_of(torus(800), report=Report(decisions=(call,)))).report.warnings
        value = float(re.search(rf"set Refiner\.{option}=(.*)$", message)[1])
        assert (probability >= value) == (cut_above != changed)
        assert 0.004 < abs(probability - value) < 0.02
