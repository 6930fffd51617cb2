"""Subdivision of edges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton
from glsk_o3d.refinement.axis_fit import POINTS_PER_PIECE, subdivide_edges


def bar(per, radii=(0.1, 0.2), length=1.0):
    """One edge; each end owns `per` points."""
    x = np.concatenate([np.linspace(0, 0.49, per), np.linspace(0.51, 1, per)]) * length
    points, normals = np.column_stack([x, 0 * x, np.repeat(radii, per)]), np.tile([0.0, 0, 1], (2 * per, 1))
    return Skeleton([[0, 0, 0], [length, 0, 0]], [(0, 1)], radii, np.repeat([0, 1], per), points, normals)


@pytest.mark.parametrize(("spacing", "pieces"), [(0.5, 14), (1.0, 7), (2.0, 4), (6.6, 2), (6.8, 1), (50.0, 1)])
def test_edges_are_as_long_as_the_share_of_the_mean_radius(spacing, pieces):
    skeleton = subdivide_edges(bar(400), spacing)
    assert len(skeleton.edges) == pieces
    np.testing.assert_allclose(skeleton.edge_lengths, 1 / pieces)
    assert skeleton.edge_lengths.max() <= spacing * 0.15 or pieces == 1
    np.testing.assert_allclose(skeleton.vertices[2:, 0], np.arange(1, pieces) / pieces)
    np.testing.assert_allclose(skeleton.radii[2:], 0.1 + 0.1 * np.arange(1, pieces) / pieces)


@pytest.mark.parametrize(("per", "pieces"), [(2, 1), (4, 1), (8, 2), (20, 5), (400, 14)])
def test_every_piece_has_its_eight_points(per, pieces):
    assert len(subdivide_edges(bar(per), 0.5).edges) == pieces
    assert POINTS_PER_PIECE == 8


def test_points_of_a_vertex_are_shared_by_its_edges(ringed):
    """A star of four edges: a quarter of the centre's points each."""
    tips = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    skeleton = subdivide_edges(ringed([[0, 0, 0], *tips], [(0, i) for i in range(1, 5)], per=16), 0.01)
    # 16 / 4 + 16 = 20 points, 2.5 pieces
    assert len(skeleton.edges) == 4 * 3


def test_tiny_radii_make_no_endless_subdivision():
    assert len(subdivide_edges(bar(5000, radii=(0, 0)), 0.5).edges) <= 1000


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.integers(1, 9), st.floats(0.2, 1.2), st.floats(0.3, 5))
def test_topology_and_length_stay(random_skeleton, seed, m, reach, spacing):
    raw = random_skeleton(seed, m, reach, n=200)
    skeleton = subdivide_edges(raw, spacing)
    np.testing.assert_array_equal(skeleton.vertices[:m], raw.vertices)
    np.testing.assert_array_equal(skeleton.radii[:m], raw.radii)
    np.testing.assert_array_equal(skeleton.degree[:m], raw.degree)
    assert (skeleton.degree[m:] == 2).all()
    assert (skeleton.n_components, skeleton.n_loops) == (raw.n_components, raw.n_loops)
    assert skeleton.length == pytest.approx(raw.length)
    assert (skeleton.edges[:, 0] < skeleton.edges[:, 1]).all()
    np.testing.assert_array_equal(skeleton.edges, np.unique(skeleton.edges, axis=0))


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.integers(2, 5))
def test_points_go_to_the_nearest_sample_of_their_own_vertex(random_skeleton, seed, m):
    """Brute force: the vertex itself and the inner samples of its edges."""
    raw = random_skeleton(seed, m, 0.6, n=60)
    skeleton = subdivide_edges(raw, 1.0)
    samples = {v: [v] for v in range(m)}
    for edge in raw.edges.tolist():
        (a, b), ends = edge, raw.vertices[edge]
        along = ends[1] - ends[0]
        t = (skeleton.vertices[m:] - ends[0]) @ along / (along @ along)
        on = np.linalg.norm(skeleton.vertices[m:] - ends[0] - t[:, None] * along, axis=1) < 1e-9
        inner = (m + np.flatnonzero(on & (t > 0) & (t < 1))).tolist()
        samples[a] += inner
        samples[b] += inner
    few = len(skeleton.vertices) <= 16
    for point, before, after in zip(raw.points, raw.vertex_of_point, skeleton.vertex_of_point, strict=True):
        if before < 0:
            assert after == -1
            continue
        assert after in samples[before]
        if few:  # all are among the nearest 16
            nearest = min(samples[before], key=lambda v: np.linalg.norm(point - skeleton.vertices[v]))
            assert after == nearest


def test_points_never_cross_to_a_strand_that_only_passes_by():
    """Two parallel bars, nearer to each other's samples than to their own vertex."""
    vertices = [[-1, 0, 0], [1, 0, 0], [-1, 0.1, 0], [1, 0.1, 0]]
    x = np.tile(np.linspace(-1, 1, 400), 2)
    side = np.repeat([0, 1], 400)
    points, normals = np.column_stack([x, 0 * x + 0.05, 0 * x]), np.tile([0.0, 1, 0], (800, 1))
    vertex = 2 * side + (x > 0)
    skeleton = subdivide_edges(Skeleton(vertices, [(0, 1), (2, 3)], np.full(4, 0.1), vertex, points, normals), 1.0)
    assert len(skeleton.vertices) > 30
    np.testing.assert_array_equal(skeleton.vertices[skeleton.vertex_of_point, 1] > 0.05, side == 1)
    assert np.abs(skeleton.vertices[skeleton.vertex_of_point, 0] - points[:, 0]).max() < 0.051


@pytest.mark.parametrize("radii", [(0.1, 0.2), (0.0, 0.0)])
def test_an_edge_of_no_length_stays(radii):
    points = bar(40).points * 0
    nowhere = Skeleton(np.zeros((2, 3)), [(0, 1)], radii, np.repeat([0, 1], 40), points, np.ones((80, 3)))
    assert len(subdivide_edges(nowhere, 0.5).edges) == 1
