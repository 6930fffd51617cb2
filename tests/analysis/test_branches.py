"""Points by branch, and the table of branches: shapes whose numbers are known."""

import csv
import math
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, Skeleton, annotate, samples, skeletonize
from glsk_o3d.analysis import branch_table, segment
from glsk_o3d.analysis.branches import PRINTED_COLUMNS
from glsk_o3d.analysis.segmentation import vertex_of_cloud

RNG = np.random.default_rng(0)
ANGLES, SHARE = (30.0, 50.0), 0.6


def grow(levels=3, pieces=8):
    """A plane tree: every branch ends in two, 30 degrees to one side and 50 to the other, 0.6 as long and thick."""
    nodes, edges, radii = [np.zeros(2)], [], [0.1]

    def branch(start, heading, length, radius, left):
        here = start
        for i in range(1, pieces + 1):
            nodes.append(nodes[start] + heading * length * i / pieces)
            radii.append(radius)
            edges.append((here, len(nodes) - 1))
            here = len(nodes) - 1
        for turn in np.deg2rad([-ANGLES[0], ANGLES[1]]) if left else ():
            turned = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]] @ heading
            branch(here, turned, SHARE * length, SHARE * radius, left - 1)

    branch(0, np.array([0.0, 1]), 1.0, 0.1, levels)
    vertices = np.insert(np.array(nodes), 1, 0, axis=1)
    return Skeleton(vertices, sorted(edges), radii, (), (), (), confidence=np.full(len(nodes), 0.5))


TREE = grow()


def test_a_tree_with_known_numbers():
    table = branch_table(TREE)
    assert len(table) == 15
    assert np.bincount(table.level).tolist() == [1, 2, 4, 8]
    np.testing.assert_allclose(table.length, SHARE**table.level)
    np.testing.assert_allclose(table.tortuosity, 1)
    np.testing.assert_allclose(table.end_radius, 0.1 * SHARE**table.level)
    np.testing.assert_allclose(table.confidence, 0.5)
    assert set(table.kind[table.level < 3]) == {"inner", "tip"}  # the trunk has a free end
    assert (table.kind[table.level == 3]).tolist() == ["tip"] * 8
    (trunk,) = np.flatnonzero(table.parent < 0)
    assert (table.start[trunk], table.level[trunk]) == (0, 0)
    child = np.flatnonzero(table.parent >= 0)
    np.testing.assert_array_equal(table.start[child], table.end[table.parent[child]])
    np.testing.assert_array_equal(table.level[child], table.level[table.parent[child]] + 1)
    assert math.isnan(table.angle[trunk])
    np.testing.assert_allclose(np.sort(table.angle[child]), np.repeat(ANGLES, 7))
    np.testing.assert_array_equal(table.start_point, TREE.vertices[table.start])
    np.testing.assert_array_equal(table.end_point, TREE.vertices[table.end])


def test_parents_and_angles_follow_the_root():
    tip = TREE.leaves[-1]
    for root in (int(tip), np.int64(tip), TREE.vertices[tip] + 1e-3, tuple(TREE.vertices[tip])):
        table = branch_table(TREE, root)
        assert table.level.max() == 5  # up the trunk's side, and down again to the farthest twigs
        (row,) = np.flatnonzero(table.level == 0)
        assert table.start[row] == tip
        # what was a fork of 30 and 50 degrees is one of 80 between the arms, seen from one of them
        first = table.angle[table.level == 1]
        np.testing.assert_allclose(np.sort(first), sorted([ANGLES[1], 180 - sum(ANGLES)]), atol=1e-6)


def test_a_root_inside_a_branch_and_at_a_junction():
    inside = branch_table(TREE, 3)  # a vertex of the trunk
    assert inside.level.tolist() == branch_table(TREE).level.tolist()
    assert inside.start[inside.level == 0].tolist() == [0]
    fork = branch_table(TREE, 8)
    assert np.flatnonzero(fork.level == 0).tolist() == np.flatnonzero(fork.start == 8).tolist()
    assert (fork.level == 0).sum() == 3
    assert np.isnan(fork.angle[fork.level == 0]).all()


def test_y_junction_from_its_cloud():
    sample = samples.y_junction(2000)
    found = branch_table(skeletonize(sample.points), root=(0, 0, -1))
    assert sorted(found.level.tolist()) == [0, 1, 1]
    np.testing.assert_allclose(found.angle[found.level == 1], 40, atol=4)
    np.testing.assert_allclose(found.length, 0.5, atol=0.1)
    np.testing.assert_allclose(found.mean_radius, np.where(found.level == 0, 0.09, 0.08), rtol=0.1)
    assert found.points.sum() == 2000


def test_loops(axis_of):
    table = branch_table(axis_of(samples.two_rings()))
    assert table.kind.tolist() == ["loop", "loop"]
    assert table.component.tolist() == [0, 1]
    assert table.parent.tolist() == [-1, -1]
    assert np.isinf(table.tortuosity).all()
    np.testing.assert_allclose(table.length, 128 * 0.6 * np.sin(np.pi / 128))

    # a ring between two sticks, and a ball apart
    ring = [[0, 0, 0], [1, 1, 0], [2, 0, 0], [1, -1, 0]]
    edges = [[0, 1], [0, 3], [0, 4], [1, 2], [2, 3], [2, 5]]
    skeleton = Skeleton([*ring, [-5, 0, 0], [4, 0, 0], [9, 9, 9]], edges, np.full(7, np.nan), (), (), ())
    table = branch_table(skeleton)
    kinds = {name: np.flatnonzero(table.kind == name) for name in ("loop", "tip", "isolated", "inner")}
    assert [len(kinds[name]) for name in kinds] == [2, 2, 1, 0]
    assert table.start[table.level == 0].tolist() == [4, 6]  # without radii the longest branch, from its free end
    assert table.level[kinds["loop"]].tolist() == [1, 1]
    assert sorted(table.level[kinds["tip"]].tolist()) == [0, 2]
    assert (table.length[kinds["isolated"]], table.start[kinds["isolated"]]) == (0, 6)
    np.testing.assert_allclose(table.angle[table.start == 0], 45)
    assert np.isnan(table.mean_radius).all()


def closed_branch_on_a_stick():
    turn = np.arange(12) * np.pi / 6
    ring = np.column_stack([1 - np.cos(turn), -np.sin(turn), 0 * turn])
    edges = [(i, i + 1) for i in range(11)] + [(0, 11), (0, 12), (12, 13)]
    return Skeleton(np.r_[ring, [[-1, 0, 0], [-12, 0, 0]]], edges, np.full(14, 0.1), (), (), ())


@pytest.mark.parametrize("root", [13, 6])
def test_a_closed_branch_has_no_direction(root):
    table = branch_table(closed_branch_on_a_stick(), root)
    (loop,), (stick,) = (np.flatnonzero(table.kind == kind) for kind in ("loop", "tip"))
    assert table.start[loop] == table.end[loop] == 0
    assert table.parent[[loop, stick]].tolist() == ([stick, -1] if root == 13 else [-1, loop])
    assert np.isnan(table.angle).all()
    assert np.isinf(table.tortuosity[loop])


def test_means_are_along_the_curve_and_the_thicker_end_is_the_start():
    for radii, start in (([1, 2, 4], 2), ([4, 2, 1], 0)):
        cone = Skeleton(np.outer([0, 1, 3], [1, 0, 0]), [(0, 1), (1, 2)], radii, (), (), ())
        mean = (1 * (radii[0] + radii[1]) + 2 * (radii[1] + radii[2])) / 2 / 3
        assert {branch_table(cone, root).mean_radius[0] for root in (0, 2, None)} == {mean}
        assert branch_table(cone).start.tolist() == [start]


def test_the_parent_lies_on_the_shortest_way_from_the_root():
    # from junction 1 to junction 2 it is 3 straight on, and 4 by junction 3, whose second half is shorter than 3
    vertices = [[-1, 0, 0], [0, 0, 0], [3, 0, 0], [1.5, np.sqrt(1.75), 0], [1.5, 3, 0], [4, 0, 0]]
    edges = [(0, 1), (1, 2), (1, 3), (2, 3), (2, 5), (3, 4)]
    skeleton = Skeleton(vertices, edges, np.full(6, 0.1), (), (), ())
    table = branch_table(skeleton, root=0)
    row = {frozenset(pair): i for i, pair in enumerate(zip(table.start.tolist(), table.end.tolist(), strict=True))}
    assert table.parent[row[frozenset((2, 5))]] == row[frozenset((1, 2))]
    assert table.parent[row[frozenset((2, 3))]] == row[frozenset((1, 3))]
    assert (table.start[row[frozenset((2, 3))]], table.end[row[frozenset((2, 3))]]) == (3, 2)


def test_the_straighter_branch_continues_the_axis():
    """At every fork of the tree the one at 30 degrees; the other one, at 50, begins an axis of the next order."""
    table = branch_table(TREE)
    np.testing.assert_array_equal(np.bincount(table.order), [4, 6, 4, 1])
    straight = np.isclose(table.angle, ANGLES[0])
    child = np.flatnonzero(table.parent >= 0)
    before = table.parent[child]
    np.testing.assert_array_equal(table.axis[child], np.where(straight[child], table.axis[before], child))
    np.testing.assert_array_equal(table.order[child], table.order[before] + ~straight[child])
    np.testing.assert_array_equal(table.order, table.order[table.axis])
    stem = np.flatnonzero(table.order == 0)
    np.testing.assert_allclose(np.sort(table.length[stem]), SHARE ** np.arange(3, -1, -1.0))


def feathered(angle, thin):
    """A bent stem along z with a straight leaf at each of five nodes, and the rows of the table that are stem."""
    nodes = [[0.1 * np.sin(i), 0, i] for i in range(7)]
    edges, radii = [(i, i + 1) for i in range(6)], [0.1] * 7
    for i in range(1, 6):
        nodes.append(np.add(nodes[i], 0.8 * np.array([np.sin(angle) * (-1) ** i, 0, np.cos(angle)])))
        edges.append((i, len(nodes) - 1))
        radii.append(thin)
    return Skeleton(nodes, edges, radii, (), (), ())


@pytest.mark.parametrize(("angle", "thin"), [(0.9, 0.05), (1.5, 0.3), (2.5, 0.9)])
def test_a_stem_has_one_order(angle, thin):
    """Also where leaves are thicker, if they leave it sideways."""
    table = branch_table(feathered(angle, thin), root=0)
    assert table.level.max() == 5
    stem = np.abs(table.end_point[:, 2] - table.start_point[:, 2] - 1) < 1e-9
    assert stem.sum() == 6
    np.testing.assert_array_equal(table.order, np.where(stem, 0, 1))
    assert set(table.axis[stem].tolist()) == {int(np.flatnonzero(table.level == 0)[0])}
    assert table.axis[~stem].tolist() == np.flatnonzero(~stem).tolist()
    if thin < 0.1:  # without radii the direction alone decides
        bare = replace(feathered(angle, thin), radii=np.full(12, np.nan))
        np.testing.assert_array_equal(branch_table(bare, 0).order, table.order)


@pytest.mark.parametrize("scale", [1e-3, 1.0])
def test_where_one_radius_is_unknown_the_unit_does_not_matter(scale):
    """A branch at 20 degrees without a radius, and one at 50 with one; then both with radii, the latter thicker."""
    a, b = np.deg2rad([20, -50])
    nodes = np.array([[0, 0, 0], [0, 0, 1], [np.sin(a), 0, 1 + np.cos(a)], [np.sin(b), 0, 1 + np.cos(b)]])
    for radii, straight in (([0.1, np.nan, np.nan, 0.1], 2), ([0.1, 0.1, 0.1, 0.3], 3)):
        fork = Skeleton(nodes * scale, [(0, 1), (1, 2), (1, 3)], np.multiply(radii, scale), (), (), ())
        table = branch_table(fork, 0)
        assert table.end[table.order == 0].tolist() in ([1, straight], [straight, 1])


@pytest.mark.parametrize(
    ("places", "edges", "radii", "stem"),
    [  # a limb that is thick and straight but soon ends: the stem goes on beside it, and turns by 117 degrees there
        (
            [[0, 0, 0], [0, 0, 2], [0, 0, 3], [0.4, 0, 1.8], [0.4, 0, 9], [1, 0, 9.5], [0.4, 1, 9.5]],
            [[0, 1], [1, 2], [1, 3], [3, 4], [4, 5], [4, 6]],
            [0.1, 0.1, 0.1, 0.05, 0.02, 0.01, 0.01],
            {0, 1, 3, 4, 5},
        ),
        # a spur inside the trunk, straight ahead and thicker than what goes on
        (
            [[0, 0, 0], [0, 0, 3], [0, 0, 3.03], [0.3, 0, 6], [1, 1, 4]],
            [[0, 1], [1, 2], [1, 3], [1, 4]],
            [0.1, 0.08, 0.08, 0.03, 0.03],
            {0, 1, 3},
        ),
    ],
)
def test_what_soon_ends_does_not_continue_the_stem(places, edges, radii, stem):
    tree = Skeleton(places, edges, radii, (), (), ())
    table = branch_table(tree, 0)
    main = [path for path, order in zip(tree.branches, table.order, strict=True) if order == 0]
    assert set(np.concatenate(main).tolist()) == stem


def test_nothing_continues_what_turns_back_or_is_closed():
    hook = Skeleton([[0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, -0.5, 0]], [(0, 1), (1, 2), (1, 3)], [0.1] * 4, (), (), ())
    assert branch_table(hook, 0).order.tolist() == [0, 1, 1]
    loop = branch_table(closed_branch_on_a_stick(), 13)
    assert sorted(loop.order.tolist()) == [0, 1]


def test_a_torso_goes_on_at_both_ends(axis_of):
    table = branch_table(axis_of(samples.sauropod(1000)))
    assert sorted(table.kind.tolist()) == ["inner"] * 2 + ["loop"] * 2 + ["tip"] * 6
    (body,) = np.flatnonzero(table.level == 0)
    assert table.mean_radius[body] == table.mean_radius.max()
    main = table.order == 0
    assert main.sum() == 5
    assert set(table.axis[main].tolist()) == {int(body)}
    ends = table.end_point[main & (table.kind == "tip")]
    assert sorted(np.sign(ends[:, 0])) == [-1, 1]  # tail and neck; legs, and the handle, are lateral
    assert np.abs(ends[:, 0]).min() > 0.5


def test_print():
    table, supported = branch_table(TREE), branch_table(replace(TREE, support=np.full(len(TREE.vertices), 0.5)))
    head, names, first, *others = str(table).splitlines()
    assert head == repr(table) == "BranchTable(15 branches, 4 levels)"
    assert set(names.split()) == set(PRINTED_COLUMNS) - {"support"}
    cells = dict(zip(names.split(), first.split(), strict=True))
    assert [cells[name] for name in ("branch", "parent", "length", "angle")] == [
        "0",
        "-1",
        f"{table.length[0]:.4g}",
        "-",
    ]
    assert {len(line) for line in (first, *others)} == {len(names)}
    assert str(supported).splitlines()[2].split().count("0.5") == 2  # it has a confidence as well


def test_csv_and_dicts(tmp_path):
    rows = list(branch_table(closed_branch_on_a_stick()))
    branch_table(closed_branch_on_a_stick()).to_csv(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="") as stream:
        back = list(csv.DictReader(stream))
    assert all(type(value) in (int, float, str) for row in rows for value in row.values())
    unknown = ("nan", "inf")  # are left empty
    assert back == [{name: "" if str(it) in unknown else str(it) for name, it in row.items()} for row in rows]


def test_an_empty_skeleton():
    nothing = Skeleton((), (), (), (), (), ())
    for ask in (branch_table, segment, annotate):
        with pytest.raises(InvalidParameterError, match="empty"):
            ask(nothing)
    assert len(nothing.to_networkx()) == 0


@pytest.fixture(scope="module")
def y():
    return skeletonize(samples.y_junction(2000).points)


def distance_to(points, curve):
    """From every point to a polyline, by brute force."""
    a, span = curve[:-1], np.diff(curve, axis=0)
    share = np.einsum("nei,ei->ne", points[:, None] - a, span) / (span**2).sum(axis=1)
    foot = a + np.clip(share, 0, 1)[:, :, None] * span
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


def test_every_point_has_the_branch_of_its_vertex_or_the_nearest_one(y):
    label = segment(y)
    assert label.shape == (2000,)
    assert label.dtype == np.int64
    apart = np.stack([distance_to(y.points, y.vertices[path]) for path in y.branches])
    at_junction = np.isin(y.vertex_of_point, y.junctions)
    assert at_junction.any()
    np.testing.assert_allclose(apart[label, np.arange(2000)][at_junction], apart.min(axis=0)[at_junction], atol=1e-9)
    rows = np.flatnonzero(~at_junction)
    assert all(y.vertex_of_point[row] in y.branches[label[row]] for row in rows)
    np.testing.assert_array_equal(np.bincount(label, minlength=3), branch_table(y).points)


def test_other_clouds(y):
    label = segment(y)
    order = RNG.permutation(2000)
    np.testing.assert_array_equal(segment(y, y.points[order].astype(np.float32)), label[order])
    np.testing.assert_array_equal(segment(y, o3d.t.geometry.PointCloud(o3d.core.Tensor(y.points))), label)
    near = segment(y, np.concatenate([y.points[:5] + 1e-7, [[np.nan, 0, 0]]]))
    np.testing.assert_array_equal(near, [*label[:5], -1])
    bare = Skeleton(y.vertices, y.edges, y.radii, (), (), ())
    with pytest.raises(InvalidCloudError, match="without its cloud"):
        segment(bare)
    apart = np.stack([distance_to(y.points, y.vertices[path]) for path in y.branches])
    chosen = apart[segment(bare, y.points), np.arange(2000)]
    assert (chosen - apart.min(axis=0)).max() < 0.01 * y.radii.max()


def test_dropped_points_and_vertices_without_edges():
    vertices = [[0, 0, 0], [1, 0, 0], [5, 5, 5], [7, 7, 7]]
    points = [[0.2, 0, 0], [np.nan] * 3, [5, 5, 5], [7, 7, 7], [0.9, 1, 0]]
    skeleton = Skeleton(vertices, [(0, 1)], np.ones(4), [0, -1, 2, 3, 1], points, ())
    assert segment(skeleton).tolist() == [0, -1, 1, 2, 0]
    assert segment(skeleton, points).tolist() == [0, -1, 1, 2, 0]
    bare = Skeleton(vertices, [(0, 1)], np.ones(4), (), (), ())
    assert segment(bare, points).tolist() == [0, -1, 1, 2, 0]
    assert vertex_of_cloud(bare, points)[1].tolist() == [0, -1, 2, 3, 1]  # the nearer end of the nearest edge
    assert segment(Skeleton(vertices, [], np.ones(4), (), (), ()), points).tolist() == [0, -1, 2, 3, 1]
    assert branch_table(skeleton).points.tolist() == [2, 1, 1]
