"""Triangle collapse against a slow greedy one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.refinement.merging import collapse_triangles
from glsk_o3d.refinement.sections import VertexPoints


def slow(skeleton, by_degree=False):
    """All prices anew before every merge: members, positions and edges of what is left."""
    position, weight = dict(enumerate(skeleton.vertices)), dict(enumerate(VertexPoints(skeleton).mass))
    members = {v: {v} for v in position}
    links = {v: set() for v in position}
    for a, b in skeleton.edges.tolist():
        links[a].add(b)
        links[b].add(a)
    while True:
        on_triangle = [(a, b) for a in links for b in links[a] if a < b and links[a] & links[b]]
        if not on_triangle:
            break
        a, b = min(
            on_triangle,
            key=lambda e: (
                (len(links[e[0]]) + len(links[e[1]])) / 2 if by_degree else 0,
                np.linalg.norm(position[e[0]] - position[e[1]]),
            ),
        )
        position[a] = (weight[a] * position[a] + weight[b] * position[b]) / (weight[a] + weight[b])
        weight[a] += weight.pop(b)
        members[a] |= members.pop(b)
        for c in links.pop(b):
            links[c].discard(b)
            if c != a:
                links[c].add(a)
                links[a].add(c)
        del position[b]
    return members, position, links


@settings(max_examples=150)
@given(st.integers(0, 10**6), st.integers(3, 25), st.floats(0.3, 1.2), st.booleans(), st.booleans())
def test_always_the_cheapest_edge(random_skeleton, seed, m, reach, every, by_degree):
    raw = random_skeleton(seed, m, reach, every=every)
    skeleton = collapse_triangles(raw, by_degree)
    members, position, links = slow(raw, by_degree)
    assert len(skeleton.vertices) == len(members)
    # merged vertices are numbered by any member: find them by place
    left = sorted(members)
    at = [int(np.argmin(np.linalg.norm(skeleton.vertices - position[v], axis=1))) for v in left]
    assert sorted(at) == list(range(len(left)))
    np.testing.assert_allclose(skeleton.vertices[at], [position[v] for v in left], atol=1e-12)
    new = dict(zip(left, at, strict=True))
    edges = {(min(new[a], new[b]), max(new[a], new[b])) for a in left for b in links[a]}
    assert {tuple(e) for e in skeleton.edges.tolist()} == edges
    vertex = {v: new[group] for group, inside in members.items() for v in inside} | {-1: -1}
    np.testing.assert_array_equal(skeleton.vertex_of_point, [vertex[v] for v in raw.vertex_of_point.tolist()])


@settings(max_examples=50)
@given(st.integers(0, 10**6), st.integers(3, 40), st.floats(0.3, 1.2))
def test_what_is_left(random_skeleton, seed, m, reach):
    raw = random_skeleton(seed, m, reach, n=3 * m)
    skeleton = collapse_triangles(raw)
    links = [set() for _ in skeleton.vertices]
    for a, b in skeleton.edges.tolist():
        links[a].add(b)
        links[b].add(a)
    assert not any(links[a] & links[b] for a, b in skeleton.edges.tolist())
    assert skeleton.n_components == raw.n_components
    # each vertex at the mean of those merged, weighted by the points they own
    weight, group = VertexPoints(raw).mass, np.full(m, -1)
    owned = raw.vertex_of_point >= 0
    group[raw.vertex_of_point[owned]] = skeleton.vertex_of_point[owned]
    for v in range(len(skeleton.vertices)):
        mean = np.average(raw.vertices[group == v], axis=0, weights=weight[group == v])
        np.testing.assert_allclose(skeleton.vertices[v], mean, atol=1e-12)


def kite(ringed):
    """A triangle with a tail: its long edge is between two free corners, its short one at the corner with the tail."""
    return ringed([[0, 0, 0], [5, 0, 0], [0, 0.1, 0], [0, 1, 0]], [(0, 1), (1, 2), (0, 2), (2, 3)])


def test_length_goes_before_degree(ringed):
    skeleton = collapse_triangles(kite(ringed))
    kept = skeleton.vertex_of_point[::12].tolist()
    assert kept[0] == kept[2]
    assert len(set(kept)) == 3
    np.testing.assert_allclose(skeleton.vertices[kept[0]], [0, 0.05, 0])


def test_degree_goes_before_length_in_the_published_order(ringed):
    skeleton = collapse_triangles(kite(ringed), by_degree=True)
    kept = skeleton.vertex_of_point[::12].tolist()
    assert kept[0] == kept[1]
    assert len(set(kept)) == 3
    np.testing.assert_allclose(skeleton.vertices[kept[0]], [2.5, 0, 0])


@pytest.mark.parametrize("by_degree", [False, True])
def test_shortest_among_equal_degrees(ringed, by_degree):
    skeleton = collapse_triangles(ringed([[0, 0, 0], [1, 0, 0], [0.9, 2, 0]], [(0, 1), (1, 2), (0, 2)]), by_degree)
    assert skeleton.vertex_of_point[::12].tolist() in ([0, 0, 1], [1, 1, 0])
    np.testing.assert_allclose(sorted(skeleton.vertices.tolist()), [[0.5, 0, 0], [0.9, 2, 0]])


@pytest.mark.parametrize("n", [4, 5, 9])
def test_longer_rings_stay(ringed, n):
    angle = np.arange(n) * 2 * np.pi / n
    raw = ringed(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [(i, (i + 1) % n) for i in range(n)])
    skeleton = collapse_triangles(raw)
    np.testing.assert_array_equal(skeleton.edges, raw.edges)
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-15)
