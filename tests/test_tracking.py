"""A Tracker: one graph in a static scene, identities that last, growth, and changes that are taken over."""

from itertools import pairwise

import numpy as np
import pytest
from glsk_studies import tracking as study
from scipy.spatial.transform import Rotation

from glsk_o3d import GlskError, InvalidCloudError, InvalidParameterError, Tracker, pipelines, samples
from glsk_o3d.editing import transform
from glsk_o3d.samples.capsules import union_sample

N = 1500
ARMS = np.sqrt(0.5) * np.array([[1, 0, 1], [-1, 0, 1], [0, 1, 1]])


def toy(handle=True, seed=0):
    """A sauropod with or without its carrying handle, of which the last 13 nodes are."""
    axis = samples.sauropod(16, cameras=None)
    m = len(axis.nodes) - (0 if handle else 13)
    edges = axis.edges[(axis.edges < m).all(axis=1)]
    return union_sample("toy", axis.nodes[:m], edges, axis.radii[:m], N, 0.001, seed).points


def plant(arms, seed=0):
    """A stem of length 0.5, and arms of given lengths from the origin towards `ARMS`."""
    nodes = np.concatenate([[[0, 0, 0], [0, 0, -0.5]], np.array(arms)[:, None] * ARMS[: len(arms)]])
    edges = np.column_stack([np.zeros(len(arms) + 1, int), np.arange(1, len(arms) + 2)])
    radii = np.array([0.05, *[0.04] * (len(arms) + 1)])
    return union_sample("plant", nodes, edges, radii, N, 0.001, seed).points


def graph(tracked):
    skeleton = tracked.skeleton
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


def at(tracked, place):
    """The identity of the branch that is nearest to a place."""
    return tracked.identity[tracked.skeleton.nearest([place]).branch[0]]


def test_a_static_scene_has_one_graph_that_hardly_moves():
    tracker = Tracker()
    frames = [tracker(samples.sauropod(N, noise=0.003, seed=seed).points) for seed in range(12)][5:]
    assert {graph(frame) for frame in frames} == {graph(frames[0])}
    assert all((frame.identity == frames[0].identity).all() for frame in frames)
    assert not any(frame.new or frame.lost for frame in frames)
    for before, after in pairwise(frames):
        moves = after.skeleton.nearest(before.skeleton.vertices).distance
        assert np.median(moves) < 0.003  # the noise of a point
    assert sum(frame.is_computed for frame in frames) <= 2


def test_a_moving_object_keeps_its_identities():
    # of 1.5 m in frames that are as far apart as 2 cm and 5 degrees of an object of 0.3 m
    tracker, rng = Tracker(), np.random.default_rng(0)
    pose = motion = np.eye(4)
    for seed in range(9):
        tracked = tracker(toy(seed=seed) @ pose[:3, :3].T + pose[:3, 3])
        resting = transform(tracked.skeleton, np.linalg.inv(pose))
        if seed == 0:
            first, names = resting, tracked.identity
        middle = resting.vertices[resting.edges].mean(axis=1)
        same = names[first.nearest(middle).branch] == tracked.identity[resting.branch_of_edge]
        assert same.mean() > 0.9  # around junctions the nearest branch is any of them
        np.testing.assert_allclose(tracked.motion, motion, atol=0.02)  # the spacing of the points is 0.03
        turn, step = rng.normal(size=(2, 3))
        motion = np.eye(4)
        motion[:3, :3] = Rotation.from_rotvec(np.deg2rad(5) * turn / np.linalg.norm(turn)).as_matrix()
        motion[:3, 3] = 0.1 * step / np.linalg.norm(step)
        pose = motion @ pose


def test_a_growing_plant_reports_the_growth_of_each_branch():
    tracker = Tracker(patience=1, check=1, average=1)
    lengths = np.array([0.3, 0.35, 0.4])
    rate = np.array([0.0, 0.03, 0.05])
    for day in range(6):
        tracked = tracker(plant(lengths + rate * day, seed=day))
        assert (tracked.new == ()) == (day > 0)
        assert tracked.lost == ()
    for length, growth, way in zip(lengths, 5 * rate, ARMS, strict=True):
        found = tracked.growth[at(tracked, 0.2 * way)]
        assert abs(found - growth) < 0.05 * (length + growth)  # a few per cent; the radius is 0.04


def test_a_new_branch_is_new_and_the_others_keep_their_identities():
    tracker = Tracker(patience=1)
    before = tracker(plant([0.3, 0.4], seed=0))
    after = tracker(plant([0.3, 0.4, 0.35], seed=1))
    assert (len(before.length), len(after.length), len(after.new), after.lost) == (3, 4, 1, ())
    assert at(after, 0.25 * ARMS[2]) == after.new[0]
    for place in ([0, 0, -0.3], 0.2 * ARMS[0], 0.2 * ARMS[1]):
        assert at(before, place) == at(after, place)


@pytest.mark.parametrize("first", [True, False])
def test_a_handle_that_comes_or_goes_for_good_is_taken_over_after_as_many_frames_as_patience(first):
    tracker = Tracker(patience=3)
    frames = [tracker(toy(first ^ (seed >= 5), seed)) for seed in range(10)]
    loops = [frame.skeleton.n_loops for frame in frames]
    assert loops == [first] * 7 + [not first] * 3
    assert (len(frames[7].new), len(frames[7].lost)) == ((0, 1) if first else (1, 0))
    assert frames[5].unexplained > 0.05 > frames[9].unexplained


def test_one_odd_frame_changes_nothing():
    tracker = Tracker(patience=2)
    frames = [tracker(toy(seed != 4, seed)) for seed in range(7)]
    assert {frame.skeleton.n_loops for frame in frames} == {1}
    assert not any(frame.new or frame.lost for frame in frames[1:])


def test_the_origin_may_be_far_away():
    tracker, offset = Tracker(patience=1), np.array([4e6, 5e6, 300.0])  # as of a map
    for seed in range(3):
        tracked = tracker(plant([0.3, 0.4], seed) + offset + [0.05 * seed, 0, 0])
    start = np.append(offset, 1)
    np.testing.assert_allclose((tracked.motion @ start - start)[:3], [0.05, 0, 0], atol=0.01)  # a third of the spacing
    assert (tracked.is_computed, tracked.identity.tolist()) == (False, [0, 1, 2])


def test_between_changes_a_vertex_is_one_place_and_points_are_those_of_the_frame():
    tracker = Tracker(pipelines.default().with_options(drop_invalid=True), patience=1)
    first, points = tracker(toy()), toy(seed=1)
    points[3] = np.nan
    second = tracker(points)
    assert first.is_computed
    assert not second.is_computed
    np.testing.assert_array_equal(first.skeleton.edges, second.skeleton.edges)
    np.testing.assert_array_equal(second.skeleton.points, points)
    assert second.skeleton.vertex_of_point[3] == -1
    assert "lost: ()" in repr(second)


@pytest.mark.parametrize("shape", [samples.sphere, samples.sheet, samples.two_rings])
@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_shapes_without_a_meaningful_skeleton_and_with_two_components_can_be_followed(shape):
    tracker = Tracker(patience=1, check=1)
    for seed in range(3):
        tracked = tracker(shape(500, seed=seed).points)
        assert len(tracked.identity) == len(tracked.skeleton.branches)


@pytest.mark.parametrize("option", [dict(patience=0), dict(check=0), dict(average=0), dict(unexplained=2)])
def test_impossible_options_are_refused(option):
    with pytest.raises(InvalidParameterError, match=next(iter(option))):
        Tracker(**option)


def test_frames_without_points_are_refused_and_the_next_one_goes_on():
    tracker = Tracker(patience=1)
    first = tracker(toy())
    with pytest.raises(InvalidCloudError, match="no finite point"):
        tracker(np.full((9, 3), np.nan))
    with pytest.raises(GlskError):
        tracker(toy()[:4])
    assert (tracker(toy(seed=1)).identity == first.identity).all()


def test_the_study_compares_single_frames_with_tracked_ones():
    rows = [
        dict(shape="y_junction", condition="moving", method=method)
        | study.measure("y_junction", "moving", method, frames=7)
        for method in ("each frame", "tracked")
    ]
    assert rows[1]["graphs"] == rows[1]["most frequent"] == 1
    assert rows[1]["move [mm]"] < 1
    assert [line[1] for line in study.tables(rows)[0][2]] == ["each frame", "tracked"]
