"""Runaway vertices are brought back to their points."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton
from glsk_o3d.refinement.axis_fit import HALF_TUBE_REACH, pull_back_detached


def cross(at, n=8):
    """One vertex and n points on the unit circle around the origin in the xy plane: their spread is 1."""
    angle = np.arange(n) * 2 * np.pi / n
    points = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return Skeleton([at], [], [1], np.zeros(n, int), points, points)


@pytest.mark.parametrize("away", [0, 0.5 * HALF_TUBE_REACH, HALF_TUBE_REACH * (1 - 1e-9)])
def test_vertices_within_reach_stay_exactly(away):
    raw = cross([0, 0.6 * away, 0.8 * away])
    np.testing.assert_array_equal(pull_back_detached(raw).vertices, raw.vertices)


@pytest.mark.parametrize("size", [1e-6, 1, 1e6])
@pytest.mark.parametrize("away", [HALF_TUBE_REACH * 1.01, 2, 1000])
def test_farther_ones_come_straight_back_to_the_end_of_it(away, size):
    raw = cross(np.array([0.48, 0.6, 0.64]) * away)
    raw = replace(raw, vertices=size * raw.vertices, points=size * raw.points)
    np.testing.assert_allclose(
        pull_back_detached(raw).vertices[0], np.array([0.48, 0.6, 0.64]) * HALF_TUBE_REACH * size, rtol=1e-9
    )


@pytest.mark.parametrize("part", [1.0, 0.8])
def test_the_axis_of_half_a_tube_is_just_within_reach(part):
    angle = (np.arange(1000) + 0.5) / 1000 * np.pi
    points = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    moved = pull_back_detached(Skeleton([[0, 0, 1 - part]], [], [1], np.zeros(1000, int), points, points)).vertices[0]
    np.testing.assert_allclose(moved, [0, 0, 1 - part], atol=1e-6)


def test_a_vertex_of_one_point_is_there():
    np.testing.assert_allclose(pull_back_detached(cross([9, 9, 9], 1)).vertices, [[1, 0, 0]], atol=1e-12)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 8), st.booleans())
def test_by_its_definition(random_skeleton, seed, m, every):
    raw = random_skeleton(seed, m, n=40, every=every)
    normals = raw.normals.copy()
    normals[::7] = np.nan
    raw = replace(raw, vertices=3 * raw.vertices, normals=normals)
    skeleton = pull_back_detached(raw)
    for v, (before, after) in enumerate(zip(raw.vertices, skeleton.vertices, strict=True)):
        own = raw.points[[p for p in raw.supporting_points if raw.vertex_of_point[p] == v]]
        if len(own) == 0:
            np.testing.assert_array_equal(after, before)
            continue
        mean = own.mean(axis=0)
        reach = HALF_TUBE_REACH * np.sqrt(((own - mean) ** 2).sum(axis=1).mean())
        away = np.linalg.norm(before - mean)
        np.testing.assert_allclose(after, mean + (before - mean) * min(1, reach / max(away, 1e-300)), atol=1e-12)
    np.testing.assert_allclose(pull_back_detached(skeleton).vertices, skeleton.vertices, atol=1e-12)  # once is enough
    for name in ("edges", "radii", "vertex_of_point", "points", "normals"):
        np.testing.assert_array_equal(getattr(skeleton, name), getattr(raw, name))


def test_goes_with_the_cloud(random_skeleton, placed):
    raw = random_skeleton(5)
    moved, turn = placed(raw, shift=1e4)
    np.testing.assert_allclose(
        pull_back_detached(moved).vertices - 1e4, pull_back_detached(raw).vertices @ turn, atol=1e-9
    )


def test_points_in_one_place_hold_their_vertex_there():
    raw = cross([0.1, 0.2, 0.3])
    skeleton = pull_back_detached(replace(raw, points=np.ones((8, 3))))
    np.testing.assert_allclose(skeleton.vertices, [[1, 1, 1]], atol=1e-15)
    on_them = pull_back_detached(replace(raw, points=np.ones((8, 3)), vertices=[[1, 1, 1]]))
    np.testing.assert_array_equal(on_them.vertices, [[1, 1, 1]])


def test_a_vertex_at_the_mean_stays_however_far_its_points_are():
    points = np.array([[1e3, 0, 0], [-1e3, 0, 0]])  # the reach is more than any number times as far as the mean
    raw = Skeleton([[0, 0, 0]], [], [1], [0, 0], points, points / 1e3)
    np.testing.assert_array_equal(pull_back_detached(raw).vertices, raw.vertices)
