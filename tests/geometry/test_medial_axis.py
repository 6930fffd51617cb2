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
    curve, half_widths = medial_curve(axis, burnt, points)
    assert loops(curve) == 1
    assert np.median(half_widths[np.unique(core)]) == pytest.approx(TUBE, rel=0.3)


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


@pytest.mark.parametrize(("wave", "left"), [(0.25, 1 / 17), (0.5, 1 / 2), (1.0, 16 / 17)])
@pytest.mark.parametrize("closed", [False, True])
def test_short_waves_of_a_curve_are_smoothed(wave, left, closed):
    """Steps of different lengths, and of no length; a ring, or a line whose ends and other waves stay."""
    rng = np.random.default_rng(0)
    u = np.sort(rng.uniform(size=800))
    u[400] = u[401]
    height = 0.02 * np.sin(2 * np.pi * u * 8 / wave)
    along = [np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)] if closed else [2 * np.pi * u, 0 * u]
    edges = np.column_stack([np.arange(799), np.arange(1, 800)])
    edges = np.concatenate([edges, [[799, 0]]]) if closed else edges
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    smooth = without_waves(np.column_stack([*along, height]) @ turn, edges, np.full(800, np.pi / 8)) @ turn.T
    np.testing.assert_allclose(smooth[:, :2], np.column_stack(along), atol=0.02)
    inner = slice(100, 700)
    assert (smooth[inner, 2] @ height[inner]) / (height[inner] @ height[inner]) == pytest.approx(left, abs=0.06)
