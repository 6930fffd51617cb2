"""The medial axis of solids whose loops and limbs are known, and what fire leaves of it."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.geometry.groups import component_labels
from glsk_o3d.geometry.medial_axis import Burnt, MedialAxis, medial_curve, without_waves
from glsk_o3d.interop.poisson import inside_of

RADIUS, TUBE = 0.4, 0.1


def even_torus(n=40, m=14, seed=0):
    """Points on a torus, nearly even, and whether places are inside of it."""
    rng = np.random.default_rng(seed)
    u, v = (2 * np.pi * np.arange(k) / k for k in (n, m))
    u, v = (angle.ravel() + 0.05 * rng.standard_normal(n * m) for angle in np.meshgrid(u, v))
    points = np.column_stack([*((RADIUS + TUBE * np.cos(v)) * np.array([np.cos(u), np.sin(u)])), TUBE * np.sin(v)])
    return points, lambda q: np.hypot(np.linalg.norm(q[:, :2], axis=1) - RADIUS, q[:, 2]) < TUBE


def cubes(filled, seed=0):
    """Points and inside of the solid of filled unit cubes, (x, y, z) bool array: corners jittered, turned at random."""
    rng, filled = np.random.default_rng(seed), np.pad(filled, 1)
    squares = []
    for axis in range(3):
        u, v = np.roll(np.eye(3, dtype=int), -axis, axis=0)[1:]
        for side, other in ((1, 0), (-1, 1)):
            at = np.argwhere(filled & ~np.roll(filled, -side, axis)) + (side > 0) * np.eye(3, dtype=int)[axis]
            square = np.stack([at, at + u, at + u + v, at + v], axis=1)
            squares.append(square[:, ::-1] if other else square)
    corners, index = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    points = (corners + 0.15 * rng.uniform(-1, 1, corners.shape)) @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(points), o3d.utility.Vector3iVector(triangles))
    return points, inside_of(mesh)


def plate(holes, seed=0):
    """A plate of bars six cubes wide and high around holes in a row that are half as wide."""
    filled = np.ones((9 * holes + 6, 15, 6), bool)
    for hole in range(holes):
        filled[9 * hole + 6 : 9 * hole + 9, 6:9] = False
    return cubes(filled, seed)


def loops(edges):
    used, index = np.unique(edges, return_inverse=True)
    return len(edges) - len(used) + len(np.unique(component_labels(len(used), index.reshape(-1, 2))))


def test_a_torus_has_the_cells_of_a_loop_and_burns_down_to_its_axis():
    points, is_inside = even_torus()
    axis = MedialAxis.of(points, is_inside)
    n_faces = len(np.unique(axis.face_edges[:, 0]))
    assert len(axis.places) - len(axis.edges) + n_faces == 0  # Euler's number of a loop
    burnt = Burnt.of(axis)
    core = axis.edges[burnt.core]
    assert loops(core) == 1
    assert (np.bincount(core.ravel(), minlength=len(axis.places))[np.unique(core)] == 2).all()
    at = axis.places[np.unique(core)]
    off = np.hypot(np.linalg.norm(at[:, :2], axis=1) - RADIUS, at[:, 2])
    assert off.max() < TUBE
    assert np.median(off) < 0.1 * TUBE
    assert np.median(axis.radii[np.unique(core)]) == pytest.approx(TUBE, rel=0.1)
    assert np.median(burnt.times[burnt.core]) == pytest.approx(TUBE, rel=0.5)
    assert (burnt.onward[np.unique(core)] == -1).all()
    assert loops(medial_curve(axis, burnt, points)[0]) == 1


def test_balls_are_empty_and_poles_touch():
    points, is_inside = even_torus(seed=1)
    axis = MedialAxis.of(points, is_inside)
    nearest = np.min([np.linalg.norm(axis.places - point, axis=1) for point in points], axis=0)
    assert (np.abs(nearest - axis.radii) < 1e-9).mean() > 0.8  # the others are flat, and their centre was outside
    assert is_inside(axis.places).all()
    has = axis.pole_of_point >= 0
    poles = axis.pole_of_point[has]
    assert (np.linalg.norm(axis.places[poles] - points[has], axis=1) - axis.radii[poles]).max() < TUBE
    assert has.mean() > 0.99


@pytest.mark.parametrize("holes", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_hole_of_a_plate_is_a_loop(holes, seed):
    points, is_inside = plate(holes, seed=seed)
    axis = MedialAxis.of(points, is_inside)
    burnt = Burnt.of(axis)
    assert len(axis.places) - len(axis.edges) + len(np.unique(axis.face_edges[:, 0])) == 1 - holes
    assert loops(axis.edges[burnt.core]) == holes
    curve, _ = medial_curve(axis, burnt, points)
    assert loops(curve) == holes
    if holes:
        assert is_inside(axis.places[np.unique(curve)]).all()


def test_the_half_width_of_a_flat_frame_is_that_of_its_bars():
    """Bars six cubes wide and two high; fire goes from cell to cell, which is no straight way."""
    filled = np.ones((15, 15, 2), bool)
    filled[6:9, 6:9] = False
    points, is_inside = cubes(filled)
    axis = MedialAxis.of(points, is_inside)
    curve, half_widths = medial_curve(axis, Burnt.of(axis), points)
    on = np.unique(curve)
    assert np.median(axis.radii[on]) < 1.5
    assert 2.5 < np.median(half_widths[on]) < 5


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_way_leads_from_the_tip_of_each_arm(seed):
    """Six arms, four wide and twice as long as wide."""
    filled, middle = np.zeros((20, 20, 20), bool), slice(8, 12)
    for axis in range(3):
        arm = [middle] * 3
        arm[axis] = slice(None)
        filled[tuple(arm)] = True
    points, is_inside = cubes(filled, seed)
    axis = MedialAxis.of(points, is_inside)
    curve, _ = medial_curve(axis, Burnt.of(axis), points)
    tips = axis.places[np.flatnonzero(np.bincount(curve.ravel()) == 1)] - points.mean(axis=0)
    assert loops(curve) == 0
    assert len(tips) == 6
    assert (np.linalg.norm(tips, axis=1) > 7).all()
    cosines = tips @ tips.T / np.linalg.norm(tips, axis=1)[:, None] / np.linalg.norm(tips, axis=1)
    assert (cosines.min(axis=1) < -0.85).all()  # another one is opposite, each anywhere across its arm


def test_sheets_around_a_cavity_are_left():
    filled = np.ones((9, 9, 9), bool)
    points, is_inside = cubes(filled)
    axis = MedialAxis.of(points, is_inside)
    assert not Burnt.of(axis).has_sheets
    filled[3:6, 3:6, 3:6] = False
    points, is_inside = cubes(filled)
    axis = MedialAxis.of(points, is_inside)
    assert len(axis.places) - len(axis.edges) + len(np.unique(axis.face_edges[:, 0])) == 2  # Euler's number of a shell
    assert Burnt.of(axis).has_sheets


def path(n, closed=False):
    """The edges of a path of n places, or a ring."""
    edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    return np.concatenate([edges, [[n - 1, 0]]]) if closed else edges


@pytest.mark.parametrize(("wave", "left"), [(0.25, 1 / 17), (0.5, 1 / 2), (1.0, 16 / 17)])
@pytest.mark.parametrize("closed", [False, True])
def test_short_waves_of_a_curve_are_smoothed(wave, left, closed):
    """Steps of different lengths, and of no length; a ring, or a line whose ends and other waves stay."""
    rng = np.random.default_rng(0)
    u = np.sort(rng.uniform(size=800))
    u[400] = u[401]
    height = 0.02 * np.sin(2 * np.pi * u * 8 / wave)
    along = [np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)] if closed else [2 * np.pi * u, 0 * u]
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    places = np.column_stack([*along, height]) @ turn
    smooth = without_waves(places, path(800, closed), np.full(800, np.pi / 8)) @ turn.T
    np.testing.assert_allclose(smooth[:, :2], np.column_stack(along), atol=0.02)
    inner = slice(100, 700)
    assert (smooth[inner, 2] @ height[inner]) / (height[inner] @ height[inner]) == pytest.approx(left, abs=0.06)


def test_a_steep_zigzag_is_as_short_as_the_curve_in_its_middle():
    x = np.linspace(0, 4, 201)
    zigzag = np.column_stack([x, np.where(np.arange(201) % 2, 0.05, -0.05), 0 * x])
    smooth = without_waves(zigzag, path(201), np.full(201, 0.4))
    assert np.abs(smooth[20:-20, 1]).max() < 0.005


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_what_is_straight_stays_wherever_it_gets_thinner(size):
    """A line, and three arms of different thickness that meet evenly; beside a line a thousand times as large."""
    x = np.linspace(0, 4, 101)
    line = np.column_stack([x, 0 * x, 0 * x])
    arms = [np.outer(x, [np.cos(turn), np.sin(turn), 0]) for turn in 2 * np.pi / 3 * np.arange(3)]
    star = np.concatenate([arms[0], *(arm[1:] for arm in arms[1:])])
    at_middle = np.concatenate([path(101), [[0, 101], [0, 201]], path(100) + 101, path(100) + 201])
    places = np.concatenate([line, [[9.0, 9, 9]] + star, [[0, 99.0, 0]] + 1000 * line])
    edges = np.concatenate([path(101), at_middle + 101, path(101) + 402])
    length = np.concatenate([np.where(x < 2, 1, 0.1), np.repeat([1, 0.3, 0.1], [101, 100, 100]), np.full(101, 1000)])
    np.testing.assert_allclose(without_waves(size * places, edges, size * length) / size, places, atol=1e-3)


def test_one_edge_stays():
    places = np.array([[0.0, 0, 0], [1, 2, 3]])
    np.testing.assert_allclose(without_waves(places, path(2), np.ones(2)), places)
