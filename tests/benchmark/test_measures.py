"""The measures of things, on curves whose values are known by hand."""

from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest
from glsk_bench import score
from glsk_bench.measures import last_turns
from glsk_bench.scoring import OF_THINGS
from glsk_bench.truths import ThingTruth

from glsk_o3d import Skeleton
from glsk_o3d.analysis import Truth
from glsk_o3d.errors import InvalidParameterError

PLANE = ((0, 0, 0), (0, 1, 0))


def thing(nodes, edges, radius=1.0, flat=(), judged=None, mirror=(), wide=1.0):
    judged = np.ones(len(edges), bool) if judged is None else judged
    radii = np.full(len(nodes), radius)
    return ThingTruth(nodes, edges, radii, wide * radii, flat, judged, mirror)


def path(*places):
    """Vertices and edges of a polyline in a plane."""
    nodes = np.array([(*place, 0.0) for place in places])
    return nodes, np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])


def turned(angle):
    """The bar's curve, its last radius turned aside by degrees."""
    return path((0, 0), (9, 0), (9 + np.cos(np.radians(angle)), np.sin(np.radians(angle))))


def fork(down):
    """A fork whose junction is so far below its place."""
    nodes = np.array([[0, -down, 0], [10, 0, 0], [-10, 0, 0], [0, 10, 0]], float)
    return nodes, np.array([[0, 1], [0, 2], [0, 3]])


BAR = path((0, 0), (10, 0))
"""A bar of radius 1 from the middle of one round end to that of the other."""
BENT, SHORT = path((0, 0), (9, 0), (9, 1)), path((0, 0), (2.4, 0), (2.4, 1))
STUB = np.array([*BAR[0], [5, 0, 0], [5, 1, 0], [6, 1, 0]]), np.array([[0, 2], [2, 1], [2, 3], [3, 4]])
ZIGZAG = path(*((x, 0.25 * (x % 1 > 0.4)) for x in np.arange(0, 10.1, 0.5)))  # half a unit along, a quarter aside
FLAT, BESIDE = dict(flat=[1]), path((0, 0), (5, 1.5), (10, 1.5))


@pytest.mark.parametrize(
    ("axis", "facts", "found", "measure", "value"),
    [
        *((BAR, {}, turned(angle), "hooks", hooks) for angle, hooks in ((90, 0.5), (31, 0.5), (29, 0), (0, 0))),
        (BENT, {}, BENT, "hooks", 0),  # what the true end turns is owed
        (path((0, 0), (9, 0), (9.8, 0.6)), {}, BENT, "hooks", 0.5),  # by 53 degrees more
        (BAR, {}, path((0, 0), (6, 0), (6, 4)), "hooks", 0),  # a bend behind the last radius is none
        (BAR, {}, SHORT, "hooks", None),
        (BAR, {}, STUB, "hooks", 0),  # of two ends: that of the stub is left out
        *((BAR, FLAT, path((0, 0), (10 + by, 0)), "reach", abs(by)) for by in (-0.5, 0, 0.5, 1.5)),
        *((BAR, FLAT, path((0, 0), (10 + by, 0)), "overshoot", by) for by in (-0.5, 0, 0.5, 1.5)),
        (BAR, FLAT, path((0, 0), (5, 0)), "reach", 4),  # where nothing comes near
        *((BAR, dict(wide=wide, **FLAT), BESIDE, "reach", reach) for wide, reach in ((1, 4), (2, 0))),
        (BAR, {}, BAR, "reach", None),  # round ends
        (BAR, {}, ZIGZAG, "wiggle", np.hypot(0.5, 0.25) / 0.5 - 1),
        *(
            (BAR, dict(mirror=PLANE, radius=r), path((0, y), (10, y)), "mirror", 2 * y / r)
            for y, r in ((0, 1), (0.3, 0.5))
        ),
        *((fork(0), dict(radius=r), fork(by), "junction_offset", by / r) for by, r in ((0, 1), (0.4, 1), (0.8, 0.5))),
        (fork(0), {}, fork(2.1), "junction_offset", None),  # without pairs
    ],
)
def test_measures(axis, facts, found, measure, value):
    told = getattr(score(thing(*axis, **facts), *found), measure)
    assert told == (value if value is None else pytest.approx(value))


@pytest.mark.parametrize("angle", [0, 29, 90])
def test_last_turns(angle):
    skeleton = Skeleton(*turned(angle), (), (), (), ())
    np.testing.assert_allclose(last_turns(skeleton, skeleton.leaves, np.ones(2)), [0, angle], atol=1e-5)


def test_what_does_not_wiggle():
    away = path((0, 0), (10, 0), (10, 30))  # leaves the object
    assert score(thing(*BAR), *away).wiggle == pytest.approx(0.1, abs=0.02)  # a radius of a tenth of the length
    nodes = np.array([*fork(0.5)[0], [2, 0, 0], [-2, 0, 0], [0, 2, 0]])  # all detours are at a junction
    edges = np.array([[0, 4], [4, 1], [0, 5], [5, 2], [0, 6], [6, 3]])
    assert score(thing(*fork(0)), nodes, edges).wiggle == pytest.approx(0, abs=0.02)


class TestJudged:
    """A handle, 0 - 1, on a body, 1 - 2, whose axis is a matter of taste."""

    HANDLE = path((0, 0), (10, 0), (20, 0))
    BODY = np.array([True, False])

    def test_what_is_not_judged_may_be_anything(self):
        other = path((0, 0), (10, 0), (20, 8), (30, 0))
        found = score(thing(*self.HANDLE, judged=self.BODY), *other)
        assert (found.perfect, found.tips_f1, found.leaves, found.ends) == (True, 1, 0, 0)
        assert (found.inside, found.completeness) == (1, 1)
        assert found.error == pytest.approx(0, abs=1e-12)
        assert found.length is found.junctions is found.junctions_f1 is found.junction_offset is None
        whole = score(thing(*self.HANDLE), *other)
        assert not whole.perfect
        assert whole.error > 1

    def test_what_is_judged_counts(self):
        found = score(thing(*self.HANDLE, judged=self.BODY), *path((0, 0.5), (10, 0.5), (20, 0)))
        assert found.error == pytest.approx(0.5, abs=0.01)
        found = score(thing(*self.HANDLE, judged=self.BODY), *path((5, 0), (20, 0)))
        assert found.completeness == pytest.approx(0.6, abs=0.01)  # half of it, and a radius
        assert (found.tips_f1, found.perfect) == (0, False)
        assert score(thing(*self.HANDLE, judged=~self.BODY), *path((5, 0), (20, 0))).perfect

    def test_topology_is_that_of_all(self):
        apart = np.array([[0, 0, 0], [10, 0, 0], [12, 0, 0], [20, 0, 0]], float), np.array([[0, 1], [2, 3]])
        found = score(thing(*self.HANDLE, judged=self.BODY), *apart)
        assert (found.components, found.topology, found.perfect) == (1, False, False)

    def test_something_must_be(self):
        with pytest.raises(InvalidParameterError, match="no edge of the truth is judged"):
            score(thing(*BAR, judged=[False]), *BAR)


def test_what_has_the_arrays_is_a_thing_and_all_else_has_none_of_this():
    told, found = thing(*BAR, flat=[1], mirror=PLANE), path((0, 0), (9.5, 0))
    alike = SimpleNamespace(**{name: getattr(told, name) for name in told.__dataclass_fields__})
    assert score(alike, *found) == score(told, *found)
    plain = asdict(score(Truth(told.nodes, told.edges, told.radii), *found))
    assert asdict(score(told, *found)) | dict.fromkeys(OF_THINGS) == plain
