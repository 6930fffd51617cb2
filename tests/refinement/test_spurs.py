"""Spurs are cut by how far their points stand out of the surface around the other branches."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from glsk_o3d.refinement.scores import LIMB_WEIGHTS, probability
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton
from glsk_o3d.numerics.polylines import relative_distance
from glsk_o3d.refinement import spurs
from glsk_o3d.refinement.spurs import SPUR_QUANTILE, limb_facts, prune_spurs

N = 21  # vertices of the trunk
PER = 60  # points of each: many, so that a cut spur does not change the thickness of its junction

# a surface that says nothing of what hangs together, and no confidence: how far points stand out decides
UNBONDED = SimpleNamespace(bonds=lambda skeleton: (np.empty((0, 2), int), np.empty(0)))
WIDE = 0.1  # half width of every section
ROUND = 0.8  # half thickness over half width of every section


@pytest.fixture(autouse=True)
def _one_width(monkeypatch):
    monkeypatch.setattr(spurs, "measure_sections", sections)


def sections(skeleton, roundness=ROUND):
    wide = np.full(len(skeleton.vertices), WIDE)
    return SimpleNamespace(half_width=wide, half_thickness=roundness * wide)


@pytest.fixture
def _alone(monkeypatch):
    """Every branch has its own probability, whatever the one beside it."""
    monkeypatch.setattr(spurs, "_with_forks", lambda skeleton, twigs: twigs)


def pruned(skeleton, reach, thick=0.1):
    """Without the branches that reach less far from a part so thick, over its thickness; at least 1."""
    out = (reach - 1) * thick / WIDE
    facts = {"protrusion": np.log(out + 0.3), "web": 0, "confidence": 0, "roundness": ROUND}
    return prune_spurs(skeleton, UNBONDED, probability(LIMB_WEIGHTS, facts))[0]


def directions(n, seed=0):
    towards = np.random.default_rng(seed).normal(size=(n, 3))
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


def tree(*spurs, radius=0.1, length=None, share=1.0, per=10, along=0.0):
    """A trunk along x from -1 to 1, every point of it at the distance `radius` from its vertex.

    Twigs (vertex, reach) grow from it in two edges each, along z, as long as they reach or `length` long. All their
    points are as far from the trunk as they reach, `along` behind the junction; where `share` is below 1, the others
    are ten times as far.
    """
    x = np.linspace(-1, 1, N)
    trunk = np.column_stack([x, 0 * x, 0 * x])
    vertices, edges, owner = [*trunk], [(i, i + 1) for i in range(N - 1)], [np.repeat(np.arange(N), PER)]
    points = [np.repeat(trunk, PER, axis=0) + np.repeat(np.broadcast_to(radius, N), PER)[:, None] * directions(N * PER)]
    for at, reach in spurs:
        first = len(vertices)
        edges += [(at, first), (first, first + 1)]
        vertices += [trunk[at] + [0, 0, (length or reach) * part] for part in (0.4, 1)]
        distance = np.where(np.arange(2 * per) < round(share * 2 * per), reach, 10 * reach)
        across = directions(2 * per, seed=first) * [0, 1, 1]
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        points.append(trunk[at] + [along, 0, 0] + distance[:, None] * across)
        owner.append(first + np.arange(2 * per) % 2)
    points, owner = np.concatenate(points), np.concatenate(owner)
    return Skeleton(vertices, sorted(edges), np.full(len(vertices), 0.1), owner, points, directions(len(points)))


def test_short_is_cut_long_stays():
    raw = tree((5, 0.07), (12, 0.5))
    skeleton = pruned(raw, 1.1)
    assert len(skeleton.vertices) == N + 2
    np.testing.assert_array_equal(skeleton.junctions, [12])
    np.testing.assert_allclose(skeleton.vertices[:N], raw.vertices[:N], atol=1e-15)
    np.testing.assert_allclose(skeleton.vertices[N:], raw.vertices[N + 2 :], atol=1e-15)
    # the junction stays in its place and takes the points
    count = np.bincount(skeleton.vertex_of_point)
    assert count.tolist() == [PER] * 5 + [PER + 20] + [PER] * (N - 6) + [10, 10]
    owner = raw.vertex_of_point
    assert (skeleton.vertex_of_point[(owner == N) | (owner == N + 1)] == 5).all()


@pytest.mark.usefixtures("_alone")
@pytest.mark.parametrize("reach", [1.1, 1.3, 2.0])
@pytest.mark.parametrize(("share", "cut"), [(1 - 1e-6, True), (1 + 1e-6, False)])
def test_threshold_is_exact(reach, share, cut):
    radius = np.full(N, 0.03)
    radius[10] = 0.1  # at the junction, and nowhere else
    skeleton = pruned(tree((10, reach * 0.1 * share), radius=radius), reach)
    assert (len(skeleton.vertices) == N) == cut


@pytest.mark.usefixtures("_alone")
@pytest.mark.parametrize("along", [0.025, 0.05, 0.9])
@pytest.mark.parametrize(("share", "cut"), [(1 - 1e-6, True), (1 + 1e-6, False)])
def test_what_counts_is_how_far_points_are_from_the_part_and_how_thick_it_is_there(along, share, cut):
    """Between two vertices of the trunk, and far from the junction where it is thin."""
    radius = np.where(np.linspace(-1, 1, N) < 0.4, 0.3, 0.1)
    there = 0.1 if along > 0.4 else 0.3
    skeleton = pruned(tree((10, 1.3 * there * share), radius=radius, along=along), 1.3, there)
    assert (len(skeleton.vertices) == N) == cut


@pytest.mark.parametrize("far", [0, 1e4])
def test_distance_from_paths_over_their_thickness(far):
    """The nearest place of edges that are cut into very short ones."""
    rng = np.random.default_rng(0)
    vertices, thickness, points = rng.normal(size=(12, 3)), rng.uniform(0.1, 1, 12), rng.normal(size=(200, 3))
    paths, expected = [np.array(path) for path in ([0, 1, 2, 3], [0, 4], [5, 0, 5])], np.inf
    for path in paths:
        for a, b in pairwise(path):
            share = np.linspace(0, 1, 3001)[:, None]
            places, thick = (values[a] + share * (values[b] - values[a]) for values in (vertices, thickness[:, None]))
            distance, nearest = cKDTree(places).query(points)
            expected = np.minimum(expected, distance / thick[nearest, 0])
    found, there = relative_distance(points + far, vertices + far, thickness, paths)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert (np.clip(there, thickness.min(), thickness.max()) == there).all()
    ratio, there = relative_distance(points + far, vertices + far, np.full(12, 0.5), paths)
    np.testing.assert_allclose(ratio, relative_distance(points, vertices, np.full(12, 0.5), paths)[0], atol=2e-8)
    np.testing.assert_allclose(there, 0.5)


@pytest.mark.parametrize(("reach", "length", "cut"), [(0.07, 0.9, True), (0.3, 0.02, False)])
def test_points_count_and_not_the_curve(reach, length, cut):
    skeleton = pruned(tree((10, reach), length=length), 1.1)
    assert (len(skeleton.vertices) == N) == cut


@pytest.mark.parametrize(("share", "cut"), [(1.0, True), (SPUR_QUANTILE + 0.02, True), (SPUR_QUANTILE - 0.02, False)])
def test_a_few_far_points_do_not_save_a_spur(share, cut):
    skeleton = pruned(tree((10, 0.05), share=share, per=100), 1.1)
    assert (len(skeleton.vertices) == N) == cut


def test_a_spur_without_points_reaches_nowhere():
    raw = tree((10, 0.5), per=0)
    skeleton = pruned(raw, 1 + 1e-6)
    assert len(skeleton.vertices) == N
    np.testing.assert_allclose(skeleton.vertices, raw.vertices[:N], atol=1e-15)


def test_points_without_a_say_do_not_count():
    """Outliers hang on the spur: they have no normal, and do not make it longer."""
    raw = tree((10, 0.05), share=0.5)
    distance = np.linalg.norm(raw.points - raw.vertices[10], axis=1)
    raw.normals[(raw.vertex_of_point >= N) & (distance > 0.1)] = np.nan
    assert len(pruned(raw, 1.1).vertices) == N


def test_a_junction_stays_what_it_was():
    raw = tree((10, 0.05))
    m = len(raw.vertices)
    raw = replace(raw, radii=np.arange(m) + 1.0, confidence=np.linspace(1, 0, m))
    skeleton = pruned(raw, 1.1)
    assert len(skeleton.vertices) == N < m
    np.testing.assert_array_equal(skeleton.vertices, raw.vertices[:N])
    np.testing.assert_array_equal(skeleton.radii, raw.radii[:N])
    np.testing.assert_array_equal(skeleton.confidence, raw.confidence[:N])


def test_ends_of_the_trunk_stay():
    """Only what leaves a junction is a spur: a path shorter than it is thick is all there is."""
    raw = tree(radius=50.0)
    assert len(pruned(raw, 1.1).vertices) == len(raw.vertices)


def test_a_vertex_without_points_is_as_thick_as_its_radius_says():
    """Not without thickness: all points would be far from the edges beside it."""
    raw = tree((10, 0.05))
    raw.vertex_of_point[raw.vertex_of_point == 10] = 9
    assert not (raw.vertex_of_point == 10).any()
    assert len(pruned(raw, 1.1).vertices) == N


def test_far_points_in_chunks(monkeypatch):
    rng = np.random.default_rng(0)
    points, vertices = rng.normal(size=(50, 3)), rng.normal(size=(8, 3))
    found, _ = relative_distance(points, vertices, np.arange(8) + 1.0, [np.arange(8)])
    monkeypatch.setattr("glsk_o3d.numerics.polylines.POLYLINE_CHUNK", 21)
    again, _ = relative_distance(points, vertices, np.arange(8) + 1.0, [np.arange(8)])
    np.testing.assert_array_equal(again, found)


def test_lines_have_no_thickness():
    """Whatever is off a line leaves it."""
    raw = tree((10, 0.5), radius=0.0)
    assert len(pruned(raw, 1.3).vertices) == len(raw.vertices)


def test_zero_keeps_all():
    raw = tree((5, 0.07))
    assert len(prune_spurs(raw, UNBONDED, 0)[0].vertices) == len(raw.vertices)


def test_least_first_until_it_is_no_junction(ringed):
    """Of three short branches the farthest two remain as a path."""
    tips = np.array([[0.06, 0, 0], [-0.02, 0.05, 0], [-0.02, -0.07, 0]])
    raw = ringed(np.concatenate([[[0, 0, 0]], tips]), [(0, 1), (0, 2), (0, 3)], radius=[0.04, 1e-6, 1e-6, 1e-6])
    skeleton = pruned(raw, 3, 0.04)
    assert skeleton.edges.tolist() == [[0, 1], [0, 2]]
    np.testing.assert_allclose(skeleton.vertices, [[0, 0, 0], tips[0], tips[2]], atol=1e-15)


def test_several_at_one_junction_and_in_any_numbering(renumbered):
    raw = tree((5, 0.03), (5, 0.07), (9, 0.05), (12, 0.5))
    for case in (raw, renumbered(raw, np.random.default_rng(1).permutation(len(raw.vertices)))):
        skeleton = pruned(case, 1.1)
        assert len(skeleton.vertices) == N + 2
        assert len(skeleton.junctions) == 1
        expected = raw.vertices[[*range(N), N + 6, N + 7]]
        gap = np.linalg.norm(skeleton.vertices[:, None] - expected[None], axis=2).min(axis=1)
        assert gap.max() < 1e-12


def test_loops_at_a_junction_are_no_spurs(ringed):
    """A tiny ring on a stem has no end: both stay."""
    tiny = [[0, 0, 0.02], [0.01, 0, 0.03], [0, 0, 0.04], [-0.01, 0, 0.03]]
    line = [[x, 0, 0] for x in (-1, 0, 1)]
    raw = ringed(line + tiny, [(0, 1), (1, 2), (1, 3), (3, 4), (4, 5), (5, 6), (3, 6)])
    assert len(pruned(raw, 1.1).edges) == len(raw.edges)


def test_two_ways_between_two_junctions_stay(ringed):
    """They are a loop: neither may go, however short."""
    places = [[-1, 0, 0], [-0.02, 0, 0], [0, 0.01, 0], [0, -0.01, 0], [0.02, 0, 0], [1, 0, 0]]
    raw = ringed(places, [(0, 1), (1, 2), (1, 3), (2, 4), (3, 4), (4, 5)])
    assert len(pruned(raw, 1.1).vertices) == len(raw.vertices)


def test_facts_of_a_limb():
    """Its points stand out of the trunk, in its own half widths; nothing is said to hang together."""
    raw = tree((5, 0.3), (12, 0.5))
    raw = replace(raw, confidence=np.where(np.arange(len(raw.vertices)) < N, 0.2, 0.7))
    found = dict(limb_facts(raw, UNBONDED))
    assert set(found) >= {N + 1, N + 3}
    for tip, reach in ((N + 1, 0.3), (N + 3, 0.5)):
        assert np.exp(found[tip]["protrusion"]) - 0.3 == pytest.approx((reach - 0.1) / WIDE, rel=0.15)
        assert found[tip]["confidence"] == pytest.approx(0.7)
        assert found[tip]["web"] == 0
        assert found[tip]["roundness"] == pytest.approx(ROUND)


def test_branches_of_flat_parts_are_less_probable_limbs(monkeypatch):
    """A flat part draws strands into its corners."""
    raw = tree((5, 0.3), (12, 0.5))
    _, limbs = prune_spurs(raw, UNBONDED, 0)
    monkeypatch.setattr(spurs, "measure_sections", partial(sections, roundness=0.2))
    _, flat = prune_spurs(raw, UNBONDED, 0)
    assert len(limbs) == len(flat) == 4
    assert all(after.probability < before.probability for before, after in zip(limbs, flat, strict=True))


def test_a_cut_spur_does_not_make_its_junction_thicker():
    """Its points are farther from the junction than the surface there is: the limb beside it stands out as before."""
    far, near = ((10, 0.105), 400), ((10, 0.2), 10)
    alone = dict(limb_facts(tree(near[0]), UNBONDED))[N + 1]["protrusion"]
    raw = tree(far[0], near[0], per=400)
    _, limbs = prune_spurs(raw, UNBONDED, 0.02)
    assert [it.changed for it in limbs if it.place == tuple(raw.vertices[N + 1].tolist())] == [True]
    kept = [it.probability for it in limbs if it.place == tuple(raw.vertices[N + 3].tolist())]
    assert kept == [
        pytest.approx(
            probability(LIMB_WEIGHTS, {"protrusion": alone, "web": 0, "confidence": 0, "roundness": ROUND}), rel=0.3
        )
    ]


def test_what_is_pruned_was_judged():
    raw = tree((5, 0.05), (12, 0.5))
    skeleton, limbs = prune_spurs(raw, UNBONDED, 0.5)
    gone = [it for it in limbs if it.changed]
    assert len(raw.leaves) - len(skeleton.leaves) == len(gone) == 1
    assert gone[0].place == tuple(raw.vertices[N + 1].tolist())
    assert gone[0].probability < 0.5
    assert all(it.probability >= 0.5 for it in limbs if not it.changed)


def test_a_fork_is_one_only_if_both_prongs_are_limbs():
    """Alike prongs count together, whichever is the less probable; beside a long limb a prong counts for itself."""
    raw = tree((10, 0.2))
    alone = [probability(LIMB_WEIGHTS, facts) for _, facts in limb_facts(raw, UNBONDED)]
    _, limbs = prune_spurs(raw, UNBONDED, 0)
    less, more, most = sorted(alone)
    assert sorted(it.probability for it in limbs) == pytest.approx(sorted([less * more, more, most]))
    for least, left in ((less * more - 1e-9, 3), (less * more + 1e-9, 2)):
        assert len(prune_spurs(raw, UNBONDED, least)[0].leaves) == left
    crossed = tree((10, 0.2), (10, 0.3))  # four branches meet: each may go alone
    alone = [probability(LIMB_WEIGHTS, facts) for _, facts in limb_facts(crossed, UNBONDED)]
    assert sorted(it.probability for it in prune_spurs(crossed, UNBONDED, 0)[1]) == pytest.approx(sorted(alone))


@pytest.mark.usefixtures("_alone")
def test_the_farther_a_limb_reaches_the_more_probable_it_is():
    skeleton, limbs = prune_spurs(tree((5, 0.3), (12, 0.7)), UNBONDED, 0)
    found = {it.place: it for it in limbs}
    assert {(it.about, it.changed) for it in limbs} == {("limb", False)}
    short, far = (found[tuple(skeleton.vertices[tip])].probability for tip in (N + 1, N + 3))
    assert 0.2 < short < 0.8 < far < 1


def test_a_part_with_two_ends_has_no_limbs():
    assert prune_spurs(tree(), UNBONDED, 1.0)[1] == []


def test_distance_of_a_point_that_is_a_vertex_to_a_line_without_thickness():
    vertices = np.array([[0.0, 0, 0], [0, 0, 1], [0, 99, 0], [0, 99, 1]])
    found, _ = relative_distance(vertices[:1], vertices, np.zeros(4), [np.array([0, 1]), np.array([2, 3])])
    np.testing.assert_array_equal(found, [0])
    far, _ = relative_distance(vertices[:1], vertices, np.zeros(4), [np.array([2, 3])])
    assert 1e12 < far < np.inf
