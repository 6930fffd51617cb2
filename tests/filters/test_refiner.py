"""Refiner: raw graph -> one-dimensional skeleton, as far as the outside can see."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.sampling import surface_sample
from glsk_o3d.filters import refiner

PUBLISHED = pipelines.cao2010().stages[-1]


def refined(skeleton, filter):
    """Warnings about what the cloud is worth are not the point here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        return filter(skeleton)


def test_an_empty_skeleton_stays_empty():
    none = np.empty((0, 3))
    nothing = glsk.Skeleton(none, np.empty((0, 2)), np.empty(0), np.empty(0), none, none)
    assert len(glsk.Tracer(root="z")(glsk.Refiner()(nothing)).vertices) == 0


@pytest.mark.parametrize("filter", [PUBLISHED, glsk.Refiner()], ids=["published", "recommended"])
def test_triangles_go_and_the_true_loop_stays(filter, assert_sound):
    """A polygon in the axis of a torus, with extra edges."""
    angle = np.arange(24) * 2 * np.pi / 24
    vertices = 0.4 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = samples.torus(n=1500).points
    inner = points * [1, 1, 0]
    inner *= 0.4 / np.linalg.norm(inner, axis=1, keepdims=True)
    edges = {tuple(sorted((i, (i + 1) % 24))) for i in range(24)}
    edges |= {(0, 2), (5, 7), (6, 8), (5, 8), (12, 14), (12, 15)}
    vertex = cKDTree(vertices).query(points)[1]
    cloud = vertex, points, (points - inner) / 0.1
    raw = glsk.Skeleton(vertices, sorted(edges), np.full(24, 0.1), *cloud, glsk.Report(n_input=1500, n_distinct=1500))
    skeleton = refined(raw, filter)
    assert_sound(skeleton, 1500)
    assert skeleton.n_loops == skeleton.n_components == 1
    assert len(skeleton.leaves) == 0
    assert cKDTree(skeleton.vertices).query(raw.vertices)[0].max() < 0.16
    assert np.median(np.abs(np.linalg.norm(skeleton.vertices[:, :2], axis=1) - 0.4)) < 0.02


def test_a_sample_of_many_points_centres_the_curve(assert_sound):
    """A thick tube along x with 40000 points, from 0 to 2, and a thin one with 300 from there to 3."""
    rng, n = np.random.default_rng(0), 40300
    thin = np.arange(n) >= 40000
    angle, along = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 1, n)
    normals = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    points = np.where(thin, 0.02, 0.2)[:, None] * normals
    points[:, 0] = np.where(thin, 2 + along, 2 * along)
    vertices = np.column_stack([np.linspace(0, 3, 16), np.zeros((16, 2))])
    vertex = np.abs(points[:, :1] - vertices[:, 0]).argmin(axis=1)
    points[5], vertex[5] = np.nan, -1
    normals[[5, 7]] = np.nan  # one that is not finite, and an outlier: it has a vertex and no say
    edges = np.column_stack([np.arange(15), np.arange(1, 16)])
    report = glsk.Report(n_input=n, n_dropped=1, n_distinct=n - 2, n_outliers=1)
    raw = glsk.Skeleton(vertices, edges, np.full(16, 0.1), vertex, points, normals, report)
    rows = surface_sample(Curve.of(raw))
    assert len(rows) < 21000
    assert np.count_nonzero(points[rows, 0] > 2.1) == np.count_nonzero(points[:, 0] > 2.1)
    skeleton = refined(raw, glsk.Refiner())
    assert_sound(skeleton, n, n_dropped=1)
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, 0, 2)
    assert np.abs(skeleton.vertices[:, 1:]).max() < 0.01
    assert np.flatnonzero(skeleton.vertex_of_point < 0).tolist() == [5]
    distance = np.abs(points[:, 0] - skeleton.vertices[skeleton.vertex_of_point, 0])
    assert np.nanquantile(distance, 0.99) < 0.12
    kept = refined(raw, PUBLISHED).vertex_of_point  # where nothing is centred every point keeps its vertex
    np.testing.assert_array_equal(kept, vertex)


@pytest.mark.slow
@settings(max_examples=100)
@given(st.integers(1, 12), st.sets(st.tuples(st.integers(0, 11), st.integers(0, 11)), max_size=40), st.integers(0, 9))
def test_random_graphs_become_sound_skeletons(assert_sound, m, edges, seed):
    rng = np.random.default_rng(seed)
    edges = sorted((a, b) for a, b in edges if a < b < m)
    vertex = np.concatenate([np.arange(m), rng.integers(0, m, 20), [-1]])  # every vertex has a point, one has no vertex
    points, normals = rng.normal(size=(2, m + 21, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points[-1] = normals[-1] = np.nan
    raw = glsk.Skeleton(
        rng.normal(size=(m, 3)), edges, np.full(m, 0.1), vertex, points, normals,
        glsk.Report(n_input=m + 21, n_dropped=1, n_distinct=m + 20),
    )  # fmt: skip
    published = refined(raw, PUBLISHED)
    for filter in (PUBLISHED, glsk.Refiner(), glsk.Refiner(air=0, bridge=0)):
        skeleton = refined(raw, filter)
        assert_sound(skeleton, m + 21, n_dropped=1)
        assert skeleton.vertex_of_point[-1] == -1
        if filter.air:
            continue
        # without cuts and bridges every part stays one, and loops go only where they are closed
        assert (skeleton.n_components, skeleton.n_loops <= published.n_loops) == (raw.n_components, True)
        before = raw.component_of_vertex[vertex[:-1]]
        after = skeleton.component_of_vertex[skeleton.vertex_of_point[:-1]]
        assert len(set(zip(before.tolist(), after.tolist(), strict=True))) == raw.n_components


@pytest.mark.parametrize(("cut", "bridged", "asked"), [(0, 0, [1]), (0, 1, [1, 2]), (1, 1, [1, 1])])
def test_loops_are_asked_about_again_if_bridges_made_some(monkeypatch, cut, bridged, asked):
    """A handle is not judged twice; one that was cut open does not stand for another that was bridged."""
    results, cut_edges = [], []

    def answer(question, curve, surface, least):
        about, edges = question.about, curve.edges
        if about == "loop":
            results.append(curve.n_loops)
        elif about == "air" and cut:
            cut_edges.append(edges[len(edges) // 2])  # of the ring, which may have a spur
            edges = np.delete(edges, len(edges) // 2, axis=0)
        elif about == "gap" and bridged:
            edges = np.vstack([edges, cut_edges or [np.sort([edges[0, 0], edges[len(edges) // 2, 1]])]])
        changed = len(edges) != len(curve.edges)
        return curve.rewired(edges), [glsk.Decision(about, (0, 0, 0), 1.0, changed)]

    monkeypatch.setattr(refiner, "ask", answer)
    glsk.Refiner(spacing=0)(glsk.Pipeline(*pipelines.default().stages[:-2])(samples.torus(1000).points))
    assert results == asked


def test_limbs_without_a_cloud_stay():
    """Nobody knows how far they reach."""
    places = [[0, 0, 0], *(length * np.array(way) for way in ([1, 0, 0], [0, 1, 0], [0, 0, 1]) for length in (1, 2))]
    edges = [(0, 1), (1, 2), (0, 3), (3, 4), (0, 5), (5, 6)]
    skeleton = glsk.Refiner()(glsk.Skeleton(places, edges, np.full(7, 0.1), (), (), ()))
    assert (len(skeleton.leaves), len(skeleton.junctions)) == (3, 1)


def test_points_that_do_not_show_the_surface_do_not_count_and_belong_to_the_nearest_that_does():
    raw = (pipelines.rings() | glsk.Contractor() | glsk.Connector())(samples.y_junction(n=6000).points)
    shown = raw.surface_points
    rest = np.setdiff1d(np.arange(6000), shown)
    assert len(rest) > 1000
    points = raw.points.copy()
    points[rest] += 0.01
    skeleton, other = glsk.Refiner()(raw), glsk.Refiner()(replace(raw, points=points))
    for name in ("vertices", "edges", "radii"):
        np.testing.assert_array_equal(getattr(skeleton, name), getattr(other, name))
    nearest = shown[cKDTree(raw.points[shown]).query(raw.points[rest])[1]]
    np.testing.assert_array_equal(skeleton.vertex_of_point[rest], skeleton.vertex_of_point[nearest])
    np.testing.assert_array_equal(skeleton.normals, raw.normals)


def test_points_outside_a_sample_have_the_vertex_of_their_representative():
    raw = (pipelines.rings() | glsk.Contractor() | glsk.Connector())(samples.y_junction(n=120_000).points)
    outside = np.setdiff1d(np.arange(120_000), raw.supporting_points)
    representative = raw.representative_of_point[outside]
    assert len(outside) > 50_000
    assert np.isin(representative, raw.supporting_points).all()
    away = np.linalg.norm(raw.points[outside] - raw.points[representative], axis=1)
    assert np.quantile(away, 0.99) < np.median(raw.radii) / 4
    owner = glsk.Refiner()(raw).vertex_of_point
    np.testing.assert_array_equal(owner[outside], owner[representative])
