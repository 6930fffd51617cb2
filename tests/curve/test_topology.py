"""Loops, limbs, branches that cross air, and gaps: what the surface says of them in closed cases, and the engine."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Connector, Contractor, Report, Skeleton, pipelines, skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.merging import collapse_triangles, drop_edges, drop_vertices
from glsk_o3d.curve.surface import Evidence, Surface
from glsk_o3d.curve.topology.false_branches import FalseBranches
from glsk_o3d.curve.topology.gaps import Gaps
from glsk_o3d.curve.topology.loops import Loops
from glsk_o3d.curve.topology.question import Candidate, Question, ask
from glsk_o3d.curve.topology.spurs import Limbs
from glsk_o3d.data.decisions import logistic
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


def assert_unchanged(skeleton, raw):
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-12)
    np.testing.assert_array_equal(skeleton.edges, raw.edges)
    np.testing.assert_array_equal(skeleton.vertex_of_point, raw.vertex_of_point)


def oriented(skeleton):
    curve = Curve.of(skeleton)
    return Evidence(curve, Surface.of(curve).oriented(curve))


@SIDES
@pytest.mark.parametrize(("lines", "loops"), [(LADDER, 2), (TORUS, 1)], ids=["ladder", "torus"])
def test_handles_stay(piped, refine, lines, loops, side):
    raw = piped(lines, side=side)
    skeleton = refine(raw, handle=0.5)
    assert_unchanged(skeleton, raw)
    assert [(it.about, it.changed) for it in skeleton.report.decisions] == loops * [("loop", False)]
    assert min(it.probability for it in skeleton.report.decisions) > 0.9


def strands(piped, gap, length, **options):
    """A tube with two strands in it that meet at both ends."""
    a, b = length / 2, length / 2 - 0.05
    middle = [[(-a, 0, 0), (-b, y, 0), (b, y, 0), (a, 0, 0)] for y in (-gap / 2, gap / 2)]
    return piped([*middle, [(-1, 0, 0), (-a, 0, 0)], [(a, 0, 0), (1, 0, 0)]], around=TUBE, **options)


def the_loop(ring):
    (loop,) = Loops().candidates(oriented(ring), 0.5)
    return loop


def passage_of(ring):
    """Three at most, in spacings."""
    return np.exp(the_loop(ring).facts["passage"]) - 0.3


def with_points(skeleton, points, normals, vertex=0):
    """A skeleton with more points, of some vertices."""
    return replace(
        skeleton,
        points=np.vstack([skeleton.points, points]),
        normals=np.vstack([skeleton.normals, np.broadcast_to(normals, points.shape)]),
        vertex_of_point=np.append(skeleton.vertex_of_point, np.broadcast_to(vertex, len(points))),
    )


def test_one_sees_through_a_loop_if_its_walls_face_it_and_no_surface_is_as_near_as_it_is_wide(piped):
    ring = piped(TORUS)
    assert passage_of(ring) > 2.7
    x, y = (each.ravel() for each in np.mgrid[-1:1:41j, -1:1:41j])
    for height, clear in ((0.6, False), (1.5, True)):  # a sheet across it
        across = with_points(ring, np.column_stack([x, y, np.full(x.size, height)]), Z)
        assert (passage_of(across) > 2.7) if clear else (passage_of(across) < 0.5)
    # points around a hole in a sheet are seen from the edge, and half a ring has no walls on the other side
    assert passage_of(replace(ring, normals=np.tile(Z, (len(ring.points), 1)))) < 0.01
    half = ring.points[:, 0] > -0.2
    assert passage_of(replace(ring, vertex_of_point=np.where(half, ring.vertex_of_point, -1))) < 1.5
    # behind the wall may be another, which is not seen
    turn, z = (each.ravel() for each in np.mgrid[0 : 2 * np.pi : 200j, -0.1:0.1:8j])
    assert passage_of(with_points(ring, np.column_stack([1.5 * np.cos(turn), 1.5 * np.sin(turn), z]), Z)) > 2.7


def test_there_is_no_passage_inside_of_a_part(piped):
    assert passage_of(strands(piped, 0.12, 1.5)) < 0.3


def test_an_opening_of_six_spacings_is_wide_enough(piped):
    assert the_loop(piped(TORUS)).facts["opening"] == pytest.approx(np.log(6 + 0.5))


def test_sparse_bars_keep_their_loops():
    corner = np.array(list(np.ndindex(2, 2, 2)), float)
    bars = np.array([(i, j) for i in range(8) for j in range(i) if np.abs(corner[i] - corner[j]).sum() == 1])
    for seed in range(3):
        frame = union_sample("frame", corner, bars, np.full(8, 0.12), 1024, 0.0, seed)
        assert skeletonize(frame.points).n_loops == 5


def test_a_passage_is_found_beside_the_wall_of_a_pot(piped):
    """The loop goes through the pot's middle, so that the wall crosses the largest circle in it."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    handle = np.column_stack([0.9 + 0.5 * np.cos(angle), 0.5 * np.sin(angle), 0 * angle])
    loop = [[(0, -0.5, 0), *handle.tolist(), (0, 0.5, 0)], [(0, 0.5, 0), (0, -0.5, 0)]]
    pot = piped(loop, around=[handle.tolist()])
    y, turn = (each.ravel() for each in np.mgrid[-1:1:60j, 0 : 2 * np.pi : 120j])
    out = np.column_stack([np.cos(turn), 0 * y, np.sin(turn)])
    wall, middle = 0.9 * out + np.outer(y, Y), np.flatnonzero(np.abs(pot.vertices[:, 0]) < 0.01)
    owner = middle[np.abs(y[:, None] - pot.vertices[middle, 1]).argmin(axis=1)]
    assert passage_of(with_points(pot, wall, out, owner)) > 1.5


@pytest.mark.parametrize("inside", [1, 0.35, 0.25, 0.1, -0.2])
def test_a_loop_is_as_probable_as_it_has_an_inside(piped, monkeypatch, inside):
    """A ring as thin as its points are apart has little, and a loop in air none, whatever else speaks for it."""
    ring, full = piped(TORUS), Surface.winding
    monkeypatch.setattr(Surface, "winding", lambda self, places: inside * full(self, places))
    loop = the_loop(ring)
    certainty = loop.probability / logistic(Loops.weights, loop.facts)
    assert certainty == pytest.approx(np.clip(2 * inside / 0.4 - 1, 0, 1), abs=0.05)


@SIDES
@pytest.mark.parametrize("gap", [0.06, 0.16])
def test_two_strands_in_one_tube_become_a_path(piped, refine, gap, side):
    raw = strands(piped, gap, 1.5, side=side)
    skeleton = refine(raw, handle=0.5)
    assert (raw.n_loops, counts(skeleton), len(skeleton.junctions)) == (1, (1, 0, 2), 0)
    assert np.abs(skeleton.vertices[:, 1]).max() < 0.4 * gap
    assert len(skeleton.vertices) > 0.8 * 2 / 0.05  # every vertex met the one across
    assert skeleton.edge_lengths.max() < 1.6 * 0.05 + gap
    assert skeleton.report.n_loops_closed == 1
    assert refine(raw).n_loops == 1


def test_a_wide_loop_is_cut_where_nothing_hangs_together(piped, refine):
    """A ring of which an eighth is in air, joined by hand; whatever is asked of a handle, it is none."""
    raw = piped([[(np.cos(t), np.sin(t), 0) for t in np.arange(4, 29) * np.pi / 16]])
    ends = np.sort(np.argsort(raw.vertices @ X)[-2:])
    closed = replace(raw, edges=np.unique([*raw.edges.tolist(), ends.tolist()], axis=0))
    skeleton = refine(closed, handle=1.0)
    assert (closed.n_loops, counts(skeleton)) == (1, (1, 0, 2))
    assert skeleton.report.n_loops_closed == 1
    np.testing.assert_allclose(skeleton.vertices[skeleton.leaves], raw.vertices[raw.leaves], atol=1e-12)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:uncertain topology")  # one of a hundred questions may be a close call
def test_an_object_of_many_parts_keeps_them():
    """What is enough for a figure leaves a ladder's rungs a few points each, and no inside."""
    rungs = 28
    height = 0.3 * np.arange(rungs)
    nodes = np.concatenate([np.column_stack([np.full(rungs, x), np.zeros(rungs), height]) for x in (0, 0.4)])
    up = np.column_stack([np.arange(rungs - 1), np.arange(1, rungs)])
    edges = np.concatenate([up, up + rungs, np.column_stack([np.arange(rungs), rungs + np.arange(rungs)])])
    ladder = union_sample("ladder", nodes, edges, np.full(2 * rungs, 0.025), 50000, 0, 0)
    assert counts(skeletonize(ladder.points)) == (1, rungs - 1, 0)


def net(seed, side=4):
    """The raw graph of a net of tubes, which are not all of one length, and its false loops."""
    rng = np.random.default_rng(seed)
    x, y = np.divmod(np.arange(side * side), side)
    nodes = np.column_stack([x, y, np.zeros(side * side)]) + rng.uniform(-0.1, 0.1, (side * side, 3))
    edges = [(i, i + 1) for i in range(side * side) if y[i] < side - 1]
    edges = np.array(edges + [(i, i + side) for i in range(side * (side - 1))])
    cloud = union_sample("net", nodes, edges, np.full(len(nodes), 0.12), 120 * len(edges), noise=0.0, seed=seed)
    return collapse_triangles((pipelines.rings() | Contractor() | Connector())(cloud.points))


@pytest.mark.parametrize("seed", range(2))
def test_points_that_are_near_say_as_much_as_all(seed, monkeypatch):
    raw = net(seed)
    near = Loops().candidates(oriented(raw), 0.5)
    assert len(near) >= 9
    monkeypatch.setattr(Surface, "near", lambda self, place, reach: np.arange(len(self.points)))
    for loop, other in zip(near, Loops().candidates(oriented(raw), 0.5), strict=True):
        np.testing.assert_allclose([*loop.facts.values()], [*other.facts.values()], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(loop.part[0], other.part[0])


@pytest.mark.parametrize("seed", range(3))
def test_every_closed_loop_is_counted_once(seed):
    """Near the surface of a gyroid, many false loops share vertices: of these one can be cut at a time."""
    x = 4 * np.pi * np.random.default_rng(seed).random((60000, 3))
    value = (np.sin(x) * np.cos(np.roll(x, -1, axis=1))).sum(axis=1)
    cloud = x[np.argsort(np.abs(value - 0.5))[:4000]]
    raw = collapse_triangles((pipelines.rings() | Contractor() | Connector())(cloud))
    closed, decisions = ask(Loops(), Curve.of(raw), oriented(raw).surface, 0.5)
    changed = [each for each in decisions if each.changed]
    assert len(decisions) - len(changed) == closed.n_loops
    assert 0 < len(changed) == len(set(changed)) <= raw.n_loops - closed.n_loops
    assert all((each.probability < 0.5) == each.changed for each in decisions)


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
    found = []
    for reach in (0.8, 1.5, 2, 3, 5):
        skeleton = refine(twig(piped, reach), limb=1e-9)
        assert len(skeleton.leaves) == 3
        (tip,) = (it for it in skeleton.report.decisions if it.place[1] > 0)
        assert (tip.about, tip.changed) == ("limb", False)
        found.append(tip.probability)
    assert (np.diff(found) > 0).all()
    assert found[0] < 0.4 < 0.5 < found[1] < found[2] < 0.95 < found[3]
    assert refine(twig(piped, 0.8)).report.decisions == ()  # 0 does not ask


def test_a_spur_goes_whole_and_nothing_else(piped, refine):
    raw, stays = twig(piped, 0.8), twig(piped, 3)
    skeleton = refine(raw, limb=0.25)
    left = raw.vertices[:, 1] == 0
    np.testing.assert_allclose(skeleton.vertices, raw.vertices[left], atol=1e-12)
    (place,) = np.flatnonzero((skeleton.vertices == 0).all(axis=1))
    owner = raw.vertex_of_point
    np.testing.assert_array_equal(skeleton.vertex_of_point[~left[owner]], place)  # the fork takes its points
    places = skeleton.vertices[skeleton.vertex_of_point[left[owner]]]
    np.testing.assert_allclose(places, raw.vertices[owner[left[owner]]], atol=1e-12)
    (gone,) = skeleton.report.decisions
    for least, leaves in ((gone.probability - 1e-9, 3), (gone.probability + 1e-9, 2)):
        assert len(refine(raw, limb=least).leaves) == leaves
    assert_unchanged(refine(stays, limb=0.25), stays)


def test_what_ends_nowhere_is_no_spur(piped, refine):
    """A tiny ring on a stem, two ways between two junctions, and a path shorter than it is thick."""
    tiny = [(0, 0, 0.02), (0.01, 0, 0.03), (0, 0, 0.04), (-0.01, 0, 0.03), (0, 0, 0.02)]
    ring = [[(-1, 0, 0), (0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 0, 0.02)], tiny]
    for raw in (piped(ring, TUBE), strands(piped, 0.04, 0.2), piped([[(0, 0, 0), (0.05, 0, 0)]])):
        assert_unchanged(refine(raw, limb=0.25), raw)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_an_edge_between_two_tubes_is_cut(piped, refine, noise):
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
def test_limbs_and_struts_are_kept(piped, refine, lines, side):
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
def test_where_the_object_goes_on_a_gap_is_bridged(piped, refine, lines, after, place, side):
    raw = piped(lines, side=side)
    skeleton = refine(raw, bridge=0.5)
    assert (counts(skeleton), skeleton.report.n_bridges) == (after, 1)
    ((about, changed),) = [(it.about, it.changed) for it in skeleton.report.decisions]
    assert (about, changed) == ("gap", True)
    np.testing.assert_allclose(skeleton.report.decisions[0].place, place, atol=0.05)
    assert len(skeleton.edges) == len(raw.edges) + 1
    np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-12)
    assert refine(raw).n_components == raw.n_components


def test_where_it_ends_it_is_not(piped, refine):
    """Two capsules end to end, and a tip that points at the side of a tube."""
    tip = piped([[(0.3, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 0, 0), (0, 1, 0)]])
    for raw in (capped(piped(PARTS), (-0.15 * X, X), (0.15 * X, -X)), capped(tip, (0.3 * X, -X))):
        skeleton = refine(raw, bridge=0.5)
        assert_unchanged(skeleton, raw)
        assert max((it.probability for it in skeleton.report.decisions), default=0) < 0.5


def test_which_gaps_are_asked(piped, refine):
    """Of what an end points at, is not near along the skeleton, and is not too far."""

    def asked(*lines):
        return len(refine(piped(lines), bridge=1.0).report.decisions)

    assert asked([(-1, 0, 0), (-0.2, 0, 0)], [(0.2, 0, 0), (1, 0, 0)]) == 1
    assert asked([(-1, 0, 0), (-0.6, 0, 0)], [(0.6, 0, 0), (1, 0, 0)]) == 0
    assert asked([(-1, 0, 0), (0, 0, 0)], [(-1, 0.3, 0), (0, 0.3, 0)]) == 0  # side by side
    assert asked([(-1, 0, 0), (0.1, 0, 0), (0.1, 0.25, 0), (0, 0.25, 0), (0, 0.15, 0)]) == 0  # a hook


def test_every_end_is_joined_once(piped, refine):
    """Three ends meet: the two in line are surer."""
    skeleton = refine(piped([*PARTS, [(0, 0.3, 0), (0, 1, 0)]]), bridge=0.01)
    assert skeleton.degree.max() <= 3
    joined = [sorted(skeleton.vertices[e, 0].tolist()) for e in skeleton.edges if skeleton.edge_lengths.max() > 0.2]
    assert [-0.15, 0.15] in joined


CASES = {
    "a ladder": (Loops, lambda piped: piped(LADDER), [5.58, 5.57]),
    "strands": (Loops, lambda piped: strands(piped, 0.16, 1.5, side=Z + 0.3 * Y), [-6.32]),
    "a stub": (Limbs, lambda piped: surely(twig(piped, 0.8)), [5.11, -3.81, 4.95]),
    "a limb in a tube": (Limbs, lambda piped: surely(twig(piped, 3, TUBE)), [5.11, -4.4, 5.05]),
    "a false branch": (
        FalseBranches,
        lambda piped: replace(piped(ACROSS, ACROSS[:2]), report=Report(noise=0.5)),
        [-7.64, -7.48, 3.39, -7.43, -7.61],
    ),
    "a strut": (FalseBranches, lambda piped: piped(ACROSS), [-8.52, -8.32, -5.81, -8.13, -8.32]),
    "a ring": (FalseBranches, lambda piped: piped(TORUS), [-6.73]),
    "a gap in a ring": (Gaps, lambda piped: piped(ARC), [1.3]),
    "capsules": (Gaps, lambda piped: capped(piped(PARTS), (-0.15 * X, X), (0.15 * X, -X)), [-1.69]),
}
"""Questions about hand-made cases, and the log-odds that the fitted models give."""


def surely(skeleton):
    """With a confidence that differs from vertex to vertex."""
    return replace(skeleton, confidence=0.5 + 0.4 * np.sin(np.arange(len(skeleton.vertices))))


@pytest.mark.parametrize("case", CASES)
def test_hand_made_cases_are_judged_as_they_were_when_the_models_were_fitted(piped, case):
    question, make, recorded = CASES[case]
    found = sorted(question().candidates(oriented(make(piped)), 0.5), key=lambda each: each.place.round(2).tolist())
    probability = np.array([each.probability for each in found])
    np.testing.assert_allclose(np.log(probability / (1 - probability)), recorded, atol=0.02)


@pytest.mark.parametrize("question", [Loops, Limbs, FalseBranches, Gaps])
@pytest.mark.parametrize("lines", [ACROSS, LADDER, FORK, PARTS], ids=["strut", "ladder", "fork", "parts"])
def test_the_numbers_of_vertices_and_points_do_not_matter(piped, placed, question, lines):
    """Nor does how the object is turned, and where it is."""
    raw, rng = surely(piped(lines)), np.random.default_rng(0)
    new, order = rng.permutation(len(raw.vertices)), rng.permutation(len(raw.points))
    old = np.argsort(new)
    other = Skeleton(
        *(raw.vertices[old], new[raw.edges], raw.radii[old], new[raw.vertex_of_point[order]]),
        *(raw.points[order], raw.normals[order], raw.report, raw.confidence[old]),
    )
    one, other = (
        sorted(each.probability for each in question().candidates(oriented(skeleton), 0.5))
        for skeleton in (raw, placed(other, shift=3.0)[0])
    )
    np.testing.assert_allclose(one, other, rtol=1e-3)


@pytest.mark.parametrize(("step", "every"), [(0.5, 3), (0.0125, 2), (0.004, 1)])
def test_the_surface_has_4096_points_and_32_for_every_vertex_of_more(piped, step, every):
    curve = Curve.of(piped(TUBE, step=step, spacing=0.01))
    assert len(curve.points) == 12566
    assert len(Surface.of(curve).points) == np.ceil(12566 / every)


@pytest.mark.parametrize("tilt", [0, 30, 90])
def test_the_area_along_a_curve_is_that_of_its_tube_as_far_as_the_normals_stand_upright(piped, tilt):
    tube, angle = piped(TUBE, spacing=0.01), np.radians(tilt)
    area = oriented(tube).area
    assert area.sum() == pytest.approx(2 * np.pi * 0.1 * 2, rel=0.06)  # its ends are open
    leaning = replace(tube, normals=np.cos(angle) * tube.normals + np.sin(angle) * X)
    np.testing.assert_allclose(oriented(leaning).area, area * np.cos(angle) ** 2, atol=1e-9)


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
def test_a_question_is_asked_until_nothing_changes_and_tells_what_it_did(piped, monkeypatch, repeats, places, n_cut):
    monkeypatch.setattr(RightEnds, "repeats", repeats)
    path = piped([[(-2, 0, 0), (2, 0, 0)]], step=1)
    evidence = oriented(path)
    found, decisions = ask(RightEnds(), evidence.curve, evidence.surface, 0.1)
    assert [it.place[0] for it in decisions] == places
    assert [it.changed for it in decisions] == [x > 0.4 for x in places]
    assert [it.probability for it in decisions] == [x / 4 for x in places]
    assert found.vertices[:, 0].tolist() == np.arange(-2, 3 - n_cut).tolist()
    assert len(found.vertex_of_point) == len(path.points)
    same, decisions = ask(RightEnds(), found, evidence.surface, 0.6)
    assert same is found
    assert not any(it.changed for it in decisions)
