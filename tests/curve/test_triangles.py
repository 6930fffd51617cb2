"""Triangle collapse against a slow greedy one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton


def slow(skeleton, by_degree):
    """All prices anew before every merge: members, positions and edges of what remains."""
    position = dict(enumerate(skeleton.vertices))
    support = np.bincount(skeleton.vertex_of_point[skeleton.supporting_points], minlength=len(position))
    weight = dict(enumerate(np.maximum(support, 1.0)))
    members, links = {v: {v} for v in position}, {v: set() for v in position}
    for a, b in skeleton.edges.tolist():
        links[a].add(b)
        links[b].add(a)

    def price(edge):
        a, b = edge
        degree = (len(links[a]) + len(links[b])) / 2
        return degree if by_degree else 0, np.linalg.norm(position[a] - position[b])

    while on_triangle := [(a, b) for a in links for b in links[a] if a < b and links[a] & links[b]]:
        a, b = min(on_triangle, key=price)
        position[a] = (weight[a] * position[a] + weight[b] * position[b]) / (weight[a] + weight[b])
        weight[a] += weight.pop(b)
        members[a] |= members.pop(b)
        for c in links.pop(b) - {a}:
            links[c].add(a)
            links[a].add(c)
        for c in links:
            links[c].discard(b)
        del position[b]
    return members, position, links


@pytest.mark.slow
@settings(max_examples=100)
@given(st.integers(0, 10**6), st.integers(3, 25), st.floats(0.3, 1.2), st.booleans(), st.booleans())
def test_triangles_collapse_at_the_cheapest_edge(random_skeleton, refine, seed, m, reach, every, by_degree):
    raw = random_skeleton(seed, m, reach, every=every)
    skeleton = refine(raw, collapse="degree" if by_degree else "length")
    members, position, links = slow(raw, by_degree)
    assert len(skeleton.vertices) == len(members)
    assert skeleton.n_components == raw.n_components
    # merged vertices are numbered by any member: find them by place
    remaining = sorted(members)
    at = [int(np.argmin(np.linalg.norm(skeleton.vertices - position[v], axis=1))) for v in remaining]
    assert sorted(at) == list(range(len(remaining)))
    np.testing.assert_allclose(skeleton.vertices[at], [position[v] for v in remaining], atol=1e-12)
    new = dict(zip(remaining, at, strict=True))
    edges = {(min(new[a], new[b]), max(new[a], new[b])) for a in remaining for b in links[a]}
    assert {tuple(e) for e in skeleton.edges.tolist()} == edges
    vertex = {v: new[group] for group, inside in members.items() for v in inside} | {-1: -1}
    np.testing.assert_array_equal(skeleton.vertex_of_point, [vertex[v] for v in raw.vertex_of_point.tolist()])


@pytest.mark.parametrize(("collapse", "merged"), [("length", [0, 0.05, 0]), ("degree", [2.5, 0, 0])])
def test_a_triangle_with_a_tail_collapses_by_length_or_degree(refine, collapse, merged):
    """Its long edge is between two free corners, its short one at the corner with the tail."""
    corners = np.array([[0, 0, 0], [5, 0, 0], [0, 0.1, 0], [0, 1, 0]])
    edges, owner = [(0, 1), (0, 2), (1, 2), (2, 3)], np.repeat(np.arange(4), 9)
    kite = Skeleton(corners, edges, np.full(4, 0.1), owner, corners[owner], np.tile([0, 0, 1], (36, 1)))
    skeleton = refine(kite, collapse=collapse)
    assert len(skeleton.vertices) == 3
    np.testing.assert_allclose(skeleton.vertices[skeleton.vertex_of_point[0]], merged)
