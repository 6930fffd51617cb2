"""Whether a cloud shows the whole surface of a solid, and the walls of holes that its contraction has shut."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Contractor, InvalidCloudError, pipelines, samples
from glsk_o3d.curve.medial import MedialGraph, OrientedSurface, genus


def surface_of(points):
    return OrientedSurface.of((pipelines.rings() | Contractor())(points))


def washer(hole, n=4096, seed=0):
    """Points on a square bar one wide around a round hole of that radius, turned at random."""
    rng = np.random.default_rng(seed)
    wall, face = 2 * np.pi * (2 * hole + 1), 2 * np.pi * ((hole + 1) ** 2 - hole**2)
    on_wall = rng.random(n) < wall / (wall + face)
    outer = rng.random(n) < (hole + 1) / (2 * hole + 1)
    radius = np.where(on_wall, np.where(outer, hole + 1, hole), np.sqrt(rng.uniform(hole**2, (hole + 1) ** 2, n)))
    z, turn = np.where(on_wall, rng.random(n), rng.integers(0, 2, n)), 2 * np.pi * rng.random(n)
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])
    return points @ np.linalg.qr(rng.standard_normal((3, 3)))[0], wall / (wall + face) * hole / (2 * hole + 1)


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_whole_tube_is_closed_and_nothing_faces_its_place(noise):
    surface = surface_of(samples.torus(3000, noise=noise).points)
    assert surface.is_closed
    assert surface.shut < 0.01
    assert surface.turned < 0.015


def test_half_of_a_tube_is_not_closed():
    points = samples.torus(4000).points
    for direction in ([0, 0, 1.0], [1.0, 0, 0]):
        seen = points @ np.array(direction) > 0
        assert not surface_of(points[seen]).is_closed


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_wall_of_a_narrow_hole_faces_its_place(seed):
    """Half of it, on average: its points went past the middle of the hole, or not so far."""
    points, share = washer(0.3, seed=seed)
    surface = surface_of(points)
    assert surface.is_closed
    assert 0.3 * share < surface.shut < 1.3 * share
    graph = surface.medial_graph()
    assert graph.n_loops == 1
    assert (np.bincount(graph.edges.ravel()) == 2).all()
    points, _ = washer(3.0, seed=seed)
    assert surface_of(points).shut == 0


def test_signs_that_conflict_are_seen():
    surface = surface_of(samples.torus(3000).points)
    assert surface.turned < 0.002
    bar = surface_of(samples.two_rings(3000, noise=0.04).points)  # noise as thick as the tubes
    assert bar.turned > 0.015
    assert not bar.is_closed


def test_genus_counts_handles_of_all_parts():
    ball, ring = o3d.geometry.TriangleMesh.create_sphere(), o3d.geometry.TriangleMesh.create_torus()
    meshes = {0: ball, 1: ring, 2: ring + o3d.geometry.TriangleMesh.create_torus().translate((9, 0, 0)) + ball}
    for handles, mesh in meshes.items():
        assert genus(len(mesh.vertices), np.asarray(mesh.triangles)) == handles


def test_open_pieces_do_not_close_each_other():
    """Their normals would cancel out."""
    low = samples.torus(4000).points
    low = low[low[:, 2] < 0]
    assert not surface_of(np.concatenate([low, low * [1, 1, -1] + [0, 0, 1.0]])).is_closed


def test_where_no_surface_goes_through_points_there_is_an_error():
    rng = np.random.default_rng(0)
    for n in (4, 8):
        points = rng.normal(size=(n, 3))
        with pytest.raises(InvalidCloudError, match=f"{n} points are too few"):
            MedialGraph.of(points, points / np.linalg.norm(points, axis=1)[:, None])


@pytest.mark.parametrize(("shut", "genus_", "believed"), [(0.1, 2, True), (0.3, 2, False), (0.3, 1, True)])
def test_where_much_faces_the_curve_only_the_genus_confirms_it(shut, genus_, believed):
    ring = MedialGraph(np.eye(3), np.ones(3), np.array([[0, 1], [1, 2], [0, 2]]), genus_)
    points = np.zeros((3, 3))
    surface = OrientedSurface(points, points, np.ones(3), np.zeros(3, int), noise=0.0, shut=shut, turned=0.0)
    assert surface.confirms(ring) == believed
