"""Minimum cycle bases against networkx, and circles inside closed curves."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.numerics import cycles as module
from glsk_o3d.numerics.cycles import inscribed_circle, minimum_cycle_basis, opens_wider


def basis_of(graph):
    """The function's answer for a networkx graph with nodes 0 .. n-1, checked for all that makes it a cycle basis."""
    edges = np.array([sorted(edge) for edge in graph.edges], int).reshape(-1, 2)
    lengths = np.array([graph.edges[edge]["weight"] for edge in edges.tolist()], float)
    cycles = minimum_cycle_basis(len(graph), edges, lengths)
    index = {frozenset(edge): i for i, edge in enumerate(edges.tolist())}
    total, pivots = [], {}
    for cycle in cycles:
        steps = list(zip(cycle.tolist(), np.roll(cycle, -1).tolist(), strict=True))
        assert len(cycle) == len(set(cycle.tolist())) >= 3
        assert all(graph.has_edge(*step) for step in steps)
        total.append(sum(graph.edges[step]["weight"] for step in steps))
        row = sum(1 << index[frozenset(step)] for step in steps)
        while row and row.bit_length() in pivots:
            row ^= pivots[row.bit_length()]
        assert row, "the cycles depend on each other"
        pivots[row.bit_length()] = row
    assert len(cycles) == graph.number_of_edges() - len(graph) + nx.number_connected_components(graph)
    np.testing.assert_allclose(total, np.sort(total))
    return cycles, total


def expected(graph):
    return sorted(
        sum(graph.edges[edge]["weight"] for edge in zip(cycle, [*cycle[1:], cycle[0]], strict=True))
        for cycle in nx.minimum_cycle_basis(graph, weight="weight")
    )


def weighted(graph, rng, whole=False):
    """In any numbering, with random weights; whole ones have ties."""
    graph = nx.relabel_nodes(graph, dict(enumerate(rng.permutation(len(graph)).tolist())))
    for edge in graph.edges:
        graph.edges[edge]["weight"] = float(rng.integers(1, 4)) if whole else rng.uniform(0.1, 2)
    return graph


@settings(max_examples=100)
@given(st.integers(1, 14), st.floats(0.05, 0.9), st.integers(0, 10**6), st.booleans())
def test_random_graphs(n, density, seed, whole):
    graph = weighted(nx.gnp_random_graph(n, density, seed=seed), np.random.default_rng(seed), whole)
    np.testing.assert_allclose(basis_of(graph)[1], expected(graph))


def parallel_chains(rng):
    """Few junctions, joined by several chains each; some chains lead back to where they began."""
    graph, m = nx.Graph(), int(rng.integers(1, 5))
    graph.add_nodes_from(range(m))
    for _ in range(rng.integers(1, 8)):
        a, b = rng.integers(0, m, 2).tolist()
        inner = int(rng.integers(2 if a == b else 0, 5))
        nx.add_path(graph, [a, *range(len(graph), len(graph) + inner), b])
    return graph


@settings(max_examples=100)
@given(st.integers(0, 10**6))
def test_chains_trees_rings_and_components(seed):
    rng = np.random.default_rng(seed)
    parts = [parallel_chains(rng) for _ in range(rng.integers(1, 3))]
    parts += [nx.cycle_graph(int(n)) for n in rng.integers(3, 7, rng.integers(0, 3))]
    parts += [nx.path_graph(int(n)) for n in rng.integers(1, 4, rng.integers(0, 3))]
    graph = nx.disjoint_union_all(parts)
    for _ in range(rng.integers(0, 8)):  # hanging trees
        graph.add_edge(int(rng.integers(len(graph))), len(graph))
    graph = weighted(graph, rng)
    np.testing.assert_allclose(basis_of(graph)[1], expected(graph))


def test_lengths_and_not_steps_are_minimised():
    """Three ways from 0 to 1: one long edge, and two short chains of three."""
    graph = nx.Graph()
    graph.add_edge(0, 1, weight=10.0)
    nx.add_path(graph, [0, 2, 3, 1], weight=1.0)
    nx.add_path(graph, [0, 4, 5, 1], weight=1.1)
    cycles, total = basis_of(graph)
    np.testing.assert_allclose(total, [6.3, 13])
    assert set(cycles[0].tolist()) == {0, 1, 2, 3, 4, 5}
    assert set(cycles[1].tolist()) == {0, 1, 2, 3}


@pytest.mark.parametrize("graph", [nx.empty_graph(4), nx.balanced_tree(3, 3), nx.path_graph(2)])
def test_no_cycles(graph):
    assert basis_of(weighted(graph, np.random.default_rng(0)))[0] == []


@pytest.mark.parametrize(
    ("graph", "lengths"),
    [
        (nx.complete_graph(6), [3] * 10),
        (nx.grid_2d_graph(5, 4), [4] * 12),
        (nx.petersen_graph(), [5] * 6),
        (nx.cubical_graph(), [4] * 5),
        (nx.ladder_graph(30), [4] * 29),
        (nx.disjoint_union(nx.cycle_graph(3), nx.cycle_graph(8)), [3, 8]),
        (nx.barbell_graph(3, 4), [3, 3]),
    ],
    ids=["complete", "grid", "petersen", "cube", "ladder", "two rings", "barbell"],
)
def test_known_graphs(graph, lengths):
    graph = nx.convert_node_labels_to_integers(graph)
    nx.set_edge_attributes(graph, 1.0, "weight")
    assert basis_of(graph)[1] == lengths


# ---- the circle inside

ANGLE = np.linspace(0, 2 * np.pi, 60, endpoint=False)
TURN = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
SHAPES = {
    "circle": (np.column_stack([np.cos(ANGLE), np.sin(ANGLE)]), np.cos(np.pi / 60), (0, 0)),
    "ellipse": (np.column_stack([3 * np.cos(ANGLE), np.sin(ANGLE)]), 1, (0, 0)),
    "square": (np.array([[0, 0], [2, 0], [2, 2], [0, 2]]), 1, (1, 1)),
    "triangle": (np.array([[0, 0], [4, 0], [0, 3]]), 1, (1, 1)),
    # arms of width 1: it touches two sides and the inner corner
    "L": (np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]), 2**0.5 / (1 + 2**0.5), (0.5858, 0.5858)),
}


@pytest.mark.parametrize("size", [1e-3, 1, 1e3])
@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("tilted", [False, True])
def test_inscribed_circle(name, size, tilted):
    flat, radius, at = SHAPES[name]
    points, middle = np.column_stack([flat, 0 * flat[:, 0]]) * size, np.array([*at, 0]) * size
    if tilted:
        points, middle = points @ TURN + 5 * size, middle @ TURN + 5 * size
    centre, found = inscribed_circle(points)
    assert found == pytest.approx(radius * size, rel=0.015)
    assert np.linalg.norm(centre - middle) < (0.15 if name == "ellipse" else 0.03) * radius * size


@pytest.mark.parametrize("name", SHAPES)
def test_opens_wider_as_the_inscribed_circle_says(name):
    flat = SHAPES[name][0]
    points = np.column_stack([flat, 0 * flat[:, 0]]) @ TURN
    radius = inscribed_circle(points)[1]
    for share in (0, 0.5, 0.9, 0.999, 1):
        assert opens_wider(points, share * radius)
    for share in (1.001, 2):
        assert not opens_wider(points, share * radius)


@pytest.mark.parametrize(("share", "grids"), [(0.9, 1), (1.5, 4)])
def test_wide_loops_are_seen_at_a_glance(share, grids, monkeypatch):
    points, calls = np.column_stack([np.cos(ANGLE), np.sin(ANGLE), 0 * ANGLE]), []
    distance = module._distance
    monkeypatch.setattr(module, "_distance", lambda *given: calls.append(1) or distance(*given))
    assert opens_wider(points, share) is (share < 1)
    assert len(calls) == grids


@pytest.mark.parametrize("share", [0.003, 0.02, 0.1, 0.3, 0.5, 1])
def test_inscribed_circle_of_rectangles(share):
    """Only corners are given."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, share, 0], [0, share, 0]]) @ TURN
    assert inscribed_circle(points)[1] == pytest.approx(share / 2, rel=0.02)


def test_distance_counts_sides_and_not_only_corners():
    """A hand fan: many corners at one place must not draw the circle there."""
    points = np.concatenate([[[0, 0, 0]], [[4, y, 0] for y in np.linspace(-1, 1, 200)]])
    half = np.arctan(1 / 4)
    radius = 4 * np.sin(half) / (1 + np.sin(half))
    centre, found = inscribed_circle(points)
    assert found == pytest.approx(radius, rel=0.02)
    np.testing.assert_allclose(centre, [4 - radius, 0, 0], atol=0.05)


def test_curves_without_an_inside():
    line = np.outer([0, 1, 2, 3, 2, 1], [1.0, 2, 3])
    # the distance is the root of a difference of squares, which rounding leaves, on some processors, of their size
    assert inscribed_circle(line)[1] < np.sqrt(np.finfo(float).eps) * np.linalg.norm(np.ptp(line, axis=0))
