"""Junctions lie where the axes of straight limbs meet, and nothing else is left of a corner."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton
from glsk_o3d.numerics.polylines import arc_lengths
from glsk_o3d.refinement.junctions import Limbs, level_tips, move_junctions
from glsk_o3d.refinement.reattachment import reattach_limbs
from glsk_o3d.refinement.scores import LIMB_WEIGHTS, probability
from glsk_o3d.refinement.spurs import prune_spurs

R = 0.1


def pruned(skeleton, reach):
    """Without the branches that reach less far."""
    return prune_spurs(skeleton, probability(LIMB_WEIGHTS, {"reach": np.log(reach + 0.1)}))[0]


def capsules(ends, per=3000):
    """Points on the surface of struts of radius R with round ends, but not inside another, (N, 3)."""
    rng, points = np.random.default_rng(0), []
    for a, b in ends:
        a, b = np.array(a, float), np.array(b, float)
        t = rng.uniform(-R, np.linalg.norm(b - a) + R, per)
        way = (b - a) / np.linalg.norm(b - a)
        foot = np.clip(t, 0, np.linalg.norm(b - a))
        side = np.cross(way, rng.normal(size=(per, 3)))
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        along = t - foot
        points.append(a + t[:, None] * way + np.sqrt(R**2 - along**2)[:, None] * side)
    points = np.concatenate(points)
    for a, b in ends:
        a, way = np.array(a, float), np.subtract(b, a)
        t = np.clip((points - a) @ way / (way @ way), 0, 1)
        points = points[np.linalg.norm(a + t[:, None] * way - points, axis=1) > R * (1 - 1e-6)]
    return points


def drawn(paths, struts):
    """A skeleton of polylines whose ends at equal places are one vertex; points belong to the nearest vertex."""
    vertices, edges, places = [], [], {}
    for path in paths:
        along = arc_lengths(np.array(path, float))
        steps = np.linspace(0, along[-1], max(int(along[-1] / (R / 2)), 2) + 1)
        numbers = []
        for place in np.column_stack([np.interp(steps, along, x) for x in np.array(path, float).T]):
            key = tuple(place.round(9))
            if key not in places:
                places[key] = len(vertices)
                vertices.append(place)
            numbers.append(places[key])
        edges += [sorted(pair) for pair in pairwise(numbers)]
    points = capsules(struts)
    owner = cKDTree(vertices).query(points)[1]
    m = len(vertices)
    return Skeleton(vertices, sorted(edges), np.full(m, R), owner, points, np.ones_like(points), confidence=np.ones(m))


def towards(angle, length=1.0):
    return length * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0])


def webbed(angles):
    """Limbs from the origin whose curves join half-way to where the sharpest corner's tubes part, on the x axis."""
    turned = np.sort(np.mod(angles, 360))
    sharpest = np.diff(turned, append=turned[0] + 360).min()
    apart = R / np.sin(np.radians(sharpest / 2))
    meet = np.array([apart / 2, 0, 0])
    struts = [((0, 0, 0), towards(angle)) for angle in angles]
    return [[meet, towards(angle, apart), towards(angle)] for angle in angles], struts, meet


@pytest.mark.parametrize("half", [20, 30, 45])
def test_a_sharp_corner_has_no_spur(half):
    """Two struts that meet in a V: the spur into its tip goes, and what is left is one path."""
    paths, struts, meet = webbed([-half, half])
    raw = drawn([*paths, [meet, [-R / 2, 0, 0]]], struts)
    assert len(raw.leaves) == 3
    skeleton = pruned(raw, 1.5)
    assert (len(skeleton.leaves), len(skeleton.junctions), skeleton.n_components) == (2, 0, 1)


@pytest.mark.parametrize("angles", [[-30, 30, 180], [-40, 40, 0], [0, 90, 180], [45, 135, 225, 315]])
def test_junctions_move_to_where_the_axes_meet(angles):
    """Y, three struts in a fan, T and four in a plane."""
    paths, struts, meet = webbed(angles)
    raw = drawn(paths, struts)
    skeleton = move_junctions(pruned(raw, 1.5))
    assert len(skeleton.junctions) == 1
    assert len(skeleton.leaves) == len(angles)
    place = skeleton.vertices[skeleton.junctions[0]]
    assert np.linalg.norm(place) < 0.3 * R < np.linalg.norm(meet)
    # and the limbs are straight from there on
    ways = np.array([towards(angle) for angle in angles])
    along = np.clip(skeleton.vertices @ ways.T, 0, None)
    off = np.linalg.norm(skeleton.vertices[:, None] - along[:, :, None] * ways, axis=2).min(axis=1)
    assert off.max() < 0.3 * R


def test_a_straight_line_keeps_its_side_branches():
    """Also one hardly longer than the tube is thick: it reaches 2.5 radii, 1.5 out of the tube."""
    struts = [((-1, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 1, 0)), ((0.5, 0, 0), (0.5, 2.5 * R, 0))]
    places = [(-1, 0, 0), (0, 0, 0), (0.5, 0, 0), (1, 0, 0)]
    paths = [*pairwise(places), *struts[1:]]
    raw = drawn(paths, struts)
    skeleton = pruned(raw, 1.5)
    assert skeleton is raw
    moved = move_junctions(skeleton)
    np.testing.assert_allclose(moved.vertices, raw.vertices, atol=0.1 * R)
    np.testing.assert_array_equal(moved.edges, raw.edges)


@pytest.mark.parametrize(("apart", "junctions"), [(1.0, 1), (4.0, 2)])
def test_junctions_of_one_corner_become_one(apart, junctions):
    """Three limbs that the contraction joins at two places; of two that are apart each stays."""
    a, b = np.array([-apart * R / 2, 0, 0]), np.array([apart * R / 2, 0, 0])
    ends = [towards(120), towards(240), towards(0), towards(90)]
    root = [a, a, b, b] if apart > 2 else [np.zeros(3)] * 4
    struts = [(r, r + end) for r, end in zip(root, ends, strict=True)] + [(a, b)]
    paths = [[start, r + 3 * R * end, r + end] for start, r, end in zip([a, a, b, b], root, ends, strict=True)]
    skeleton = move_junctions(pruned(drawn([*paths, [a, b]], struts), 1.5))
    assert len(skeleton.junctions) == junctions
    assert len(skeleton.leaves) == 4


def test_limbs_that_pass_each_other_do_not_move_their_junction():
    paths = [[(0, 0, 0), (0.3, 0, 3 * R * s), (1, 0, 3 * R * s)] for s in (-1, 1)] + [[(0, 0, 0), (-1, 0, 0)]]
    raw = drawn(paths, [tuple(path[1:]) for path in paths[:2]] + [tuple(paths[2])])
    np.testing.assert_allclose(move_junctions(raw).vertices, raw.vertices, atol=1e-12)


def test_axes_that_meet_outside_of_the_cloud_do_not_move_their_junction():
    """Three limbs of a fan that ends before its ribs meet."""
    ways = [towards(180 + angle) for angle in (-20, 0, 20)]
    meet = np.array([3.5 * R, 0, 0])
    raw = drawn(
        [[(0, 0, 0), meet + 0.38 * way, meet + way] for way in ways], [(meet + 0.5 * w, meet + w) for w in ways]
    )
    limbs = Limbs(raw, joined=False)
    meeting = limbs.meeting(limbs.at[raw.junctions[0]], np.zeros(3))
    assert (meeting.fits & meeting.ahead).all()
    assert meeting.place[0] > 2 * R > 2 * R + raw.points[:, 0].max()
    np.testing.assert_array_equal(move_junctions(raw).vertices, raw.vertices)


def test_a_junction_is_as_thick_as_its_thickest_limb():
    """A right-angled junction owns points of everything around: what it measured itself does not count."""
    paths, struts, _ = webbed([0, 90, 180])
    raw = drawn(paths, struts)
    raw.radii[:] = np.where(raw.vertices[:, 1] > 2 * R, 0.05, 0.1)
    raw.radii[raw.junctions] = 0.7
    skeleton = move_junctions(raw)
    assert skeleton.radii[skeleton.junctions].tolist() == pytest.approx([0.1])
    assert skeleton.radii.max() == pytest.approx(0.1)


def test_a_limb_beside_another_begins_where_it_leaves_it():
    """It grows from the middle of a strut, but its curve runs 5 radii along inside it."""
    struts = [((-1, 0, 0), (1, 0, 0)), ((0.5, 0, 0), (0.5, 1, 0))]
    aside = [(0, 0, 0), (0.05, R / 2, 0), (0.5, R / 2, 0), (0.5, 1, 0)]
    raw = drawn([[(-1, 0, 0), (0, 0, 0)], [(0, 0, 0), (1, 0, 0)], aside], struts)
    np.testing.assert_allclose(raw.vertices[raw.junctions], [[0, 0, 0]], atol=1e-12)
    skeleton = move_junctions(pruned(reattach_limbs(raw), 1.5))
    assert (len(skeleton.leaves), skeleton.n_components, skeleton.n_loops) == (3, 1, 0)
    np.testing.assert_allclose(skeleton.vertices[skeleton.junctions], [[0.5, 0, 0]], atol=0.5 * R)
    assert skeleton.length == pytest.approx(3, abs=R)
    assert len(skeleton.vertex_of_point) == len(raw.points)
    assert (skeleton.vertex_of_point >= 0).all()


def test_a_plain_branch_is_not_reattached():
    paths, struts, _ = webbed([-20, 20, 180])
    raw = drawn(paths, struts)
    assert reattach_limbs(raw) is raw


def test_graphs_without_junctions_stay():
    raw = drawn([[(0, 0, 0), (1, 0, 0)]], [((0, 0, 0), (1, 0, 0))])
    assert reattach_limbs(raw) is raw
    np.testing.assert_array_equal(move_junctions(raw).vertices, raw.vertices)
    none = Skeleton([[0, 0, 0]], [], [1], [0], [[0, 0, 1]], [[0, 0, 1]])
    assert Limbs(none, joined=True).paths == []
    assert pruned(none, 1.5) is none


def test_tips_are_as_thick_as_their_branch():
    """A cone from 0.1 to 0.2 whose leaves measured nonsense, one radius back on either side."""
    raw = drawn([[(0, 0, 0), (1, 0, 0)]], [((0, 0, 0), (1, 0, 0))])
    raw.radii[:] = 0.1 + 0.1 * raw.vertices[:, 0]
    raw.radii[raw.leaves] = [0.7, 0.01]
    found = level_tips(raw).radii
    np.testing.assert_allclose(found[raw.leaves], [0.115, 0.185], atol=1e-3)
    inner = np.setdiff1d(np.arange(len(found)), raw.leaves)
    np.testing.assert_array_equal(found[inner], raw.radii[inner])
