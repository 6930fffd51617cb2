"""Limbs, branches that cross empty space, and gaps: what the surface says of them in closed cases, and the engine."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Report, Skeleton, skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.merging import drop_edges, drop_vertices
from glsk_o3d.curve.surface import Surface
from glsk_o3d.curve.topology.false_branches import FalseBranches
from glsk_o3d.curve.topology.gaps import Gaps, gap_facts
from glsk_o3d.curve.topology.loops import Loops
from glsk_o3d.curve.topology.question import Candidate, Question, ask
from glsk_o3d.curve.topology.spurs import Limbs, _creases
from glsk_o3d.samples.capsules import union_sample

X, Y, Z = np.eye(3)
TUBE = [[(-1, 0, 0), (1, 0, 0)]]
TORUS = [[(np.cos(t), np.sin(t), 0) for t in np.arange(25) * np.pi / 12]]
FORK = [[(0, 0, 0), (0, 0, -1)], [(0, 0, 0), (0.7, 0, 0.7)], [(0, 0, 0), (-0.7, 0, 0.7)]]
LADDER = [[(-0.8, y, 0), (0, y, 0), (0.8, y, 0)] for y in (0, 0.5)] + [[(x, 0, 0), (x, 0.5, 0)] for x in (-0.8, 0, 0.8)]
ACROSS = [[(-1, y, 0), (0, y, 0), (1, y, 0)] for y in (0, 0.5)] + [[(0, 0, 0), (0, 0.5, 0)]]
"""Two parallel tubes, and an edge from one to the other."""
SIDES = pytest.mark.parametrize("side", [None, Z + 0.3 * Y], ids=["whole", "one side"])


def counts(skeleton):
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


def test_a_thin_spout_of_a_thick_body_is_a_limb():
    """Up to the surface the points around its curve are the body's, ten times as wide."""
    nodes = np.array([[-0.7, 0, 0], [0.7, 0, 0], [0, 0, 0], [0.2, 0, 0.8]])
    body = union_sample("", nodes, np.array([[0, 1], [2, 3]]), np.array([0.4, 0.4, 0.04, 0.04]), 4000, 0.0, 0)
    skeleton = skeletonize(body.points)
    assert counts(skeleton) == (1, 0, 3)
    assert min(it.probability for it in skeleton.report.decisions if it.about == "limb") > 0.9


def twig(piped, reach, around=None):
    """A tube and an edge path from its middle, `reach` radii long."""
    return piped([[(-1, 0, 0), (0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 0.1 * reach, 0)]], around)


def test_a_branch_is_a_limb_as_far_as_its_points_reach(piped, refine):
    """However long its curve is."""
    assert counts(refine(twig(piped, 5, TUBE), limb=0.25)) == (1, 0, 2)
    probabilities = []
    for reach in (0.8, 1.5, 2, 3, 5):
        skeleton = refine(twig(piped, reach), limb=1e-9)
        assert len(skeleton.leaves) == 3
        (tip,) = (it for it in skeleton.report.decisions if it.place[1] > 0)
        assert (tip.about, tip.changed) == ("limb", False)
        probabilities.append(tip.probability)
    assert (np.diff(probabilities) > 0).all()
    assert probabilities[0] < 0.4 < 0.5 < probabilities[1] < 0.95 < probabilities[2]
    assert refine(twig(piped, 0.8)).report.decisions == ()  # 0 does not ask


def test_a_spur_goes_whole_and_nothing_else(piped, refine, assert_unchanged):
    raw, stays = twig(piped, 0.8), twig(piped, 3)
    skeleton = refine(raw, limb=0.25)
    kept = raw.vertices[:, 1] == 0
    np.testing.assert_allclose(skeleton.vertices, raw.vertices[kept], atol=1e-12)
    (place,) = np.flatnonzero((skeleton.vertices == 0).all(axis=1))
    owner = raw.vertex_of_point
    np.testing.assert_array_equal(skeleton.vertex_of_point[~kept[owner]], place)  # the fork takes its points
    places = skeleton.vertices[skeleton.vertex_of_point[kept[owner]]]
    np.testing.assert_allclose(places, raw.vertices[owner[kept[owner]]], atol=1e-12)
    (decision,) = skeleton.report.decisions
    for least, leaves in ((decision.probability - 1e-9, 3), (decision.probability + 1e-9, 2)):
        assert len(refine(raw, limb=least).leaves) == leaves
    assert_unchanged(refine(stays, limb=0.25), stays)


def test_parts_without_a_free_end_are_no_spurs(piped, refine, strands, assert_unchanged):
    """A tiny ring on a stem, two ways between two junctions, and a path shorter than it is thick."""
    tiny = [(0, 0, 0.02), (0.01, 0, 0.03), (0, 0, 0.04), (-0.01, 0, 0.03), (0, 0, 0.02)]
    ring = [[(-1, 0, 0), (0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 0, 0.02)], tiny]
    for raw in (piped(ring, TUBE), strands(0.04, 0.2), piped([[(0, 0, 0), (0.05, 0, 0)]])):
        assert_unchanged(refine(raw, limb=0.25), raw)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_an_edge_between_two_tubes_is_cut(piped, refine, noise, assert_unchanged):
    raw = replace(piped(ACROSS, ACROSS[:2]), report=Report(noise=noise))
    skeleton = refine(raw, air=0.5, limb=0.5)
    assert (raw.n_components, counts(skeleton), skeleton.report.n_cuts) == (1, (2, 0, 4), 1)
    (false,) = (it for it in skeleton.report.decisions if it.about == "air" and it.changed)
    np.testing.assert_allclose(false.place, [0, 0.25, 0], atol=0.16)
    # what stays lies in the tubes, and has all points
    assert np.minimum(np.abs(skeleton.vertices[:, 1]), np.abs(skeleton.vertices[:, 1] - 0.5)).max() < 0.16
    assert skeleton.vertex_of_point.min() >= 0
    assert_unchanged(refine(raw, air=1.0), raw)


@SIDES
@pytest.mark.parametrize("lines", [ACROSS, FORK, TUBE, TORUS], ids=["strut", "fork", "tube", "ring"])
def test_limbs_and_struts_are_kept(piped, refine, lines, side, assert_unchanged):
    raw = piped(lines, side=None if lines is ACROSS else side)
    skeleton = refine(raw, air=0.5)
    assert_unchanged(skeleton, raw)
    assert len(skeleton.report.decisions) == len(raw.branches)
    assert max(it.probability for it in skeleton.report.decisions) < 0.25


ARC = [[(np.cos(t), np.sin(t), 0) for t in np.linspace(0.15, 2 * np.pi - 0.15, 30)]]
PARTS = [[(-1, 0, 0), (-0.15, 0, 0)], [(0.15, 0, 0), (1, 0, 0)]]
"""A tube of which a stretch of three radii was not seen."""


def capped(skeleton, *caps, radius=0.1, spacing=0.03):
    """Half balls of points more, each at a place, bulging along a direction."""
    points, normals = [skeleton.points], [skeleton.normals]
    for k, (place, way) in enumerate(caps):
        out = np.random.default_rng(k).normal(size=(round(4 * np.pi * radius**2 / spacing**2), 3))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        out = out[out @ way > 0]
        points.append(place + radius * out)
        normals.append(out)
    points, normals = np.concatenate(points), np.concatenate(normals)
    owner = np.argmin(np.linalg.norm(points[:, None] - skeleton.vertices, axis=2), axis=1)
    return replace(skeleton, points=points, normals=normals, vertex_of_point=owner)


@SIDES
@pytest.mark.parametrize(
    ("lines", "after", "place"), [(ARC, (1, 1, 0), X), (PARTS, (1, 0, 2), 0 * X)], ids=["ring", "limb"]
)
def test_a_gap_is_bridged_where_the_object_goes_on(piped, refine, lines, after, place, side):
    raw = piped(lines, side=side)
    skeleton = refine(raw, bridge=0.5)
    assert (counts(skeleton), skeleton.report.n_bridges) == (after, 1)
    ((about, changed),) = [(it.about, it.changed) for it in skeleton.report.decisions]
    assert (about, changed) == ("gap", True)
    np.testing.assert_allclose(skeleton.report.decisions[0].place, place, atol=0.05)
    assert len(skeleton.edges) == len(raw.edges) + 1
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-12)
    assert refine(raw).n_components == raw.n_components


def test_a_gap_between_closed_ends_is_not_bridged(piped, refine, assert_unchanged):
    """Two capsules end to end, and a tip that points at the side of a tube."""
    tip = piped([[(0.3, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 0, 0), (0, 1, 0)]])
    for raw in (capped(piped(PARTS), (-0.15 * X, X), (0.15 * X, -X)), capped(tip, (0.3 * X, -X))):
        skeleton = refine(raw, bridge=0.5)
        assert_unchanged(skeleton, raw)
        assert max((it.probability for it in skeleton.report.decisions), default=0) < 0.5


def test_a_gap_is_asked_about_if_an_end_points_across_it(piped, refine):
    """Of what an end points at, is not near along the skeleton, and is not too far."""

    def asked(*lines):
        return len(refine(piped(lines), bridge=1.0).report.decisions)

    assert asked([(-1, 0, 0), (-0.2, 0, 0)], [(0.2, 0, 0), (1, 0, 0)]) == 1
    assert asked([(-1, 0, 0), (-0.6, 0, 0)], [(0.6, 0, 0), (1, 0, 0)]) == 0
    assert asked([(-1, 0, 0), (0, 0, 0)], [(-1, 0.3, 0), (0, 0.3, 0)]) == 0  # side by side
    assert asked([(-1, 0, 0), (0.1, 0, 0), (0.1, 0.25, 0), (0, 0.25, 0), (0, 0.15, 0)]) == 0  # a hook


def test_an_end_points_at_what_is_ahead_rather_than_at_what_is_a_little_nearer(piped, evidence):
    aside = np.array([-0.2, 0, 0]) + 0.35 * (np.cos(np.radians(50)) * X + np.sin(np.radians(50)) * Y)
    raw = piped([[(-1, 0, 0), (-0.2, 0, 0)], [(0.2, 0, 0), (1, 0, 0)], [aside, aside + 0.5 * X + 0.9 * Y]])
    pairs = [raw.vertices[list(pair)] for pair, _ in gap_facts(evidence(raw)) if (raw.degree[list(pair)] == 1).all()]
    (aim,) = (other for leaf, other in pairs if leaf[0] == -0.2)
    np.testing.assert_array_equal(aim, [0.2, 0, 0])


def test_every_end_is_joined_once(piped, refine):
    """Three ends meet: the two in line are surer."""
    skeleton = refine(piped([*PARTS, [(0, 0.3, 0), (0, 1, 0)]]), bridge=0.01)
    assert skeleton.degree.max() <= 3
    joined = [sorted(skeleton.vertices[e, 0].tolist()) for e in skeleton.edges if skeleton.edge_lengths.max() > 0.2]
    assert [-0.15, 0.15] in joined


CASES = {
    "a ladder": (Loops, lambda piped, _: piped(LADDER), [5.58, 5.57]),
    "strands": (Loops, lambda piped, strands: strands(0.16, 1.5, side=Z + 0.3 * Y), [-6.32]),
    "a stub": (Limbs, lambda piped, _: surely(twig(piped, 0.8)), [5.32, -4.44, 5.07]),
    "a limb in a tube": (Limbs, lambda piped, _: surely(twig(piped, 3, TUBE)), [5.19, -7.32, 5.13]),
    "a false branch": (
        FalseBranches,
        lambda piped, _: replace(piped(ACROSS, ACROSS[:2]), report=Report(noise=0.5)),
        [-7.64, -7.48, 3.39, -7.43, -7.61],
    ),
    "a strut": (FalseBranches, lambda piped, _: piped(ACROSS), [-8.52, -8.32, -5.81, -8.13, -8.32]),
    "a ring": (FalseBranches, lambda piped, _: piped(TORUS), [-6.73]),
    "a gap in a ring": (Gaps, lambda piped, _: piped(ARC), [1.3]),
    "capsules": (Gaps, lambda piped, _: capped(piped(PARTS), (-0.15 * X, X), (0.15 * X, -X)), [-1.69]),
}
"""Questions about hand-made cases, and the log-odds that the fitted models give."""


def surely(skeleton):
    """With a confidence that differs from vertex to vertex."""
    return replace(skeleton, confidence=0.5 + 0.4 * np.sin(np.arange(len(skeleton.vertices))))


@pytest.mark.parametrize("case", CASES)
def test_hand_made_cases_have_the_recorded_log_odds(piped, case, strands, evidence):
    question, make, recorded = CASES[case]
    candidates = question().candidates(evidence(make(piped, strands)), 0.5)
    candidates = sorted(candidates, key=lambda each: each.place.round(2).tolist())
    probability = np.array([each.probability for each in candidates])
    np.testing.assert_allclose(np.log(probability / (1 - probability)), recorded, atol=0.02)


@pytest.mark.parametrize("question", [Loops, Limbs, FalseBranches, Gaps])
@pytest.mark.parametrize("lines", [ACROSS, LADDER, FORK, PARTS], ids=["strut", "ladder", "fork", "parts"])
def test_decisions_do_not_depend_on_numbering_and_pose(piped, placed, question, lines, evidence):
    raw, rng = surely(piped(lines)), np.random.default_rng(0)
    new, order = rng.permutation(len(raw.vertices)), rng.permutation(len(raw.points))
    old = np.argsort(new)
    other = Skeleton(
        *(raw.vertices[old], new[raw.edges], raw.radii[old], new[raw.vertex_of_point[order]]),
        *(raw.points[order], raw.normals[order], raw.report, raw.confidence[old]),
    )
    one, other = (
        sorted(each.probability for each in question().candidates(evidence(skeleton), 0.5))
        for skeleton in (raw, placed(other, shift=3.0)[0])
    )
    np.testing.assert_allclose(one, other, rtol=1e-3)


@pytest.mark.parametrize(("step", "every"), [(0.5, 3), (0.0125, 2), (0.004, 1)])
def test_the_surface_has_4096_points_and_32_for_every_vertex_of_more(piped, step, every):
    curve = Curve.of(piped(TUBE, step=step, spacing=0.01))
    assert len(curve.points) == 12566
    assert len(Surface.of(curve).points) == np.ceil(12566 / every)


@pytest.mark.parametrize("tilt", [0, 30, 90])
def test_the_area_along_a_curve_is_that_of_its_tube_as_far_as_the_normals_stand_upright(piped, tilt, evidence):
    tube, angle = piped(TUBE, spacing=0.01), np.radians(tilt)
    area = evidence(tube).area
    assert area.sum() == pytest.approx(2 * np.pi * 0.1 * 2, rel=0.06)  # its ends are open
    leaning = replace(tube, normals=np.cos(angle) * tube.normals + np.sin(angle) * X)
    np.testing.assert_allclose(evidence(leaning).area, area * np.cos(angle) ** 2, atol=1e-9)


class RightEnds(Question):
    """Which ends are right of the middle? They are cut, edge by edge."""

    about, repeats = "limb", True

    def candidates(self, evidence, least):
        ends = evidence.curve.vertices[evidence.curve.leaves]
        return [
            Candidate(v, p, {}, p[0] / 4, p[0] / 4 > least) for v, p in zip(evidence.curve.leaves, ends, strict=True)
        ]

    def change(self, evidence, chosen):
        cut = drop_edges(
            evidence.curve, [e for e in evidence.curve.edges if np.isin(e, [c.part for c in chosen]).any()]
        )
        return drop_vertices(cut, cut.degree == 0)


@pytest.mark.parametrize(
    ("repeats", "places", "n_cut"), [(True, [2, 1, -2, 0], 2), (False, [-2, 2], 1)], ids=["repeated", "once"]
)
def test_a_question_repeats_until_nothing_changes(piped, evidence, monkeypatch, repeats, places, n_cut):
    monkeypatch.setattr(RightEnds, "repeats", repeats)
    path = piped([[(-2, 0, 0), (2, 0, 0)]], step=1)
    given = evidence(path)
    cut, decisions = ask(RightEnds(), given.curve, given.surface, 0.1)
    assert [it.place[0] for it in decisions] == places
    assert [it.changed for it in decisions] == [x > 0.4 for x in places]
    assert [it.probability for it in decisions] == [x / 4 for x in places]
    assert cut.vertices[:, 0].tolist() == np.arange(-2, 3 - n_cut).tolist()
    assert len(cut.vertex_of_point) == len(path.points)
    same, decisions = ask(RightEnds(), cut, given.surface, 0.6)
    assert same is cut
    assert not any(it.changed for it in decisions)


@pytest.mark.parametrize(("fold", "crease"), [(1, 1.0), (0, 0.0), (-1, 0.0)])
def test_a_limb_leaves_a_floor_in_a_crease_and_a_spur_over_an_edge(fold, crease):
    """A floor along x goes on as a wall, up or down, or straight on."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(-0.95, 1, 0.1), np.arange(0, 1, 0.1)))
    is_wall = (u > 0) & (fold != 0)
    points = np.column_stack([np.where(is_wall, 0, u), v, np.where(is_wall, fold * u, 0)])
    normals = np.where(is_wall[:, None], [-fold, 0, 0], [0, 0, 1.0])
    on = [0, fold, 1 - abs(fold)]  # x and z of a place so far behind the fold
    vertices = [(-1.5, 0.5, 0), (-0.4, 0.5, 0), *((on[2] * far, 0.5, on[1] * far) for far in (0.4, 1.2))]
    edges, owner = [(0, 1), (1, 2), (2, 3)], np.where(u < 0, 1, 2)
    curve = Curve.of(Skeleton(vertices, edges, np.ones(4), owner, points, normals))
    surface = Surface.of(curve).changed(normals=normals)
    found = _creases(curve, surface, [np.arange(4)], np.array([0.2]))
    assert found == [crease]
