"""Approaches of a gripper beside walls, through handles, over planes, in noise and in gaps, with known answers."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glsk_o3d import Decision, InvalidCloudError, InvalidParameterError, Skeleton, SkeletonWarning, samples
from glsk_o3d.analysis import Gripper, grasp_candidates, grasps

HAND = Gripper(0.4, finger=(0.05, 0.06, 0.3), palm=(0.5, 0.1, 0.2), reach=0.05)
CLEARANCE = 0.02
TOUCHING, BEHIND = "ways in that touch points", "ways in behind the plane"


def rod(extra=(), n=4000):
    """The axis of a tube of radius 0.1 along x, its points, and more."""
    sample = samples.tube(n, length=1.0, radius=0.1)
    points = np.concatenate([sample.points, np.reshape(extra, (-1, 3))])
    return Skeleton(sample.nodes, sample.edges, sample.radii, (), points, (), confidence=[1, 1])


def sheet(x, y, z, step=0.01):
    """Points on a grid: each coordinate is between two limits, or one number."""
    axes = [np.arange(*side, step) if isinstance(side, tuple) else [side] for side in (x, y, z)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def grasp(skeleton, **options):
    return grasp_candidates(skeleton, HAND, **{"clearance": CLEARANCE, "around": 8, "spacing": 0.1, **options})


def check_same(grasps, others):
    """The same approaches in any order, as `left_out` numbers."""
    assert grasps.left_out == others.left_out
    rows, other_rows = (np.lexsort((*it.approach.round(6).T, *it.position.round(6).T)) for it in (grasps, others))
    for name in ("position", "approach", "closing", "opening", "depth", "quality", "seen"):
        np.testing.assert_allclose(getattr(grasps, name)[rows], getattr(others, name)[other_rows], atol=1e-9)


WALL = sheet((-1, 1), 0.3, (-1.5, 1.5), 0.02)


@pytest.mark.parametrize(
    ("points", "plane", "why"), [((), (0, 1, 0, -0.3), BEHIND), ((), (0, -10, 0, 3.0), BEHIND), (WALL, None, TOUCHING)]
)
def test_a_wall_blocks_exactly_the_approaches_from_its_side(points, plane, why):
    free, beside = grasp(rod()), grasp(rod(points), plane=plane)
    assert len(free) == 8 * free.places
    assert beside.left_out == {why: 3 * free.places}
    kept = free.approach[:, 1] > -1e-9
    check_same(replace(free[kept], left_out=beside.left_out), beside)
    np.testing.assert_allclose(beside.opening, 0.2 + 3 * CLEARANCE)
    assert (beside.seen == 3).all()


@pytest.mark.parametrize(("gap", "sides"), [(0.05 + CLEARANCE - 1e-3, 0), (0.05 + CLEARANCE + 1e-3, 2)])
def test_a_finger_goes_through_a_handle_that_is_wider_than_it(gap, sides):
    """From the side one finger is between the rod and the body below it, half the clearance from either."""
    handle = grasp(rod(sheet((-0.6, 0.6), (-0.2, 0.2), -0.1 - gap)), around=4)
    assert handle.left_out[TOUCHING] == (3 - sides) * handle.places
    assert len(handle) == (1 + sides) * handle.places
    assert handle.approach[:, 2].max() < 1e-9  # none from below


@pytest.mark.parametrize(("step", "count"), [(-1e-3, 9), (1e-3, 0)])
@pytest.mark.filterwarnings("ignore:no grasp")
def test_a_palm_stops_at_what_is_as_far_as_the_fingers_are_long(step, count):
    """A ridge on the rod, between the fingers."""
    ridge = sheet((-0.6, 0.6), (-0.05, 0.05), 0.3 - 0.05 - CLEARANCE / 2 + step)
    assert len(grasp(rod(ridge), around=1)) == count


def test_an_approach_is_as_long_as_the_object():
    skeleton = rod()
    diagonal = np.linalg.norm(np.ptp(skeleton.points, axis=0))
    back = 0.05 - 0.3 - 0.2 - diagonal - CLEARANCE / 2  # where the palm comes from
    for height, places in ((-back + 0.01, 9), (-back - 0.01, 0)):
        assert sum(grasp(skeleton, plane=(0, 0, -1, height)).approach[:, 2] < -0.99) == places


def test_turned_moved_scaled_and_shuffled():
    """About z, since approaches come from above first."""
    turn, shift, scale = Rotation.from_rotvec([0, 0, 1.1]), np.array([3.0, -7, 1]), 25.0
    rng, sample = np.random.default_rng(0), samples.sauropod(1500)
    plain = Skeleton(sample.nodes, sample.edges, sample.radii, (), sample.points, (), confidence=0 * sample.radii + 1)

    def moved(points):
        return scale * turn.apply(points) + shift

    points = moved(rng.permutation(plain.points))
    image = replace(plain, vertices=moved(plain.vertices), radii=scale * plain.radii, points=points)
    grasps = grasp_candidates(plain, 0.2, plane=(0, 1, 0, -0.25), around=4, spacing=0.1)
    side = turn.apply([0, 1, 0])
    plane = (*side, -0.25 * scale - side @ shift)
    images = grasp_candidates(image, 0.2 * scale, plane=plane, around=4, spacing=0.1 * scale)
    assert len(grasps) > 15
    assert len(grasps.left_out) >= 3
    assert grasps.left_out == images.left_out
    np.testing.assert_array_equal(grasps.seen, images.seen)
    np.testing.assert_allclose(images.position, moved(grasps.position), atol=1e-8)
    np.testing.assert_allclose(images.opening, scale * grasps.opening)
    np.testing.assert_allclose(images.depth, scale * grasps.depth)
    np.testing.assert_allclose(images.approach, turn.apply(grasps.approach), atol=1e-9)


def test_points_between_the_jaws_and_those_that_are_not_finite_are_no_obstacle():
    inside = np.random.default_rng(0).uniform(-1, 1, (500, 3)) * [0.5, 0.06, 0.06]
    check_same(grasp(rod()), grasp(rod([*inside, [np.nan, 0, 0], [0, np.inf, 0]])))


@pytest.mark.parametrize("seed", range(3))
def test_no_finger_slips_between_the_points_of_a_sparse_thin_wall(seed):
    """Points scattered over a wall, 1.2 thicknesses of a finger apart: it is hit, though often no point is."""
    rng, size = np.random.default_rng(seed), np.array([1.6, 1.6])
    n = int(size.prod() / (1.2 * HAND.finger[0]) ** 2)
    wall = np.insert((rng.random((n, 2)) - 0.5) * size, 2, 0.2, axis=1)
    with pytest.warns(SkeletonWarning, match=TOUCHING):
        assert len(grasp(rod(wall), around=1, spacing=0.02, clearance=0.0)) == 0


def test_the_jaws_close_on_something_and_no_sparse_part_is_made_thicker():
    sparse = grasp(rod(n=150))
    assert len(sparse) == 8 * sparse.places
    np.testing.assert_allclose(sparse.opening, 0.2 + 3 * CLEARANCE)
    with pytest.warns(SkeletonWarning, match="72 ways in with nothing between the jaws"):
        assert len(grasp(rod(), cloud=rod().points + [0, 0, 30])) == 0


def test_sides_with_points_are_counted_and_rank():
    whole = rod()
    seen = whole.points[:, 1] > 0.01
    owner, normals = whole.vertex_of_point[seen], whole.normals[seen]
    half = grasp(replace(whole, points=whole.points[seen], vertex_of_point=owner, normals=normals), around=4)
    across = half.approach[:, 1].round(6)  # 1: from the side that is not there, past both edges of the other
    assert len(half) == 4 * half.places
    np.testing.assert_array_equal(half.seen, np.select([across == 1, across == -1], [2, 3], 2))
    np.testing.assert_allclose(half.quality, grasp(whole, around=4).quality * half.seen / 3)
    assert (across[: half.places] == -1).all()


def test_the_best_of_each_place_comes_before_the_second_best_of_any():
    sample = samples.sauropod(4000)
    half = sample.points[sample.points[:, 1] > -0.02]  # qualities differ also around a place
    confidence = np.linspace(0.6, 1, len(sample.radii))
    skeleton = Skeleton(sample.nodes, sample.edges, sample.radii, (), half, (), confidence=confidence)
    grasps = grasp_candidates(skeleton, 0.2)
    place = np.unique(grasps.position, axis=0, return_inverse=True)[1].reshape(-1)
    rank = np.array([np.sum(place[:row] == place[row]) for row in range(len(place))])
    assert place.max() > 20
    assert len(set(grasps[rank == 0].seen)) > 1
    assert (np.diff(rank) >= 0).all()
    for group in (rank, place):  # the best of a round comes first, and the best of a place
        for number in np.unique(group):
            assert (np.diff(grasps.quality[group == number].round(9)) <= 0).all()


@pytest.mark.parametrize(("room", "times"), [(3, 3), (2.5, 2), (2, 2), (1, 1)])
def test_jaws_open_by_three_clearances_or_as_wide_as_is_free(room, times):
    """Between two walls, each as far from the rod as a finger is thick and as so many halves of the clearance."""
    walls = [sheet((-1, 1), side * (0.1 + 0.05 + (room + 1) * CLEARANCE / 2 + 1e-3), (-0.2, 0.2)) for side in (-1, 1)]
    between = grasp(rod(np.concatenate(walls)), around=1)
    np.testing.assert_allclose(between.opening, 0.2 + times * CLEARANCE)
    assert len(between) == between.places


def test_jaws_open_wide_enough_where_points_scatter():
    noisy = rod()
    noisy = replace(noisy, points=noisy.points + np.random.default_rng(0).normal(scale=0.006, size=noisy.points.shape))
    assert len(grasp(noisy)) == 72


def test_fingers_reach_as_far_as_the_part_and_no_farther_than_they_can():
    thin = rod()
    thin = replace(thin, radii=[0.02, 0.02], points=thin.points * [1, 0.2, 0.2])
    np.testing.assert_allclose(grasp(thin).depth, 0.02)
    np.testing.assert_allclose(grasp(rod()).depth, HAND.reach)


@pytest.mark.parametrize("plane", [(0, 0, 0, 1), (0, 0, np.nan, 1), (0, 0, 1), "table", ((0, 0, 1, 0), [0] * 999)])
def test_impossible_planes_and_empty_clouds_are_refused(plane):
    with pytest.raises(InvalidParameterError, match=r"plane = .{,210}: must be four finite numbers .* such as 0, 0, 1"):
        grasp(rod(), plane=plane)
    with pytest.raises(InvalidCloudError, match="empty"):
        grasp(rod(), cloud=np.empty((0, 3)))


def test_a_skeleton_without_points_asks_for_them():
    bare = replace(rod(), points=(), vertex_of_point=(), normals=())
    with pytest.raises(InvalidParameterError, match=r"cloud=\(\)"):
        grasp(bare)
    check_same(grasp(bare, cloud=rod().points), grasp(rod()))
    assert (grasp(bare, cloud=()).seen == 0).all()
    assert len(grasp(bare, cloud=(), plane=(0, 0, 1, 0.11))) < len(grasp(bare, cloud=()))


def test_boxes_of_a_gripper():
    low, high = HAND.boxes([0.2, 0.3], [0.05, 0.01])
    np.testing.assert_allclose(low[0], [[-0.15, -0.03, -0.25], [0.1, -0.03, -0.25], [-0.25, -0.05, -0.45]])
    np.testing.assert_allclose(high[0], [[-0.1, 0.03, 0.05], [0.15, 0.03, 0.05], [0.25, 0.05, -0.25]])
    np.testing.assert_allclose((high - low)[0], (high - low)[1])
    np.testing.assert_allclose(high[1, :, 2], [0.01, 0.01, -0.29])


def test_a_gripper_in_proportion():
    small, large = Gripper(0.08), Gripper(80)
    np.testing.assert_allclose(np.multiply(1000, small.finger + small.palm), large.finger + large.palm)
    assert small == Gripper(0.08, finger=list(small.finger))


@pytest.mark.parametrize(
    "options",
    [
        *(dict(max_opening=opening) for opening in ("wide", True, 0)),
        dict(max_opening=1.0, finger=(1, 2)),
        dict(max_opening=1.0, palm=(1, 0, 1)),
        dict(max_opening=1.0, finger=(1, 1, 1), reach=1.5),
    ],
)
def test_impossible_grippers_are_refused(options):
    with pytest.raises(InvalidParameterError):
        Gripper(**options)


def bar(n=6000, half=(0.6, 0.12, 0.04), turn=0.5, seen=None):
    """A flat bar along x, turned about it, with the points of its surface, or those `seen`, and its axis."""
    rng = np.random.default_rng(0)
    points, side = rng.uniform(-1, 1, (n, 3)) * half, rng.integers(1, 3, n)
    row, sign = np.arange(n), rng.choice([-1, 1], n)
    normals = np.zeros((n, 3))
    points[row, side] = sign * np.array(half)[side]
    normals[row, side] = 1
    rotation = Rotation.from_rotvec([turn, 0, 0])
    shown = np.ones(n, bool) if seen is None else seen(points)
    x = np.linspace(-0.6, 0.6, 13)
    axis, edges, radius = x[:, None] * [1.0, 0, 0], np.column_stack([row[:12], row[1:13]]), np.sqrt(half[1] * half[2])
    owner = abs(points[shown, :1] - x).argmin(axis=1)
    places, facing = rotation.apply(points[shown]), rotation.apply(normals[shown])
    return Skeleton(axis, edges, [radius] * 13, owner, places, facing, confidence=[1] * 13), rotation


def test_the_jaws_close_across_the_thin_side():
    skeleton, turn = bar()
    best = grasp(skeleton)
    best = best[: best.places]
    np.testing.assert_allclose(abs(best.closing @ turn.apply([0, 0, 1])), 1, atol=0.02)
    np.testing.assert_allclose(best.opening, 0.08 + 3 * CLEARANCE, atol=0.03)  # turned by 6 degrees
    np.testing.assert_allclose(best.contact, 1, atol=0.05)


def test_an_unseen_side_is_as_far_as_the_other_and_the_middle_is_between_the_jaws():
    half, _ = bar(turn=0.0, seen=lambda points: points[:, 2] > 0)
    best = grasp(half, around=4)
    across = abs(best.closing[:, 2]) > 0.99
    np.testing.assert_allclose(best.opening[across], 0.08 + 3 * CLEARANCE, atol=0.01)
    assert best.seen[across].max() == 2
    whole, _ = bar(turn=0.0)
    lowered = grasp(replace(whole, vertices=whole.vertices - [0, 0, 0.01]), around=4)  # an axis beside the middle
    np.testing.assert_allclose(lowered.position[abs(lowered.closing[:, 2]) > 0.99, 2], 0, atol=2e-3)


def test_outliers_do_not_block_fingers():
    free, rng = grasp(rod()), np.random.default_rng(1)
    scattered = rod(rng.uniform(-0.8, 0.8, (60, 3)))
    assert len(grasp(scattered)) > 0.9 * len(free)
    with pytest.warns(SkeletonWarning, match="touch"):
        assert len(grasp(scattered, outlier_factor=0)) == 0


def test_a_budget_takes_the_best_places_first():
    skeleton, _ = bar()
    everything, some = grasp(skeleton), grasp(skeleton, max_places=3)
    assert (some.places, some.left_out["places not searched"]) == (3, everything.places - 3)
    assert len(np.unique(some.branch * 1e3 + some.position[:, 0].round(2))) == 3
    assert some.quality.max() >= everything.quality.max() - 0.02


@pytest.mark.parametrize(("seconds", "searched"), [(0, 1), (0.02, 1), (1.5, 2), (3.5, 4), (1e6, 22)])
def test_seconds_are_over_after_at_most_one_more_place(monkeypatch, seconds, searched):
    """With a clock that goes on by a second in each search, and by a thousandth whenever it is read."""
    clock, check = [0.0], grasps.check_approaches

    def read():
        clock[0] += 0.001
        return clock[0]

    def search(*words):
        clock[0] += 1
        return check(*words)

    monkeypatch.setattr(time, "monotonic", read)
    monkeypatch.setattr(grasps, "check_approaches", search)
    skeleton, _ = bar()
    found = grasp(skeleton, spacing=0.05, seconds=seconds)
    assert found.places == searched
    assert clock[0] < seconds + 1.01
    check_same(found, grasp(skeleton, spacing=0.05, max_places=searched)) if seconds >= 1 else None


def test_the_scene_is_an_obstacle_and_the_mask_says_what_the_object_is():
    alone, walled = rod(), rod(WALL)
    mask = np.arange(len(walled.points)) < len(alone.points)
    plain = replace(alone, points=(), normals=(), vertex_of_point=())
    masked = grasp(plain, cloud=walled.points, mask=mask)
    assert masked.left_out[TOUCHING] == 3 * masked.places
    check_same(masked, grasp(walled))
    assert grasp(alone, cloud=walled.points).left_out == masked.left_out
    for wrong in (mask[:5], 1 * mask, ~mask & mask):
        with pytest.raises(InvalidParameterError, match="mask"):
            grasp(plain, cloud=walled.points, mask=wrong)


def test_no_curve_skeleton_has_no_grasps_unless_it_is_accepted():
    skeleton = rod()
    sheet_like = skeleton.with_report(skeleton.report.with_reason("sheet", "this is a sheet"))
    with pytest.warns(SkeletonWarning, match="no curve skeleton.*this is a sheet.*accept"):
        assert len(grasp(sheet_like)) == 0
    assert len(grasp(sheet_like, accept="no curve skeleton")) == len(grasp(skeleton))
    calls = tuple(Decision(about, (0.0, 0.0, 0.0), 0.5, changed=False) for about in ("loop", "limb"))
    unsure = rod().with_facts(decisions=calls)
    with pytest.warns(SkeletonWarning, match=r"doubtful \(low score: .*accept"):
        assert len(grasp(unsure, accept="good")) == 0
    with pytest.raises(InvalidParameterError, match="accept"):
        grasp(skeleton, accept="any")
