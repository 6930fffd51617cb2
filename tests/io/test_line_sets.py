"""Skeletons as line sets of both APIs."""

import numpy as np
import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.io.colors import COLOR_NAMES
from glsk_o3d.skeleton import OF_VERTICES


@pytest.fixture(scope="module", params=[np.float32, np.float64])
def branched(request):
    return glsk.skeletonize(samples.y_junction(800).points.astype(request.param))


def test_line_sets_of_both_kinds_have_their_own_copy_of_the_graph(skeleton):
    legacy, tensor = skeleton.to_line_set((0, 0.5, 1)), skeleton.to_tensor_line_set()
    assert isinstance(legacy, o3d.geometry.LineSet)
    np.testing.assert_array_equal(np.asarray(legacy.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(legacy.lines).reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(np.asarray(legacy.colors), np.tile([0, 0.5, 1], (len(skeleton.edges), 1)))
    assert isinstance(tensor, o3d.t.geometry.LineSet)
    expected = {"positions": skeleton.vertices, "radius": skeleton.radii[:, None]}
    expected |= {name: getattr(skeleton, name)[:, None] for name in OF_VERTICES[1:]}
    assert set(tensor.point) == expected.keys()
    for name, values in expected.items():
        assert tensor.point[name].dtype == o3d.core.float64
        np.testing.assert_array_equal(tensor.point[name].numpy(), values)
    np.testing.assert_array_equal(tensor.line.indices.numpy(), skeleton.edges)
    before = skeleton.vertices.copy()
    tensor.point.positions += 1
    legacy.translate((1, 1, 1))
    np.testing.assert_array_equal(skeleton.vertices, before)


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
