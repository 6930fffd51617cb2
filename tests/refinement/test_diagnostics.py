"""Warnings where a curve skeleton means little."""

import re
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Judgement, Skeleton
from glsk_o3d.refinement.diagnostics import LOW_CONFIDENCE, LOW_CONFIDENCE_SHARE, diagnose, otherwise


def unit(n, seed=0):
    normals = np.random.default_rng(seed).normal(size=(n, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def sheet(n=400):
    points = np.column_stack([*np.random.default_rng(0).uniform(-1, 1, (2, n)), np.zeros(n)])
    return points, np.tile([0.0, 0, 1], (n, 1)), [[-0.5, 0, 0], [0, 0, 0], [0.5, 0, 0]]


def ball(n=400):
    normals = unit(n)
    return normals, normals, [[-0.3, 0, 0], [0, 0, 0], [0.3, 0, 0]]


def torus(n=1600):
    a, b = np.random.default_rng(1).uniform(0, 2 * np.pi, (2, n))
    out = np.column_stack([np.cos(a), np.sin(a), 0 * a])
    normals = np.cos(b)[:, None] * out + np.sin(b)[:, None] * [0, 0, 1]
    t = np.arange(12) * np.pi / 6
    return out + 0.3 * normals, normals, np.column_stack([np.cos(t), np.sin(t), 0 * t]).tolist()


def tube(n=800):
    a, x = np.random.default_rng(2).uniform([[0], [-1]], [[2 * np.pi], [1]], (2, n))
    normals = np.column_stack([0 * a, np.cos(a), np.sin(a)])
    return 0.1 * normals + x[:, None] * [1, 0, 0], normals, [[0, 0, 0]]


def skeleton_of(*shapes, joined=True):
    """Shapes side by side, each a component: a path over its vertices."""
    vertices, edges, points, normals, vertex = [], [], [], [], []
    for k, (p, n, v) in enumerate(shapes):
        first = len(vertices)
        nearest = np.linalg.norm(p[:, None] - np.array(v)[None], axis=2).argmin(axis=1)
        vertex.append(first + nearest)
        vertices += (np.array(v) + [10 * k, 0, 0]).tolist()
        points.append(p + [10 * k, 0, 0])
        normals.append(n * np.random.default_rng(k).choice([-1, 1], (len(n), 1)))
        edges += [(i, i + 1) for i in range(first, len(vertices) - 1)] if joined else []
    return Skeleton(
        vertices, edges, np.ones(len(vertices)), np.concatenate(vertex), np.concatenate(points), np.concatenate(normals)
    )


@pytest.mark.parametrize(
    ("shapes", "start"),
    [
        ([sheet()], "sheet-like: around 100% of the points"),
        ([ball()], "sphere-like: the normals of parts with 100% of the points"),
        ([torus()], None),
        ([sheet(600), torus(400)], "sheet-like: around 60% of the points"),
        ([sheet(400), torus(600)], None),
        ([ball(600), torus(400)], "sphere-like: the normals of parts with 60% of the points"),
        ([ball(400), torus(600)], None),
        ([ball(200), ball(200)], "sphere-like: the normals of parts with 100% of the points"),
    ],
)
@pytest.mark.parametrize("size", [1e-3, 1, 1e3])
def test_shapes(shapes, start, size):
    skeleton = skeleton_of(*shapes)
    scaled = replace(skeleton, vertices=size * skeleton.vertices, points=size * skeleton.points)
    messages = diagnose(scaled)
    assert len(messages) == (start is not None)
    assert not start or messages[0].startswith(start)


def test_the_cure_for_a_table_is_said():
    (message,) = diagnose(skeleton_of(sheet(600), torus(400)))
    assert "segment_plane or read_cloud(..., where='z > ...')" in message


def test_asks_the_cloud_and_not_the_skeleton():
    """Wherever the vertices are."""
    skeleton = skeleton_of(ball())
    astray = replace(skeleton, vertices=skeleton.vertices + [3, 1, 2])
    assert diagnose(astray)[0].startswith("sphere-like")


def test_no_edges():
    messages = diagnose(skeleton_of(tube(), tube()))
    assert [message.startswith("no edges: every part became one vertex") for message in messages] == [True]
    # one reason is enough
    assert diagnose(skeleton_of(sheet(), joined=False))[0].startswith("sheet-like")


# ---- weakly supported


def unsure(shape, vertices, confidence=0.9 * LOW_CONFIDENCE):
    """A shape, some of whose vertices have little confidence."""
    skeleton = skeleton_of(*shape)
    values = np.ones(len(skeleton.vertices))
    values[vertices] = confidence
    return replace(skeleton, confidence=values)


def weak_place(message):
    """Reach and middle of the region that a message names."""
    reach, place = re.search(r"above all within (\S+) of \((.*?)\)", message).groups()
    return float(reach), [float(c) for c in place.split(",")]


@pytest.mark.parametrize("size", [1e-3, 1, 1e3])
def test_names_the_region_that_is_weakly_supported(size):
    skeleton = unsure([torus(), torus()], [*range(12, 24)])
    scaled = replace(skeleton, vertices=size * skeleton.vertices, points=size * skeleton.points)
    (message,) = diagnose(scaled)
    assert message.startswith("weakly supported: around 50% of the points")
    reach, place = weak_place(message)
    assert reach == pytest.approx(size, rel=1e-2)
    np.testing.assert_allclose(place, [10 * size, 0, 0], atol=1e-2 * size)


def test_the_region_with_most_points_is_named():
    """Of two regions of a torus, the first has more vertices, but few of its points have a say."""
    skeleton = unsure([torus()], [0, 1, 2, 3, 6, 7, 8])
    vertex, normals = skeleton.vertex_of_point, skeleton.normals.copy()
    normals[(vertex < 4) & (np.arange(len(vertex)) % 10 > 0)] = np.nan
    skeleton = replace(skeleton, normals=normals)
    share = np.isin(vertex[skeleton.supporting_points], [0, 1, 2, 3, 6, 7, 8]).mean()
    (message,) = diagnose(skeleton)
    assert message.startswith(f"weakly supported: around {share:.0%} of the points")
    reach, place = weak_place(message)
    region = skeleton.vertices[6:9]
    np.testing.assert_allclose(place, region.mean(axis=0), atol=1e-3)
    assert reach == pytest.approx(np.linalg.norm(region - region.mean(axis=0), axis=1).max(), rel=1e-2)


def test_thresholds_of_support():
    count = np.bincount(skeleton_of(torus()).vertex_of_point, minlength=12)
    share = np.cumsum(count) / count.sum()
    for few in range(1, 13):
        weak = diagnose(unsure([torus()], [*range(few)]))
        assert len(weak) == (share[few - 1] > LOW_CONFIDENCE_SHARE)
    assert diagnose(unsure([torus()], [*range(12)], LOW_CONFIDENCE)) == []
    assert len(diagnose(unsure([torus()], [*range(12)], np.nextafter(LOW_CONFIDENCE, 0)))) == 1


def test_confidence_that_nobody_measured_is_no_reason():
    assert np.isnan(skeleton_of(torus()).confidence).all()
    assert diagnose(skeleton_of(torus())) == []


@pytest.mark.parametrize(("shape", "start"), [(sheet, "sheet-like"), (ball, "sphere-like"), (tube, "no edges")])
def test_other_reasons_say_more(shape, start):
    skeleton = skeleton_of(shape())
    messages = diagnose(replace(skeleton, confidence=np.zeros(len(skeleton.vertices))))
    assert [message.startswith(start) for message in messages] == [True]


def test_points_without_a_say_do_not_count():
    skeleton = skeleton_of(sheet(600), torus(400))
    normals = skeleton.normals.copy()
    normals[:400] = np.nan
    assert diagnose(replace(skeleton, normals=normals)) == []
    assert diagnose(replace(skeleton, normals=np.full_like(normals, np.nan))) == []


@pytest.mark.parametrize("about", ["loop", "air", "gap", "limb"])
@pytest.mark.parametrize("changed", [False, True])
def test_the_option_that_answers_otherwise_is_beyond_the_probability(about, changed):
    for probability in (0.25, 0.414, 0.57, 0.7499):
        option, value = otherwise(Judgement(about, (0.0, 0.0, 0.0), probability, changed)).split("=")
        assert option == {"loop": "Refiner.handle", "gap": "Refiner.bridge"}.get(about, f"Refiner.{about}")
        reached = probability >= float(value)
        assert (reached if about in ("air", "gap") else not reached) != changed
        assert 0.004 < abs(probability - float(value)) < 0.02


def test_names_the_closest_call():
    calls = [
        Judgement("loop", (0.0, 1.0, 2.0), 0.55, changed=False),
        Judgement("air", (3.0, 4.0, 5.0), 0.7, changed=True),
        Judgement("gap", (6.0, 7.0, 8.0), 0.9, changed=True),
        Judgement("limb", (6.0, 7.0, 8.0), 0.5, changed=False),
    ]
    skeleton = skeleton_of(torus())
    judged = replace(skeleton, report=replace(skeleton.report, judgements=tuple(calls)))
    assert diagnose(judged) == [
        "uncertain topology: 2 of 3 questions about loops, air and gaps were close calls, above all whether the loop "
        "at (0, 1, 2) is a handle (probability 0.55): look there; if 'loop kept' is wrong, set Refiner.handle=0.56"
    ]
    clear = replace(skeleton, report=replace(skeleton.report, judgements=tuple(calls[2:])))
    assert diagnose(skeleton) == diagnose(clear) == []
