"""Skeleton: the graph and what can be asked of it."""

import dataclasses
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import InvalidParameterError, Skeleton


def skeleton_of(m, edges):
    rng = np.random.default_rng(m)
    edges = sorted({(min(edge), max(edge)) for edge in edges})
    cloud = [0] * 4, rng.normal(size=(4, 3)), ()
    return Skeleton(rng.normal(size=(m, 3)), edges, rng.random(m), *cloud, confidence=rng.random(m))


def cycle(nodes):
    return list(zip(nodes, [*nodes[1:], nodes[0]], strict=True))


def path(nodes):
    return list(pairwise(nodes))


HAND_MADE = {
    # vertices, edges; components, loops, leaves, junctions; vertices of the branches
    "one vertex": (1, [], (1, 0, 0, 0), []),
    "a path": (5, path([3, 1, 4, 0, 2]), (1, 0, 2, 0), [5]),
    "a ring": (6, cycle([0, 3, 1, 5, 2, 4]), (1, 1, 0, 0), [7]),
    "a ring on a stick": (7, cycle([0, 1, 2, 3]) + path([0, 4, 5, 6]), (1, 1, 1, 1), [4, 5]),
    "an eight": (7, cycle([0, 1, 2, 3]) + cycle([0, 4, 5, 6]), (1, 2, 0, 1), [5, 5]),
    "a theta": (6, [*cycle([0, 1, 2, 3, 4, 5]), (0, 3)], (1, 2, 0, 2), [2, 4, 4]),
    "a forest": (9, [*path([0, 4, 8]), *cycle([1, 2, 3]), (5, 6)], (4, 1, 4, 0), [2, 3, 4]),
}


@pytest.mark.parametrize("which", HAND_MADE)
def test_counts_and_branches_of_hand_made_graphs_are_known(which):
    m, edges, counts, branches = HAND_MADE[which]
    skeleton = skeleton_of(m, edges)
    actual = skeleton.n_components, skeleton.n_loops, len(skeleton.leaves), len(skeleton.junctions)
    assert actual == counts
    assert sorted(map(len, skeleton.branches)) == branches
    for count, name in zip(counts, ("components", "loops", "leaves", "junctions"), strict=True):
        assert f"{count} {name}" in repr(skeleton)


@pytest.mark.slow
@settings(max_examples=150)
@given(st.integers(1, 14), st.sets(st.tuples(st.integers(0, 13), st.integers(0, 13))))
def test_a_random_graph_is_that_of_networkx(m, edges):
    edges = {(a, b) for a, b in edges if a < b < m}
    skeleton, graph = skeleton_of(m, edges), nx.Graph()
    graph.add_nodes_from(range(m))
    graph.add_edges_from(edges)
    degree = np.array([graph.degree[i] for i in range(m)])
    np.testing.assert_array_equal(skeleton.degree, degree)
    np.testing.assert_array_equal(skeleton.leaves, np.flatnonzero(degree == 1))
    np.testing.assert_array_equal(skeleton.junctions, np.flatnonzero(degree > 2))
    assert skeleton.n_components == nx.number_connected_components(graph)
    assert skeleton.n_loops == len(nx.cycle_basis(graph))
    for part in nx.connected_components(graph):
        assert len({skeleton.component_of_vertex[i] for i in part}) == 1
    covered = [tuple(sorted(edge)) for branch in skeleton.branches for edge in path(branch.tolist())]
    assert sorted(covered) == sorted(edges)  # every edge in one branch, once
    for branch in skeleton.branches:
        assert (degree[branch[1:-1]] == 2).all()
        assert branch[0] == branch[-1] or (degree[branch[[0, -1]]] != 2).all()
    back = skeleton.to_networkx()
    assert {*back.nodes} == {*range(m)}
    assert {tuple(sorted(edge)) for edge in back.edges} == edges
    names = dict(radius="radii", confidence="confidence", half_width="half_width", half_thickness="half_thickness")
    for word, name in names.items():
        assert [back.nodes[i][word] for i in range(m)] == getattr(skeleton, name).tolist()
    assert all(back.nodes[i]["position"] == tuple(skeleton.vertices[i]) for i in range(m))
    assert skeleton.length == pytest.approx(sum(length for _, _, length in back.edges(data="length")))


def test_arrays_are_of_the_promised_kind_and_what_is_unknown_is_filled_in():
    skeleton = Skeleton([[3, 4, 0], [0, 0, 0]], [(1, 0)], [1, 2], [0], [[0, 0, 0]], [[0, 0, 1]])
    assert skeleton.vertices.dtype == skeleton.radii.dtype == skeleton.points.dtype == np.float64
    assert skeleton.edges.dtype == skeleton.vertex_of_point.dtype == np.int64
    assert (skeleton.length, skeleton.edge_lengths.tolist(), skeleton.edges.tolist()) == (5, [5], [[0, 1]])
    assert np.isnan(skeleton.confidence).all()
    assert skeleton.half_width.tolist() == skeleton.half_thickness.tolist() == [1, 2]
    with pytest.raises(dataclasses.FrozenInstanceError):
        skeleton.edges = None
    nothing = Skeleton([], [], [], [], [], [])
    assert nothing.edges.shape == (0, 2)
    assert (nothing.n_components, nothing.n_loops, nothing.length, nothing.branches) == (0, 0, 0, ())
    bare = Skeleton(LINE["vertices"], [], (), (), LINE["points"], ())
    assert np.isnan(np.concatenate([bare.radii, bare.half_width, bare.normals.ravel()])).all()
    assert bare.vertex_of_point.tolist() == bare.representative_of_point.tolist() == [-1] * 3
    # unknown representatives do not bind the number of points
    fewer = dataclasses.replace(bare, points=LINE["points"][:2], normals=None, vertex_of_point=None)
    assert fewer.representative_of_point.tolist() == [-1] * 2


LINE = dict(
    vertices=[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]],
    edges=[[0, 1], [1, 2]],
    radii=[1.0, 1, 1],
    vertex_of_point=[0, 2, -1],
    points=[[0.0, 0, 1], [2, 0, 1], [np.nan] * 3],
    normals=[[0, 0, 1.0]] * 3,
)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("vertices", [[0.0, 0], [1, 0]], r"vertices: has shape \(2, 2\) and dtype float64: must be numbers, 3 a row"),
        ("vertices", [[0, 0, 0], [1, 0]], "vertices: is no array: "),
        ("vertices", [["0", "0", "0"]] * 3, "vertices: has shape .* and dtype <U1: must be numbers"),
        ("vertices", [[0, 0, 0], [1, 0, np.nan], [2, 0, 0]], r"vertices\[1\] = \[1.0, 0.0, nan\]: must be finite"),
        ("vertices", [[0, 0, 0], [1, 0, 0], [0, 0, 1e200]], r"vertices\[2\] = .*: must be finite, and at most 1e\+150"),
        ("edges", [[0.5, 1]], r"edges: has shape \(1, 2\) and dtype float64: must be whole numbers, 2 a row"),
        ("edges", [[0, 1], [1, 3]], r"edges\[1\] = \[1, 3\]: names a missing vertex: there are 3"),
        ("edges", [[0, 1], [2, 2]], r"edges\[1\] = \[2, 2\]: joins a vertex with itself"),
        ("edges", [[0, 1], [1, 2], [1, 0]], r"edges\[0\] = \[0, 1\]: is there twice"),
        ("radii", [1, 1], "radii: has 2 rows for 3 vertices"),
        ("radii", [[1], [1], [1]], r"radii: has shape \(3, 1\)"),
        ("radii", [1, -1, 1], r"radii\[1\] = -1.0: must lie between 0 and 1e\+150, or be NaN"),
        ("radii", [1, 10**400, 1], "radii: has shape .* and dtype object"),
        ("vertex_of_point", [0, 2], "vertex_of_point: has 2 rows for 3 points"),
        ("vertex_of_point", [0, -2, 3], r"vertex_of_point\[1\] = -2: names a missing vertex"),
        ("vertex_of_point", [0, 1, 1], r"points\[2\] = .*: must be finite, .* as vertex_of_point gives it a vertex"),
        ("representative_of_point", [0, 1, 3], r"representative_of_point\[2\] = 3: names a missing point"),
        ("representative_of_point", [1, 2, 0], r"representative_of_point\[0\] = 1: names a point that another one"),
        ("representative_of_point", [0, 1], "representative_of_point: has 2 rows for 3 points"),
        ("normals", [[0, 0, np.inf]] * 3, r"normals\[0\] = .*: must be unit vectors, or NaN"),
        ("confidence", [0, 1.5, 0], r"confidence\[1\] = 1.5: must lie between 0 and 1, or be NaN"),
        ("half_thickness", [1, 1, 2], r"half_thickness\[2\] = 2.0: must be at most half_width"),
        ("support", [-1, 0, 0], r"support\[0\] = -1.0"),
        ("report", {}, "report = {}: must be a Report"),
    ],
)
def test_an_unsound_skeleton_is_refused(name, value, message):
    Skeleton(**LINE)
    with pytest.raises(InvalidParameterError, match=message):
        Skeleton(**{**LINE, name: value})
