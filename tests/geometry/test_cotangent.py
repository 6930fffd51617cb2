"""The cotangent Laplacian: closed forms, linear precision, and libigl's."""

import igl
import numpy as np
import pytest

from glsk_o3d.geometry.cotangent import WEIGHT_CAP, cotangent_laplacian
from glsk_o3d.geometry.rings import Rings


def rings_of(lists, closed):
    indptr = np.concatenate([[0], np.cumsum([len(row) for row in lists])]).astype(int)
    return Rings(indptr, np.array([j for row in lists for j in row], int), np.array(closed, bool))


def mesh_rings(n, faces):
    """One-rings of an oriented manifold mesh."""
    following = [{} for _ in range(n)]
    for triangle in faces.tolist():
        for at in range(3):
            i, j, k = triangle[at:] + triangle[:at]
            following[i][j] = k
    lists, closed = [], []
    for after in following:
        starts = set(after) - set(after.values())
        row = [min(starts or after)]
        while row[-1] in after and after[row[-1]] != row[0]:
            row.append(after[row[-1]])
        lists.append(row)
        closed.append(not starts)
    return rings_of(lists, closed)


def sheet_mesh(side=20):
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    flat = (grid + np.random.default_rng(2).uniform(-0.2, 0.2, grid.shape)) / side
    p = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([np.stack([p, p + 1, p + side + 1], 1), np.stack([p, p + side + 1, p + side], 1)])
    return np.column_stack([flat, 0.1 * np.sin(7 * flat[:, 0])]), faces


def relative(difference, reference):
    return abs(difference).max() / abs(reference).max()


def test_the_laplacian_is_twice_the_matrix_of_libigl():
    """Wherever, how large and however turned the mesh is."""
    points, faces = sheet_mesh()
    rings = mesh_rings(len(points), faces)
    ours = cotangent_laplacian(points, rings)
    assert abs(ours.diagonal()).max() < WEIGHT_CAP
    assert relative(ours - 2 * igl.cotmatrix(points, faces), ours) < 1e-12
    assert np.abs(ours @ np.ones(len(points))).max() < 1e-12 * abs(ours).max()
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    for moved, tolerance in ((points @ turn.T, 1e-12), (points * 1e-3, 1e-12), (points + 100, 1e-9)):
        assert relative(cotangent_laplacian(moved, rings) - ours, ours) < tolerance


def test_the_laplacian_of_one_triangle_is_known():
    # angles: 90 degrees at 0, 60 at 1, 30 at 2
    points = np.array([[0, 0, 0], [1, 0, 0], [0, np.sqrt(3), 0]])
    rings = rings_of([[1, 2], [2, 0], []], [False] * 3)
    root = np.sqrt(3)
    expected = [[-root - 1 / root, root, 1 / root], [root, -root, 0], [0, 0, 0]]
    np.testing.assert_allclose(cotangent_laplacian(points, rings).toarray(), expected, atol=1e-14)


def test_the_laplacian_of_plane_umbrellas_has_linear_precision():
    rng = np.random.default_rng(0)
    flat, faces = sheet_mesh()
    points = flat * [1, 1, 0] @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    rings = mesh_rings(len(points), faces)
    laplacian = cotangent_laplacian(points, rings)
    assert rings.closed.sum() > 250
    coordinates = np.abs(laplacian @ points)
    scale = abs(laplacian).max()
    assert coordinates[rings.closed].max() < 1e-12 * scale
    assert coordinates[~rings.closed].max() > 1e-3 * scale  # not so at the border


def test_rows_are_capped_by_scaling():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1e-7, 0], [0, 1, 0]])
    rings = rings_of([[], [2, 0], [], [0, 1]], [False] * 4)
    free, capped = (cotangent_laplacian(points, rings, cap=cap).toarray() for cap in (1e300, WEIGHT_CAP))
    assert free[1, 1] < -1e6
    np.testing.assert_allclose(capped[1], free[1] / abs(free[1, 1]) * 1e4, rtol=1e-12)
    np.testing.assert_array_equal(capped[3], free[3])


@pytest.mark.parametrize("height", [1, 1e-3, 1e-6, 1e-9, 1e-12])
def test_both_cotangents_of_a_needle_have_the_same_area(height):
    """However flat the triangle: else the point is drawn along it, and lines contract to points."""
    points = np.array([[0, 0, 0], [1, 0.3, 0.1], [2, 0.6 + height, 0.2]])
    needle = cotangent_laplacian(points, rings_of([[1, 2], [], []], [False] * 3), cap=1e30)
    one, other = points[1:]
    along = other - one
    assert needle[0, 1] / needle[0, 2] == pytest.approx(-(other @ along) / (one @ along), rel=1e-13)


def test_triangles_without_area_add_nothing():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]])
    degenerate = rings_of([[1, 2], [0, 3], [1, 3], [], [], [0, 1]], [False] * 6)
    assert abs(cotangent_laplacian(points, degenerate)).max() == 0
    # next to one with area, only that one counts
    mixed, alone = rings_of([[2, 1, 4], *[[]] * 5], [False] * 6), rings_of([[1, 4], *[[]] * 5], [False] * 6)
    assert abs(cotangent_laplacian(points, mixed) - cotangent_laplacian(points, alone)).max() == 0
