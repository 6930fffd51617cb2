"""Minimum cycle bases against networkx, and circles inside closed curves."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.geometry import cycles as cycles_module
from glsk_o3d.geometry.cycles import edges_on_cycles, inscribed_circle, minimum_cycle_basis, places_inside


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


@settings(max_examples=200)
@given(st.integers(1, 14), st.floats(0.05, 0.9), st.integers(0, 10**6), st.booleans())
def test_a_cycle_basis_is_as_short_as_that_of_networkx(n, density, seed, whole):
    graph = weighted(nx.gnp_random_graph(n, density, seed=seed), np.random.default_rng(seed), whole)
    np.testing.assert_allclose(basis_of(graph)[1], expected(graph))


@settings(max_examples=100)
@given(st.integers(1, 30), st.floats(0.02, 0.3), st.integers(0, 10**6))
def test_edges_on_no_cycle_are_the_bridges_of_networkx(n, density, seed):
    graph = nx.gnp_random_graph(n, density, seed=seed)
    bridges = {tuple(sorted(edge)) for edge in nx.bridges(graph)}
    edges = np.array(sorted(map(sorted, graph.edges)), int).reshape(-1, 2)
    actual = edges_on_cycles(n, edges)
    assert {tuple(edge) for edge in edges[~actual].tolist()} == bridges


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
def test_the_inscribed_circle_of_a_shape_is_known(name, size):
    flat, radius, at = SHAPES[name]
    points = np.column_stack([flat, 0 * flat[:, 0]]) @ TURN * size + 5 * size
    middle = np.array([*at, 0]) @ TURN * size + 5 * size
    centre, actual = inscribed_circle(points)
    assert actual == pytest.approx(radius * size, rel=0.015)
    assert np.linalg.norm(centre - middle) < (0.15 if name == "ellipse" else 0.03) * radius * size


@pytest.mark.parametrize(("name", "area"), [("L", 3), ("triangle", 6)])
def test_places_inside_a_polygon_are_on_a_grid_in_its_plane(name, area):
    flat = SHAPES[name][0]
    points = np.column_stack([flat, 0 * flat[:, 0]]) @ TURN + 5
    places, axes = places_inside(points, 15)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    x, y, z = ((places - 5) @ TURN.T).T
    np.testing.assert_allclose(z, 0, atol=1e-12)
    inside = (x < 2) & (y < 2) & ((x < 1) | (y < 1)) if name == "L" else x / 4 + y / 3 < 1
    assert ((x > 0) & (y > 0) & inside).all()
    box = np.prod(np.ptp(points @ axes[:2].T, axis=0))
    assert len(places) / 15**2 == pytest.approx(area / box, rel=0.05)


def test_a_line_has_no_inscribed_circle():
    line = np.outer([0, 1, 2, 3, 2, 1], [1.0, 2, 3])
    # the distance is the root of a difference of squares, which rounding leaves, on some processors, of their size
    assert inscribed_circle(line)[1] < np.sqrt(np.finfo(float).eps) * np.linalg.norm(np.ptp(line, axis=0))


@pytest.mark.parametrize("seed", range(4))
def test_a_cycle_basis_does_not_depend_on_how_many_roots_are_taken_at_a_time(seed, monkeypatch):
    """A ladder with one long way around: the last cycle of its basis is longer than any other."""
    graph = weighted(nx.circular_ladder_graph(40), np.random.default_rng(seed), whole=seed % 2 == 1)
    cycles, total = basis_of(graph)
    np.testing.assert_allclose(total, expected(graph))
    monkeypatch.setattr(cycles_module, "ROOTS_CHUNK", 1)
    for one, other in zip(cycles, basis_of(graph)[0], strict=True):
        np.testing.assert_array_equal(one, other)


def test_edges_without_length_have_a_cycle_basis():
    """Of vertices in one place: there is a basis all the same."""
    graph = nx.circular_ladder_graph(8)
    for lengths in (np.zeros(24), np.where(np.arange(24) % 3, 1.0, 0.0)):
        edges = np.array(sorted(map(sorted, graph.edges)))
        cycles = minimum_cycle_basis(16, edges, lengths)
        assert len(cycles) == 24 - 16 + 1
        assert all(
            graph.has_edge(*step) for c in cycles for step in zip(c.tolist(), np.roll(c, -1).tolist(), strict=True)
        )


def test_rounding_loses_no_cycle():
    """A ring with a loop at each junction is as long as all chains together, added in another order."""
    for seed in range(300):
        edges, n = list[tuple[int, int]](), 4
        for i in range(4):
            edges += [(i, (i + 1) % 4), (i, n), (n, n + 1), (i, n + 1)]
            n += 2
        lengths = np.random.default_rng(seed).random(len(edges))
        assert len(minimum_cycle_basis(n, np.sort(edges, axis=1), lengths)) == 5
