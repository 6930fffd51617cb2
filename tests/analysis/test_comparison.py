"""`compare` on closed forms."""

import re
from dataclasses import asdict

import numpy as np
import pytest

from glsk_o3d import annotate, editing, read_truth, save_skeleton, skeletonize, to_line_set, to_tubes
from glsk_o3d.analysis import Truth, branch_table, compare, segment
from glsk_o3d.analysis.comparison import matching_f1
from glsk_o3d.analysis.curves import distances
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.samples import helix, sample_object, sphere, torus, tube, two_rings, y_junction

LINE = [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize("make", [tube, torus, helix, y_junction, two_rings, sample_object])
def test_an_axis_agrees_with_itself(make, axis_of):
    sample = make(100)
    same = compare(axis_of(sample), sample)
    assert max(same.error, same.radius_error) < 1e-12
    assert same.ends == (None if make in (torus, two_rings) else 0)
    assert (same.inside, same.completeness, same.tips_f1, same.junctions_f1) == (1, 1, 1, 1)
    assert (same.components, same.loops, same.leaves, same.junctions) == (0, 0, 0, 0)
    assert same.length == pytest.approx(1, rel=1e-12)
    assert same.topology is same.perfect is True


@pytest.mark.parametrize("d", [0.03, 0.099, 0.101])
def test_a_shift_is_an_error_of_as_many_radii(d, axis_of):
    sample = tube(100, radius=0.1)
    shifted = compare(axis_of(sample, shift=[0, d, 0]), sample)
    assert (shifted.error, shifted.ends) == (pytest.approx(d / 0.1, rel=1e-12), pytest.approx(d / 0.1, rel=1e-12))
    assert shifted.inside == shifted.completeness == (d < 0.1)


def test_half_of_the_axis(curve):
    half = compare(curve([[-2, 0, 0], [0, 0, 0]]), tube(100, length=4, radius=0.01))
    assert half.completeness == pytest.approx(0.5 + 0.01 / 4, abs=0.001 / 4)  # and one radius more
    assert (half.error, half.inside) == (pytest.approx(0, abs=1e-12), 1)
    assert half.ends == pytest.approx((0 + 2 / 0.01) / 2)
    assert half.length == pytest.approx(0.5)
    assert (half.tips_f1, half.topology, half.perfect) == (0.5, True, False)


def test_errors_are_in_the_radius_nearby(curve):
    cone = Truth(LINE, [[0, 1]], [0.1, 0.3])
    error = compare(curve([[0, 0.1, 0], [1, 0.1, 0]]), cone).error
    assert error == pytest.approx(0.1 / 0.2 * np.log(3), rel=1e-3)  # the mean of 0.1 / (0.1 + 0.2 x)


def test_radii_are_interpolated(pipe, curve):
    line = [[-0.5, 0, 0], [0.5, 0, 0]]
    assert compare(curve(line, radii=[0.1, 0.3]), pipe).radius_error == pytest.approx(1, rel=1e-12)
    assert compare(curve(line, radii=[0.05, 0.05]), pipe).radius_error == pytest.approx(0.5)
    assert compare(curve(line), pipe).radius_error is None
    assert compare(curve([*line, [0.5, 0, 0.1]], radii=[0.2, 0.2, np.nan]), pipe).radius_error == pytest.approx(1)


def test_structure_is_counted(ring, curve):
    cut = compare(curve(ring.nodes), ring)
    assert (cut.components, cut.loops, cut.leaves, cut.junctions, cut.topology) == (0, -1, 2, 0, False)
    detached = compare(curve([*ring.nodes, [0, 0, 0]], ring.edges), ring)
    assert (detached.components, detached.loops, detached.leaves, detached.topology) == (1, 0, 0, False)
    spur = compare(curve([*ring.nodes, [0.5, 0, 0]], [*ring.edges.tolist(), [0, len(ring.nodes)]]), ring)
    assert (spur.leaves, spur.junctions, spur.topology) == (1, 1, True)
    assert (spur.tips_f1, spur.junctions_f1, spur.perfect) == (0, 0, False)  # the axis has neither
    assert spur.length == pytest.approx(1 + 0.1 / (128 * 0.8 * np.sin(np.pi / 128)))


def test_a_ball_has_one_node(curve):
    ball = compare(curve([[0.1, 0, 0]], np.empty((0, 2), int)), sphere(100))
    assert (ball.error, ball.inside, ball.completeness) == (pytest.approx(0.2), 1, 1)
    assert (ball.ends, ball.length, ball.topology) == (None, None, True)
    assert (ball.tips_f1, ball.junctions_f1, ball.perfect) == (1, 1, True)


def test_a_skeleton_without_leaves_ends_at_its_nearest_vertex(ring, axis_of):
    straight = Truth([[0.9, 0, 0], [2, 0, 0]], [[0, 1]], [0.1, 0.2])
    assert compare(axis_of(ring), straight).ends == pytest.approx((5 + 8) / 2)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_units_places_and_the_order_of_vertices_do_not_matter(scale, curve):
    sample = sample_object(100)
    bent = curve(sample.nodes + 0.02 * np.sin(40 * sample.nodes[:, ::-1]), sample.edges, 0.9 * sample.radii)
    moved_truth = Truth(sample.nodes * scale + scale, sample.edges, sample.radii * scale)
    order = np.random.default_rng(2).permutation(len(sample.nodes))
    edges = np.argsort(order)[sample.edges][::-1, ::-1]
    moved = curve(bent.vertices[order] * scale + scale, edges, bent.radii[order] * scale)
    plain = asdict(compare(bent, sample))
    assert asdict(compare(moved, moved_truth)) == pytest.approx(plain, rel=1e-6)
    assert plain["error"] > 0.05


def test_a_tip_reaches_as_far_as_it_is_thick_and_is_matched_once(curve):
    """A pair is at most two and a half radii apart."""
    cone, pipe = (Truth([[0, 0, 0], [4, 0, 0]], [[0, 1]], radii) for radii in ([0.1, 0.3], [0.1, 0.1]))
    for gap, f1 in ((0.24, 1), (0.26, 0.5)):
        assert compare(curve([[gap, 0, 0], [4 - 3 * 0.24, 0, 0]]), cone).tips_f1 == f1
    forked = curve([[0, 0, 0], [3.8, 0, 0], [4, 0.1, 0], [4, -0.1, 0]], [[0, 1], [1, 2], [1, 3]])
    comparison = compare(forked, pipe)
    assert comparison.tips_f1 == pytest.approx(2 * 2 / (3 + 2))
    assert (comparison.junctions_f1, comparison.topology, comparison.perfect) == (0, True, False)


def test_the_nearest_pair_comes_first():
    true, points = (np.outer(places, [1.0, 0, 0]) for places in ([0, 1], [0.6, 1.5]))
    assert matching_f1(points, true, np.array([1.0, 1.0])) == 0.5  # 0.6 takes 1, and 1.5 is too far from 0
    assert matching_f1(points, true, np.array([1.5, 0.3])) == 0.5  # 0.6 takes 0, and 1.5 is too far from 1
    assert matching_f1(points[:0], true, np.ones(2)) == matching_f1(points, true[:0], np.ones(0)) == 0
    assert matching_f1(points[:0], true[:0], np.ones(0)) == 1


def cross(gap):
    """A cross of four arms whose junction is drawn out along x into two, so far apart."""
    ends = [[-2, -1, 0], [-2, 1, 0], [2, -1, 0], [2, 1, 0]]
    middle = [[-gap / 2, 0, 0], [gap / 2, 0, 0]]
    return np.array([*ends, *middle], float), np.array([[0, 4], [1, 4], [2, 5], [3, 5], [4, 5]])


@pytest.mark.parametrize(("gap", "share"), [(0.19, 1), (0.21, 2 / 3)])
def test_junctions_less_than_a_radius_apart_are_one(gap, share, curve):
    (vertices, edges), nodes = cross(gap), np.delete(cross(0)[0], 5, axis=0)
    one = [[0, 4], [1, 4], [2, 4], [3, 4]]
    comparison = compare(curve(vertices, edges), Truth(nodes, one, np.full(5, 0.2)))
    assert comparison.junctions_f1 == pytest.approx(share)
    assert (comparison.tips_f1, comparison.perfect, comparison.junctions) == (1, True, 1)
    assert compare(curve(nodes, one), Truth(vertices, edges, np.full(6, 0.2))).junctions_f1 == pytest.approx(share)


@pytest.mark.parametrize(("offset", "share"), [(0.38, 1), (0.42, 0)])
def test_junctions_are_matched_within_two_radii(offset, share, curve):
    vertices, edges = cross(0)
    moved = vertices + np.outer([0, 0, 0, 0, offset, offset], [0, 0, 1])
    assert compare(curve(moved, edges), Truth(vertices, edges, np.full(6, 0.2))).junctions_f1 == share


def test_distances_between_lines(curve):
    line = curve(LINE, radii=[1, 3])
    distance, radius = distances(line, curve([[0, 2, 0], [1, 2, 0]], radii=[5, 5]), 0.01)
    np.testing.assert_allclose(distance, 2)
    np.testing.assert_allclose(radius, (5 + np.linspace(1.01, 2.99, 100)) / 2)
    half, whole = curve(LINE, radii=1), curve([[0, 0, 0], [2, 0, 0]], radii=1)
    assert distances(half, whole, 0.001)[0].max() < 0.001
    assert distances(whole, half, 0.001)[0].mean() == pytest.approx(0.25, abs=0.001)
    dots, other = curve([[0, 0, 0], [4, 0, 0]], (), radii=0), curve([[0, 3, 0], [4, 3, 0]], radii=0)
    distance, radius = distances(dots, other, 0.1)
    np.testing.assert_allclose(distance, 3, rtol=1e-3)
    assert radius.tolist() == [0.1, 0.1]


@pytest.mark.parametrize(
    ("nodes", "edges", "radii"),
    [
        (np.empty((0, 3)), np.empty((0, 2), int), []),
        *((LINE, [[0, 1]], radii) for radii in ([1, 0], [1, np.inf], [1])),
        ([[0, 0, np.inf], [1, 0, 0]], [[0, 1]], [1, 1]),
        *((LINE, edges, [1, 1]) for edges in ([[0, 5]], [[0.5, 1]])),
        ([[0, 0]], [[0, 1]], [1, 1]),
    ],
)
def test_impossible_truths_are_refused(nodes, edges, radii):
    with pytest.raises(InvalidParameterError):
        Truth(nodes, edges, radii)


def test_truths_in_files(ring, tmp_path, axis_of):
    np.savez(tmp_path / "truth.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii, more=1)
    axis = axis_of(ring)
    for name in ("s.npz", "s.json", "s.ply"):
        save_skeleton(axis, tmp_path / name)
    for path in tmp_path.iterdir():
        assert compare(axis, read_truth(path)).error < 1e-12
    data = (tmp_path / "truth.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(data[: len(data) // 2])
    np.savez(tmp_path / "nodes.npz", nodes=ring.nodes)
    np.savez(tmp_path / "bad.npz", nodes=ring.nodes, edges=ring.edges, radii=0 * ring.radii)
    save_skeleton(axis, tmp_path / "noradii.obj")
    for name in ("cut.npz", "nodes.npz", "bad.npz", "noradii.obj"):
        with pytest.raises(FileFormatError, match=re.escape(name)):
            read_truth(tmp_path / name)


def test_a_skeleton_in_other_units_is_refused_before_the_memory_is_full(axis_of):
    with pytest.raises(InvalidParameterError, match="too long for places"):
        compare(axis_of(torus(100), scale=1e12), torus(100))


def test_two_skeletons_are_compared():
    one, other = (skeletonize(y_junction(1500, seed=seed).points) for seed in (0, 1))
    assert compare(one, other).perfect
    assert compare(one, one).error == 0 < compare(one, other).error < 0.1


EDITS = [editing.prune, editing.simplify, editing.reroot, editing.largest_component, editing.cut_loops]
MEASURES = [branch_table, segment, annotate, to_tubes, to_line_set]


@pytest.mark.parametrize("function", [*MEASURES, *EDITS])
def test_a_cloud_is_no_skeleton(function):
    with pytest.raises(InvalidParameterError, match="a ndarray is no Skeleton"):
        function(np.zeros((9, 3)))
