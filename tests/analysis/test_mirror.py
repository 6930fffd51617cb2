"""The plane of symmetry, joints that are mirror images, and the names of limbs."""

import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis.limb_names import axes_of_body, bone_names
from glsk_o3d.analysis.mirror import Plane, mirror_plane, mirrored_branches
from glsk_o3d.analysis.rigging import armature
from glsk_o3d.io.formats.graphs import as_forest


def limbs(name):
    """Curves of the limbs: an animal's trunk goes along x, a person's along z."""
    if name == "animal":
        trunk = [[x, 0, 1.0] for x in np.linspace(-0.8, 0.8, 9)]
        head = [trunk[-1], [1.1, 0, 1.4], [1.3, 0, 1.8], [1.6, 0, 1.8]]
        legs = [[[x, 0, 1], [x, y, 0.9], [x + 0.1, y, 0.5], [x, y, 0]] for x in (-0.8, 0.8) for y in (-0.3, 0.3)]
        return [trunk, head, [trunk[0], [-1.3, 0, 1.2], [-1.7, 0, 1]], *legs]
    trunk = [[0, 0, z] for z in np.linspace(1, 1.5, 6)]
    limbs = [trunk, [trunk[-1], [0, 0, 1.7], [0, 0, 1.9]]]
    for s in (-1, 1):
        foot = [s * 0.2, -0.05, 0.5], [s * 0.2, 0, 0.05], [s * 0.2, -0.2, 0]
        limbs.append([trunk[0], [s * 0.15, 0, 0.9], *foot])
        limbs.append([trunk[-1], [s * 0.2, 0, 1.5], [s * 0.5, 0, 1.4], [s * 0.9, -0.1, 1.4]])
    return limbs


def body(name, noise=0.0, more=()):
    """A tree of limbs, rooted in the trunk, with a cloud around its curve."""
    curves = [np.array(limb, float) for limb in (*limbs(name), *more)]
    pieces = [np.linspace(*ends, 5) for curve in curves for ends in itertools.pairwise(curve)]
    vertices, inverse = np.unique(np.concatenate(pieces).round(9), axis=0, return_inverse=True)
    edges = [pair for piece in inverse.reshape(-1, 5) for pair in itertools.pairwise(piece)]
    rng = np.random.default_rng(5)
    vertex = np.repeat(np.arange(len(vertices)), 20)
    points = vertices[vertex] + 0.05 * rng.normal(size=(len(vertex), 3))
    radii = np.where(cKDTree(curves[0]).query(vertices)[0] < 0.1, 0.12, 0.05)
    vertices = vertices + noise * rng.normal(size=vertices.shape)
    skeleton = Skeleton(vertices, np.sort(edges, axis=1), radii, vertex, points, np.zeros_like(points))
    return as_forest(skeleton, True, curves[0].mean(axis=0))


@pytest.mark.parametrize("seed", range(3))
def test_the_plane_of_a_mirrored_cloud(seed):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(800, 3)) * [1, 0.4, 0.7] + [0.5, 0.5, 0] + np.abs(rng.normal(size=(800, 1)))
    turn = Rotation.random(random_state=seed)
    cloud = turn.apply(np.concatenate([half, half * [1, -1, 1]])) + [30, -20, 10]
    plane = mirror_plane(np.concatenate([cloud, [[np.nan, 0, 0]]]))
    assert abs(plane.normal @ turn.apply([0, 1, 0])) > np.cos(np.radians(1))
    middle = np.array([[30.0, -20, 10]])
    np.testing.assert_allclose(plane.mirrored(middle), middle, atol=0.1)
    np.testing.assert_allclose(plane.mirrored(plane.mirrored(cloud)), cloud, atol=1e-9)


@pytest.mark.parametrize(("name", "joints"), [("animal", None), ("animal", 31), ("person", None), ("person", 20)])
def test_joints_of_a_symmetric_rig_are_mirror_images(name, joints):
    forest = body(name, noise=0.01)
    plane = mirror_plane(forest.points)
    bones = armature(forest, joints, plane)
    gap, partner = cKDTree(bones.vertices).query(plane.mirrored(bones.vertices))
    np.testing.assert_allclose(gap, 0, atol=1e-9)
    np.testing.assert_array_equal(partner[partner], np.arange(len(partner)))
    assert (partner != np.arange(len(partner))).sum() > 12
    assert (mirrored_branches(bones, plane) >= 0).all()
    assert joints is None or len(bones.edges) in (joints - 1, joints)
    sides = [bone.rpartition("_")[2] for bone in bone_names(bones, plane, sides=True)]
    assert sides.count("left") == sides.count("right") > 5
    assert cKDTree(forest.vertices).query(bones.vertices)[0].max() < 0.12


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("name", ["animal", "person"])
def test_limbs_have_names(name, up):
    forest = body(name)
    if up == "y":
        turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
        forest = forest.changed(vertices=forest.vertices @ turn.T, points=forest.points @ turn.T)
    bones = armature(forest)
    names = bone_names(bones, mirror_plane(forest.points), up)
    assert len(set(names)) == len(names) == len(bones.edges)
    middles = bones.vertices[bones.edges].mean(axis=1) @ (turn if up == "y" else np.eye(3))

    def middle(part):
        rows = [i for i, bone in enumerate(names) if bone.split(".")[0] + bone[len(bone.split(".")[0]) + 4 :] == part]
        return middles[rows].mean(axis=0)

    if name == "animal":
        assert middle("head")[0] > middle("neck")[0] > middle("spine")[0] > middle("tail")[0]
        limb, low, (first, second) = "front_leg", "hind_leg", (0, 1)
        assert middle("front_leg_left")[0] > 0.5
    else:
        assert middle("head")[2] > middle("neck")[2] > middle("spine")[2] > middle("leg_left")[2]
        limb, low, (first, second) = "arm", "leg", (1, 0)
    for kind in (limb, low):  # ahead is x of the animal, and -y of the person
        side = middle(f"{kind}_left") - middle(f"{kind}_right")
        assert side[second] > 0.2
        assert abs(side[first]) < 0.1


def prongs(end, back, n, length):
    """So many curves from the end of a limb, spread over the half circle ahead of it; one is shorter by a third."""
    ahead = np.subtract(end, back) / np.linalg.norm(np.subtract(end, back))
    aside = np.array([0, 1.0, 0]) if abs(ahead[1]) < 0.9 else np.array([1.0, 0, 0])
    aside = aside - aside @ ahead * ahead
    for k, turn in enumerate(np.linspace(-0.9, 0.9, n)):
        way = np.cos(turn) * ahead + np.sin(turn) * aside / np.linalg.norm(aside)
        yield [end, end + length * (2 / 3 if k == 0 else 1) * way]


@pytest.mark.parametrize("joints", [None, 55])
@pytest.mark.parametrize("toes", [0, 3])
@pytest.mark.parametrize("fingers", [(2, 2), (3, 3), (4, 4), (5, 5), (5, 2), (0, 4)])
def test_fingers_and_toes_belong_to_their_limb(fingers, toes, joints):
    curves, more = limbs("person"), []
    for side, n in zip((3, 5), fingers, strict=True):
        more += prongs(curves[side][-1], curves[side][-2], n, 0.12)
        more += prongs(curves[side - 1][-1], curves[side - 1][-2], toes, 0.06)
    forest = body("person", more=more)
    bones = armature(forest, joints)
    plane = Plane(np.zeros(3), np.array([1.0, 0, 0]))
    names = bone_names(bones, plane)
    assert "z" in axes_of_body(bones, plane)
    assert {"head", "arm", "leg"} <= {each.split(".")[0] for each in names} <= {"head", "neck", "spine", "arm", "leg"}
    assert len(set(names)) == len(names)
    x, z = bones.vertices[bones.edges[:, 1]][:, [0, 2]].T
    for where, part, side in ((x > 0.5, "arm", "left"), (x < -0.5, "arm", "right")):
        assert {(name[:4], name.partition("_")[2]) for name in np.array(names)[where]} == {(f"{part}.", side)}
    assert all(name.startswith("leg.") for name in np.array(names)[z < 0.8])


def test_what_is_no_body_has_numbers():
    animal, plant = body("animal"), samples.tree(500, forks=2)
    feet_up = animal.changed(vertices=animal.vertices * [1, 1, -1])
    assert "-z" in axes_of_body(armature(feet_up), mirror_plane(feet_up.vertices))
    for forest in (feet_up, as_forest(Skeleton(plant.nodes, plant.edges, plant.radii, (), (), ()), True, None)):
        names = bone_names(armature(forest), mirror_plane(forest.vertices))
        assert all(name.startswith("branch_") and name[-4] == "." for name in names)
