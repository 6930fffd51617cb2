"""Every score on graphs made by hand, what must not matter, what is refused; and the yardstick, where it is there."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest
from glsk_bench.scoring import MOST_ANSWER_JUNCTIONS, MOST_ANSWER_PLACES, score

from glsk_o3d.errors import InvalidParameterError

BEST = dict(
    **dict(perfect=True, topology=True, tips_f1=1, junctions_f1=1, inside=1, completeness=1),
    **dict(components=0, loops=0, leaves=0, junctions=0, failure=None),
)


def path(*places, radius=0.1):
    """An axis: a path through places."""
    n = len(places)
    edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    return SimpleNamespace(nodes=np.array(places, float), edges=edges, radii=np.full(n, radius))


@pytest.fixture
def rod():
    """A straight axis from 0 to 1 along x, radius 0.1."""
    return path((0, 0, 0), (1, 0, 0))


@pytest.fixture
def star():
    """Four arms of length 1 around a junction, radius 0.1."""
    arms = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]
    edges = np.array([[0, 1], [0, 2], [0, 3], [0, 4]])
    return SimpleNamespace(nodes=np.array(arms, float), edges=edges, radii=np.full(5, 0.1))


@pytest.fixture
def square():
    """A closed path of four sides of length 1, radius 0.1."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    return SimpleNamespace(nodes=nodes, edges=np.array([[0, 1], [1, 2], [2, 3], [0, 3]]), radii=np.full(4, 0.1))


def numbers(scores, *names):
    told = scores.as_dict()
    return [told[name] for name in names]


# --------------------------------------------------------------------------------------------------- by hand


@pytest.mark.parametrize("shape", ["rod", "star", "square"])
def test_the_axis_is_perfect(request, shape):
    axis = request.getfixturevalue(shape)
    told = score(axis, axis.nodes, axis.edges).as_dict()
    assert told.pop("error") == pytest.approx(0, abs=1e-12)
    assert told.pop("length") == pytest.approx(1)
    assert told.pop("ends") == (None if shape == "square" else 0)
    assert told == BEST


def test_error_inside_and_completeness_beside_the_axis(rod):
    near = score(rod, rod.nodes + [0, 0.05, 0], rod.edges)
    assert numbers(near, "error", "inside", "completeness", "ends") == pytest.approx([0.5, 1, 1, 0.5])
    far = score(rod, rod.nodes + [0, 0.15, 0], rod.edges)
    assert numbers(far, "error", "inside", "completeness", "ends") == pytest.approx([1.5, 0, 0, 1.5])
    assert far.tips_f1 == 1
    assert score(rod, rod.nodes + [0, 0.26, 0], rod.edges).tips_f1 == 0


def test_half_of_the_axis(rod):
    half = score(rod, [[0, 0, 0], [0.5, 0, 0]], [[0, 1]])
    assert numbers(half, "error", "inside", "length") == pytest.approx([0, 1, 0.5], abs=1e-12)
    assert half.completeness == pytest.approx(0.6, abs=0.011)  # and a radius more
    assert half.ends == pytest.approx((0 + 5) / 2)
    assert numbers(half, "tips_f1", "topology", "perfect") == [0.5, True, False]


def test_a_leg_that_is_missing(star):
    found = score(star, star.nodes[:4], star.edges[:3])
    assert numbers(found, "topology", "perfect", "leaves", "junctions") == [True, False, -1, 0]
    assert found.tips_f1 == pytest.approx(2 * 3 / (3 + 4))
    assert numbers(found, "junctions_f1", "length") == pytest.approx([1, 0.75])


def test_a_break_a_loop_and_a_piece_beside(rod, square):
    broken = score(rod, [[0, 0, 0], [0.4, 0, 0], [0.6, 0, 0], [1, 0, 0]], [[0, 1], [2, 3]])
    assert numbers(broken, "components", "loops", "topology", "perfect") == [1, 0, False, False]
    opened = score(square, square.nodes, square.edges[:3])
    assert numbers(opened, "components", "loops", "leaves", "topology") == [0, -1, 2, False]
    beside = score(square, [*square.nodes, [5, 5, 5]], square.edges)
    assert numbers(beside, "components", "loops", "topology") == [1, 0, False]
    even = score(square, [*square.nodes, *(square.nodes + 5)], [*square.edges, *(square.edges[:3] + 4)])
    assert numbers(even, "components", "loops", "topology") == [1, 0, False]  # one wrong is enough


def test_a_junction_drawn_as_two_nearby_is_one(star):
    nodes = np.array([[0.03, 0, 0], *star.nodes[1:], [-0.03, 0, 0]])
    found = score(star, nodes, [[0, 1], [0, 3], [0, 5], [5, 2], [5, 4]])
    assert numbers(found, "junctions", "junctions_f1", "perfect") == [1, 1, True]
    apart = score(star, nodes * [[8.5], [1], [1], [1], [1], [8.5]], [[0, 1], [0, 3], [0, 5], [5, 2], [5, 4]])
    assert apart.junctions_f1 == 0


# ---------------------------------------------------------------------------------------------- what does not matter


def known(scores):
    return {name: value for name, value in scores.as_dict().items() if value is not None}


def crooked(axis, seed=0):
    """An answer with faults of every kind."""
    rng = np.random.default_rng(seed)
    n = len(axis.nodes)
    nodes = axis.nodes + 0.5 * axis.radii[:, None] * rng.normal(size=(n, 3))
    spur = nodes[0] + [0.3, 0.2, 0.5]
    return np.array([*nodes, spur]), np.array([*axis.edges[:-1], [0, n]])


def test_order_direction_and_cuts_do_not_matter(star):
    vertices, edges = crooked(star)
    expected = known(score(star, vertices, edges))
    order = np.random.default_rng(1).permutation(len(vertices))
    shuffled = score(star, vertices[order], np.argsort(order)[edges][::-1, ::-1])
    assert known(shuffled) == pytest.approx(expected, rel=1e-12)
    middle = vertices[edges[0]].mean(0)  # a vertex within an edge
    cut = score(star, [*vertices, middle], [*edges[1:], [edges[0, 0], len(vertices)], [len(vertices), edges[0, 1]]])
    same = ("perfect", "topology", "tips_f1", "junctions_f1", "length", "leaves", "loops", "components", "ends")
    assert numbers(cut, *same) == pytest.approx([expected[name] for name in same])
    assert cut.error == pytest.approx(expected["error"], rel=0.05)


def test_units_and_turns_do_not_matter(star):
    star.radii *= 0.97  # sides are no whole number of steps: a rounding would make one more
    vertices, edges = crooked(star)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    moved = SimpleNamespace(nodes=1000 * star.nodes @ turn + 7, edges=star.edges, radii=1000 * star.radii)
    found = score(moved, 1000 * vertices @ turn + 7, edges)
    assert known(found) == pytest.approx(known(score(star, vertices, edges)), rel=1e-9)


# ------------------------------------------------------------------------------------------------------- no answers


@pytest.mark.parametrize(
    ("vertices", "edges", "said"),
    [
        ([], [], "empty"),
        ([[0, 0, np.nan], [1, 0, 0]], [[0, 1]], "not finite"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 2]], "not there"),
        ([[0, 0, 0], [1, 0, 0]], [[0.0, 1.0]], "whole numbers"),
        ([[0, 0], [1, 0]], [[0, 1]], "of no use"),
        ([[0, 0, 0], [1e9, 0, 0]], [[0, 1]], "units"),
        (np.zeros((MOST_ANSWER_PLACES + 1, 3)), [], "too much for an answer"),
        (np.zeros((2, 3)), np.tile([0, 1], (MOST_ANSWER_PLACES, 1)), "too much for an answer"),
    ],
)
def test_what_is_no_skeleton_is_refused(rod, vertices, edges, said):
    with pytest.raises(InvalidParameterError, match=said):
        score(rod, vertices, edges)


def test_a_mesh_is_no_skeleton(rod):
    n = MOST_ANSWER_JUNCTIONS + 10
    ring = np.arange(n)
    edges = np.vstack([np.column_stack([ring, (ring + step) % n]) for step in (1, 2)])
    places = np.column_stack([np.cos(ring), np.sin(ring), ring]) * 0.001
    with pytest.raises(InvalidParameterError, match="is it a mesh"):
        score(rod, places, edges)


# -------------------------------------------------------------------------------------------------- the yardstick


def axes(shared_dir):
    for path in sorted((shared_dir / "truth").glob("*.npz")):
        with np.load(path) as file:
            yield SimpleNamespace(**{name: file[name] for name in ("nodes", "edges", "radii")}), path.stem


def test_agrees_with_the_yardstick(shared_dir):
    spec = importlib.util.spec_from_file_location("yardstick", shared_dir / "score.py")
    spec.loader.exec_module(yardstick := importlib.util.module_from_spec(spec))
    compared = 0
    for axis, name in axes(shared_dir):
        for answer in ((axis.nodes, axis.edges), crooked(axis, seed=len(name)), (axis.nodes[:1], axis.edges[:0])):
            if len(axis.edges) == 0:
                continue
            given = dict(nodes=axis.nodes, edges=axis.edges, radii=axis.radii)
            expected, told = yardstick.score(given, *answer), score(axis, *answer).as_dict()
            assert expected.keys() - told.keys() == set()
            for measure, value in told.items():
                if measure != "failure" and value is not None:
                    assert value == pytest.approx(expected[measure], rel=1e-12, abs=1e-12), (name, measure)
            compared += 1
    assert compared > 30
