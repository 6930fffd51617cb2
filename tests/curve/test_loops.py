"""Loops: which are handles, what one sees through them, and how the others are closed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Connector, Contractor, Skeleton, pipelines, skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.merging import collapse_triangles
from glsk_o3d.curve.surface import Surface
from glsk_o3d.curve.topology.loops import Loops, facing_pairs
from glsk_o3d.curve.topology.question import ask
from glsk_o3d.data.decisions import logistic
from glsk_o3d.samples.capsules import union_sample

X, Y, Z = np.eye(3)
TORUS = [[(np.cos(t), np.sin(t), 0) for t in np.arange(25) * np.pi / 12]]
LADDER = [[(-0.8, y, 0), (0, y, 0), (0.8, y, 0)] for y in (0, 0.5)] + [[(x, 0, 0), (x, 0.5, 0)] for x in (-0.8, 0, 0.8)]
SIDES = pytest.mark.parametrize("side", [None, Z + 0.3 * Y], ids=["whole", "one side"])


def counts(skeleton):
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


@pytest.fixture
def passage(evidence):
    """Three at most, in spacings, of the only loop."""

    def of(ring):
        (loop,) = Loops().candidates(evidence(ring), 0.5)
        return np.exp(loop.facts["passage"]) - 0.3

    return of


def with_points(skeleton, points, normals, vertex=0):
    """A skeleton with more points, of some vertices."""
    return replace(
        skeleton,
        points=np.vstack([skeleton.points, points]),
        normals=np.vstack([skeleton.normals, np.broadcast_to(normals, points.shape)]),
        vertex_of_point=np.append(skeleton.vertex_of_point, np.broadcast_to(vertex, len(points))),
    )


@SIDES
@pytest.mark.parametrize(("lines", "loops"), [(LADDER, 2), (TORUS, 1)], ids=["ladder", "torus"])
def test_handles_stay(piped, refine, assert_unchanged, lines, loops, side):
    raw = piped(lines, side=side)
    skeleton = refine(raw, handle=0.5)
    assert_unchanged(skeleton, raw)
    assert [(it.about, it.changed) for it in skeleton.report.decisions] == loops * [("loop", False)]
    assert min(it.probability for it in skeleton.report.decisions) > 0.9


def test_a_passage_is_seen_if_walls_face_it_and_no_surface_is_as_near_as_the_loop_is_wide(piped, passage):
    ring = piped(TORUS)
    assert passage(ring) > 2.7
    x, y = (each.ravel() for each in np.mgrid[-1:1:41j, -1:1:41j])
    near, far = (with_points(ring, np.column_stack([x, y, 0 * x + height]), Z) for height in (0.6, 1.5))
    assert passage(near) < 0.5  # a sheet across it
    assert passage(far) > 2.7
    # points around a hole in a sheet are seen from the edge, and half a ring has no walls on the other side
    assert passage(replace(ring, normals=np.tile(Z, (len(ring.points), 1)))) < 0.01
    half = ring.points[:, 0] > -0.2
    assert passage(replace(ring, vertex_of_point=np.where(half, ring.vertex_of_point, -1))) < 1.5
    # behind the wall may be another, which is not seen
    turn, z = (each.ravel() for each in np.mgrid[0 : 2 * np.pi : 200j, -0.1:0.1:8j])
    assert passage(with_points(ring, np.column_stack([1.5 * np.cos(turn), 1.5 * np.sin(turn), z]), Z)) > 2.7


def test_two_strands_in_one_part_have_no_passage(strands, passage):
    assert passage(strands(0.12, 1.5)) < 0.3


@pytest.mark.parametrize(
    ("along", "hole", "fall"), [(1, 0, 1), (1, 0.6, 0.4), (0.5, 0.2, 0.6), (0.1, 0.2, 0.5), (1, -1, 1)]
)
def test_a_passage_shrinks_with_the_fall_of_the_winding_number(piped, passage, monkeypatch, along, hole, fall):
    """From that along the loop to that in the hole; or from 0.4, if it is less along the loop."""

    def winding(surface, places):
        return np.where(np.hypot(*places[:, :2].T) < 0.8, hole, along)

    monkeypatch.setattr(Surface, "winding", winding)
    assert passage(piped(TORUS)) == pytest.approx(3 * fall, rel=0.1)


def test_the_wall_of_a_pot_does_not_hide_the_passage_through_its_handle(piped, passage):
    """The loop goes through the pot's middle, so that the wall crosses the largest circle in it."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    handle = np.column_stack([0.9 + 0.5 * np.cos(angle), 0.5 * np.sin(angle), 0 * angle])
    loop = [[(0, -0.5, 0), *handle.tolist(), (0, 0.5, 0)], [(0, 0.5, 0), (0, -0.5, 0)]]
    pot = piped(loop, around=[handle.tolist()])
    y, turn = (each.ravel() for each in np.mgrid[-1:1:60j, 0 : 2 * np.pi : 120j])
    out = np.column_stack([np.cos(turn), 0 * y, np.sin(turn)])
    wall, middle = 0.9 * out + np.outer(y, Y), np.flatnonzero(np.abs(pot.vertices[:, 0]) < 0.01)
    owner = middle[np.abs(y[:, None] - pot.vertices[middle, 1]).argmin(axis=1)]
    assert passage(with_points(pot, wall, out, owner)) > 1.5


@pytest.mark.parametrize("inside", [1, 0.35, 0.25, 0.1, -0.2])
def test_a_loop_is_as_probable_as_it_has_an_inside(piped, evidence, monkeypatch, inside):
    """A ring as thin as its points are apart has little, and a loop in empty space none, whatever else is for it."""
    ring, full = piped(TORUS), Surface.winding
    monkeypatch.setattr(Surface, "winding", lambda self, places: inside * full(self, places))
    (loop,) = Loops().candidates(evidence(ring), 0.5)
    assert loop.facts["opening"] == pytest.approx(np.log(6 + 0.5))  # six spacings are wide enough
    certainty = loop.probability / logistic(Loops.weights, loop.facts)
    assert certainty == pytest.approx(np.clip(2 * inside / 0.4 - 1, 0, 1), abs=0.05)


def wires(squares=1, twigs=0, scatter=0.0, sure=-np.inf):
    """Unit squares of wires in a row, and twigs from a corner: points on lines, with normals that say nothing.

    Vertices up to x = `sure` have a confidence of 1, the others of 0.
    """
    rng, share = np.random.default_rng(0), np.linspace(0, 1, 9)[:, None]
    sides = [(0 * X, X), (0 * X, Y), (X, Y), (Y, X)]
    lines = [(start + 2 * i * X, step) for i in range(squares) for start, step in sides]
    lines += [(0 * X, -X - i * Y) for i in range(twigs)]
    paths = np.concatenate([np.round(start + share * step, 6) + 0.0 for start, step in lines])
    vertices, number = np.unique(paths, axis=0, return_inverse=True)
    number = number.reshape(-1, 9)
    edges = np.sort(np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]))
    points = np.concatenate([start + rng.random((150, 1)) * step for start, step in lines])
    points += scatter * rng.normal(size=points.shape)
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    owner, m = cKDTree(vertices).query(points)[1], len(vertices)
    confidence = (vertices[:, 0] < sure).astype(float)
    return Skeleton(vertices, edges, np.full(m, 0.05), owner, points, normals, confidence=confidence)


@pytest.mark.parametrize(
    ("case", "bare"),
    [
        (dict(), 1),
        (dict(squares=3), 3),
        (dict(squares=3, sure=1.1), 2),  # one square has a surface
        (dict(squares=3, sure=3.1), 0),  # and here most have
        (dict(twigs=1), 0),  # a crown
        (dict(scatter=0.06), 0),  # points that fill space
    ],
    ids=repr,
)
def test_bonds_do_not_count_where_most_of_an_object_is_a_frame_of_wires(evidence, case, bare):
    loops = Loops().candidates(evidence(wires(**case)), 0.5)
    assert len(loops) == case.get("squares", 1)
    assert [loop.facts["bonds"] == np.log(1.1) for loop in loops].count(True) == bare


def test_sparse_bars_keep_their_loops():
    corner = np.array(list(np.ndindex(2, 2, 2)), float)
    bars = np.array([(i, j) for i in range(8) for j in range(i) if np.abs(corner[i] - corner[j]).sum() == 1])
    for seed in range(3):
        frame = union_sample("frame", corner, bars, np.full(8, 0.12), 1024, 0.0, seed)
        assert skeletonize(frame.points).n_loops == 5


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


@SIDES
@pytest.mark.parametrize("gap", [0.06, 0.16])
def test_two_strands_in_one_tube_become_a_path(strands, refine, gap, side):
    raw = strands(gap, 1.5, side=side)
    skeleton = refine(raw, handle=0.5)
    assert (raw.n_loops, counts(skeleton), len(skeleton.junctions)) == (1, (1, 0, 2), 0)
    assert np.abs(skeleton.vertices[:, 1]).max() < 0.4 * gap
    assert len(skeleton.vertices) > 0.8 * 2 / 0.05  # every vertex met the one across
    assert skeleton.edge_lengths.max() < 1.6 * 0.05 + gap
    assert skeleton.report.n_loops_closed == 1
    assert refine(raw).n_loops == 1


@pytest.mark.parametrize("turn", range(0, 12, 5))
@pytest.mark.parametrize("step", [1, -1])
def test_vertices_of_a_narrow_loop_meet_those_as_far_along_on_its_other_side(turn, step):
    above, below = [0, 0.2, 1.3, 2, 3, 4.9, 5], [1.4, 2.7, 2.9, 4.1]
    places = np.array([(x, 0.01 * (0 < x < 5), 0) for x in above] + [(x, -0.01, 0) for x in below[::-1]])
    order = np.roll(np.arange(11)[::step], turn)
    pairs = facing_pairs(places[order], 20 + order) - 20
    met = {tuple(sorted(places[pair, 0].tolist())) for pair in pairs}
    assert met == {(0, 0.2), (1.3, 1.4), (1.4, 2), (2.9, 3), (2.7, 3), (4.9, 5), (4.1, 4.9)}


def test_vertices_of_a_loop_without_length_meet_in_the_first():
    pairs = facing_pairs(np.ones((4, 3)), np.array([7, 3, 5, 9]))
    np.testing.assert_array_equal(pairs, [[7, 3], [7, 5], [7, 9]])


def test_a_wide_loop_is_cut_where_nothing_hangs_together(piped, refine):
    """A ring of which an eighth is in empty space, joined by hand; whatever is asked of a handle, it is none."""
    raw = piped([[(np.cos(t), np.sin(t), 0) for t in np.arange(4, 29) * np.pi / 16]])
    ends = np.sort(np.argsort(raw.vertices @ X)[-2:])
    closed = replace(raw, edges=np.unique([*raw.edges.tolist(), ends.tolist()], axis=0))
    skeleton = refine(closed, handle=1.0)
    assert (closed.n_loops, counts(skeleton)) == (1, (1, 0, 2))
    assert skeleton.report.n_loops_closed == 1
    np.testing.assert_allclose(skeleton.vertices[skeleton.leaves], raw.vertices[raw.leaves], atol=1e-12)


def raw_graph(points):
    return collapse_triangles((pipelines.rings() | Contractor() | Connector())(points))


def test_points_that_are_near_say_as_much_as_all(evidence, monkeypatch):
    """Of a net of tubes, which are not all of one length, and its false loops."""
    rng, side = np.random.default_rng(0), 4
    knots = np.array(list(np.ndindex(side, side, 1)), float)
    edges = np.array([(i, j) for i in range(16) for j in range(i) if np.abs(knots[i] - knots[j]).sum() == 1])
    nodes = knots + rng.uniform(-0.1, 0.1, (16, 3))
    raw = raw_graph(union_sample("net", nodes, edges, np.full(16, 0.12), 120 * len(edges), 0.0, 0).points)
    near = Loops().candidates(evidence(raw), 0.5)
    assert len(near) >= 9
    monkeypatch.setattr(Surface, "near", lambda self, place, reach: np.arange(len(self.points)))
    for loop, other in zip(near, Loops().candidates(evidence(raw), 0.5), strict=True):
        np.testing.assert_allclose([*loop.facts.values()], [*other.facts.values()], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(loop.part[0], other.part[0])


@pytest.mark.parametrize("seed", range(3))
def test_every_closed_loop_is_counted_once(evidence, seed):
    """Near the surface of a gyroid, many false loops share vertices: of these one can be cut at a time."""
    x = 4 * np.pi * np.random.default_rng(seed).random((60000, 3))
    value = (np.sin(x) * np.cos(np.roll(x, -1, axis=1))).sum(axis=1)
    raw = raw_graph(x[np.argsort(np.abs(value - 0.5))[:4000]])
    closed, decisions = ask(Loops(), Curve.of(raw), evidence(raw).surface, 0.5)
    changed = [each for each in decisions if each.changed]
    assert len(decisions) - len(changed) == closed.n_loops
    assert 0 < len(changed) == len(set(changed)) <= raw.n_loops - closed.n_loops
    assert all((each.probability < 0.5) == each.changed for each in decisions)
