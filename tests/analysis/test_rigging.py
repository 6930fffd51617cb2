"""Armatures of known curves, and the weights of the points around them."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis.rigging import armature, bone_before
from glsk_o3d.analysis.segmentation import vertex_of_cloud
from glsk_o3d.analysis.skinning import MOST_WEIGHTS, skin_weights
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.formats.graphs import as_forest


def bare(nodes, edges, radii):
    return as_forest(Skeleton(nodes, edges, radii, (), (), ()), True, None)


def figure(rise=0.0, pieces=20):
    """A trunk of radius 0.2 along z; two arms of radius 0.05 leave it, one so much higher than the other."""
    arm = np.linspace(0, 1, pieces + 1)[1:]
    trunk = [[0, 0, z] for z in (0, 0.5, 1, 1 + rise, 1.5)]
    arms = [[side * x, 0, 1 + up] for side, up in ((-1, 0), (1, rise)) for x in arm]
    nodes = np.array([*trunk, *arms])
    chain = np.arange(pieces - 1)
    edges = [(0, 1), (1, 2), (2, 3), (3, 4), (2, 5), (3, 5 + pieces)]
    edges += [(5 + first + i, 6 + first + i) for first in (0, pieces) for i in chain]
    return nodes, edges, [0.2] * 5 + [0.05] * 2 * pieces


@pytest.mark.parametrize("rise", [0.05, 0.15])
@pytest.mark.parametrize("pieces", [1, 20])
def test_limbs_begin_at_one_joint_and_leave_its_ball_at_one_height(rise, pieces):
    bones = armature(bare(*figure(rise, pieces)))
    (joint,) = bones.junctions
    assert bones.degree[joint] == 4
    np.testing.assert_allclose(bones.vertices[joint, :2], 0, atol=1e-12)
    beside = bones.edges[(bones.edges == joint).any(axis=1)].sum(axis=1) - joint
    shoulders = beside[np.abs(bones.vertices[beside, 0]) > 0.05]
    far = np.linalg.norm(bones.vertices[shoulders] - bones.vertices[joint], axis=1)
    assert len(shoulders) == 2
    np.testing.assert_allclose(far, 0.2, atol=1e-9)
    assert np.ptp(np.abs(bones.vertices[shoulders, 0])) < 0.1


def test_junctions_farther_apart_than_a_radius_stay():
    assert len(armature(bare(*figure(0.25))).junctions) == 2


def test_joints_are_no_nearer_than_the_radius_there():
    forest = bare(*figure(0.1, 200))
    bones = armature(forest)
    inner = bones.degree[bones.edges].min(axis=1) == 2
    least = bones.radii[bones.edges].min(axis=1)
    assert (bones.edge_lengths[inner] >= least[inner] - 1e-9).all()
    assert len(bones.edges) < len(forest.edges) / 4
    np.testing.assert_array_equal(bones.vertices[0], forest.vertices[0])
    assert (bone_before(bones) < np.arange(len(bones.edges))).all()


def test_without_radii_all_vertices_are_joints(tree):
    forest = as_forest(Skeleton(tree.vertices, tree.edges, np.full(6, np.nan), (), (), ()), True, None)
    bones = armature(forest)
    np.testing.assert_allclose(sorted(bones.vertices.tolist()), sorted(forest.vertices.tolist()))
    assert bones.length == pytest.approx(forest.length)


def dense_weights(bones, points):
    which, weights = skin_weights(bones, points, vertex_of_cloud(bones, points)[1])
    assert which.shape == weights.shape == (len(points), MOST_WEIGHTS)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    dense = np.zeros((len(points), len(bones.edges)))
    np.add.at(dense, (np.arange(len(points))[:, None], which), weights)
    return dense


def test_on_a_tube_bones_share_what_is_around_the_joint():
    bones = bare([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)], [0.2] * 3)
    x = np.linspace(0.5, 1.5, 1001)
    first, second = dense_weights(bones, np.column_stack([x, 0 * x, 0 * x + 0.2])).T
    less = np.clip(1 - ((x - 1) / 0.3) ** 2, 0, 1) ** 2  # of the farther bone, before both are made to sum to 1
    np.testing.assert_allclose(first, np.where(x < 1, 1, less) / (1 + less), atol=1e-9)
    np.testing.assert_allclose(second, first[::-1], atol=1e-9)


def test_weights_go_over_from_bone_to_bone_also_at_creases():
    sample = samples.y_junction(40000)
    bones = armature(bare(sample.nodes, sample.edges, sample.radii))
    dense = dense_weights(bones, sample.points)
    first, second = cKDTree(sample.points).query_pairs(0.05 * sample.radii.min(), output_type="ndarray").T
    assert len(first) > 10000
    assert np.abs(dense[first] - dense[second]).max() < 0.15
    assert (np.count_nonzero(dense, axis=1) > 1).mean() > 0.05


def test_a_bone_without_points_of_its_own_still_moves_what_is_nearest_to_it():
    """Bones may be shorter than the mesh is fine: then no distance along the surface is known."""

    class Coarse:
        def continued(self, vertex, *_):
            return vertex

        def distances(self, own, limit):
            return np.full(len(own), np.inf)

    bones = bare([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)], [0.2] * 3)
    points = np.array([[0.4, 0.2, 0], [1.6, 0.2, 0]])
    vertex = vertex_of_cloud(bones, points)[1]
    for values, others in zip(
        skin_weights(bones, points, vertex, Coarse()), skin_weights(bones, points, vertex), strict=True
    ):
        np.testing.assert_array_equal(values, others)


def test_behind_a_joint_a_bone_that_points_away_moves_less():
    bones = bare([[-1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 1]], [(0, 1), (1, 2), (1, 3)], [0.2] * 4)
    dense = dense_weights(bones, np.array([[0, 0, -0.2], [0, 0.2, 0]]))
    limb = np.flatnonzero(bones.vertices[bones.edges].max(axis=1)[:, 2] > 0)
    behind, beside = dense[:, limb].ravel()
    share = (1 - 0.2**2 / (2 * 1.5**2 * 0.2**2)) ** 2  # 0.2 from its end, and as much beyond it, which counts twice
    assert beside == pytest.approx(1 / 3)
    assert behind == pytest.approx(share / (2 + share))
    assert behind < 0.3


def test_a_number_of_joints_goes_to_ends_junctions_bends_and_long_bones():
    arm = [[x, 0, 0] for x in range(1, 11)] + [[10, y, 0] for y in range(1, 7)]  # an elbow at x = 10
    others = [[0, 0, z] for z in range(1, 13)], [[-x, 0, 0] for x in range(1, 3)]
    nodes = np.array([[0, 0, 0], *arm, *others[0], *others[1]], float)
    edges = [(i, i + 1) for i in range(len(nodes) - 1) if i not in (16, 28)] + [(0, 17), (0, 29)]
    forest = bare(nodes, edges, np.full(len(nodes), 0.1))
    first = np.array([[0, 0, 0], [10, 6, 0], [0, 0, 12], [-2, 0, 0]])
    for joints, more in ((3, []), (4, [[10, 0, 0]]), (6, [[10, 0, 0], [0, 0, 6], [5, 0, 0]])):
        bones = armature(forest, joints)
        assert len(bones.edges) == joints
        assert sorted(bones.vertices.tolist()) == sorted([*first.tolist(), *more])
        assert bones.vertices[0].tolist() == forest.vertices[0].tolist()
    assert len(armature(forest, 1000).vertices) == len(forest.vertices)
    with pytest.raises(InvalidParameterError, match=r"joints = 2.*has 3 bones"):
        armature(forest, 2)
