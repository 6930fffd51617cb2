"""Refiner: raw graph -> one-dimensional skeleton, as far as the outside can see."""

import warnings
from dataclasses import replace
from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import glsk_o3d as glsk
from glsk_o3d import Refiner, Report, Skeleton, SkeletonWarning, pipelines, samples
from glsk_o3d.refinement.merging import collapse_triangles

PUBLISHED = pipelines.cao2010().stages[3]
VARIANTS = {"published": PUBLISHED, "recommended": Refiner()}
APART = {"published": PUBLISHED, "neither cut nor bridged": Refiner(air=0, bridge=0)}


def refined(skeleton, filter):
    """Warnings about what the cloud is worth are not the point here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)
        return filter(skeleton)


def around_torus(pieces=24, extra=(), n=1500):
    """A polygon in the axis of a torus, with extra edges; the points belong to the nearest corner."""
    angle = np.arange(pieces) * 2 * np.pi / pieces
    vertices = 0.4 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = samples.torus(n=n).points
    inner = points * [1, 1, 0]
    inner *= 0.4 / np.linalg.norm(inner, axis=1, keepdims=True)
    edges = {tuple(sorted((i, (i + 1) % pieces))) for i in range(pieces)} | set(extra)
    vertex = cKDTree(vertices).query(points)[1]
    report = Report(n_input=n, n_distinct=n)
    return Skeleton(vertices, sorted(edges), np.full(pieces, 0.1), vertex, points, (points - inner) / 0.1, report)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("shape", ["tube", "torus", "y_junction", "two_rings", "sauropod"])
def test_gives_a_sound_skeleton_of_what_the_connector_makes(name, shape, assert_sound):
    *stages, _ = pipelines.default().stages
    raw = glsk.Pipeline(*stages)(samples.SAMPLES[shape](n=700).points)
    skeleton = refined(raw, VARIANTS[name])
    assert_sound(skeleton, 700)
    np.testing.assert_array_equal(skeleton.points, raw.points)
    np.testing.assert_array_equal(skeleton.normals, raw.normals)
    # each component stays: neither torn nor joined
    where = [raw.component_of_vertex[raw.vertex_of_point], skeleton.component_of_vertex[skeleton.vertex_of_point]]
    assert len(set(zip(*map(np.ndarray.tolist, where), strict=True))) == raw.n_components == skeleton.n_components


@pytest.mark.parametrize("name", VARIANTS)
def test_triangles_go_and_the_true_loop_stays(name, assert_sound):
    raw = around_torus(extra={(0, 2), (5, 7), (6, 8), (5, 8), (12, 14), (12, 15)})
    assert raw.n_loops == 7
    skeleton = refined(raw, VARIANTS[name])
    assert_sound(skeleton, 1500)
    assert skeleton.n_loops == skeleton.n_components == 1
    assert len(skeleton.leaves) == 0
    assert cKDTree(skeleton.vertices).query(raw.vertices)[0].max() < 0.16
    assert np.median(np.abs(np.linalg.norm(skeleton.vertices[:, :2], axis=1) - 0.4)) < 0.02


@pytest.mark.parametrize("m", [3, 4, 5, 8])
@pytest.mark.parametrize("name", VARIANTS)
def test_complete_graphs_become_trees(name, m, assert_sound):
    rng = np.random.default_rng(m)
    vertices, points = rng.normal(size=(m, 3)), rng.normal(size=(40, 3))
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    raw = Skeleton(
        vertices, list(combinations(range(m), 2)), np.ones(m), rng.integers(0, m, 40), points, normals,
        Report(n_input=40, n_distinct=40),
    )  # fmt: skip
    skeleton = refined(raw, VARIANTS[name])
    assert_sound(skeleton, 40)
    assert skeleton.n_loops == 0
    assert skeleton.n_components == 1


@settings(max_examples=150)
@given(st.integers(1, 12), st.sets(st.tuples(st.integers(0, 11), st.integers(0, 11)), max_size=40), st.integers(0, 9))
def test_random_graphs(assert_sound, m, edges, seed):
    rng = np.random.default_rng(seed)
    edges = sorted((a, b) for a, b in edges if a < b < m)
    vertex = np.concatenate([np.arange(m), rng.integers(0, m, 20), [-1]])  # every vertex has a point, one has no vertex
    points, normals = rng.normal(size=(2, m + 21, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points[-1] = normals[-1] = np.nan
    raw = Skeleton(
        rng.normal(size=(m, 3)), edges, np.full(m, 0.1), vertex, points, normals,
        Report(n_input=m + 21, n_dropped=1, n_distinct=m + 20),
    )  # fmt: skip
    graph = nx.Graph()
    graph.add_nodes_from(range(m))
    graph.add_edges_from(edges)
    for filter in (*VARIANTS.values(), *APART.values()):
        skeleton = refined(raw, filter)
        assert_sound(skeleton, m + 21, n_dropped=1)
        assert skeleton.vertex_of_point[-1] == -1
    for filter in APART.values():
        skeleton = refined(raw, filter)
        assert skeleton.n_components == nx.number_connected_components(graph)
        assert skeleton.n_loops <= collapse_triangles(raw).n_loops
        assert skeleton.report.n_loops_closed or skeleton.n_loops == collapse_triangles(raw).n_loops
        # points of one component stay in one component
        parts = {part: set() for part in range(raw.n_components)}
        for before, after in zip(vertex[:-1], skeleton.vertex_of_point[:-1], strict=True):
            parts[raw.component_of_vertex[before]].add(int(skeleton.component_of_vertex[after]))
        assert all(len(after) == 1 for after in parts.values())


@pytest.mark.filterwarnings("ignore:uncertain topology")  # whether they touch is a close call
@pytest.mark.parametrize("seed", [6, 8])
def test_a_loop_that_is_cut_leaves_no_spurs(seed):
    """Two legs of a scan touch; the ends of the cut loop are no ends of the animal."""
    skeleton = glsk.skeletonize(samples.sample_object(seed=seed).points)
    assert (skeleton.n_loops, len(skeleton.leaves)) == (1, 6)
    assert np.isfinite(skeleton.confidence).all()
    assert (skeleton.radii > 0).all()


def test_graphs_without_triangles_are_left_alone():
    raw = around_torus()
    skeleton = refined(raw, PUBLISHED)
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-15)
    np.testing.assert_array_equal(skeleton.edges, raw.edges)
    np.testing.assert_array_equal(skeleton.vertex_of_point, raw.vertex_of_point)


def test_vertices_of_half_a_tube_move_into_its_axis():
    """Seen from one side only, the vertices lie in the surface; the normals still meet in the axis."""
    rng = np.random.default_rng(0)
    angle, along = rng.uniform(0, np.pi, 2000), rng.uniform(-1, 1, 2000)
    normals = np.column_stack([0 * along, np.cos(angle), np.sin(angle)])
    points = 0.15 * normals + along[:, None] * [1, 0, 0]
    x = np.linspace(-0.95, 0.95, 20)
    vertices = np.column_stack([x, 0 * x, 0 * x + 0.12])
    raw = Skeleton(
        vertices, [[i, i + 1] for i in range(19)], np.full(20, 0.1), cKDTree(vertices).query(points)[1], points,
        rng.choice([-1, 1], (2000, 1)) * normals, Report(n_input=2000, n_distinct=2000),
    )  # fmt: skip
    off = [np.hypot(*refined(raw, filter).vertices[:, 1:].T).max() for filter in (PUBLISHED, Refiner())]
    assert off[0] == pytest.approx(0.12)
    assert off[1] < 0.02
    radii = refined(raw, Refiner()).radii
    np.testing.assert_allclose(radii, 0.15, rtol=0.1)


def test_centring_halves_the_error_of_a_scanned_tube():
    points = samples.tube(n=3000, radius=0.1).points
    points = points[points[:, 2] > -0.03]
    *stages, refiner = pipelines.default().stages
    raw = glsk.Pipeline(*stages)(points)
    middle = slice(None)
    error = []
    for passes in (0, refiner.recentre):
        vertices = refined(raw, replace(refiner, recentre=passes)).vertices
        middle = np.abs(vertices[:, 0]) < 0.4
        error.append(np.hypot(vertices[middle, 1], vertices[middle, 2]).mean())
    assert error[1] < error[0] / 2


def test_confidence_is_high_where_normals_agree_and_low_where_they_do_not():
    raw = around_torus()
    sure = Refiner()(raw)
    assert sure.confidence.shape == (len(sure.vertices),)
    assert sure.confidence.min() > 0.7
    # any direction across the axis
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, (1500, 1))
    out = raw.points * [1, 1, 0] / np.linalg.norm(raw.points[:, :2], axis=1, keepdims=True)
    anyhow = replace(raw, normals=np.cos(angle) * out + np.sin(angle) * [0, 0, 1])
    unsure = refined(anyhow, Refiner(recentre=0))
    assert unsure.confidence.max() < 0.25
    assert unsure.report.warnings[0].startswith("weakly supported")


@pytest.mark.parametrize(
    ("name", "shape", "n", "kind"),
    [
        ("default", "sphere", 800, "sphere-like"),
        ("default", "sphere", 2048, "sphere-like"),
        *((name, "sheet", n, "sheet-like") for name in pipelines.PIPELINES for n in (800, 2048)),
        ("wen2024", "sphere", 2048, "sphere-like"),
        ("cao2010", "sphere", 2048, "sheet-like"),  # what is left of it are patches
        ("cao2010", "sphere", 800, "-like"),
    ],
)  # fmt: skip
def test_shapes_without_a_curve_skeleton_are_called_so(name, shape, n, kind, assert_sound):
    points = samples.SAMPLES[shape](n=n).points
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        skeleton = glsk.skeletonize(points, name)
    messages = [str(warning.message) for warning in caught]
    assert all(warning.category is SkeletonWarning for warning in caught)
    assert tuple(messages) == skeleton.report.warnings
    assert any(kind in message for message in messages)
    assert_sound(skeleton, n)


@pytest.mark.parametrize("shape", ["tube", "torus", "helix", "y_junction", "two_rings", "sauropod"])
def test_shapes_with_one_are_not(shape):
    # warnings are errors
    assert glsk.skeletonize(samples.SAMPLES[shape](n=2048).points).report.warnings == ()


@pytest.mark.parametrize("name", VARIANTS)
def test_graph_without_a_cloud(name):
    bare = replace(around_torus(), points=(), normals=(), vertex_of_point=())
    skeleton = refined(bare, VARIANTS[name])
    assert skeleton.n_loops == 1


def test_limbs_without_a_cloud_stay():
    """Nobody knows how far they reach."""
    places = [[0, 0, 0], *(length * np.array(way) for way in ([1, 0, 0], [0, 1, 0], [0, 0, 1]) for length in (1, 2))]
    edges = [(0, 1), (1, 2), (0, 3), (3, 4), (0, 5), (5, 6)]
    skeleton = Refiner()(Skeleton(places, edges, np.full(7, 0.1), (), (), ()))
    assert (len(skeleton.leaves), len(skeleton.junctions)) == (3, 1)


def test_the_only_branch_may_go():
    """Nothing is left to ask about then."""
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, 400)
    normals = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    points = 0.1 * normals + rng.uniform(-1, 1, (400, 1)) * np.eye(3)[0]
    skeleton = Skeleton([[-1, 0, 0], [1, 0, 0]], [(0, 1)], [0.1, 0.1], np.arange(len(points)) % 2, points, normals)
    with pytest.warns(SkeletonWarning):
        assert len(Refiner(air=1e-12, spacing=0)(skeleton).edges) == 0
