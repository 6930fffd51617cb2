"""Editing of skeletons: what goes, what stays, and that the topology does."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, pipelines, samples, skeletonize
from glsk_o3d.editing import cut_loops, largest_component, prune, reroot, simplify, smooth


@pytest.fixture(scope="module")
def grown():
    return pipelines.tree()(samples.tree(8000, forks=3, seed=1).points)


@pytest.fixture(scope="module")
def ring():
    return skeletonize(samples.torus(2000, noise=0.005).points)


def graph(vertices, edges, radii=None):
    """A skeleton with a point at every vertex."""
    vertices = np.asarray(vertices, float)
    m = len(vertices)
    return Skeleton(vertices, edges, np.ones(m) if radii is None else radii, np.arange(m), vertices, vertices)


def comb():
    """A stem of length 10 along x, and three twigs of length 1, 2 and 3 at 3, 5 and 7, 0.1, 0.2 and 0.3 thick."""
    vertices = [(x, 0, 0) for x in range(11)]
    edges, radii = [(i, i + 1) for i in range(10)], [0.5] * 11
    for place, length in ((3, 1), (5, 2), (7, 3)):
        edges.append((place, len(vertices)))
        vertices.append((place, length, 0))
        radii.append(length / 10)
    return graph(vertices, edges, radii)


def same_points(before, after):
    """No point is lost, and each is with a vertex that is there."""
    assert (after.vertex_of_point < len(after.vertices)).all()
    np.testing.assert_array_equal(after.vertex_of_point >= 0, before.vertex_of_point >= 0)


class TestPrune:
    @pytest.mark.parametrize(("length", "leaves"), [(0, 5), (1, 5), (1.5, 4), (2.5, 3), (3.2, 2), (99, 2)])
    def test_short_branches_go_and_the_longest_way_stays(self, length, leaves):
        raw = comb()
        left = prune(raw, length=length)
        assert len(left.leaves) == leaves
        assert left.n_components == 1
        same_points(raw, left)

    def test_of_a_fork_the_shorter_prong_goes(self):
        fork = graph([(0, 0, 0), (9, 0, 0), (10, 1, 0), (12, -1, 0)], [(0, 1), (1, 2), (1, 3)])
        left = prune(fork, length=5)
        np.testing.assert_array_equal(left.vertices, fork.vertices[[0, 1, 3]])

    def test_points_belong_to_where_a_branch_grew_from(self):
        left = prune(comb(), length=1.5)
        assert left.vertex_of_point[11] == 3

    @pytest.mark.parametrize(("radius", "leaves"), [(0.05, 5), (0.15, 4), (0.25, 3), (0.35, 2)])
    def test_thin_branches_go(self, radius, leaves):
        assert len(prune(comb(), radius=radius).leaves) == leaves

    def test_orders(self, grown):
        stem = prune(grown, order=0)
        assert len(stem.leaves) == 2
        table = grown.branch_table()
        assert stem.length == pytest.approx(table.length[table.order == 0].sum())
        assert prune(grown, order=int(table.order.max())).length == pytest.approx(grown.length)
        same_points(grown, stem)

    def test_a_tree_still_leads_from_its_root(self, grown):
        left = prune(grown, order=1)
        np.testing.assert_array_equal(left.vertices[0], grown.report.root)
        assert len(np.unique(left.edges[:, 1])) == len(left.vertices) - 1  # each has one parent

    def test_without_junctions_nothing_goes(self, ring):
        assert prune(ring, length=99, radius=99) is ring

    @pytest.mark.parametrize(
        "wrong", [dict(length=-1), dict(length=np.nan), dict(radius=np.inf), dict(order=-1), dict(order=1.5)]
    )
    def test_refuses(self, wrong):
        with pytest.raises(InvalidParameterError):
            prune(comb(), **wrong)

    def test_refuses_orders_of_loops_and_radii_that_are_not_there(self, ring):
        with pytest.raises(InvalidParameterError, match="loops"):
            prune(ring, order=0)
        with pytest.raises(InvalidParameterError, match="radii"):
            prune(replace(comb(), radii=np.full(14, np.nan)), radius=1)


class TestSimplify:
    def test_a_straight_line_is_its_ends(self):
        line = graph([(x, 2 * x, 0) for x in range(50)], [(i, i + 1) for i in range(49)])
        left = simplify(line, tolerance=1e-9)
        np.testing.assert_array_equal(left.vertices, line.vertices[[0, 49]])
        np.testing.assert_array_equal(left.vertex_of_point, np.arange(50) > 24)

    @pytest.mark.parametrize("tolerance", [0.001, 0.01, 0.1])
    def test_no_vertex_was_farther_away(self, grown, tolerance):
        left = simplify(grown, tolerance=tolerance)
        a, b = left.vertices[left.edges].swapaxes(0, 1)
        offset = grown.vertices[:, None] - a
        along = ((offset * (b - a)).sum(2) / ((b - a) ** 2).sum(1)).clip(0, 1)
        away = np.linalg.norm(offset - along[..., None] * (b - a), axis=2).min(axis=1)
        assert away.max() <= tolerance * (1 + 1e-9)
        assert len(left.vertices) < len(grown.vertices)
        np.testing.assert_array_equal(left.vertices[left.leaves], grown.vertices[grown.leaves])
        assert len(left.junctions) == len(grown.junctions)
        same_points(grown, left)

    @pytest.mark.parametrize("n", [40, 100])
    def test_so_many_vertices(self, grown, n):
        left = simplify(grown, n=n)
        assert len(left.vertices) == n
        assert (left.n_components, left.n_loops, len(left.leaves)) == (1, 0, len(grown.leaves))

    @pytest.mark.parametrize("tolerance", [0.01, 99])
    def test_loops_stay(self, ring, tolerance):
        assert simplify(ring, tolerance=tolerance).n_loops == 1
        theta = graph(
            [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0), (1, -1, 0), (3, 0, 0), (4, 0, 0)],
            [(0, 1), (1, 2), (0, 3), (3, 2), (0, 4), (4, 2), (2, 5), (5, 6)],
        )
        assert simplify(theta, tolerance=99).n_loops == theta.n_loops == 2

    def test_a_ring_of_three_is_least(self, ring):
        assert len(simplify(ring, tolerance=99).vertices) == 3
        assert len(simplify(ring, n=1).vertices) == 3

    @pytest.mark.parametrize("wrong", [{}, dict(tolerance=1, n=3), dict(tolerance=-1), dict(n=0), dict(n=2.5)])
    def test_refuses(self, ring, wrong):
        with pytest.raises(InvalidParameterError):
            simplify(ring, **wrong)


class TestSmooth:
    def test_noise_goes_and_the_size_stays(self):
        turn = np.linspace(0, 2 * np.pi, 200, endpoint=False)
        circle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
        rough = circle + np.random.default_rng(0).normal(scale=0.02, size=circle.shape)
        ring = graph(rough, [*((i, i + 1) for i in range(199)), (0, 199)])
        left = smooth(ring, passes=20).vertices
        off = np.abs(np.linalg.norm(left, axis=1) - 1)
        assert off.mean() < 0.5 * np.abs(np.linalg.norm(rough, axis=1) - 1).mean()
        assert np.linalg.norm(left, axis=1).mean() == pytest.approx(1, abs=0.003)

    def test_ends_and_junctions_stay(self, grown):
        left = smooth(grown, passes=5)
        kept = grown.degree != 2
        np.testing.assert_array_equal(left.vertices[kept], grown.vertices[kept])
        assert (left.vertices[~kept] != grown.vertices[~kept]).any()
        np.testing.assert_array_equal(left.edges, grown.edges)
        np.testing.assert_array_equal(left.confidence, grown.confidence)

    def test_no_passes_change_nothing(self, grown):
        np.testing.assert_array_equal(smooth(grown, passes=0).vertices, grown.vertices)

    @pytest.mark.parametrize("passes", [-1, 1.5, True])
    def test_refuses(self, ring, passes):
        with pytest.raises(InvalidParameterError):
            smooth(ring, passes=passes)


class TestGraphs:
    def test_the_longest_component(self):
        two = graph([(0, 0, 0), (1, 0, 0), (5, 0, 0), (5, 3, 0), (9, 9, 9)], [(0, 1), (2, 3)])
        left = largest_component(two)
        np.testing.assert_array_equal(left.vertices, two.vertices[2:4])
        np.testing.assert_array_equal(left.vertex_of_point, [-1, -1, 0, 1, -1])
        assert largest_component(left) is left

    def test_loops_are_cut_and_told(self, ring):
        left, cut = cut_loops(ring)
        assert (left.n_loops, left.n_components) == (0, 1)
        assert np.linalg.norm(cut[0, 0] - cut[0, 1]) == pytest.approx(ring.edge_lengths.max())
        assert left.length == pytest.approx(ring.length - ring.edge_lengths.max())

    def test_nothing_is_cut_of_a_tree(self, grown):
        left, cut = cut_loops(grown)
        np.testing.assert_array_equal(left.edges, grown.edges)
        assert cut.shape == (0, 2, 3)

    @pytest.mark.parametrize("root", ["-z", "thickest", (0, 0, 9), "0,0,9", 7])
    def test_another_root(self, grown, root):
        left = reroot(grown, root)
        np.testing.assert_array_equal(left.vertices[0], left.report.root)
        assert len(np.unique(left.edges[:, 1])) == len(left.vertices) - 1
        assert left.length == pytest.approx(grown.length)
        if root == "-z":
            assert left.vertices[0, 2] == grown.vertices[:, 2].max()
        if root == 7:
            np.testing.assert_array_equal(left.vertices[0], grown.vertices[7])

    def test_components_follow_the_one_of_the_root(self):
        two = graph([(9, 0, 0), (8, 0, 0), (0, 0, 0), (1, 0, 0), (20, 0, 0)], [(0, 1), (2, 3)])
        left = reroot(two, "x")
        np.testing.assert_array_equal(left.vertices[:, 0], [0, 1, 8, 9, 20])
        np.testing.assert_array_equal(left.edges, [[0, 1], [2, 3]])
        np.testing.assert_array_equal(left.vertex_of_point, [3, 2, 0, 1, 4])

    @pytest.mark.parametrize("root", ["w", 9999, -1, (1, 2), "1,2", (np.nan, 0, 0), True, ("a", "b", "c"), [[]]])
    def test_refuses_roots_that_are_none(self, grown, root):
        with pytest.raises(InvalidParameterError):
            reroot(grown, root)

    def test_none_is_the_thickest_where_radii_are_unknown(self):
        with pytest.raises(InvalidParameterError, match="no radii"):
            reroot(replace(graph(np.eye(3), [[0, 1], [1, 2]]), radii=np.full(3, np.nan)), "thickest")

    def test_refuses_loops_and_nothing(self, ring):
        with pytest.raises(InvalidParameterError, match="loops"):
            reroot(ring, "x")
        with pytest.raises(InvalidParameterError, match="empty"):
            reroot(graph(np.empty((0, 3)), []), "x")


EDITS = [
    lambda it: prune(it, length=0.2, order=2),
    lambda it: simplify(it, tolerance=0.01),
    lambda it: reroot(it, "x"),
    largest_component,
    lambda it: cut_loops(it)[0],
    lambda it: smooth(it, passes=0),
]


@pytest.mark.parametrize("edit", EDITS)
def test_half_axes_stay_with_their_vertices(grown, edit):
    two = largest_component(grown)
    two = replace(two, edges=np.delete(two.edges, 5, axis=0))  # two components
    two = replace(two, half_width=two.vertices[:, 0] + 9, half_thickness=two.vertices[:, 1])
    left = edit(two)
    assert 0 < len(left.vertices) <= len(two.vertices)
    np.testing.assert_array_equal(left.half_width, left.vertices[:, 0] + 9)
    np.testing.assert_array_equal(left.half_thickness, left.vertices[:, 1])
