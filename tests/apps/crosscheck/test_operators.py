"""Two Laplacians against closed forms, by both ways to them, and against each other."""

import numpy as np
import open3d as o3d
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigs, eigsh
from scipy.spatial import Delaunay

from glsk_o3d import RingBuilder, Sampler, pipelines, samples
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.apps.crosscheck.operators import compare_operators, mesh_operator
from glsk_o3d.apps.crosscheck.solid import Solid
from glsk_o3d.geometry.cotangent import Operator, eigenvalues, mapped, ring_operator

SPHERE = np.repeat([4 * i * (i + 1) for i in range(8)], [2 * i + 1 for i in range(8)])[:50]  # of radius 1/2
WAVES = np.array([[i, j] for i in range(-9, 10) for j in range(-9, 10)])
FLAT_TORUS = np.sort(4 * np.pi**2 * (WAVES**2).sum(axis=1))[:50]  # of sides 1


def of_rings(points):
    """Our operator of a cloud, in its units."""
    state = (Sampler(frame="box") | RingBuilder(k=24))(points)
    return ring_operator(state.frame.out_of(state.cloud), state.rings), state


def of_mesh(points, faces):
    return mesh_operator(Solid(points, faces, "given"))


def folded_up(operator, tile, n):
    """The operator of nine tiles as that of the middle one, whose sides are glued: a flat torus."""
    middle = np.flatnonzero(tile // n == 4)
    ordered = middle[np.argsort(tile[middle])]
    rows = operator.laplacian.tocsr()[ordered].tocoo()
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (rows.row, tile[rows.col] % n), rows.data)
    return Operator(operator.places[ordered], csr_matrix(laplacian), operator.area[ordered])


def flat_torus(side):
    """Shaken grid points of a unit square, nine tiles of it, as our operator and as libigl's."""
    rng = np.random.default_rng(1)
    x, y = np.mgrid[:side, :side].reshape(2, -1)
    square = (np.column_stack([x, y]) + 0.5 + rng.uniform(-0.3, 0.3, (side**2, 2))) / side
    plane = np.concatenate([square + [i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    places, numbers = np.column_stack([plane, np.zeros(len(plane))]), np.arange(len(plane))
    ours, state = of_rings(places)
    mesh = of_mesh(places, Delaunay(plane).simplices.astype(np.int64))
    number = np.empty(len(plane), int)
    number[state.map.row_of_point] = numbers
    return folded_up(ours, number, side**2), folded_up(mesh, numbers, side**2)


def error(operator, solver, true):
    actual = eigenvalues(operator, solver)
    assert abs(actual[0]) < 1e-3 * true[1]
    return np.abs(actual[1:] / true[1:] - 1).mean()


def test_eigenvalues_of_the_sphere_by_both_ways_converge(even_ball):
    errors = []
    for n in (500, 2000):
        points, faces = even_ball(n)
        errors.append((error(of_rings(points)[0], eigs, SPHERE), error(of_mesh(points, faces), eigsh, SPHERE)))
    coarse, fine = np.array(errors)
    assert (fine < 0.012).all()
    assert (fine < 0.35 * coarse).all()  # of second order: four times the points, a quarter of the error


def test_eigenvalues_of_the_flat_torus_by_both_ways_converge():
    coarse, fine = (
        np.array(
            [error(item, solver, FLAT_TORUS) for item, solver in zip(flat_torus(side), (eigs, eigsh), strict=True)]
        )
        for side in (16, 32)
    )
    assert (fine < 0.03).all()
    assert (fine < 0.4 * coarse).all()


def test_the_mean_curvature_vector_of_a_sphere(even_ball):
    points, faces = even_ball(2000)
    for operator in (of_rings(points)[0], of_mesh(points, faces)):
        for length, scatter in ((0.001, 1.0), (0.03, 0.25)):
            actual = mapped(operator, operator.places, length)
            # linear functions are eigenfunctions: 8 inward, averaged over the length
            expected = -8 / (1 + 8 * length**2) * operator.places
            np.testing.assert_allclose(actual, expected, atol=scatter)
            assert np.median(np.linalg.norm(actual, axis=1)) == pytest.approx(4 / (1 + 8 * length**2), rel=0.01)


@pytest.mark.parametrize("shape", ["torus", "y_junction"])
def test_areas_of_an_ordinary_cloud_tile_the_surface(shape):
    drawn = samples.SAMPLES[shape](3000)
    state = (Sampler() | RingBuilder())(drawn.points)
    actual = ring_operator(state.positions, state.rings).area.sum() * state.frame.scale**2
    true = {"torus": 0.16 * np.pi**2}.get(shape)
    solid = cross_check(drawn.points).solid
    assert actual == pytest.approx(true or solid.parts[0].area, rel=0.06)


def test_a_constant_is_mapped_to_nothing(even_ball):
    points, faces = even_ball(300)
    for operator in (of_rings(points)[0], of_mesh(points, faces)):
        np.testing.assert_allclose(mapped(operator, np.ones((300, 1)), 0.1), 0, atol=1e-9)


def test_rings_and_one_rings_of_the_same_points_agree(even_ball):
    points, faces = even_ball(1000)
    ours, state = of_rings(points)
    solid = Solid(points, faces, "given")
    angle, actual = compare_operators(ours, state.rings, ours.places, mesh_operator(solid), solid)
    assert (actual.points, actual.compared, actual.flat, actual.folded) == (1000, 1000, 0, 0)
    assert actual.angle["p90"] < 1
    assert actual.ratio["p10"] == pytest.approx(1, abs=0.02)
    assert actual.functions < 0.02
    assert actual.eigenvalue_ratio == pytest.approx(1, abs=0.01)
    assert actual.eigenvalues.shape == (50, 2)
    assert np.isfinite(angle).all()


def test_scale_does_not_matter(even_ball):
    points, faces = even_ball(600)
    actual = []
    for unit in (1.0, 1e3):
        state = (Sampler(frame="box") | RingBuilder())(points * unit)
        ours, solid = ring_operator(state.cloud * unit, state.rings), Solid(1.6 * points * unit, faces, "given")
        actual.append(compare_operators(ours, state.rings, state.cloud, mesh_operator(solid), solid)[1])
    for name in ("angle", "ratio"):
        assert getattr(actual[0], name) == pytest.approx(getattr(actual[1], name), rel=1e-5)
    np.testing.assert_allclose(actual[0].eigenvalues, actual[1].eigenvalues * 1e6, rtol=1e-4, atol=1e-3)


@pytest.mark.filterwarnings("ignore:sphere-like")
def test_flat_faces_have_no_curvature_to_compare():
    o3d.utility.random.seed(0)
    cube = o3d.geometry.TriangleMesh.create_box(1, 1, 1).sample_points_uniformly(16000)
    check = cross_check(cube, pipeline=pipelines.default().with_options({"Thinner.thin_to": "all"}))
    assert check.rows.flat > 0.4 * check.rows.points
    from_edge = np.sort(0.5 - np.abs(check.points - 0.5), axis=1)[:, 1]
    assert (check.angle[from_edge > 0.15] == 0).mean() > 0.95
    assert check.rows.angle["median"] < 10  # of the edges
