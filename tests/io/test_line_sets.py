"""Skeletons as line sets of both APIs."""

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.io.colors import COLOR_NAMES
from glsk_o3d.io.line_sets import to_line_set


@pytest.fixture(scope="module", params=[np.float32, np.float64])
def branched(request):
    return glsk.skeletonize(samples.y_junction(800).points.astype(request.param))


def test_line_set(skeleton):
    lines = skeleton.to_line_set()
    assert isinstance(lines, o3d.geometry.LineSet)
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines).reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(
        np.asarray(to_line_set(skeleton, (0, 0.5, 1)).colors).reshape(-1, 3),
        np.tile([0, 0.5, 1], (len(skeleton.edges), 1)),
    )


def test_tensor_line_set(skeleton):
    lines = skeleton.to_tensor_line_set()
    assert isinstance(lines, o3d.t.geometry.LineSet)
    assert lines.point.positions.dtype == o3d.core.float64
    np.testing.assert_array_equal(lines.point.positions.numpy(), skeleton.vertices)
    np.testing.assert_array_equal(lines.point.radius.numpy(), skeleton.radii[:, None])
    assert set(lines.point) == {"positions", "radius", "confidence", "half_width", "half_thickness", "support"}
    np.testing.assert_array_equal(lines.point.half_width.numpy(), skeleton.half_width[:, None])
    np.testing.assert_array_equal(lines.point.half_thickness.numpy(), skeleton.half_thickness[:, None])
    assert lines.point.confidence.dtype == o3d.core.float64
    np.testing.assert_array_equal(lines.point.confidence.numpy(), skeleton.confidence[:, None])
    np.testing.assert_array_equal(lines.line.indices.numpy(), skeleton.edges)
    legacy = lines.to_legacy()
    np.testing.assert_array_equal(np.asarray(legacy.lines).reshape(-1, 2), skeleton.edges)


def test_line_sets_do_not_alias_the_skeleton(tree):
    before = tree.vertices.copy()
    tensor, legacy = tree.to_tensor_line_set(), tree.to_line_set()
    tensor.point.positions += 1
    legacy.translate((1, 1, 1))
    np.testing.assert_array_equal(tree.vertices, before)


def test_colours_without_radii_or_confidence(branched):
    bare = glsk.Skeleton(branched.vertices, branched.edges, np.full(len(branched.radii), np.nan), (), (), ())
    for color in ("radius", "confidence", "thickness"):
        assert (np.asarray(bare.to_line_set(color).colors) == 0.6).all()
    even = glsk.Skeleton([[0, 0, 0], [1, 0, 0]], [(0, 1)], [1, 1], (), (), ())
    assert np.ptp(np.asarray(even.to_line_set("radius").colors)) > 0


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("color", [*COLOR_NAMES, (0.1, 0.2, 0.3)])
def test_line_sets_in_colour_without_edges(count, color):
    lone = glsk.Skeleton(np.zeros((count, 3)), (), np.ones(count), (), (), (), confidence=np.ones(count))
    legacy, tensor = lone.to_line_set(color), lone.to_tensor_line_set(color)
    assert (len(legacy.points), len(legacy.lines), len(legacy.colors)) == (count, 0, 0)
    assert tuple(tensor.point.positions.shape) == (count, 3)
    assert tuple(tensor.line.indices.shape) == (0, 2)
    assert tuple(tensor.line.colors.shape) == (0, 3)
    assert len(lone.to_tubes(color).vertex_colors) == len(lone.to_tubes(color).vertices)


def test_line_sets_in_colour(branched):
    for color, distinct in (("branch", 3), ((0.1, 0.2, 0.3), 1), ("radius", None), ("confidence", None)):
        legacy = np.asarray(branched.to_line_set(color).colors)
        tensor = branched.to_tensor_line_set(color)
        np.testing.assert_array_equal(tensor.line.colors.numpy(), legacy)
        assert legacy.shape == (len(branched.edges), 3)
        count = len(np.unique(legacy, axis=0))
        assert count == distinct if distinct else count > 5
    plain = branched.to_tensor_line_set()
    assert "colors" not in plain.line
    for path, branch in zip(branched.branches, range(3), strict=True):
        rows = np.isin(branched.edges, path).all(axis=1)
        assert (plain.line.branch.numpy()[rows] == branch).all()
