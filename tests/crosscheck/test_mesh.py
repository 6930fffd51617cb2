"""Meshes of clouds: their reconstruction, libigl's Laplacian in our convention, contraction."""

from dataclasses import replace

import igl
import numpy as np
import pytest
from scipy.spatial import ConvexHull, cKDTree

from glsk_o3d import Contractor, RingBuilder, Sampler, pipelines
from glsk_o3d.crosscheck.mesh import ball_pivoting, mesh_laplacian, mesh_skeleton, mesh_state, orient_normals, umbrellas
from glsk_o3d.numerics.cotangent import WEIGHT_CAP, cotangent_laplacian
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
from glsk_o3d.numerics.rings import Rings
from glsk_o3d.samples import sphere, torus, tube, two_rings


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


def meshed(points):
    """The state of a cloud, and the faces of a mesh of it."""
    state = RingBuilder()(points)
    return state, ball_pivoting(state)


# -------------------------------------------------------------------------------------------------- reconstruction


def test_ball_pivoting_closes_what_is_closed_and_leaves_open_ends_open(even_ball):
    _, faces = meshed(even_ball(1000)[0])
    assert umbrellas(1000, faces).all()
    assert igl.euler_characteristic(faces) == 2
    state, faces = meshed(tube(3000, capped=False).points)
    border = ~umbrellas(3000, faces)
    ends = np.abs(state.frame.out_of(state.cloud)[:, 0]) > 0.48
    assert border[ends].mean() > 5 * border[~ends].mean()


def test_the_same_twice():
    points = torus(600, noise=0.01).points
    np.testing.assert_array_equal(meshed(points)[1], meshed(points)[1])


# ------------------------------------------------------------------------------------------------- sign and factor


def test_our_rows_are_twice_libigls_where_the_rings_are_the_same(even_ball):
    points, faces = even_ball(700)
    state = (Sampler(frame="box") | RingBuilder())(points)
    faces, cloud = state.representative_of_point[faces], state.frame.out_of(state.cloud)
    mesh = convex_rings(cloud, faces)
    same = np.array([{*state.rings[i]} == {*mesh[i]} for i in range(700)])
    assert same.mean() > 0.95  # the others lie on squares, which have two diagonals
    ours, theirs = cotangent_laplacian(cloud, state.rings), 2 * igl.cotmatrix(cloud, faces).tocsr()
    for each in (theirs, mesh_laplacian(cloud, faces)):
        assert abs(ours - each)[same].max() < 1e-10 * abs(theirs).max()


def test_the_sign(even_ball):
    points, faces = even_ball(300)
    laplacian = mesh_laplacian(points, faces)
    dense = laplacian.toarray()
    assert np.linalg.eigvalsh(dense).max() < 1e-12  # negative semi-definite
    assert (dense - np.diag(np.diag(dense)) >= -1e-12).all()  # Delaunay: no weight is negative
    np.testing.assert_allclose(dense.sum(axis=1), 0, atol=1e-12)
    assert (np.einsum("ij,ij->i", laplacian @ points, points) < 0).all()  # inward


def test_it_is_the_gradient_of_the_area():
    # x . L x = -4 area of any mesh, torn or not manifold
    state, faces = meshed(torus(1500, noise=0.02).points)
    points = state.cloud
    area = igl.doublearea(points, faces).sum() / 2
    found = (points * (mesh_laplacian(points, faces, cap=1e300) @ points)).sum()
    assert found == pytest.approx(-4 * area, rel=1e-9)


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


def test_it_is_the_contractor_where_rings_and_one_rings_are_the_same():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(400, 3))
    points *= [[1, 0.6, 2.5]] / np.linalg.norm(points, axis=1, keepdims=True)
    state = RingBuilder()(points)
    faces = ConvexHull(state.cloud).simplices.astype(np.int64)
    begun, faces = mesh_state(state, faces)
    centred = state.cloud - state.cloud.mean(axis=0)
    rings = convex_rings(centred, faces)
    contractor = Contractor(max_iterations=3, stop=lambda iterations: None)
    ours = contractor(replace(begun, rings=rings))
    theirs = contractor.contract(begun, lambda state: mesh_laplacian(state.positions, faces))
    assert len(theirs.report.iterations) == len(ours.report.iterations) == 3
    assert len(theirs) == len(ours) == 400
    np.testing.assert_allclose(theirs.positions, ours.positions, atol=1e-5)
    assert theirs.report.stages == begun.report.stages == ()


def test_points_without_a_triangle_go_to_the_nearest_with_one():
    state, faces = meshed(tube(1500).points)
    gone = np.flatnonzero(state.cloud[:, 0] > 0.3)
    faces = faces[~np.isin(faces, gone).any(axis=1)]
    begun, local = mesh_state(state, faces)
    assert len(begun) == len(np.unique(faces)) < len(state)
    np.testing.assert_array_equal(begun.survivors[local], faces)
    np.testing.assert_array_equal(begun.representative[begun.survivors], np.arange(len(begun)))
    assert (begun.cloud[begun.survivors[begun.representative[gone]], 0] > 0.2).all()
    skeleton = mesh_skeleton(state, faces, pipelines.default())
    assert (skeleton.vertex_of_point >= 0).all()
    assert skeleton.n_components == 1


# ------------------------------------------------------------------------------------------------------ orientation


@pytest.mark.parametrize("shape", [sphere, torus, two_rings])
def test_normals_of_closed_surfaces_point_outward(shape):
    sample = shape(3000)
    outward = sample.points - sample.nodes[cKDTree(sample.nodes).query(sample.points)[1]]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    mixed = outward * np.random.default_rng(0).choice([-1, 1], (len(outward), 1))
    neighbours = nearest_neighbours(sample.points, 8)[1]
    edges = np.column_stack([np.repeat(np.arange(3000), 7), neighbours[:, 1:].ravel()])
    np.testing.assert_array_equal(orient_normals(sample.points, mixed, edges), outward)
