"""Meshes of clouds: closed where the object is, with its handles, volume and area; and those that users give."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import RingBuilder, Sampler
from glsk_o3d.apps.crosscheck.solid import Solid, ball_pivoting, given, poisson
from glsk_o3d.errors import InvalidCloudError
from glsk_o3d.geometry.frame import Frame
from glsk_o3d.geometry.inscribed_balls import outward_normals
from glsk_o3d.geometry.neighbourhoods import spacing
from glsk_o3d.interop.clouds import SurfaceMesh, surface_mesh
from glsk_o3d.samples import torus, tube, two_rings

UNIT = Frame(np.zeros(3), 1.0, np.ones(3), 1.0)


def solid_of(points, made_by=poisson):
    """The mesh of a cloud in the cloud's units."""
    state = (Sampler() | RingBuilder())(points)
    outward = outward_normals(state.positions, state.normals[state.survivors], state.rings)
    through = (state.positions, outward)
    solid = made_by(*through) if made_by is ball_pivoting else made_by(*through, spacing(state.positions))
    return Solid(state.frame.out_of(solid.vertices), solid.faces, solid.made_by)


def triangles(mesh):
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles, np.int64)


@pytest.mark.parametrize("noise", [0, 0.005])
def test_a_torus_has_its_handle_volume_and_area(noise):
    solid = solid_of(torus(4000, noise=noise).points)
    (part,) = solid.parts
    assert (solid.is_watertight, solid.n_solids, solid.genus, part.borders) == (True, 1, 1, 0)
    radius, tube_radius = 0.4, 0.1
    assert part.volume == pytest.approx(2 * np.pi**2 * radius * tube_radius**2, rel=0.03)
    assert part.area == pytest.approx(4 * np.pi**2 * radius * tube_radius, rel=0.02)


def test_two_linked_rings_are_two_solids():
    solid = solid_of(two_rings(6000).points)
    assert (solid.n_solids, solid.genus, solid.is_watertight) == (2, 2, True)


def test_the_wall_of_a_cavity_is_no_solid(even_ball):
    points, faces = even_ball(500)
    both = np.vstack([points, 0.5 * points]), np.vstack([faces, faces[:, ::-1] + len(points)])
    solid = given(SurfaceMesh(*both), UNIT, 0.1)
    assert [part.volume > 0 for part in solid.parts] == [True, False]
    assert (solid.n_solids, solid.genus) == (1, 0)


def test_open_ends_are_borders():
    solid = solid_of(tube(4000, capped=False).points)
    assert not solid.is_watertight
    assert (solid.parts[0].borders, solid.genus, solid.parts[0].volume) == (2, 0, None)


# --------------------------------------------------------------------------------------------------- those of the user


def test_long_edges_are_halved_and_the_surface_stays():
    box = triangles(o3d.geometry.TriangleMesh.create_box(1, 1, 4))
    solid = given(SurfaceMesh(*box), UNIT, 0.1)
    a, b, c = solid.vertices[solid.faces].transpose(1, 0, 2)
    assert max(np.linalg.norm(p - q, axis=1).max() for p, q in ((a, b), (b, c), (c, a))) <= 0.3
    assert (solid.parts[0].area, solid.parts[0].volume) == (pytest.approx(18), pytest.approx(4))


def test_two_tetrahedra_that_share_an_edge_or_a_corner_are_two_parts():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1], [-1, 0, 0.0]])
    sides = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    for other in ([0, 1, 4, 5], [0, 6, 4, 5]):
        faces = np.vstack([sides, np.array(other)[sides]])
        solid = given(SurfaceMesh(corners, faces), UNIT, 1.0)
        assert [(part.borders, part.genus) for part in solid.parts] == [(0, 0), (0, 0)]


def test_meshes_that_are_wrong():
    vertices, faces = triangles(o3d.geometry.TriangleMesh.create_box(1, 1, 1))
    for wrong in (
        (vertices, faces + 5),
        (np.where(vertices == 1, np.nan, vertices), faces),
        (vertices * [1, 0, 0], faces),
    ):
        with pytest.raises(InvalidCloudError):
            given(surface_mesh(SurfaceMesh(*wrong)), UNIT, 0.1)


@pytest.mark.parametrize("spoil", ["corners apart", "inside out", "every other face turned"])
def test_what_files_do_to_a_mesh_is_mended(even_ball, spoil):
    vertices, faces = even_ball(800)
    if spoil == "corners apart":  # as in STL
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    else:
        faces = np.where(
            np.arange(len(faces))[:, None] % (2 if spoil.startswith("every") else 1) == 0, faces[:, ::-1], faces
        )
    (part,) = given(SurfaceMesh(vertices, faces), UNIT, 0.1).parts
    assert (part.genus, part.borders) == (0, 0)
    assert part.volume == pytest.approx(np.pi / 6, rel=0.02)


def test_a_much_finer_mesh_is_simplified():
    ring = triangles(o3d.geometry.TriangleMesh.create_torus(0.4, 0.1, 300, 150))
    solid = given(SurfaceMesh(*ring), UNIT, 0.03)
    assert len(solid.faces) < 30_000
    assert (solid.genus, solid.is_watertight) == (1, True)
