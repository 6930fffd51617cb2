"""Connector: contracted cloud -> graph, as far as the outside can see."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from glsk_o3d import Connector, Contractor, LPRReducer, RingBuilder, Skeleton, pipelines, samples
from glsk_o3d.connector import UNSUPPORTED_NOISE, drop_unsupported

VARIANTS = {name: make().stages[2] for name, make in pipelines.PIPELINES.items()}
ONE_RADIUS = VARIANTS["cao2010"]


def contracted(points, reducer=None):
    return Contractor(reducer=reducer, max_iterations=3)(RingBuilder(drop_invalid=True)(points))


@pytest.fixture(scope="module", params=[None, LPRReducer()], ids=["all points", "reduced"])
def state(request):
    return contracted(samples.y_junction(n=800).points, request.param)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("shape", ["tube", "torus", "two_rings", "sheet"])
def test_gives_a_sound_skeleton(name, shape, assert_sound):
    points = samples.SAMPLES[shape](n=500).points
    skeleton = VARIANTS[name](contracted(points, LPRReducer()))
    assert isinstance(skeleton, Skeleton)
    assert_sound(skeleton, 500, triangles=True)
    np.testing.assert_array_equal(skeleton.points, points)
    assert (np.bincount(skeleton.vertex_of_point, minlength=len(skeleton.vertices)) > 0).all()


def test_vertices_are_the_weighted_means_of_their_points_and_rings_join_them(state):
    skeleton = Connector()(state)
    owner = np.full(len(state), -1)
    owner[state.survivor_of_point] = skeleton.vertex_of_point
    np.testing.assert_array_equal(owner[state.survivor_of_point], skeleton.vertex_of_point)  # of a survivor one vertex
    total = np.zeros_like(skeleton.vertices)
    np.add.at(total, owner, state.mass[:, None] * state.contracted)
    np.testing.assert_allclose(skeleton.vertices, total / np.bincount(owner, state.mass)[:, None], atol=1e-12)
    a, b = np.sort([owner[state.rings.centres], owner[state.rings.indices]], axis=0)
    possible = {(i, j) for i, j in zip(a.tolist(), b.tolist(), strict=True) if i != j}
    assert {tuple(edge) for edge in skeleton.edges.tolist()} <= possible
    assert len(ONE_RADIUS(state).edges)
    # a vertex with a neighbour in another one is never left alone
    assert (skeleton.degree > 0).all()


@pytest.mark.parametrize(("frame", "share"), [("box", 2), ("spread", 5)])
def test_percentages_and_units_agree(frame, share):
    sample = samples.y_junction(n=800).points * 250
    state = Contractor(max_iterations=3)(RingBuilder(frame=frame)(sample))
    # of the box with the spread of the points: a^2 / 12 is the variance of one side, evenly filled
    diagonal = np.linalg.norm(np.ptp(sample, axis=0) if frame == "box" else np.sqrt(12) * sample.std(axis=0))
    a, b = (replace(ONE_RADIUS, radius=radius)(state) for radius in (f"{share}%", share / 100 * diagonal))
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)


def test_balls_of_one_radius_cover_and_keep_apart():
    state = contracted(samples.y_junction(n=800).points)
    sizes = []
    for radius in (0.01, 0.03, 0.1, 0.3):
        skeleton = replace(ONE_RADIUS, radius=radius)(state)
        sizes.append(len(skeleton.vertices))
        at = state.contracted[state.survivor_of_point]
        for vertex in range(len(skeleton.vertices)):
            own = at[skeleton.vertex_of_point == vertex]
            assert cdist(own, own).max() <= 2 * radius
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 3 * sizes[-1]


# ---- vertices that few points support


def counted(edges, count, seed=0):
    """A graph whose vertices own as many points as they count, and two points of no vertex."""
    rng, m = np.random.default_rng(seed), len(count)
    owner = rng.permutation(np.concatenate([np.repeat(np.arange(m), count), [-1, -1]]))
    vertices, points, normals = (rng.normal(size=(n, 3)) for n in (m, len(owner), len(owner)))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = sorted({(min(edge), max(edge)) for edge in edges})
    raw = Skeleton(vertices, edges, rng.random(m), owner, points, normals, confidence=rng.random(m))
    return raw, np.array(count)


def slow_stray(edges, count, noisy, share):
    """The vertices that are dropped."""
    graph = nx.Graph(edges)
    graph.add_nodes_from(range(len(count)))
    near = [nx.single_source_shortest_path_length(graph, v, cutoff=2) for v in range(len(count))]
    little = [v for v in graph if noisy[v] and count[v] < share * max(count[w] for w in near[v])]
    parts = list(nx.connected_components(graph.subgraph(set(graph) - set(little))))
    dropped = []
    for group in nx.connected_components(graph.subgraph(little)):
        touched = [part for part in parts if any(set(graph[v]) & part for v in group)]
        dropped += group if len(touched) == 1 else []
    return sorted(dropped)


@st.composite
def graphs(draw):
    m = draw(st.integers(1, 12))
    pairs = [(a, b) for b in range(m) for a in range(b)]
    edges = draw(st.lists(st.sampled_from(pairs), max_size=16, unique=True)) if pairs else []
    count = draw(st.lists(st.sampled_from([1, 2, 5, 20, 100]), min_size=m, max_size=m))
    return edges, count, np.array(draw(st.lists(st.booleans() | st.just(True), min_size=m, max_size=m)), bool)


@settings(max_examples=100)
@given(graphs(), st.sampled_from([0.0, 0.1, 0.5, 1.0]), st.integers(0, 100))
def test_drop_unsupported_by_its_definition(graph, share, seed):
    edges, count, noisy = graph
    raw, count = counted(edges, count, seed)
    skeleton = drop_unsupported(raw, count, noisy, share)
    dropped = slow_stray(edges, count.tolist(), noisy, share)
    left = np.setdiff1d(np.arange(len(count)), dropped)
    np.testing.assert_array_equal(skeleton.vertices, raw.vertices[left])
    assert left[skeleton.edges].tolist() == [e for e in raw.edges.tolist() if not set(e) & set(dropped)]
    # components are neither torn nor joined, and none vanishes
    of = raw.component_of_vertex[left]
    pairs = set(zip(of.tolist(), skeleton.component_of_vertex.tolist(), strict=True))
    assert len(pairs) == raw.n_components == skeleton.n_components
    # points of dropped vertices go with the nearest left and have no say; all others are as before
    owner, gone = raw.vertex_of_point, np.isin(raw.vertex_of_point, dropped)
    nearest = left[cdist(raw.vertices, skeleton.vertices).argmin(axis=1)]
    now = np.where(skeleton.vertex_of_point >= 0, left[skeleton.vertex_of_point], -1)
    np.testing.assert_array_equal(now, np.where(owner >= 0, nearest[owner], -1))
    np.testing.assert_array_equal(now[~gone], owner[~gone])
    np.testing.assert_array_equal(np.isnan(skeleton.normals).all(axis=1), gone)
    np.testing.assert_array_equal(skeleton.normals[~gone], raw.normals[~gone])
    np.testing.assert_array_equal(skeleton.points, raw.points)


@pytest.mark.parametrize("noise", [0.0, 0.99 * UNSUPPORTED_NOISE, 1.01 * UNSUPPORTED_NOISE, 1.0])
def test_vertices_are_unsupported_only_where_noise_is(state, noise, assert_sound):
    all_of_them = Connector(min_support=0)(state)
    share = np.full(len(state.cloud), noise)
    skeleton = Connector(min_support=1.0)(replace(state, noise=share))
    assert (len(skeleton.vertices) < len(all_of_them.vertices)) == (noise > UNSUPPORTED_NOISE)
    assert_sound(skeleton, 800, triangles=True)
    assert skeleton.n_components == all_of_them.n_components
