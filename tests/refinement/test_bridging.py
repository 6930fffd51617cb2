"""Gaps between parts that continue each other."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Refiner, Report, Skeleton, SkeletonWarning
from glsk_o3d.refinement.bridging import BRIDGE_COSINE, BRIDGE_LOOK_BACK, BRIDGE_RADIUS_RATIO, bridge_gaps

GAP = 8.0


def bridged(raw, gap):
    """The skeleton and how many bridges it got."""
    skeleton = bridge_gaps(raw, gap)
    return skeleton, len(skeleton.edges) - len(raw.edges)


def graph(*paths, radii=0.1):
    """Each path a component of its own."""
    paths = [np.asarray(path, float) for path in paths]
    first = np.cumsum([0, *map(len, paths)])
    edges = [(a + i, a + i + 1) for a, path in zip(first, paths, strict=False) for i in range(len(path) - 1)]
    radii = np.repeat(np.broadcast_to(radii, len(paths)), [len(path) for path in paths])
    return Skeleton(np.concatenate(paths), edges, radii, [], [], [])


def bar(start, along, length=1.0, pieces=6):
    """Vertices 0, 1, ... from its start on."""
    along = np.asarray(along, float) / np.linalg.norm(along)
    return start + np.linspace(0, length, pieces + 1)[:, None] * along


def facing(gap, turn=0.0, aside=0.0, radii=0.1):
    """Two bars whose starts, vertices 0 and 7, face each other across a gap along x; the second turned or aside."""
    first, second = bar([0, 0, 0], [-1, 0, 0]), bar([gap, aside, 0], [np.cos(turn), np.sin(turn), 0])
    return graph(first, second, radii=radii)


def new_edges(raw, skeleton):
    return sorted(set(map(tuple, skeleton.edges.tolist())) - set(map(tuple, raw.edges.tolist())))


@pytest.mark.parametrize("gap", [1e-6, 0.1, 0.5, 0.79])
def test_collinear_tubes_are_joined_at_the_ends_that_face(gap):
    raw = facing(gap)
    skeleton, bridges = bridged(raw, GAP)
    assert bridges == 1
    assert new_edges(raw, skeleton) == [(0, 7)]
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, 0, 2)
    np.testing.assert_array_equal(skeleton.edges, np.unique(skeleton.edges, axis=0))
    for name in ("vertices", "radii", "vertex_of_point", "points", "normals"):
        np.testing.assert_array_equal(getattr(skeleton, name), getattr(raw, name))


@pytest.mark.parametrize("gap", [2.0, GAP])
@pytest.mark.parametrize("radii", [0.1, (0.05, 0.08)])
@pytest.mark.parametrize(("share", "bridges"), [(1 - 1e-9, 1), (1 + 1e-9, 0)])
def test_width_is_over_the_mean_radius(gap, radii, share, bridges):
    raw = facing(gap * np.mean(radii) * share, radii=radii)
    assert bridged(raw, gap)[1] == bridges


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(("share", "bridges"), [(1 - 1e-9, 1), (1 + 1e-9, 0)])
def test_thicknesses_are_alike(share, bridges, order):
    assert bridged(facing(0.1, radii=(0.1, 0.1 * BRIDGE_RADIUS_RATIO * share)[::order]), GAP)[1] == bridges


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("share", "bridges"), [(1 - 1e-6, 1), (1 + 1e-6, 0)])
def test_ends_point_at_each_other(share, bridges, sign):
    limit = np.arccos(BRIDGE_COSINE) * share * sign
    assert bridged(facing(0.3, turn=limit), GAP)[1] == bridges
    # parallel, but side by side
    assert bridged(facing(0.3, aside=0.3 * np.tan(limit)), GAP)[1] == bridges


@pytest.mark.parametrize(
    "second",
    [
        bar([0.3, 0, 0], [0, 1, 0]),  # across
        bar([0, 0.3, 0], [-1, 0, 0]),  # side by side, both starts on one side
        bar([-0.5, 0.2, 0], [1, 0, 0]),  # overlapping
    ],
)
def test_others_stay_apart(second):
    raw = graph(bar([0, 0, 0], [-1, 0, 0]), second)
    assert bridged(raw, GAP) == (raw, 0)


def test_ends_of_one_component_stay_apart():
    """A ring with a gap, and a far bar."""
    angle = np.linspace(0.2, 2 * np.pi - 0.2, 40)
    raw = graph(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), bar([9, 9, 9], [1, 0, 0]))
    assert np.linalg.norm(raw.vertices[0] - raw.vertices[39]) < GAP * 0.1
    for skeleton in (raw, replace(raw, vertices=raw.vertices[:40], edges=raw.edges[:39], radii=raw.radii[:40])):
        assert bridged(skeleton, GAP) == (skeleton, 0)


def test_two_halves_of_a_ring_are_joined_once_across_the_narrower_gap():
    angles = np.linspace(0.2, np.pi - 0.1, 30), np.linspace(np.pi + 0.1, 2 * np.pi - 0.2, 30)
    raw = graph(*(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) for angle in angles))
    skeleton, bridges = bridged(raw, GAP)
    assert bridges == 1
    assert new_edges(raw, skeleton) == [(29, 30)]
    assert skeleton.n_loops == 0


@pytest.mark.parametrize("n", [2, 3, 7])
def test_many_in_a_row_with_equal_gaps(n):
    raw = graph(*(bar([1.25 * k, 0, 0], [1, 0, 0]) for k in range(n)))
    skeleton, bridges = bridged(raw, GAP)
    assert bridges == n - 1
    assert new_edges(raw, skeleton) == [(7 * k + 6, 7 * k + 7) for k in range(n - 1)]
    assert (skeleton.n_components, skeleton.n_loops) == (1, 0)


def test_an_end_is_joined_once_to_the_nearest():
    up, down = bar([0.4, 0.15, 0], [1, 0.3, 0]), bar([0.35, -0.15, 0], [1, -0.3, 0])
    for second, third in ((up, down), (down, up)):
        raw = graph(bar([0, 0, 0], [-1, 0, 0]), second, third)
        skeleton, bridges = bridged(raw, GAP)
        assert bridges == 1
        ((a, b),) = new_edges(raw, skeleton)
        assert a == 0
        np.testing.assert_array_equal(skeleton.vertices[b], down[0])


def test_of_two_as_near_one_is_taken():
    raw = graph(bar([0, 0, 0], [-1, 0, 0]), bar([0.5, 0.25, 0], [1, 0.5, 0]), bar([0.5, -0.25, 0], [1, -0.5, 0]))
    skeleton, bridges = bridged(raw, GAP)
    assert bridges == 1
    assert new_edges(raw, skeleton) in ([(0, 7)], [(0, 14)])


def test_nearness_counts_in_radii():
    """Wide bars are nearer over a wider gap."""
    thick, thin = bar([0.5, 0.1, 0], [1, 0, 0]), bar([0.4, -0.1, 0], [1, 0, 0])
    raw = graph(bar([0, 0, 0], [-1, 0, 0]), thick, thin, radii=(0.1, 0.19, 0.06))
    skeleton, bridges = bridged(raw, GAP)
    assert bridges == 1
    assert new_edges(raw, skeleton) == [(0, 7)]


@pytest.mark.parametrize(("hook", "bridges"), [(0.1 * BRIDGE_LOOK_BACK, 1), (3 * BRIDGE_LOOK_BACK, 0)])
def test_direction_looks_back_a_few_radii(hook, bridges):
    """A last edge at a right angle is nothing where it is short; a long one is the direction."""
    tip = np.array([[0, -hook * 0.1, 0]])
    first = np.concatenate([tip, bar([0, 0, 0], [-1, 0, 0], length=2.0, pieces=20)])
    raw = graph(first, bar([0.5, tip[0, 1], 0], [1, 0, 0]))
    assert bridged(raw, GAP)[1] == bridges


def test_branches_of_one_edge_and_rings_and_specks():
    """Shorter than the look back; without a leaf; without an edge."""
    pairs = graph([[-0.1, 0, 0], [0, 0, 0]], [[0.2, 0, 0], [0.3, 0, 0]])
    skeleton, bridges = bridged(pairs, GAP)
    assert bridges == 1
    assert new_edges(pairs, skeleton) == [(1, 2)]
    ring = Skeleton(np.eye(3), [(0, 1), (0, 2), (1, 2)], np.full(3, 0.1), [], [], [])
    specks = Skeleton(np.eye(3), [], np.full(3, 0.1), [], [], [])
    nothing = Skeleton([], [], [], [], [], [])
    for raw in (ring, specks, nothing, graph(bar([0, 0, 0], [1, 0, 0]))):
        assert bridged(raw, GAP) == (raw, 0)


@pytest.mark.parametrize("radii", [0, (0, 0.1)])
def test_no_thickness_no_bridge(radii):
    raw = facing(0.05, radii=radii)
    assert bridged(raw, GAP) == (raw, 0)


def scattered(seed, n=14):
    rng = np.random.default_rng(seed)
    starts, along = rng.uniform(0, 1.2, (n, 3)), rng.normal(size=(n, 3)) * [1, 0.25, 0.25]
    return graph(*(bar(*one, length=0.3) for one in zip(starts, along, strict=True)), radii=rng.uniform(0.04, 0.08, n))


def test_scattered_bars_have_bridges():
    assert np.mean([bridged(scattered(seed), GAP)[1] for seed in range(10)]) > 1


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(0, 99))
def test_numbers_do_not_matter(seed, other):
    raw = scattered(seed)
    skeleton, bridges = bridged(raw, GAP)
    name = np.random.default_rng(other).permutation(len(raw.vertices))
    back = np.argsort(name)
    edges = np.sort(name[raw.edges], axis=1)
    renamed = replace(raw, vertices=raw.vertices[back], radii=raw.radii[back], edges=edges[np.lexsort(edges.T[::-1])])
    again, as_many = bridged(renamed, GAP)
    assert as_many == bridges
    named = {tuple(sorted(name[list(edge)].tolist())) for edge in new_edges(raw, skeleton)}
    assert set(new_edges(renamed, again)) == named


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.sampled_from([1e-9, 1.0, 1e9]))
def test_goes_with_the_skeleton_and_keeps_a_forest(seed, scale):
    raw = scattered(seed)
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    moved = replace(raw, vertices=scale * (raw.vertices @ turn + 3), radii=scale * raw.radii)
    skeleton, bridges = bridged(raw, GAP)
    np.testing.assert_array_equal(bridged(moved, GAP)[0].edges, skeleton.edges)
    assert skeleton.n_components == raw.n_components - bridges
    assert skeleton.n_loops == 0
    assert skeleton.degree.max() == 2  # each end once
    assert bridged(raw, 0)[1] == 0


# ---- in the refiner


def tubes(*spans, radius=0.1):
    """A skeleton of tubes along x with their points, the curve in the axis."""
    vertices, edges, vertex, points, normals = [], [], [], [], []
    angle, m = np.arange(16) * np.pi / 8, 9
    out = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    for start, stop in spans:
        first = len(vertices)
        vertices += [[x, 0, 0] for x in np.linspace(start, stop, m)]
        edges += [(first + i, first + i + 1) for i in range(m - 1)]
        x = np.linspace(start, stop, 60)
        points.append((x[:, None, None] * [1, 0, 0] + radius * out).reshape(-1, 3))
        normals.append(np.tile(out, (60, 1)))
        vertex.append(first + np.repeat(np.rint((x - start) / (stop - start) * (m - 1)).astype(int), 16))
    vertex, points, normals = (np.concatenate(part) for part in (vertex, points, normals))
    n = len(points)
    report = Report(n_input=n, n_distinct=n)
    return Skeleton(vertices, edges, np.full(len(vertices), radius), vertex, points, normals, report)


@pytest.mark.parametrize(
    ("spans", "gap", "bridges"),
    [
        ([(-2, -0.2), (0.2, 2)], 8, 1),
        ([(-2, -0.2), (0.2, 2)], 0, 0),
        ([(-2, -0.2), (0.2, 2)], 2, 0),
        ([(-2, -0.2), (0.2, 2), (2.3, 4)], 8, 2),
        ([(-2, -0.2), (0.2, 2), (4.5, 6)], 8, 1),
        ([(-2, 2)], 8, 0),
    ],
)
def test_report_counts_the_bridges(spans, gap, bridges):
    with warnings.catch_warnings():
        warnings.simplefilter("error", SkeletonWarning)
        skeleton = Refiner(bridge=gap)(tubes(*spans))
    assert skeleton.report.n_bridges == bridges
    assert skeleton.n_components == len(spans) - bridges
    assert skeleton.n_loops == 0
    np.testing.assert_allclose(skeleton.vertices[:, 1:], 0, atol=1e-9)
    assert Report.from_dict(skeleton.report.to_dict()).n_bridges == bridges
