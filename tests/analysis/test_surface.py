"""Limbs that touch are apart in the rig if they are apart in the mesh."""

import numpy as np
import pytest

from glsk_o3d import Skeleton
from glsk_o3d.analysis.rigging import armature
from glsk_o3d.analysis.skinning import skin_weights
from glsk_o3d.analysis.surface import Surface, without_loops
from glsk_o3d.io.formats.graphs import as_forest

AROUND = np.linspace(0, 2 * np.pi, 16, endpoint=False)


def tube(curve, radius):
    """A mesh around a curve in the plane y = 0: places and triangles, with open ends."""
    along = np.gradient(curve, axis=0)
    across = np.cross(along / np.linalg.norm(along, axis=1)[:, None], [0, 1, 0])
    ring = np.cos(AROUND)[:, None] * across[:, None] + np.sin(AROUND)[:, None] * np.array([0, 1, 0])
    points = (curve[:, None] + radius * ring).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(curve) - 1), np.arange(16), indexing="ij")
    a, b, c, d = (16 * (i + down) + (j + turn) % 16 for down, turn in ((0, 0), (0, 1), (1, 0), (1, 1)))
    return points, np.stack([a, b, d, a, d, c], axis=-1).reshape(-1, 3)


def hairpin(gap, length=3.0):
    """A line down at x = -gap / 2, half a turn, and up again."""
    turn, z = np.linspace(np.pi, 2 * np.pi, 9), np.linspace(length, 0, 31)[:-1]
    bend = gap / 2 * np.column_stack([np.cos(turn), 0 * turn, np.sin(turn)])
    down = np.column_stack([0 * z - gap / 2, 0 * z, z])
    return np.concatenate([down, bend, (down * [-1, 1, 1])[::-1]])


def test_the_bones_of_a_limb_do_not_move_one_beside_it():
    curve = hairpin(0.5)
    points, triangles = tube(curve, 0.2)
    n = len(curve)
    vertex = np.repeat(np.arange(n), 16)
    edges, none = np.column_stack([np.arange(n - 1), np.arange(1, n)]), np.zeros_like(points)
    skeleton = Skeleton(curve, edges, np.full(n, 0.2), vertex, points, none)
    bones = armature(skeleton, 5)
    of_bone = np.sign(bones.vertices[bones.edges].mean(axis=1)[:, 0])
    high = points[:, 2] > 1.0
    foreign = {}
    for name, surface in (("space", None), ("surface", Surface(points, triangles))):
        which, weights = skin_weights(bones, points, bones.vertex_of_point, surface)
        np.testing.assert_allclose(weights.sum(axis=1), 1)
        other = of_bone[which] * np.sign(points[:, :1]) < 0
        foreign[name] = (weights * other)[high].sum(axis=1).max()
    assert foreign["space"] > 0.1
    assert foreign["surface"] == 0


def test_a_patch_that_the_cloud_gives_to_another_limb_returns_to_its_own():
    curve = hairpin(0.5)
    points, triangles = tube(curve, 0.2)
    n = len(curve)
    true = np.repeat(np.arange(n), 16)
    wrong = np.where(
        (points[:, 2] > 1.5) & (points[:, 2] < 2) & (points[:, 0] > -0.25) & (points[:, 0] < 0), n - 1 - true, true
    )
    assert (wrong != true).sum() > 20
    bone, table = np.arange(n) // 4, np.arange(n // 4 + 1)[:, None] + [-1, 0, 1]
    own = Surface(points, triangles).continued(wrong, bone, table)
    assert (own[wrong != true] < n / 2).all()
    np.testing.assert_array_equal(own[wrong == true], true[wrong == true])
    two = np.concatenate([points, points + 9])  # a component of its own has nothing to return to
    again = Surface(two, np.concatenate([triangles, triangles + len(points)])).continued(
        np.r_[wrong, wrong], bone, table
    )
    np.testing.assert_array_equal(again, np.r_[own, own])


@pytest.mark.parametrize("gap", [0.03, None])
def test_a_loop_is_cut_where_its_parts_only_touch(gap):
    n = 60
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)
    circle = np.column_stack([np.cos(turn), 0 * turn, np.sin(turn)])
    edges = np.sort(np.column_stack([np.arange(n), (np.arange(n) + 1) % n]), axis=1)
    edges = edges[np.lexsort(edges.T[::-1])]
    radii = np.full(n, 0.12)
    radii[40] = 0.05
    ring = Skeleton(circle, edges, radii, (), (), ())
    around = np.linspace(gap or 0, 2 * np.pi - (gap or 0), 200) + turn[20]
    points, triangles = tube(np.column_stack([np.cos(around), 0 * around, np.sin(around)]), 0.12)
    points = points.round(9)  # the seam of the closed one has the same places twice
    surface = Surface(points, triangles)
    opened = without_loops(ring, points, surface, cut=False)
    assert opened.n_loops == (0 if gap else 1)
    (lost,) = set(map(tuple, ring.edges.tolist())) - set(
        map(tuple, without_loops(ring, points, surface, True).edges.tolist())
    )
    assert set(lost) <= ({18, 19, 20, 21, 22} if gap else {39, 40, 41})
    assert len(as_forest(opened, True, None).edges) == n - 1


def test_a_surface_joins_points_in_one_place():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)  # as STL has them
    surface = Surface(corners, np.array([[0, 1, 2], [3, 4, 5]]))
    distance = surface.distances(np.arange(6) == 0)
    np.testing.assert_allclose(distance, [0, 1, 1, 1, 1, 2])
    assert np.isinf(surface.distances(np.arange(6) == 0, 1.5)[5])
