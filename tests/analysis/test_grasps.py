"""Grasp candidates on axes whose openings, counts and directions are known."""

import json
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, SkeletonWarning, samples
from glsk_o3d.analysis import grasp_candidates as checked_candidates

WIDE = 10.0


def axis_of(sample, confidence=1.0):
    confidence = np.full(len(sample.nodes), confidence)
    return Skeleton(sample.nodes, sample.edges, sample.radii, (), (), (), confidence=confidence)


def cone(start=0.1, end=0.25, length=1.0, pieces=7):
    """A tapered tube along x; the radii are those of the balls that touch it, as in `samples`."""
    x = np.linspace(0, length, pieces + 1)
    row = np.arange(pieces)
    radii = start + (end - start) / length * x
    return Skeleton(x[:, None] * [1.0, 0, 0], np.column_stack([row, row + 1]), radii, (), (), (), confidence=0 * x + 1)


TUBE = axis_of(samples.tube(10, length=1.0, radius=0.1))
SAUROPOD = axis_of(samples.sauropod(10))


def grasp_candidates(skeleton, gripper, **options):
    """By the axis and the radii alone."""
    return checked_candidates(skeleton, gripper, cloud=(), **options)


def test_a_straight_tube():
    grasps = grasp_candidates(TUBE, 0.5, clearance=0.03, around=6, spacing=0.1)
    identity = grasps.poses[:, :3, :3].transpose(0, 2, 1) @ grasps.poses[:, :3, :3]
    np.testing.assert_allclose(identity, np.tile(np.eye(3), (54, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(grasps.poses), 1)
    assert (len(grasps), grasps.places, grasps.left_out) == (54, 9, {})
    along = np.tile(np.linspace(-0.4, 0.4, 9)[:, None] * [1, 0, 0], (6, 1))  # each place once, six times over
    np.testing.assert_allclose(grasps.position, along, atol=1e-12)
    np.testing.assert_allclose(grasps.opening, 0.29)
    np.testing.assert_allclose(grasps.quality, 1 - 0.2 / 0.5)
    np.testing.assert_allclose(grasps.axis, np.tile([1, 0, 0], (54, 1)), atol=1e-12)
    np.testing.assert_allclose(grasps.approach[0], [0, 0, -1], atol=1e-12)  # from above
    turn = np.einsum("igj,kgj->gik", *[grasps.approach.reshape(6, 9, 3)] * 2)
    step = np.arange(6)
    np.testing.assert_allclose(turn, np.tile(np.cos(np.pi / 3 * (step - step[:, None])), (9, 1, 1)), atol=1e-12)


@pytest.mark.parametrize("skeleton", [TUBE, cone(), cone(0.25, 0.04)])
def test_jaws_without_clearance_touch_the_surface(skeleton):
    grasps = grasp_candidates(skeleton, WIDE, clearance=0, around=5)
    for side in (-1, 1):
        jaws = grasps.position + side * grasps.opening[:, None] / 2 * grasps.closing
        distance = samples.signed_distance(jaws, skeleton.vertices, skeleton.edges, skeleton.radii)
        np.testing.assert_allclose(distance, 0, atol=1e-12)


def test_a_cone_is_wider_across_than_the_ball_in_it():
    grasps = grasp_candidates(cone(0.1, 0.25), 1.0, clearance=0.01, spacing=0.1)
    slope, radius = 0.15, 0.1 + 0.15 * grasps.position[:, 0]
    width = 2 * radius / np.sqrt(1 - slope**2)
    np.testing.assert_allclose(grasps.opening, width + 0.03)
    np.testing.assert_allclose(grasps.quality, (1 - width) * np.sqrt(1 - slope**2))
    assert (np.diff(grasps.position[: grasps.places, 0]) > 0).all()  # the thin end is best


def test_a_torus():
    skeleton = axis_of(samples.torus(10, ring_radius=0.4, radius=0.1))
    grasps = grasp_candidates(skeleton, 0.5, clearance=0.05, around=4)
    assert grasps.places == round(2 * np.pi * 0.4 / 0.1) == 25
    np.testing.assert_allclose(grasps.opening, 0.35)
    position, out = grasps.position[:25], grasps.position / np.linalg.norm(grasps.position, axis=1, keepdims=True)
    gap = np.linalg.norm(position - np.roll(position, 1, axis=0), axis=1)
    np.testing.assert_allclose(gap, 2 * 0.4 * np.sin(np.pi / 25), rtol=2e-3)
    turned = np.abs(np.einsum("ij,ij->i", grasps.axis, out))
    assert turned.max() <= np.sin(np.pi / 128)  # of the polygon that stands for the circle
    np.testing.assert_allclose(grasps.approach[:25], np.tile([0, 0, -1], (25, 1)), atol=1e-9)


@pytest.mark.parametrize(("spacing", "count"), [(0.1, 9), (0.8, 2), (0.81, 1), (5.0, 1)])
def test_places_share_the_room_between_the_margins(spacing, count):
    x = grasp_candidates(TUBE, WIDE, spacing=spacing, around=1).position[:, 0]
    assert len(x) == count
    np.testing.assert_allclose(np.diff(np.sort(x)), spacing)
    np.testing.assert_allclose(x.min(), -x.max(), atol=1e-12)


def test_places_keep_away_from_ends_and_junctions():
    sample = samples.y_junction(10, radii=(0.09, 0.05, 0.05))
    grasps = grasp_candidates(axis_of(sample), WIDE, spacing=0.01)
    distance = np.linalg.norm(grasps.position[:, None] - sample.nodes, axis=2)
    assert (distance >= sample.radii - 1e-12).all()
    np.testing.assert_allclose(distance.min(axis=0), sample.radii, atol=0.01)
    assert set(grasps.branch) == {0, 1, 2}


def test_a_loop_with_a_junction_has_margins_too(loop):
    skeleton = replace(loop, radii=np.full(6, 0.2), confidence=np.ones(6), edges=[[0, 1], [1, 2], [2, 3], [0, 3]])
    whole = grasp_candidates(skeleton, WIDE, spacing=0.01, around=1)
    tailed = replace(skeleton, edges=[*skeleton.edges, [0, 5]])
    assert whole.places == round(skeleton.length / 0.01)
    grasps = grasp_candidates(tailed, WIDE, spacing=0.01, around=1)
    ring = grasps.branch == next(i for i, path in enumerate(tailed.branches) if path[0] == path[-1])
    assert np.linalg.norm(grasps.position[ring] - tailed.vertices[0], axis=1).min() > 0.19
    assert 0 < ring.sum() == int((skeleton.length - 0.4) / 0.01) + 1


def test_every_place_has_grasps_or_a_reason():
    doubtful = replace(SAUROPOD, confidence=np.where(SAUROPOD.vertices[:, 0] > 0.3, 0.2, 0.9))
    grasps = grasp_candidates(doubtful, 0.16, clearance=0.01, around=3)
    assert set(grasps.left_out) >= {"too wide", "uncertain"}
    places = sum(count for reason, count in grasps.left_out.items() if not reason.startswith("branches"))
    assert len(grasps) == 3 * (grasps.places - places)
    assert grasps.opening.max() <= 0.16
    assert grasps.confidence.min() >= 0.5
    assert 0 < grasps.quality.min() <= grasps.quality.max() < 0.9


@pytest.mark.parametrize(
    ("skeleton", "gripper"),
    [
        (TUBE, 0.2),
        (axis_of(samples.tube(10), 0.2), 1.0),
        (replace(TUBE, radii=[0.6, 0.6]), 2.0),
        (replace(TUBE, edges=()), 1.0),
    ],
    ids=["too wide", "uncertain", "too short", "without a branch"],
)
def test_where_there_is_no_grasp_a_warning_says_why(skeleton, gripper, tmp_path):
    with pytest.warns(SkeletonWarning, match=r"no grasp at \d+ places: ."):
        grasps = grasp_candidates(skeleton, gripper)
    assert len(grasps) == len(list(grasps)) == 0
    assert grasps.position.shape == grasps.approach.shape == grasps.closing.shape == grasps.axis.shape == (0, 3)
    assert grasps.poses.shape == (0, 4, 4)
    grasps.to_json(tmp_path / "g.json")
    assert json.loads((tmp_path / "g.json").read_text())["grasps"] == []


def test_a_gripper_in_other_units_warns():
    with pytest.warns(SkeletonWarning, match="more than 20 times as wide"):
        assert len(grasp_candidates(TUBE, 80.0)) > 0


def test_unknown_confidence_and_radii():
    unknown = replace(TUBE, confidence=())
    with pytest.raises(InvalidParameterError, match="min_confidence=0"):
        grasp_candidates(unknown, 0.5)
    grasps = grasp_candidates(unknown, 0.5, min_confidence=0)
    assert np.isnan(grasps.confidence).all()
    np.testing.assert_array_equal(grasps.quality, grasp_candidates(TUBE, 0.5).quality)
    with pytest.raises(InvalidParameterError, match="radii"):
        grasp_candidates(replace(TUBE, radii=[np.nan] * 2), 0.5)
    half = replace(cone(), radii=np.where(np.arange(8) < 4, 0.1, np.nan))
    grasps = grasp_candidates(half, 0.5)
    assert grasps.left_out["unknown radius"] > 0
    assert grasps.position[:, 0].max() < 3 / 7


@pytest.mark.parametrize("wrong", [dict(clearance=-0.1), dict(spacing=0.0), dict(min_confidence=1.1), dict(around=0)])
def test_impossible_options_and_an_empty_skeleton_are_refused(wrong):
    with pytest.raises(InvalidParameterError, match=next(iter(wrong))):
        grasp_candidates(TUBE, 1.0, **wrong)
    with pytest.raises(InvalidParameterError, match="empty"):
        grasp_candidates(Skeleton((), (), (), (), (), ()), 1.0)


def test_rows_are_selected_by_slice_numbers_or_mask():
    grasps = grasp_candidates(SAUROPOD, 0.2)
    for rows in (slice(3), [5], grasps.branch == 2):
        for name in ("position", "approach", "closing", "opening", "depth", "branch", "confidence", "quality", "seen"):
            np.testing.assert_array_equal(getattr(grasps[rows], name), getattr(grasps, name)[rows])
    with pytest.raises(IndexError):
        grasps[len(grasps)]


def test_lines_of_the_gripper():
    grasps = grasp_candidates(SAUROPOD, 0.2, around=2)
    lines = grasps.to_line_set()
    points, tip = np.asarray(lines.points).reshape(-1, 6, 3), grasps.position + grasps.depth[:, None] * grasps.approach
    np.testing.assert_allclose(points[:, [0, 3]].mean(axis=1), tip, atol=1e-12)
    np.testing.assert_allclose(points[:, 0] - points[:, 3], grasps.opening[:, None] * grasps.closing, atol=1e-12)
    np.testing.assert_allclose(points[:, 4], tip - grasps.gripper.finger[2] * grasps.approach, atol=1e-12)
    steps = np.diff(np.asarray(lines.points)[np.asarray(lines.lines)], axis=1)
    assert len(steps) == 4 * len(grasps)
    assert np.linalg.norm(steps, axis=2).min() > 0.4 * grasps.opening.min()
