"""Inscriber: rings -> rings around places on the medial axis."""

from itertools import product

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples

CONTRACTED = glsk.Inscriber() | glsk.Contractor(reducer=glsk.LPRReducer(least=8192)) | glsk.Connector()
OPEN = pipelines.rings() | CONTRACTED | glsk.Refiner() | glsk.Tracer()


def plate(hole, high, holes=3, n=4096, seed=0):
    """A plate with square holes in a row, `hole` wide, and bars one wide around them, turned at random."""
    rng = np.random.default_rng(seed)
    length, width = holes * hole + holes + 1, hole + 2
    starts = 1 + (hole + 1) * np.arange(holes)
    walls = [(0, 0, length, width), *((start, 1, start + hole, 1 + hole) for start in starts)]
    sides = np.array([((a, b), (c, b)) for a, b, c, d in walls] + [((a, d), (c, d)) for a, b, c, d in walls])
    more = [((a, b), (a, d)) for a, b, c, d in walls] + [((c, b), (c, d)) for a, b, c, d in walls]
    sides = np.concatenate([sides, more]).astype(float)
    lengths = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)
    wall, face = lengths.sum() * high, 2 * (length * width - holes * hole**2)
    on_wall = rng.random(2 * n) < wall / (wall + face)
    side = rng.choice(len(sides), 2 * n, p=lengths / lengths.sum())
    on_walls = sides[side, 0] + rng.random((2 * n, 1)) * (sides[side, 1] - sides[side, 0])
    x = np.where(on_wall[:, None], on_walls, rng.random((2 * n, 2)) * [length, width])
    z = np.where(on_wall, rng.random(2 * n), rng.integers(0, 2, 2 * n)) * high
    in_hole = ((x[:, :1] > starts) & (x[:, :1] < starts + hole)).any(axis=1) & (np.abs(x[:, 1] - width / 2) < hole / 2)
    points = np.column_stack([x, z])[on_wall | ~in_hole][:n]
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0]


def counts(skeleton):
    return skeleton.n_components, skeleton.n_loops


@pytest.mark.slow
def test_narrow_holes_of_a_plate_stay_open():
    """Those half as wide as the bars, which the contraction shuts."""
    opened, shut = [], []
    for hole, holes, seed in product((0.5, 0.7, 0.9), (1, 2, 3), (0, 1)):
        cloud = plate(hole, 1.0, holes, seed=seed)
        opened.append(counts(OPEN(cloud)) == (1, holes))
        shut.append(counts(glsk.skeletonize(cloud)) == (1, holes))
    assert sum(opened) >= 17
    assert sum(opened) > sum(shut) + 3


@pytest.mark.parametrize("name", ["torus", "y_junction", "sauropod"])
def test_tubes_keep_their_topology_and_length(name):
    cloud = getattr(samples, name)(2500).points
    plain, opened = glsk.skeletonize(cloud), OPEN(cloud)
    assert counts(opened) == counts(plain)
    assert len(opened.leaves) == len(plain.leaves)
    assert abs(opened.length / plain.length - 1) < 0.03


def test_between_two_faces_points_go_to_the_middle():
    state = (glsk.Sampler(sample=4000) | glsk.RingBuilder())(o3d.geometry.TriangleMesh.create_box(1, 1, 0.1))
    moved = glsk.Inscriber()(state)
    inner = (np.abs(state.contracted[:, :2] - 0.5) < 0.4).all(axis=1)
    assert np.quantile(np.abs(moved.contracted[inner, 2] - 0.05), 0.95) < 0.01
    np.testing.assert_array_equal(moved.cloud, state.cloud)
    half = glsk.Inscriber(share=0.5)(state)
    np.testing.assert_allclose(half.positions, (state.positions + moved.positions) / 2)
    np.testing.assert_array_equal(glsk.Inscriber(share=0)(state).positions, state.positions)


@pytest.mark.parametrize("size", [1e-60, 1.0, 1e60])
def test_inscribed_places_turn_and_scale_with_the_cloud(size):
    points, rng = samples.y_junction(1500).points, np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    one, other = ((pipelines.rings() | glsk.Inscriber())(cloud) for cloud in (points, size * points @ turn))
    rows = [state.contracted[state.survivor_of_point] for state in (one, other)]
    np.testing.assert_allclose(rows[1] / size, rows[0] @ turn, atol=1e-6)
