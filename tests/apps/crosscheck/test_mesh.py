"""libigl's Laplacian in our convention, and the skeletons of meshes."""

from dataclasses import replace

import igl
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from glsk_o3d import Contractor, RingBuilder, Sampler, pipelines
from glsk_o3d.apps.crosscheck.mesh import mesh_laplacian, mesh_skeleton, mesh_state
from glsk_o3d.apps.crosscheck.solid import Solid
from glsk_o3d.geometry.cotangent import WEIGHT_CAP, cotangent_laplacian
from glsk_o3d.geometry.rings import Rings


def convex_rings(points, faces):
    """One-rings of a convex surface around the origin, in rotational order."""
    around = [set() for _ in points]
    for a, b, c in faces.tolist():
        around[a] |= {b, c}
        around[b] |= {c, a}
        around[c] |= {a, b}
    rows = []
    for i, names in enumerate(around):
        names = np.array(sorted(names))
        axes = np.linalg.svd(points[i][None])[2][1:]
        x, y = axes @ (points[names] - points[i]).T
        rows.append(names[np.argsort(np.arctan2(y, x))])
    return Rings(np.cumsum([0, *map(len, rows)]), np.concatenate(rows), np.ones(len(rows), bool))


# ------------------------------------------------------------------------------------------------- sign and factor


def test_our_rows_are_twice_libigls_where_the_rings_are_the_same(even_ball):
    points, faces = even_ball(700)
    state = (Sampler(frame="box") | RingBuilder())(points)
    faces, cloud = state.map.row_of_point[faces], state.frame.out_of(state.cloud)
    mesh = convex_rings(cloud, faces)
    same = np.array([{*state.rings[i]} == {*mesh[i]} for i in range(700)])
    assert same.mean() > 0.95  # the others lie on squares, which have two diagonals
    ours, theirs = cotangent_laplacian(cloud, state.rings), 2 * igl.cotmatrix(cloud, faces).tocsr()
    for item in (theirs, mesh_laplacian(cloud, faces)):
        assert abs(ours - item)[same].max() < 1e-10 * abs(theirs).max()


def test_the_sign(even_ball):
    points, faces = even_ball(300)
    laplacian = mesh_laplacian(points, faces)
    dense = laplacian.toarray()
    assert np.linalg.eigvalsh(dense).max() < 1e-12  # negative semi-definite
    assert (dense - np.diag(np.diag(dense)) >= -1e-12).all()  # Delaunay: no weight is negative
    np.testing.assert_allclose(dense.sum(axis=1), 0, atol=1e-12)
    assert (np.einsum("ij,ij->i", laplacian @ points, points) < 0).all()  # inward


def test_the_laplacian_is_the_gradient_of_the_area():
    # x . L x = -4 area of any mesh, torn or not manifold
    rng = np.random.default_rng(0)
    points, faces = rng.normal(size=(300, 3)), rng.integers(0, 300, (500, 3))
    faces = faces[(np.diff(np.sort(faces, axis=1)) > 0).all(axis=1)]
    area = igl.doublearea(points, faces).sum() / 2
    actual = (points * (mesh_laplacian(points, faces, cap=1e300) @ points)).sum()
    assert actual == pytest.approx(-4 * area, rel=1e-9)


def test_rows_are_capped_as_ours_are():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0], [0, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    free, capped = mesh_laplacian(points, faces, cap=1e300).toarray(), mesh_laplacian(points, faces).toarray()
    assert abs(free[2, 2]) > 1e5
    np.testing.assert_allclose(capped[2], free[2] / abs(free[2, 2]) * WEIGHT_CAP)
    np.testing.assert_allclose(capped[3], free[3])


def test_triangles_without_area_and_bare_vertices_add_nothing():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [5, 5, 5]])
    with_flat = mesh_laplacian(points, np.array([[0, 1, 3], [0, 1, 2]])).toarray()
    np.testing.assert_array_equal(with_flat, mesh_laplacian(points, np.array([[0, 1, 3]])).toarray())
    assert not with_flat[[2, 4]].any()


# ----------------------------------------------------------------------------------------------------- contraction


def ellipsoid(n=400):
    points = np.random.default_rng(3).normal(size=(n, 3))
    points *= [[1, 0.6, 2.5]] / np.linalg.norm(points, axis=1, keepdims=True)
    hull = ConvexHull(points)
    outward = np.einsum(
        "ij,ij->i", np.cross(*np.diff(points[hull.simplices], axis=1).swapaxes(0, 1)), hull.equations[:, :3]
    )
    faces = np.where(outward[:, None] < 0, hull.simplices[:, ::-1], hull.simplices)
    return Solid(points, faces.astype(np.int64), "given")


def test_the_contraction_is_ours_where_rings_and_one_rings_are_the_same():
    state, faces = mesh_state(ellipsoid())
    rings = convex_rings(state.cloud - state.cloud.mean(axis=0), faces)
    contractor = Contractor(max_iterations=3, stop=lambda iterations: None)
    ours = contractor(replace(state, rings=rings))
    theirs = contractor.contract(state, lambda state: mesh_laplacian(state.positions, faces))
    assert len(theirs.report.iterations) == len(ours.report.iterations) == 3
    assert len(theirs) == len(ours) == 400
    np.testing.assert_allclose(theirs.positions, ours.positions, atol=1e-5)


def test_the_contraction_starts_from_medial_places():
    solid = ellipsoid(1500)
    state, _ = mesh_state(solid)
    place = state.frame.out_of(state.positions) / [1, 0.6, 2.5]
    middle = np.abs(place[:, 2]) < 0.5
    assert np.median(np.linalg.norm(place[middle], axis=1)) < 0.75  # the surface is at 1
    area = igl.massmatrix(solid.vertices, solid.faces).diagonal()
    mass = state.mass[state.map.row_of_point]
    np.testing.assert_allclose(mass, np.maximum(area / area.mean(), 0.05), rtol=1e-9)


def test_vertices_that_fall_together_keep_the_mesh_whole():
    solid = ellipsoid()
    twice = np.vstack([solid.vertices, solid.vertices[:200] + 1e-12])
    faces = np.where(
        (solid.faces < 200) & (np.arange(len(solid.faces)) % 2 == 0)[:, None], solid.faces + 400, solid.faces
    )
    state, over = mesh_state(Solid(twice, faces, "given"))
    assert len(state) == 400
    assert igl.euler_characteristic(over) == 2


def test_the_skeleton_of_an_ellipsoid():
    skeleton = mesh_skeleton(ellipsoid(1500), pipelines.default())
    assert (skeleton.n_components, skeleton.n_loops) == (1, 0)
    assert np.abs(skeleton.vertices[:, :2]).max() < 0.2
    assert skeleton.length > 2
