"""Inside or outside: orientation, areas and winding numbers, on closed forms."""

import igl
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from glsk_o3d.geometry.neighbourhoods import nearest_neighbours
from glsk_o3d.geometry.winding import orient_from_axis, point_areas, winding_number

X = np.eye(3)[0]


def ball(n, radius=1.0, seed=0):
    """Points of a sphere, and their normals."""
    points = np.random.default_rng(seed).normal(size=(n, 3))
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    return radius * normals, normals


def open_tube(n, half=False, seed=0):
    """An open tube of radius .1 and length 1, or its upper half: points and normals."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, np.pi if half else 2 * np.pi, n)
    normals = np.stack([np.zeros(n), np.cos(angle), np.sin(angle)], axis=1)
    return 0.1 * normals + rng.uniform(-0.5, 0.5, (n, 1)) * X, normals


def areas_of(points):
    return point_areas(points, nearest_neighbours(points, min(16, len(points)))[1])


def field(points, normals, queries):
    return winding_number(points, normals, areas_of(points), np.atleast_2d(queries))


# --------------------------------------------------------------------------------------------------------------- field


def test_the_winding_number_of_a_ball_is_1_inside_0_outside_and_half_on_it():
    points, normals = ball(4000)
    assert areas_of(points).sum() == pytest.approx(4 * np.pi, rel=0.04)
    actual = field(points, normals, np.outer([0, 0.5, 0.9, 1.1, 1.5, 4], X))
    np.testing.assert_allclose(actual, [1, 1, 1, 0, 0, 0], atol=0.04)
    on_it = field(points, normals, ball(500, seed=1)[0])
    assert on_it.mean() == pytest.approx(0.5, abs=0.05)
    assert on_it.std() < 0.1  # a dipole that is not averaged would spike


@pytest.mark.parametrize("half", [False, True])
def test_the_winding_number_of_a_tube_and_half_of_one_is_its_solid_angle(half):
    actual = field(*open_tube(4000, half), np.outer([0, 0.25, 2], X))
    # what an open tube hides of the sphere of directions
    ends = [-0.5, 0.5] - np.array([[0], [0.25], [2]])
    exact = np.diff(ends / np.hypot(ends, 0.1), axis=1)[:, 0] / 2
    np.testing.assert_allclose(actual, exact / (2 if half else 1), atol=0.04)


def test_the_winding_number_of_a_mesh_is_that_of_libigl():
    points = ball(1500)[0] * [1, 0.6, 0.3]
    faces = ConvexHull(points).simplices
    a, b, c = points[faces].transpose(1, 0, 2)
    cross = np.cross(b - a, c - a)
    faces[np.einsum("ij,ij->i", cross, a) < 0] = faces[np.einsum("ij,ij->i", cross, a) < 0][:, ::-1]
    faces = faces[a[:, 2] < 0.1]  # not closed: between 0 and 1
    a, b, c = points[faces].transpose(1, 0, 2)
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    queries = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 3)) * [1, 0.6, 0.3]
    exact = igl.winding_number(points, faces.astype(np.int64), queries)
    actual = winding_number((a + b + c) / 3, cross / double[:, None], double / 2, queries)
    assert np.ptp(exact) > 0.2
    np.testing.assert_allclose(actual, exact, atol=0.02)


def test_the_winding_number_near_a_point_is_the_mean_over_a_ball():
    point, area = np.zeros((1, 3)), np.array([0.04])
    # seen from the dipole the mean is one over directions: what it sends out along each is constant, times the chord
    z = np.linspace(-1, 1, 200001)[1::2]
    turn = np.arange(len(z)) * np.pi * (3 - np.sqrt(5))  # directions on a spiral
    rays = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    for place in np.array([[0.05, 0, 0], [-0.12, 0.1, 0], [-0.1, 0.17, 0.2]]):
        middle = rays @ place
        half = np.sqrt(np.maximum(middle**2 - place @ place + 0.2**2, 0))  # of the chord of the ball of radius .2
        chord = np.maximum(middle + half, 0) - np.maximum(middle - half, 0)
        mean = -0.04 * (rays[:, 0] * chord).mean() / (4 / 3 * np.pi * 0.2**3)
        assert winding_number(point, X[None], area, place[None])[0] == pytest.approx(mean, rel=1e-4)


def test_the_winding_number_does_not_depend_on_pose_units_or_order():
    points, normals = open_tube(1500)
    rng = np.random.default_rng(0)
    queries = rng.uniform(-0.5, 0.5, (100, 3))
    before = field(points, normals, queries)
    turn = Rotation.random(random_state=0)
    np.testing.assert_allclose(field(turn.apply(points), turn.apply(normals), turn.apply(queries)), before, atol=1e-4)
    np.testing.assert_allclose(field(points + 1e5, normals, queries + 1e5), before, atol=1e-4)
    for unit in (1e-30, 1e30):
        np.testing.assert_allclose(field(points * unit, normals, queries * unit), before, atol=1e-4)
    order = rng.permutation(len(points))
    np.testing.assert_allclose(field(points[order], normals[order], queries), before, atol=1e-4)


@pytest.mark.parametrize("n", [1, 2, 8])
def test_the_winding_number_of_few_or_coincident_points_is_finite(n):
    coincident = np.ones((n, 3))
    areas = areas_of(coincident)
    assert (areas == 0).all()
    assert np.isfinite(winding_number(coincident, coincident, areas, np.array([[1, 1, 1], [0, 0, 0.0]]))).all()
    points, normals = ball(n)
    assert np.isfinite(field(points, normals, points)).all()


# ------------------------------------------------------------------------------------------------------ areas and signs


def test_points_that_belong_to_no_axis_follow_their_neighbours():
    """A tenth of a ball's points have an axis along the surface, or a little outside."""
    (points, normals), rng = ball(500), np.random.default_rng(0)
    axis = np.zeros((500, 3))
    axis[:50] = points[:50] + 0.3 * np.cross(normals[:50], rng.normal(size=(50, 3))) + 0.1 * normals[:50]
    signs = rng.choice([-1.0, 1.0], (500, 1))
    actual = orient_from_axis(points, normals * signs, axis, nearest_neighbours(points, 9)[1])
    np.testing.assert_array_equal(actual, normals)
