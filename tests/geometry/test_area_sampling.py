"""Points of a mesh by area, and when its vertices would mislead."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.data.points import POINTS, default_k
from glsk_o3d.geometry.area_sampling import sample_by_area, vertices_mislead

SHAPES = o3d.geometry.TriangleMesh


def arrays(mesh):
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles, np.int64)


def mislead(mesh):
    return vertices_mislead(arrays(mesh) if isinstance(mesh, SHAPES) else mesh, default_k, POINTS.enough)


# ------------------------------------------------------------------------------------------------------------- samples


def test_every_triangle_has_its_share_of_places():
    vertices, triangles = arrays(SHAPES.create_cone(1.0, 4.0, 12, 3))
    places, corners, normals, whole = sample_by_area(vertices, triangles, 5000)
    assert places.shape == normals.shape == corners.shape == (5000, 3)
    a, b, c = (vertices[corner] for corner in triangles.T)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1) / 2
    np.testing.assert_allclose(whole, area.sum())
    key = {tuple(three): row for row, three in enumerate(triangles.tolist())}
    row = np.array([key[tuple(three)] for three in corners.tolist()])
    count = np.bincount(row, minlength=len(triangles))
    assert np.abs(count - 5000 * area / area.sum()).max() < 1 + 1e-9
    np.testing.assert_allclose(normals, (normal / 2 / area[:, None])[row], atol=1e-12)
    # barycentric coordinates: in the plane of the triangle, and within it
    ends = np.stack([(b - a)[row], (c - a)[row], normals], axis=2)
    weight = np.linalg.solve(ends, (places - a[row])[:, :, None])[:, :, 0]
    assert np.abs(weight[:, 2]).max() < 1e-12
    assert weight[:, :2].min() > 0
    assert weight[:, :2].sum(axis=1).max() < 1 + 1e-12


def test_places_in_a_triangle_have_its_moments():
    """Of 1000 even places they are off by less than .002, of random ones by .007."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    places = sample_by_area(corners, np.array([[0, 1, 2]]), 1000)[0]
    np.testing.assert_allclose(places.mean(axis=0), corners.mean(axis=0), atol=2e-3)
    np.testing.assert_allclose((places**2).mean(axis=0), [1 / 6, 1 / 6, 0], atol=2e-3)


def test_places_do_not_depend_on_the_order_of_triangles():
    vertices, triangles = arrays(SHAPES.create_torus(1, 0.3, 8, 5))
    shuffled = np.random.default_rng(1).permutation(triangles)
    for other in (triangles, shuffled):
        places = sample_by_area(vertices, other, 300)[0]
        np.testing.assert_array_equal(places, sample_by_area(vertices, triangles, 300)[0])


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_triangles_without_area_or_end_have_no_places(scale):
    vertices = scale * np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [np.nan, 0, 0]])
    assert len(sample_by_area(vertices, np.array([[0, 1, 2], [0, 0, 3], [0, 1, 4]]), 10)[0]) == 0
    assert len(sample_by_area(vertices, np.empty((0, 3), int), 10)[0]) == 0
    _, corners, _, area = sample_by_area(vertices, np.array([[0, 1, 2], [0, 1, 4], [0, 1, 3]]), 10)
    np.testing.assert_array_equal(corners, np.tile([0, 1, 3], (10, 1)))
    np.testing.assert_allclose(area, scale**2 / 2)


def test_places_far_from_the_origin_are_as_exact():
    vertices, triangles = arrays(SHAPES.create_box())
    far = np.array([5e5, 5.5e6, 300.0])
    np.testing.assert_allclose(
        sample_by_area(vertices + far, triangles, 100)[0] - far,
        sample_by_area(vertices, triangles, 100)[0],
        atol=1e-8,
    )


# ------------------------------------------------------------------------------------------------------------ the rule


def soup(mesh):
    """With three vertices for each triangle, as STL has them."""
    vertices, triangles = arrays(mesh)
    return vertices[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3)


def bumpy(n):
    """Triangles of many sizes: a sphere with points at random."""
    points = np.random.default_rng(n).normal(size=(n, 3))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points / np.linalg.norm(points, axis=1, keepdims=True)))
    return cloud.compute_convex_hull()[0]


def plastered(mesh, loose):
    """With vertices that no triangle has."""
    vertices, triangles = arrays(mesh)
    return np.append(vertices, np.random.default_rng(0).random((loose, 3)), axis=0), triangles


DENSE = {
    "a tube of squares": SHAPES.create_cylinder(0.1, 2, 40, 127),
    "a torus": SHAPES.create_torus(1, 0.3, 120, 36),
    "a sphere": SHAPES.create_sphere(1, 40),
    "points at random": bumpy(4000),
    "a box of a grid": SHAPES.create_box().subdivide_midpoint(5),
    "a soup": soup(SHAPES.create_sphere(1, 40)),
    "a cloud with a triangle": (np.random.default_rng(0).random((500, 3)), np.array([[0, 1, 2]])),
    "a cloud in threes": (np.random.default_rng(0).random((600, 3)), np.arange(600).reshape(-1, 3)),
    "mostly loose": plastered(SHAPES.create_box(), 9),
    "no triangles": (np.random.default_rng(0).random((50, 3)), np.empty((0, 3), int)),
}
COARSE = {
    "a cube": SHAPES.create_box(),
    "a tube of two circles": SHAPES.create_cylinder(0.1, 2, 40, 1),
    "a tube of needles": SHAPES.create_cylinder(0.1, 2, 200, 20),
    "needles around": SHAPES.create_torus(1, 0.3, 1000, 6),
    "few triangles": SHAPES.create_torus(1, 0.3, 16, 8),
    "a soup": soup(SHAPES.create_cylinder(0.1, 2, 200, 20)),
    "some loose": plastered(SHAPES.create_cylinder(0.1, 2, 200, 20), 2000),
}


@pytest.mark.parametrize("name", DENSE)
def test_vertices_of_dense_meshes_and_clouds_do_not_mislead(name):
    assert not mislead(DENSE[name])


@pytest.mark.parametrize("name", COARSE)
def test_vertices_of_coarse_meshes_and_needles_mislead(name):
    assert mislead(COARSE[name])


@pytest.mark.parametrize(("name", "halvings"), [("a cube", 5), ("a tube of two circles", 6)])
def test_vertices_mislead_at_any_size_until_triangles_are_subdivided(name, halvings):
    mesh = SHAPES(COARSE[name])
    for _ in range(halvings):
        assert mislead(mesh) == mislead(SHAPES(mesh).scale(1e-6, (1, 2, 3))) == mislead(soup(mesh))
        mesh = mesh.subdivide_midpoint(1)
