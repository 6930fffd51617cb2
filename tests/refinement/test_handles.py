"""Handles: their curves keep to their axes up to the wall of the body, and go straight on to its middle."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import skeletonize
from glsk_o3d.refinement.handles import Handles
from glsk_o3d.samples.capsules import union_sample

BODY, HANDLE, REACH = 0.4, 0.06, 0.28
TURN = np.linspace(-np.pi / 2, np.pi / 2, 17)


def bow(side=1):
    """The axis of a handle, from one place to another inside a body along z."""
    return np.column_stack([side * (0.38 + REACH * np.cos(TURN)), 0 * TURN, REACH * np.sin(TURN)])


def pot(sides, seed=0):
    """Points of a body with handles on some sides, and no other ends."""
    nodes, edges, radii = [np.array([[0, 0, -0.35], [0, 0, 0.35]])], [np.array([[0, 1]])], [[BODY, BODY]]
    for side in sides:
        k = sum(map(len, nodes)) + np.arange(len(TURN))
        nodes.append(bow(side))
        edges.append(np.column_stack([k[:-1], k[1:]]))
        radii.append([HANDLE] * len(k))
    made = (np.concatenate(each) for each in (nodes, edges, radii))
    return union_sample("pot", *made, 4096, 0.0, seed).points


def off_axis(skeleton, side):
    """Distance of places on a handle's axis outside of the body from the skeleton, in radii."""
    axis = bow(side)
    axis = axis[np.abs(axis[:, 0]) > BODY + HANDLE]
    a, b = skeleton.vertices[skeleton.edges].transpose(1, 0, 2)
    share = np.linspace(0, 1, 40)[:, None, None]
    curve = ((1 - share) * a + share * b).reshape(-1, 3)
    return cKDTree(curve).query(axis)[0] / HANDLE


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
@pytest.mark.parametrize("sides", [(1,), (1, -1)])
@pytest.mark.parametrize("seed", [0, 1])
def test_handles_keep_to_their_axes_up_to_the_wall(sides, seed):
    skeleton = skeletonize(pot(sides, seed=seed))
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, len(sides), 0)
    assert max(off_axis(skeleton, side).max() for side in sides) < 0.5


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_a_handle_goes_through_the_middle_of_its_body():
    """Without a junction there; the points of the body belong to it, and its radius is that of the body."""
    skeleton = skeletonize(pot([1]))
    middle = np.linalg.norm(skeleton.vertices, axis=1).argmin()
    assert np.linalg.norm(skeleton.vertices[middle]) < 0.2 * BODY
    assert skeleton.degree[middle] == 2
    assert 0.8 * BODY < skeleton.radii[middle] < 1.2 * BODY
    of_body = skeleton.points[:, 0] < 0
    inside = np.linalg.norm(skeleton.vertices[:, :2], axis=1) < BODY
    assert inside[skeleton.vertex_of_point[of_body]].mean() > 0.99


@pytest.mark.parametrize("thick", [0.06, 0.3])
def test_only_a_thick_body_has_handles(thick):
    """A ring of which one side is no, or hardly, thicker than the other is a ring."""
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    nodes = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    edges = np.column_stack([np.arange(64), np.roll(np.arange(64), -1)])
    radii = np.interp(np.abs(np.pi - turn), [0, np.pi], [min(thick, 0.15), 0.06])
    skeleton = skeletonize(union_sample("ring", nodes, edges, radii, 4096, 0.0, 0).points)
    assert not len(Handles(skeleton).bodies)
    assert cKDTree(nodes).query(skeleton.vertices)[0].max() < 0.1
