"""Merging of vertices by its definition."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.refinement.merging import drop_lone_vertices, merge_vertices
from glsk_o3d.refinement.sections import VertexPoints


def test_support_counts_supporting_points_and_is_at_least_one(ringed):
    raw = ringed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1)], per=3)
    normals = raw.normals.copy()
    normals[[0, 1]] = np.nan  # set aside
    vertex = np.array([0, 0, 0, 1, 1, -1, 1, 1, 1])
    skeleton = replace(raw, normals=normals, vertex_of_point=vertex)
    assert VertexPoints(skeleton).mass.tolist() == [1, 5, 1]
    assert VertexPoints(skeleton).mass.dtype == float


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.lists(st.integers(-3, 5), min_size=12, max_size=12), st.booleans())
def test_by_its_definition(random_skeleton, seed, labels, every):
    raw, group = random_skeleton(seed, every=every), np.array(labels)
    raw = replace(raw, half_width=2 * raw.radii)
    skeleton = merge_vertices(raw, group)
    names = sorted(set(labels))
    weight = VertexPoints(raw).mass
    for v, name in enumerate(names):
        inside = group == name
        for merged, own in ((skeleton.vertices, raw.vertices), (skeleton.half_width, raw.half_width)):
            np.testing.assert_allclose(merged[v], np.average(own[inside], axis=0, weights=weight[inside]), atol=1e-12)
    np.testing.assert_allclose(skeleton.half_width, 2 * skeleton.radii)
    new = [names.index(label) for label in labels]
    expected = [-1 if v < 0 else new[v] for v in raw.vertex_of_point.tolist()]
    np.testing.assert_array_equal(skeleton.vertex_of_point, expected)
    edges = {tuple(sorted((new[a], new[b]))) for a, b in raw.edges.tolist() if new[a] != new[b]}
    assert [tuple(e) for e in skeleton.edges.tolist()] == sorted(edges)
    np.testing.assert_array_equal(skeleton.points, raw.points)
    np.testing.assert_array_equal(skeleton.normals, raw.normals)


def test_nothing_to_merge_changes_nothing(random_skeleton):
    raw = random_skeleton(3)
    skeleton = merge_vertices(raw, np.arange(12))
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, rtol=1e-15)
    np.testing.assert_array_equal(skeleton.edges, raw.edges)
    np.testing.assert_array_equal(skeleton.vertex_of_point, raw.vertex_of_point)


def test_lone_vertices_go_and_their_points_to_the_nearest_that_stays(ringed):
    raw = ringed(
        [[0, 0, 0], [1, 0, 0], [9, 0, 0], [2, 0, 0], [-3, 0, 0]], [(0, 1), (1, 3)], radius=[1, 2, 3, 4, 5], per=2
    )
    raw = replace(raw, confidence=np.arange(5) / 10, vertex_of_point=np.array([0, 0, 1, 1, 2, 2, 3, -1, 4, 4]))
    skeleton = drop_lone_vertices(raw)
    np.testing.assert_array_equal(skeleton.vertices, raw.vertices[[0, 1, 3]])
    np.testing.assert_array_equal(skeleton.edges, [(0, 1), (1, 2)])
    np.testing.assert_array_equal(skeleton.radii, [1, 2, 4])
    np.testing.assert_array_equal(skeleton.confidence, [0, 0.1, 0.3])
    np.testing.assert_array_equal(skeleton.vertex_of_point, [0, 0, 1, 1, 2, 2, 2, -1, 0, 0])


def test_where_all_or_none_are_lone_nothing_is_dropped(ringed):
    vertices = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    for edges in ([], [(0, 1), (1, 2)]):
        raw = ringed(vertices, edges)
        assert drop_lone_vertices(raw) is raw
