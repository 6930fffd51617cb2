"""What is refused, each by a shape on either side of the border; and the paths and grids that tell it."""

import numpy as np
import pytest
from glsk_bench.shapes.axis import Axis, joined
from glsk_bench.shapes.curves import polygon
from glsk_bench.shapes.fairness import chains, fault, shortest_loop, topology


def line(start, end, radius=0.1):
    axis = Axis()
    axis.path(np.array([start, end], float), radius)
    return axis


def ring(radius, thick=0.1):
    axis = Axis()
    axis.ring(polygon(40, radius=radius), thick)
    return axis


def fork(length):
    """A bar with a stub in its middle."""
    axis = Axis()
    middle = axis.path(np.array([[-1, 0, 0], [0, 0, 0], [1, 0, 0.0]]), 0.2)[1]
    axis.path(np.array([[0, 0, 0], [0, 0, length]]), 0.1, start=middle)
    return axis


def keyhole(neck, bend_radius=0.15):
    """A wide bend whose two ends come near each other and part again."""
    half = np.arcsin(neck / bend_radius / 2)
    angle = np.linspace(half - np.pi / 2, 1.5 * np.pi - half, 40)
    bend = bend_radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    axis = Axis()
    axis.path(np.vstack([[0.7, -0.5, 0], bend, [-0.7, -0.5, 0]]), 0.1)
    return axis


def verdict(axis, spacing=0.01):
    return fault(axis.nodes, axis.edges, axis.radii, spacing)


@pytest.mark.parametrize(
    ("word", "bad", "good"),
    [
        ("gap", joined([line([0, 0, 0], [1, 0, 0]), line([0, 0, 0.249], [1, 0, 0.249])]),
         joined([line([0, 0, 0], [1, 0, 0]), line([0, 0, 0.251], [1, 0, 0.251])])),
        ("gap", joined([line([0, 0, 0], [1, 0, 0]), line([0, 0, 0.349], [1, 0, 0.349], 0.2)]),
         joined([line([0, 0, 0], [1, 0, 0]), line([0, 0, 0.351], [1, 0, 0.351], 0.2)])),
        ("gap", keyhole(0.2, 0.19), keyhole(0.25, 0.19)),  # it is not round the bend that its ends are joined nearby
        ("opening", ring(0.19), ring(0.22)),
        ("stub", fork(0.255), fork(0.259)),
        ("holes", keyhole(0.2), keyhole(0.25)),
    ],
)  # fmt: skip
def test_what_is_refused_and_what_just_is_not(word, bad, good):
    assert verdict(bad) == word
    assert verdict(good) is None


def test_what_is_thin_or_near_for_the_points_or_too_long_to_look_at():
    tube, two = line([0, 0, 0], [1, 0, 0]), joined([line([0, 0, 0], [1, 0, 0]), line([0, 0, 0.27], [1, 0, 0.27])])
    assert (verdict(tube, 0.083), verdict(tube, 0.084)) == (None, "thin")
    assert (verdict(two, 0.069), verdict(two, 0.071)) == (None, "gap")
    assert verdict(line([0, 0, 0], [160, 0, 0])) == "large"


# ---------------------------------------------------------------------------------------------------------------- grids


def ball(n=4000, radius=1.0):
    points = np.random.default_rng(0).normal(size=(n, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("centres", "radius", "found"),
    [
        ([[0, 0, 0]], 0.1, (1, 0, 0)),
        ([[0, 0, 0], [0.15, 0, 0]], 0.1, (1, 0, 0)),
        ([[0, 0, 0], [0.25, 0, 0]], 0.1, (2, 0, 0)),
        (polygon(40, radius=0.3), 0.1, (1, 1, 0)),
        (np.vstack([polygon(40, radius=0.3), polygon(40, radius=0.3) + [1, 0, 0]]), 0.1, (2, 2, 0)),
        (ball(2000, 0.4), 0.1, (1, 0, 1)),
    ],
)
def test_topology_of_balls(centres, radius, found):
    centres = np.asarray(centres, float) + 0.01234
    assert topology(centres, np.full(len(centres), radius)) == found


# ---------------------------------------------------------------------------------------------------------------- paths


def test_the_shortest_loop_through_a_chain():
    edges = np.array([[0, 1], [1, 2], [2, 3], [0, 3], [0, 4], [4, 3], [3, 5]])
    lengths = np.array([1, 1, 1, 1.5, 1, 1, 1.0])
    through = {chain[1]: shortest_loop(6, edges, lengths, chain) for chain in chains(6, edges)}
    assert through == {1: [1, 2, 3, 0], 3: [3, 4, 0], 4: [4, 3, 0], 5: []}
    assert shortest_loop(3, np.array([[0, 1], [1, 2], [2, 0]]), np.ones(3), [0, 1, 2, 0]) == [0, 1, 2]
