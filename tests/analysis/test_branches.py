"""Points by branch, and the table of branches: shapes whose numbers are known."""

import csv
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, Skeleton, annotate, samples, skeletonize
from glsk_o3d.analysis import branch_table, segment
from glsk_o3d.analysis.branches import PRINTED_COLUMNS
from glsk_o3d.analysis.segmentation import vertex_of_cloud
from glsk_o3d.samples.capsules import Axis

ANGLES, SHARE = (30.0, 50.0), 0.6
PIECES = 8


def graph(vertices, edges, radii=0.1):
    """A skeleton without a cloud."""
    return Skeleton(vertices, edges, np.broadcast_to(radii, len(vertices)), (), (), ())


def plane_tree():
    """Every branch ends in two, 30 degrees to one side and 50 to the other, 0.6 as long and thick: four levels."""
    axis = Axis()
    axis.grow([np.zeros(3)], 0.1)
    limbs = [(0, 90.0, 0)]
    while limbs:
        start, heading, level = limbs.pop(0)
        direction = np.array([np.cos(np.radians(heading)), 0, np.sin(np.radians(heading))])
        share = np.arange(1, PIECES + 1)[:, None] / PIECES
        end = axis.grow(axis.nodes[start] + SHARE**level * share * direction, 0.1 * SHARE**level, start)
        limbs += [(end, heading + turn, level + 1) for turn in (-ANGLES[0], ANGLES[1]) if level < 3]
    nodes, edges, radii = axis.arrays()
    return replace(graph(nodes, edges, radii), confidence=np.full(len(nodes), 0.5))


TREE = plane_tree()


def test_a_tree_with_known_numbers():
    table = branch_table(TREE)
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
    parent = table.parent[child]
    np.testing.assert_array_equal(table.start[child], table.end[parent])
    np.testing.assert_array_equal(table.level[child], table.level[parent] + 1)
    assert np.isnan(table.angle[trunk])
    np.testing.assert_allclose(np.sort(table.angle[child]), np.repeat(ANGLES, 7))
    np.testing.assert_array_equal(table.start_point, TREE.vertices[table.start])
    np.testing.assert_array_equal(table.end_point, TREE.vertices[table.end])
    # at every fork the branch at 30 degrees continues the axis, and that at 50 begins one of the next order
    np.testing.assert_array_equal(np.bincount(table.order), [4, 6, 4, 1])
    straight = np.isclose(table.angle[child], ANGLES[0])
    np.testing.assert_array_equal(table.axis[child], np.where(straight, table.axis[parent], child))
    np.testing.assert_array_equal(table.order[child], table.order[parent] + ~straight)
    np.testing.assert_array_equal(table.order, table.order[table.axis])
    np.testing.assert_allclose(np.sort(table.length[table.order == 0]), SHARE ** np.arange(3, -1, -1.0))


def test_parents_and_angles_follow_the_root():
    tip = TREE.leaves[-1]
    for root in (int(tip), np.int64(tip), TREE.vertices[tip] + 1e-3, tuple(TREE.vertices[tip])):
        table = branch_table(TREE, root)
        assert table.level.max() == 5  # up the trunk's side, and down again to the farthest twigs
        assert table.start[table.level == 0].tolist() == [tip]
        # a fork of 30 and 50 degrees is one of 80 between the arms, seen from one of them
        first = table.angle[table.level == 1]
        np.testing.assert_allclose(np.sort(first), sorted([ANGLES[1], 180 - sum(ANGLES)]), atol=1e-6)


def test_a_root_inside_a_branch_and_at_a_junction():
    inside = branch_table(TREE, 3)  # a vertex of the trunk
    assert inside.level.tolist() == branch_table(TREE).level.tolist()
    assert inside.start[inside.level == 0].tolist() == [0]
    fork = branch_table(TREE, PIECES)
    np.testing.assert_array_equal(fork.level == 0, fork.start == PIECES)
    assert (fork.level == 0).sum() == 3
    assert np.isnan(fork.angle[fork.level == 0]).all()


def test_y_junction_from_its_cloud():
    table = branch_table(skeletonize(samples.y_junction(2000).points), root=(0, 0, -1))
    assert sorted(table.level.tolist()) == [0, 1, 1]
    np.testing.assert_allclose(table.angle[table.level == 1], 40, atol=4)
    np.testing.assert_allclose(table.length, 0.5, atol=0.1)
    np.testing.assert_allclose(table.mean_radius, np.where(table.level == 0, 0.09, 0.08), rtol=0.1)
    assert table.points.sum() == 2000


def test_rings(axis_of):
    table = branch_table(axis_of(samples.two_rings()))
    assert table.kind.tolist() == ["loop", "loop"]
    assert table.component.tolist() == [0, 1]
    assert table.parent.tolist() == [-1, -1]
    assert np.isinf(table.tortuosity).all()
    np.testing.assert_allclose(table.length, 128 * 0.6 * np.sin(np.pi / 128))


def test_a_ring_between_two_sticks_and_a_detached_vertex():
    ring = [[0, 0, 0], [1, 1, 0], [2, 0, 0], [1, -1, 0]]
    edges = [[0, 1], [0, 3], [0, 4], [1, 2], [2, 3], [2, 5]]
    table = branch_table(graph([*ring, [-5, 0, 0], [4, 0, 0], [9, 9, 9]], edges, np.nan))
    assert sorted(table.kind.tolist()) == ["isolated", "loop", "loop", "tip", "tip"]
    assert table.start[table.level == 0].tolist() == [4, 6]  # without radii the longest branch, from its free end
    assert table.level[table.kind == "loop"].tolist() == [1, 1]
    assert sorted(table.level[table.kind == "tip"].tolist()) == [0, 2]
    assert table.length[table.kind == "isolated"] == 0
    np.testing.assert_allclose(table.angle[table.start == 0], 45)
    assert np.isnan(table.mean_radius).all()


def closed_branch_on_a_stick():
    turn = np.arange(12) * np.pi / 6
    axis = Axis()
    axis.grow(np.column_stack([1 - np.cos(turn), -np.sin(turn), 0 * turn]), 0.1, end=0)
    axis.grow([[-1, 0, 0], [-12, 0, 0]], 0.1, start=0)
    return graph(*axis.arrays())


@pytest.mark.parametrize("root", [13, 6])
def test_a_closed_branch_has_no_direction(root):
    table = branch_table(closed_branch_on_a_stick(), root)
    (loop,), (stick,) = (np.flatnonzero(table.kind == kind) for kind in ("loop", "tip"))
    assert table.start[loop] == table.end[loop] == 0
    assert table.parent[[loop, stick]].tolist() == ([stick, -1] if root == 13 else [-1, loop])
    assert np.isnan(table.angle).all()
    assert np.isinf(table.tortuosity[loop])
    assert sorted(table.order.tolist()) == [0, 1]


@pytest.mark.parametrize(("radii", "start"), [([1, 2, 4], 2), ([4, 2, 1], 0)])
def test_means_are_along_the_curve_and_the_thicker_end_is_the_start(radii, start):
    cone = graph(np.outer([0, 1, 3], [1, 0, 0]), [(0, 1), (1, 2)], radii)
    mean = (1 * (radii[0] + radii[1]) + 2 * (radii[1] + radii[2])) / 2 / 3
    assert {branch_table(cone, root).mean_radius[0] for root in (0, 2, None)} == {mean}
    assert branch_table(cone).start.tolist() == [start]


def test_the_parent_lies_on_the_shortest_path_from_the_root():
    # from junction 1 to junction 2 it is 3 straight on, and 4 by junction 3, whose second half is shorter than 3
    vertices = [[-1, 0, 0], [0, 0, 0], [3, 0, 0], [1.5, np.sqrt(1.75), 0], [1.5, 3, 0], [4, 0, 0]]
    table = branch_table(graph(vertices, [(0, 1), (1, 2), (1, 3), (2, 3), (2, 5), (3, 4)]), root=0)
    rows = list(zip(table.start.tolist(), table.end.tolist(), strict=True))
    parent = {pair: rows[row] for pair, row in zip(rows, table.parent.tolist(), strict=True)}
    assert parent[2, 5] == (1, 2)
    assert parent[3, 2] == (1, 3)


def feathered(angle, thin):
    """A bent stem along z, of radius 0.1, with a straight leaf at each of its five joints."""
    axis = Axis()
    stem = np.array([[0.1 * np.sin(i), 0, i] for i in range(7)])
    axis.grow(stem, 0.1)
    for i in range(1, 6):
        axis.grow([stem[i] + 0.8 * np.array([np.sin(angle) * (-1) ** i, 0, np.cos(angle)])], thin, start=i)
    return graph(*axis.arrays())


@pytest.mark.parametrize(("angle", "thin"), [(0.9, 0.05), (1.5, 0.3), (2.5, 0.9)])
def test_a_stem_has_one_order(angle, thin):
    """Also where leaves are thicker, if they leave it sideways."""
    plant = feathered(angle, thin)
    table = branch_table(plant, root=0)
    assert table.level.max() == 5
    stem = np.abs(table.end_point[:, 2] - table.start_point[:, 2] - 1) < 1e-9
    assert stem.sum() == 6
    np.testing.assert_array_equal(table.order, np.where(stem, 0, 1))
    assert set(table.axis[stem].tolist()) == {int(np.flatnonzero(table.level == 0)[0])}
    assert table.axis[~stem].tolist() == np.flatnonzero(~stem).tolist()
    if thin < 0.1:  # without radii the direction alone decides
        bare = replace(plant, radii=np.full(len(plant.vertices), np.nan))
        np.testing.assert_array_equal(branch_table(bare, 0).order, table.order)


@pytest.mark.parametrize("scale", [1e-3, 1.0])
@pytest.mark.parametrize(("radii", "straight"), [([0.1, np.nan, np.nan, 0.1], 2), ([0.1, 0.1, 0.1, 0.3], 3)])
def test_where_one_radius_is_unknown_the_unit_does_not_matter(scale, radii, straight):
    """A branch at 20 degrees without a radius, and one at 50 with one; then both with radii, the latter thicker."""
    a, b = np.deg2rad([20, -50])
    nodes = np.array([[0, 0, 0], [0, 0, 1], [np.sin(a), 0, 1 + np.cos(a)], [np.sin(b), 0, 1 + np.cos(b)]])
    table = branch_table(graph(nodes * scale, [(0, 1), (1, 2), (1, 3)], np.multiply(radii, scale)), 0)
    assert sorted(table.end[table.order == 0].tolist()) == [1, straight]


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
        # both branches turn back: neither continues the stem
        (
            [[0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, -0.5, 0]],
            [[0, 1], [1, 2], [1, 3]],
            [0.1] * 4,
            {0, 1},
        ),
    ],
)
def test_what_soon_ends_or_turns_back_does_not_continue_the_stem(places, edges, radii, stem):
    tree = graph(places, edges, radii)
    main = [path for path, order in zip(tree.branches, branch_table(tree, 0).order, strict=True) if order == 0]
    assert set(np.concatenate(main).tolist()) == stem


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


def test_a_printed_table_has_a_column_for_the_support_only_if_it_is_known():
    table, supported = branch_table(TREE), branch_table(replace(TREE, support=np.full(len(TREE.vertices), 0.5)))
    head, names, *rows = str(table).splitlines()
    assert head == repr(table) == "BranchTable(15 branches, 4 levels)"
    assert set(names.split()) == set(PRINTED_COLUMNS) - {"support"}
    assert {len(row) for row in rows} == {len(names)}
    assert "support" in str(supported).splitlines()[1].split()


def test_csv_and_dicts(tmp_path):
    table = branch_table(closed_branch_on_a_stick())
    table.to_csv(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="") as stream:
        read = list(csv.DictReader(stream))
    assert all(type(value) in (int, float, str) for row in table for value in row.values())
    unknown = ("nan", "inf")  # are empty cells
    assert read == [{name: "" if str(cell) in unknown else str(cell) for name, cell in row.items()} for row in table]


@pytest.mark.parametrize("measure", [branch_table, segment, annotate])
def test_an_empty_skeleton_is_refused(measure):
    with pytest.raises(InvalidParameterError, match="empty"):
        measure(Skeleton((), (), (), (), (), ()))


@pytest.fixture(scope="module")
def y():
    return skeletonize(samples.y_junction(2000).points)


def distances_to_branches(skeleton):
    """From every branch to every point, by brute force: (B, N) float array."""

    def distance(curve):
        a, span = curve[:-1], np.diff(curve, axis=0)
        share = np.einsum("nei,ei->ne", skeleton.points[:, None] - a, span) / (span**2).sum(axis=1)
        foot = a + np.clip(share, 0, 1)[:, :, None] * span
        return np.linalg.norm(skeleton.points[:, None] - foot, axis=2).min(axis=1)

    return np.stack([distance(skeleton.vertices[path]) for path in skeleton.branches])


def test_every_point_has_the_branch_of_its_vertex_or_the_nearest_one(y):
    label = segment(y)
    assert (label.shape, label.dtype) == ((2000,), np.int64)
    gap = distances_to_branches(y)
    at_junction = np.isin(y.vertex_of_point, y.junctions)
    assert at_junction.any()
    np.testing.assert_allclose(gap[label, np.arange(2000)][at_junction], gap.min(axis=0)[at_junction], atol=1e-9)
    assert all(y.vertex_of_point[row] in y.branches[label[row]] for row in np.flatnonzero(~at_junction))
    np.testing.assert_array_equal(np.bincount(label, minlength=3), branch_table(y).points)


def test_other_clouds(y):
    label, order = segment(y), np.random.default_rng(0).permutation(2000)
    np.testing.assert_array_equal(segment(y, y.points[order].astype(np.float32)), label[order])
    np.testing.assert_array_equal(segment(y, o3d.t.geometry.PointCloud(o3d.core.Tensor(y.points))), label)
    near = segment(y, np.concatenate([y.points[:5] + 1e-7, [[np.nan, 0, 0]]]))
    np.testing.assert_array_equal(near, [*label[:5], -1])
    bare = graph(y.vertices, y.edges, y.radii)
    with pytest.raises(InvalidCloudError, match="without its cloud"):
        segment(bare)
    gap = distances_to_branches(y)
    assert (gap[segment(bare, y.points), np.arange(2000)] - gap.min(axis=0)).max() < 0.01 * y.radii.max()


def test_dropped_points_and_detached_vertices():
    vertices = [[0, 0, 0], [1, 0, 0], [5, 5, 5], [7, 7, 7]]
    points = [[0.2, 0, 0], [np.nan] * 3, [5, 5, 5], [7, 7, 7], [0.9, 1, 0]]
    skeleton = Skeleton(vertices, [(0, 1)], np.ones(4), [0, -1, 2, 3, 1], points, ())
    bare = graph(vertices, [(0, 1)])
    for label in (segment(skeleton), segment(skeleton, points), segment(bare, points)):
        assert label.tolist() == [0, -1, 1, 2, 0]
    assert vertex_of_cloud(bare, points)[1].tolist() == [0, -1, 2, 3, 1]  # the nearer end of the nearest edge
    assert segment(graph(vertices, []), points).tolist() == [0, -1, 2, 3, 1]
    assert branch_table(skeleton).points.tolist() == [2, 1, 1]
