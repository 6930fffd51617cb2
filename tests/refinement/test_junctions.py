"""Junctions lie where the axes of straight limbs meet, and nothing else is left of a corner."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from glsk_o3d.refinement.scores import LIMB_WEIGHTS, probability
from scipy.spatial import cKDTree

from glsk_o3d import Refiner, Skeleton
from glsk_o3d.numerics.polylines import arc_lengths
from glsk_o3d.refinement.evidence import Evidence
from glsk_o3d.refinement.junctions import Line, _Place, _straightened, limb_line, meet, move_junctions
from glsk_o3d.refinement.limbs import Limbs
from glsk_o3d.refinement.spurs import prune_spurs

R = 0.1


def pruned(skeleton, reach):
    """Without the branches that reach less far in tubes, even of those that hang together with no others."""
    least = probability(
        LIMB_WEIGHTS, {"protrusion": np.log(reach - 1 + 0.3), "web": 0.0, "confidence": 0.0, "roundness": 1.0}
    )
    return prune_spurs(skeleton, Evidence.of(skeleton), least)[0]


def capsules(ends, per=3000):
    """Points on the surface of struts of radius R with round ends, but not inside another, and normals, (N, 3) each."""
    rng, points, normals = np.random.default_rng(0), [], []
    for a, b in ends:
        a, b = np.array(a, float), np.array(b, float)
        t = rng.uniform(-R, np.linalg.norm(b - a) + R, per)
        way = (b - a) / np.linalg.norm(b - a)
        foot = np.clip(t, 0, np.linalg.norm(b - a))
        side = np.cross(way, rng.normal(size=(per, 3)))
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        along = t - foot
        out = along[:, None] * way + np.sqrt(R**2 - along**2)[:, None] * side
        points.append(a + foot[:, None] * way + out)
        normals.append(out / R)
    points, normals = np.concatenate(points), np.concatenate(normals)
    for a, b in ends:
        a, way = np.array(a, float), np.subtract(b, a)
        t = np.clip((points - a) @ way / (way @ way), 0, 1)
        outside = np.linalg.norm(a + t[:, None] * way - points, axis=1) > R * (1 - 1e-6)
        points, normals = points[outside], normals[outside]
    return points, normals


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
    points, normals = capsules(struts)
    owner = cKDTree(vertices).query(points)[1]
    m = len(vertices)
    return Skeleton(vertices, sorted(edges), np.full(m, R), owner, points, normals, confidence=np.ones(m))


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
    skeleton = prune_spurs(raw, Evidence.of(raw), Refiner().limb)[0]
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
    assert len(skeleton.vertices) == len(raw.vertices)
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


def test_limbs_that_pass_each_other_hardly_move_their_junction():
    paths = [[(0, 0, 0), (0.3, 0, 3 * R * s), (1, 0, 3 * R * s)] for s in (-1, 1)] + [[(0, 0, 0), (-1, 0, 0)]]
    raw = drawn(paths, [tuple(path[1:]) for path in paths[:2]] + [tuple(paths[2])])
    np.testing.assert_allclose(move_junctions(raw).vertices, raw.vertices, atol=0.1 * R)


def test_axes_that_meet_outside_of_the_cloud_hardly_move_their_junction():
    """Three limbs of a fan that ends before its ribs meet."""
    ways = [towards(180 + angle) for angle in (-20, 0, 20)]
    meet = np.array([3.5 * R, 0, 0])
    raw = drawn(
        [[(0, 0, 0), meet + 0.38 * way, meet + way] for way in ways], [(meet + 0.5 * w, meet + w) for w in ways]
    )
    limbs = Limbs(raw, joined=False)
    _, foot, fits = limbs.meeting(limbs.at[raw.junctions[0]], np.zeros(3))
    assert fits.all()
    assert (foot[:, 0] > 2 * R).all()
    assert raw.points[:, 0].max() < 0
    np.testing.assert_allclose(move_junctions(raw).vertices, raw.vertices, atol=R)


def test_a_junction_is_as_thick_as_its_thickest_limb():
    """A right-angled junction owns points of everything around: what it measured itself does not count."""
    paths, struts, _ = webbed([0, 90, 180])
    raw = drawn(paths, struts)
    raw.radii[:] = np.where(raw.vertices[:, 1] > 2 * R, 0.05, 0.1)
    raw.radii[raw.junctions] = 0.7
    skeleton = move_junctions(raw)
    assert skeleton.radii[skeleton.junctions].tolist() == pytest.approx([0.1])
    assert skeleton.radii.max() == pytest.approx(0.1)


def test_graphs_without_junctions_stay():
    raw = drawn([[(0, 0, 0), (1, 0, 0)]], [((0, 0, 0), (1, 0, 0))])
    np.testing.assert_array_equal(move_junctions(raw).vertices, raw.vertices)
    assert len(pruned(raw, 1.5).vertices) == len(raw.vertices)
    none = Skeleton([[0, 0, 0]], [], [1], [0], [[0, 0, 1]], [[0, 0, 1]])
    assert Limbs(none, joined=True).paths == []
    np.testing.assert_array_equal(move_junctions(none).vertices, none.vertices)


@pytest.mark.parametrize("angles", [[0, 90, 180], [90, 210, 330], [45, 135, 225, 315], [0, 90, 180, 270]])
def test_t_y_x_and_plus_meet_in_their_centres(angles):
    """Wherever the contraction left the junction."""
    paths, struts, _ = webbed(angles)
    for shift in ([0, 0, 0], [0.5 * R, 0, 0], [0, -0.5 * R, 0.5 * R]):
        raw = drawn([[meet + shift, *rest] for meet, *rest in paths], struts)
        skeleton = move_junctions(raw)
        assert len(skeleton.junctions) == 1
        assert np.linalg.norm(skeleton.vertices[skeleton.junctions[0]]) < 0.15 * R


def quadruped(bent=0.0, apart=0.0):
    """A trunk along x with a pair of legs at either end.

    Those in front are `apart`, and the contraction has put their junctions farther from each other by `bent`.
    """
    back, front, shift = np.array([-0.5, 0, 0]), np.array([0.5, 0, 0]), np.array([0.5, 0, 0])
    hips = [back, back, front - apart * shift, front + apart * shift]
    feet = [hip + [0, y, -0.8] for hip, y in zip(hips, [-0.4, 0.4, -0.4, 0.4], strict=True)]
    roots = [back, back, hips[2] - bent * shift, hips[3] + bent * shift]
    struts = [((-1, 0, 0), (1, 0, 0)), *zip(hips, feet, strict=True)]
    ends = [(-1, 0, 0), back, *roots[2:], (1, 0, 0)]
    paths = [pair for pair in pairwise(ends) if not np.array_equal(*pair)]
    paths += [(r, h + 0.2 * (f - h), f) for r, h, f in zip(roots, hips, feet, strict=True)]
    return drawn(paths, struts)


def test_limbs_that_meet_a_trunk_within_a_radius_share_a_junction():
    """Two legs whose junctions are .8 radii apart, in either order of the branches."""
    raw = quadruped(bent=0.8 * R)
    assert len(raw.junctions) == 3
    skeleton = move_junctions(raw)
    assert (len(skeleton.junctions), len(skeleton.leaves), skeleton.n_components, skeleton.n_loops) == (2, 6, 1, 0)
    found = skeleton.vertices[skeleton.junctions]
    np.testing.assert_allclose(found[np.argsort(found[:, 0])], [[-0.5, 0, 0], [0.5, 0, 0]], atol=0.15 * R)
    assert np.isin(skeleton.vertex_of_point, np.arange(len(skeleton.vertices))).all()
    assert len(skeleton.radii) == len(skeleton.confidence) == len(skeleton.vertices)


def test_limbs_that_meet_a_trunk_farther_apart_do_not():
    assert len(move_junctions(quadruped(apart=3 * R)).junctions) == 3


def test_a_symmetric_body_has_a_symmetric_skeleton():
    raw = quadruped(bent=0.8 * R)
    skeleton, image = (move_junctions(it) for it in (raw, replace(
        raw, vertices=raw.vertices * [1, -1, 1], points=raw.points * [1, -1, 1], normals=raw.normals * [1, -1, 1]
    )))  # fmt: skip
    np.testing.assert_allclose(image.vertices, skeleton.vertices * [1, -1, 1], atol=1e-9)
    a, b = skeleton.vertices[skeleton.edges].transpose(1, 0, 2)
    curve = np.concatenate([(1 - t) * a + t * b for t in np.linspace(0, 1, 21)])
    assert cKDTree(curve).query(skeleton.vertices * [1, -1, 1])[0].max() < 0.2 * R


def test_two_limbs_side_by_side_do_not_close_a_loop():
    """A ring no wider than the radius of its limbs keeps both its sides."""
    ring = [((0, 0, 0), (R / 4, s * R, 0), (R / 2, 0, 0)) for s in (-1, 1)]
    tails = [((0, 0, 0), (-1, 0, 0)), ((R / 2, 0, 0), (1, 0, 0))]
    raw = drawn([*ring, *tails], tails)
    assert move_junctions(raw).n_loops == raw.n_loops == 1


def test_junctions_turn_and_grow_with_the_shape(placed):
    raw = quadruped(bent=0.8 * R)
    moved, turn = placed(raw, 3, 7)
    expected, found = move_junctions(raw), move_junctions(moved)
    np.testing.assert_array_equal(found.edges, expected.edges)
    np.testing.assert_allclose(found.vertices, 7 * expected.vertices @ turn, atol=1e-8)
    np.testing.assert_allclose(found.radii, 7 * expected.radii, rtol=1e-9)


def test_junctions_do_not_hang_on_the_order_of_points_and_vertices(renumbered):
    raw = quadruped(bent=0.8 * R)
    rng = np.random.default_rng(5)
    points, name = rng.permutation(len(raw.points)), rng.permutation(len(raw.vertices))
    shuffled = renumbered(raw, name, points)
    expected, found = move_junctions(raw), move_junctions(shuffled)
    apart, which = cKDTree(expected.vertices).query(found.vertices)
    assert apart.max() < 1e-9
    assert len(set(which.tolist())) == len(expected.vertices) == len(found.vertices)


def test_sphere_centres_of_a_ball():
    """Without lines the surface alone says where the middle is."""
    normals = np.random.default_rng(0).normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    place, radius = meet([], np.array([0.3, 0.2, 0]), 1.0, normals, normals)
    assert np.linalg.norm(place) < 0.05
    assert radius == pytest.approx(1, abs=0.02)
    nowhere, same = meet([], np.array([0.3, 0.2, 0]), 1.0, np.empty((0, 3)), np.empty((0, 3)))
    assert (nowhere.tolist(), same) == ([0.3, 0.2, 0], 1.0)


def test_a_limbs_line_is_taken_where_it_has_left_the_others():
    """A limb that bends at 2 radii: its line is the straight part beyond."""
    path = np.array([[0, 0, 0], [R, 0, 0], [R, 10 * R, 0]])
    other = np.array([[-10 * R, 0, 0], [10 * R, 0, 0]])
    vertices, surface = np.concatenate([path, other]), np.full(5, R)
    line = limb_line(vertices, surface, np.arange(3), R, [np.array([3, 4])])
    np.testing.assert_allclose(line.way, [0, -1, 0], atol=1e-9)
    assert line.middle[0] == pytest.approx(R)
    assert line.bend == pytest.approx(0, abs=1e-9)
    assert 2 * R < line.start < 2.5 * R


def test_a_limb_does_not_turn_back_where_its_junction_moved_along_it():
    """Three radii up a trunk, and its undisturbed part begins after one."""
    paths = [[(0, 0, 0), (0, 0, 1)], [(0, 0, 0), (0.4, 0, -0.3)], [(0, 0, 0), (-0.4, 0, -0.3)]]
    skeleton = drawn(paths, paths)
    limbs = Limbs(skeleton, joined=False)
    (junction,) = skeleton.junctions.tolist()
    lines = []
    for limb in limbs.at[junction]:
        path = limbs.vertices[limbs.paths[limb]]
        way = (path[0] - path[-1]) / np.linalg.norm(path[0] - path[-1])
        lines.append(Line(path.mean(axis=0), way, 0.1, 0.0, R, path[0] - R * way, R))
    moved = _straightened(skeleton, limbs, {junction: _Place(np.array([0, 0, 3 * R]), R, lines)})
    trunk = next(branch for branch in moved.branches if moved.vertices[branch, 2].max() == 1)
    height = moved.vertices[trunk, 2]
    assert np.all(np.diff(height if height[0] < height[-1] else height[::-1]) > 0)
    np.testing.assert_allclose(moved.vertices[junction], [0, 0, 3 * R])
