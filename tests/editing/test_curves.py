"""Resampled, smoothed and transformed skeletons."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, pipelines, samples, skeletonize
from glsk_o3d.editing import resample, smooth, transform
from glsk_o3d.geometry.polylines import arc_lengths
from glsk_o3d.geometry.vectors import norm

RNG = np.random.default_rng(1)


@pytest.fixture(scope="module")
def animal():
    return skeletonize(samples.sauropod(2000).points)


def structure(skeleton):
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves), len(skeleton.junctions)


@pytest.mark.parametrize("spacing", [0.01, 0.05, 10.0])
def test_a_resampled_curve_has_equal_steps_on_each_branch_and_the_same_graph(animal, spacing):
    other = resample(animal, spacing=spacing)
    assert structure(other) == structure(animal)
    for path in other.branches:
        steps = other.edge_lengths[other.edges_along([path])]
        if spacing < 0.05:
            assert np.quantile(np.abs(steps / np.median(steps) - 1), 0.8) < 0.1  # corners are cut
    assert other.nearest(animal.vertices).distance.max() < max(spacing, 1e-9)
    assert animal.nearest(other.vertices).distance.max() < 1e-12
    ends = {tuple(place) for place in animal.vertices[[*animal.leaves, *animal.junctions]]}
    assert ends == {tuple(place) for place in other.vertices[[*other.leaves, *other.junctions]]}


def test_points_keep_to_the_nearest_vertex_along_the_curve(animal):
    other = resample(animal, spacing=0.02)
    np.testing.assert_array_equal(other.vertex_of_point < 0, animal.vertex_of_point < 0)
    along = other.nearest(other.points)
    offset = norm(other.vertices[other.vertex_of_point] - along.position)
    assert (offset < 0.011).mean() > 0.85  # others are nearest to another part of the curve


def test_loops_and_double_edges_survive_any_spacing():
    theta = Skeleton(
        [[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0], [9, 0, 0], [10, 0, 0], [9, 1, 0]],
        [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [4, 5], [4, 6], [5, 6]],
        np.ones(7),
        (),
        (),
        (),
    )
    assert structure(resample(theta, spacing=100.0)) == structure(theta)


def test_a_tree_keeps_its_root_at_vertex_0():
    tree = pipelines.tree()(samples.tree(3000, forks=2).points)
    other = resample(tree, spacing=0.02)
    np.testing.assert_array_equal(other.vertices[0], tree.vertices[0])
    np.testing.assert_array_equal(np.sort(other.edges[:, 1]), np.arange(1, len(other.vertices)))  # a parent each
    inner = replace(tree, report=replace(tree.report, root=()))
    assert resample(inner, spacing=0.02).n_loops == 0


def ring_with_waves(waves, height, n=240):
    """A circle of radius 1 with waves across its plane."""
    turn = 2 * np.pi * np.arange(n) / n
    places = np.column_stack([np.cos(turn), np.sin(turn), height * np.sin(waves * turn)])
    return Skeleton(places, np.sort(np.column_stack([np.arange(n), np.roll(np.arange(n), -1)])), np.ones(n), (), (), ())


@pytest.mark.parametrize("ratio", [0.5, 1, 2])
def test_waves_keep_the_share_of_their_height_that_the_formula_says(ratio):
    ring = ring_with_waves(waves=12, height=0.01)
    length = ring.edge_lengths.sum() / 12
    kept = np.abs(smooth(ring, length=ratio * length).vertices[:, 2]).max() / 0.01
    np.testing.assert_allclose(kept, 1 / (1 + ratio**4), rtol=0.03)


def test_smoothing_takes_the_noise_from_a_helix():
    t = np.linspace(0, 4 * np.pi, 200)
    helix = np.column_stack([np.cos(t), np.sin(t), 0.2 * t])
    edges = np.column_stack([np.arange(199), np.arange(1, 200)])
    noise = np.random.default_rng(2).normal(scale=0.01, size=helix.shape)
    noisy = Skeleton(helix + noise, edges, np.ones(200), (), (), ())
    smoother = smooth(noisy, length=1.0)
    curvature, distance = (
        [np.nanmedian(error) for error in errors]
        for errors in (
            [np.abs(curve.curvature - 1 / (1 + 0.2**2)) for curve in (noisy, smoother)],
            [norm(curve.vertices - helix) for curve in (noisy, smoother)],
        )
    )
    assert curvature[1] < 0.1 * curvature[0]
    assert distance[1] < 0.6 * distance[0]
    np.testing.assert_array_equal(smoother.vertices[[0, -1]], noisy.vertices[[0, -1]])


def test_smoothing_keeps_junctions_and_ends(animal):
    fixed = [*animal.leaves, *animal.junctions]
    np.testing.assert_array_equal(smooth(animal, length=0.2).vertices[fixed], animal.vertices[fixed])


def test_a_transformed_skeleton_is_that_of_the_transformed_cloud(animal):
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = 3 * turn, [1, -2, 5]
    moved = transform(animal, matrix)
    np.testing.assert_allclose(moved.vertices, 3 * animal.vertices @ turn.T + [1, -2, 5])
    np.testing.assert_allclose(moved.edge_lengths, 3 * animal.edge_lengths)
    for name in ("radii", "half_width", "half_thickness"):
        np.testing.assert_allclose(getattr(moved, name), 3 * getattr(animal, name))
    for before, after in zip(animal.report.decisions, moved.report.decisions, strict=True):
        np.testing.assert_allclose(after.place, 3 * turn @ before.place + [1, -2, 5])
        np.testing.assert_allclose(after.radii, np.multiply(3, before.radii))
    query = RNG.normal(size=(50, 3))
    np.testing.assert_allclose(
        moved.nearest(3 * query @ turn.T + [1, -2, 5]).distance, 3 * animal.nearest(query).distance
    )
    back = transform(moved, np.linalg.inv(matrix))
    np.testing.assert_allclose(back.points, animal.points, atol=1e-12)
    np.testing.assert_allclose(back.normals, animal.normals, atol=1e-12)


@pytest.mark.parametrize(
    ("edit", "options"),
    [
        *((resample, dict(spacing=wrong)) for wrong in (0, -1, np.nan, "1")),
        *((smooth, dict(length=wrong)) for wrong in (0, -1, np.inf)),
        *((transform, dict(matrix=wrong)) for wrong in (np.eye(3), np.diag([1, 2, 1, 1]), 0 * np.eye(4), "turn", None)),
    ],
)
def test_wrong_options_are_refused(animal, edit, options):
    with pytest.raises(InvalidParameterError):
        edit(animal, **options)


def test_a_branch_of_one_edge_stays(animal):
    line = Skeleton([[0, 0, 0], [1, 0, 0]], [[0, 1]], np.ones(2), (), (), ())
    np.testing.assert_array_equal(smooth(line, length=1.0).vertices, line.vertices)
    np.testing.assert_allclose(arc_lengths(resample(line, spacing=0.3).vertices[[0, 2, 3, 1]])[-1], 1)
