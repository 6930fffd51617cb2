"""Subdivision of edges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton


def bar(per, radii=(0.1, 0.2)):
    """One edge of length 1; each end owns `per` points."""
    x = np.concatenate([np.linspace(0, 0.49, per), np.linspace(0.51, 1, per)])
    points, normals = np.column_stack([x, 0 * x, np.repeat(radii, per)]), np.tile([0.0, 0, 1], (2 * per, 1))
    return Skeleton([[0, 0, 0], [1, 0, 0]], [(0, 1)], radii, np.repeat([0, 1], per), points, normals)


@pytest.mark.parametrize(
    ("per", "spacing", "pieces"),
    [
        *((400, spacing, pieces) for spacing, pieces in [(0.5, 14), (1.0, 7), (2.0, 4), (6.6, 2), (6.8, 1), (50.0, 1)]),
        *((per, 0.5, pieces) for per, pieces in [(2, 1), (4, 1), (8, 2), (20, 5)]),
    ],
)
def test_edges_are_as_long_as_a_share_of_the_mean_radius_and_have_eight_points_each(refine, per, spacing, pieces):
    skeleton = refine(bar(per), spacing=spacing)
    np.testing.assert_allclose(np.sort(skeleton.vertices[:, 0]), np.linspace(0, 1, pieces + 1), atol=1e-12)
    np.testing.assert_array_equal(np.sort(skeleton.degree), [1, 1] + [2] * (pieces - 1))


def test_tiny_radii_make_no_endless_subdivision(refine):
    assert len(refine(bar(5000, radii=(0, 0)), spacing=0.5).edges) <= 1000


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 9), st.floats(0.2, 0.4), st.floats(0.3, 5))
def test_subdivision_keeps_topology_and_length(random_skeleton, refine, seed, m, reach, spacing):
    raw = refine(random_skeleton(seed, m, reach, n=200))
    skeleton = refine(raw, spacing=spacing)
    m = len(raw.vertices)
    np.testing.assert_allclose(skeleton.vertices[:m], raw.vertices, atol=1e-12)
    np.testing.assert_array_equal(skeleton.degree[:m], raw.degree)
    assert (skeleton.degree[m:] == 2).all()
    assert (skeleton.n_components, skeleton.n_loops) == (raw.n_components, raw.n_loops)
    assert skeleton.length == pytest.approx(raw.length)
    np.testing.assert_array_equal(skeleton.edges, np.unique(np.sort(skeleton.edges, axis=1), axis=0))


def test_points_never_cross_to_a_strand_that_only_passes_by(refine):
    """Two parallel bars, nearer to each other's samples than to their own vertex."""
    vertices = [[-1, 0, 0], [1, 0, 0], [-1, 0.1, 0], [1, 0.1, 0]]
    x, side = np.tile(np.linspace(-1, 1, 400), 2), np.repeat([0, 1], 400)
    points, normals = np.column_stack([x, 0 * x + 0.05, 0 * x]), np.tile([0.0, 1, 0], (800, 1))
    bars = Skeleton(vertices, [(0, 1), (2, 3)], np.full(4, 0.1), 2 * side + (x > 0), points, normals)
    skeleton = refine(bars, spacing=1.0)
    assert len(skeleton.vertices) > 30
    np.testing.assert_array_equal(skeleton.vertices[skeleton.vertex_of_point, 1] > 0.05, side == 1)
    assert np.abs(skeleton.vertices[skeleton.vertex_of_point, 0] - points[:, 0]).max() < 0.051
