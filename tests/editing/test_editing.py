"""Editing of skeletons: which vertices, branches and points remain, and that the topology stays."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, pipelines, samples, skeletonize
from glsk_o3d.analysis import branch_table
from glsk_o3d.editing import cut_loops, largest_component, prune, reroot, simplify


@pytest.fixture(scope="module")
def grown():
    return pipelines.tree()(samples.tree(4000, forks=3, seed=1).points)


@pytest.fixture(scope="module")
def ring():
    return skeletonize(samples.torus(1000, noise=0.005).points)


def graph(vertices, edges, radii=None):
    """A skeleton with a point at every vertex."""
    vertices = np.asarray(vertices, float)
    m = len(vertices)
    return Skeleton(vertices, edges, np.ones(m) if radii is None else radii, np.arange(m), vertices, ())


def comb():
    """A stem of length 10 along x, and three twigs of length 1, 2 and 3 at 3, 5 and 7, 0.1, 0.2 and 0.3 thick."""
    vertices = [(x, 0, 0) for x in range(11)] + [(3, 1, 0), (5, 2, 0), (7, 3, 0)]
    edges = [(i, i + 1) for i in range(10)] + [(3, 11), (5, 12), (7, 13)]
    return graph(vertices, edges, [0.5] * 11 + [0.1, 0.2, 0.3])


def same_points(before, after):
    """No point is lost, and each has a vertex that remains."""
    assert (after.vertex_of_point < len(after.vertices)).all()
    np.testing.assert_array_equal(after.vertex_of_point >= 0, before.vertex_of_point >= 0)


@pytest.mark.parametrize(("length", "leaves"), [(0, 5), (1, 5), (1.5, 4), (3.2, 2), (99, 2)])
def test_short_branches_go_and_the_longest_path_stays(length, leaves):
    edited = prune(comb(), length=length)
    assert (len(edited.leaves), edited.n_components) == (leaves, 1)
    same_points(comb(), edited)
    if leaves < 5:
        assert edited.vertex_of_point[11] == 3  # where its branch grew from


def test_the_shorter_limb_of_a_fork_goes():
    fork = graph([(0, 0, 0), (9, 0, 0), (10, 1, 0), (12, -1, 0)], [(0, 1), (1, 2), (1, 3)])
    np.testing.assert_array_equal(prune(fork, length=5).vertices, fork.vertices[[0, 1, 3]])


def test_orders(grown):
    stem, table = prune(grown, order=0), branch_table(grown)
    assert len(stem.leaves) == 2
    assert stem.length == pytest.approx(table.length[table.order == 0].sum())
    assert prune(grown, order=int(table.order.max())).length == pytest.approx(grown.length)
    same_points(grown, stem)
    edited = prune(grown, order=1)
    np.testing.assert_array_equal(edited.vertices[0], grown.report.root)
    assert len(np.unique(edited.edges[:, 1])) == len(edited.vertices) - 1  # each has one parent


def test_what_cannot_be_pruned(ring):
    assert prune(ring, length=99) is ring
    with pytest.raises(InvalidParameterError, match="loops"):
        prune(ring, order=0)


def test_a_straight_line_is_its_ends():
    line = graph([(x, 2 * x, 0) for x in range(50)], [(i, i + 1) for i in range(49)])
    edited = simplify(line, tolerance=1e-9)
    np.testing.assert_array_equal(edited.vertices, line.vertices[[0, 49]])
    np.testing.assert_array_equal(edited.vertex_of_point, np.arange(50) > 24)


@pytest.mark.parametrize("tolerance", [0.001, 0.1])
def test_dropped_vertices_are_within_the_tolerance(grown, tolerance):
    edited = simplify(grown, tolerance=tolerance)
    a, b = edited.vertices[edited.edges].swapaxes(0, 1)
    offset = grown.vertices[:, None] - a
    along = ((offset * (b - a)).sum(2) / ((b - a) ** 2).sum(1)).clip(0, 1)
    distance = np.linalg.norm(offset - along[..., None] * (b - a), axis=2).min(axis=1)
    assert distance.max() <= tolerance * (1 + 1e-9)
    assert len(edited.vertices) < len(grown.vertices)
    np.testing.assert_array_equal(edited.vertices[edited.leaves], grown.vertices[grown.leaves])
    assert len(edited.junctions) == len(grown.junctions)
    same_points(grown, edited)


def test_loops_stay_and_a_ring_is_at_least_a_triangle(ring):
    edited = simplify(ring, tolerance=99)
    assert (edited.n_loops, len(edited.vertices)) == (1, 3)
    places = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0), (1, -1, 0), (3, 0, 0), (4, 0, 0)]
    theta = graph(places, [(0, 1), (1, 2), (0, 3), (3, 2), (0, 4), (4, 2), (2, 5), (5, 6)])
    assert simplify(theta, tolerance=99).n_loops == theta.n_loops == 2


def test_the_longest_component():
    two = graph([(0, 0, 0), (1, 0, 0), (5, 0, 0), (5, 3, 0), (9, 9, 9)], [(0, 1), (2, 3)])
    edited = largest_component(two)
    np.testing.assert_array_equal(edited.vertices, two.vertices[2:4])
    np.testing.assert_array_equal(edited.vertex_of_point, [-1, -1, 0, 1, -1])
    assert largest_component(edited) is edited


def test_cut_loops_have_edges(ring, grown):
    edited, cut = cut_loops(ring)
    assert (edited.n_loops, edited.n_components) == (0, 1)
    assert np.linalg.norm(cut[0, 0] - cut[0, 1]) == pytest.approx(ring.edge_lengths.max())
    assert edited.length == pytest.approx(ring.length - ring.edge_lengths.max())
    edited, cut = cut_loops(grown)
    np.testing.assert_array_equal(edited.edges, grown.edges)
    assert cut.shape == (0, 2, 3)


@pytest.mark.parametrize("root", ["-z", "thickest", (0, 0, 9), "0,0,9", 7])
def test_another_root(grown, root):
    edited = reroot(grown, root)
    np.testing.assert_array_equal(edited.vertices[0], edited.report.root)
    assert len(np.unique(edited.edges[:, 1])) == len(edited.vertices) - 1
    assert edited.length == pytest.approx(grown.length)
    expected = {"-z": grown.vertices[:, 2].argmax(), 7: 7}.get(root)
    assert expected is None or (edited.vertices[0] == grown.vertices[expected]).all()


def test_components_follow_the_one_of_the_root():
    two = graph([(9, 0, 0), (8, 0, 0), (0, 0, 0), (1, 0, 0), (20, 0, 0)], [(0, 1), (2, 3)])
    edited = reroot(two, "x")
    np.testing.assert_array_equal(edited.vertices[:, 0], [0, 1, 8, 9, 20])
    np.testing.assert_array_equal(edited.edges, [[0, 1], [2, 3]])
    np.testing.assert_array_equal(edited.vertex_of_point, [3, 2, 0, 1, 4])


def test_what_has_no_root(ring):
    with pytest.raises(InvalidParameterError, match="loops"):
        reroot(ring, "x")
    with pytest.raises(InvalidParameterError, match="empty"):
        reroot(graph(np.empty((0, 3)), []), "x")
    with pytest.raises(InvalidParameterError, match="no radii"):
        reroot(replace(comb(), radii=np.full(14, np.nan)), "thickest")


@pytest.mark.parametrize(
    ("edit", "wrong"),
    [
        *((prune, wrong) for wrong in (dict(length=-1), dict(length=np.nan), dict(order=1.5))),
        (simplify, dict(tolerance=-1)),
        *((reroot, dict(root=wrong)) for wrong in ("w", 9999, -1, (1, 2), "1,2", (np.nan, 0, 0), True, [[]])),
    ],
)
def test_impossible_options_are_refused(edit, wrong):
    with pytest.raises(InvalidParameterError):
        edit(comb(), **wrong)


@pytest.mark.parametrize(
    "edit",
    [
        lambda it: prune(it, length=0.2, order=2),
        lambda it: simplify(it, tolerance=0.01),
        lambda it: reroot(it, "x"),
        largest_component,
        lambda it: cut_loops(it)[0],
    ],
)
def test_half_axes_stay_with_their_vertices(grown, edit):
    two = replace(grown, edges=np.delete(grown.edges, 5, axis=0))  # two components
    two = replace(two, half_width=two.vertices[:, 0] + 9, half_thickness=two.vertices[:, 1] + 2)
    edited = edit(two)
    assert 0 < len(edited.vertices) <= len(two.vertices)
    np.testing.assert_array_equal(edited.half_width, edited.vertices[:, 0] + 9)
    np.testing.assert_array_equal(edited.half_thickness, edited.vertices[:, 1] + 2)


@pytest.mark.parametrize("edit", [largest_component, simplify, lambda it: cut_loops(it)[0]])
def test_a_cloud_without_vertices_stays_one(edit):
    cloud = Skeleton((), (), (), (), np.eye(3), ())
    assert edit(cloud).vertex_of_point.tolist() == [-1] * 3
