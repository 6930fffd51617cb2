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


def thing(nodes, edges, radius=1.0, flat=(), judged=None, mirror=(), half_width=None):
    judged = np.ones(len(edges), bool) if judged is None else judged
    radii = np.full(len(nodes), radius)
    return ThingTruth(nodes, edges, radii, radii if half_width is None else half_width, flat, judged, mirror)


def path(*places):
    """Vertices and edges of a polyline in a plane."""
    nodes = np.array([(*place, 0.0) for place in places])
    return nodes, np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])


BAR = path((0, 0), (10, 0))
"""A bar of radius 1 from the middle of one round end to that of the other."""
FORK = np.array([[0, 0, 0], [10, 0, 0], [-10, 0, 0], [0, 10, 0]], float), np.array([[0, 1], [0, 2], [0, 3]])


class TestHooks:
    @pytest.mark.parametrize(("angle", "hooks"), [(90, 0.5), (31, 0.5), (29, 0), (0, 0)])
    def test_the_last_radius_turns(self, angle, hooks):
        turn = np.radians(angle)
        found = path((0, 0), (9, 0), (9 + np.cos(turn), np.sin(turn)))
        assert score(thing(*BAR), *found).hooks == hooks
        skeleton = Skeleton(*found, (), (), (), ())
        np.testing.assert_allclose(last_turns(skeleton, skeleton.leaves, np.ones(2)), [0, angle], atol=1e-5)

    def test_what_the_true_end_turns_is_owed(self):
        bent = path((0, 0), (9, 0), (9, 1))
        assert score(thing(*bent), *bent).hooks == 0
        assert score(thing(*path((0, 0), (9, 0), (9.8, 0.6))), *path((0, 0), (9, 0), (9, 1))).hooks == 0.5  # 53 degrees

    def test_a_bend_behind_the_last_radius_is_none(self):
        assert score(thing(*BAR), *path((0, 0), (6, 0), (6, 4))).hooks == 0

    def test_short_branches_do_not_count(self):
        assert score(thing(*BAR), *path((0, 0), (2.4, 0), (2.4, 1))).hooks is None
        stub = np.array([*BAR[0], [5, 0, 0], [5, 1, 0], [6, 1, 0]]), np.array([[0, 2], [2, 1], [2, 3], [3, 4]])
        assert score(thing(*BAR), *stub).hooks == 0  # of two ends: that of the stub is left out


class TestReach:
    @pytest.mark.parametrize("by", [-0.5, 0, 0.5, 1.5])
    def test_how_far_the_end_is_from_where_it_should_be(self, by):
        found = score(thing(*BAR, flat=[1]), *path((0, 0), (10 + by, 0)))
        assert (found.reach, found.overshoot) == (pytest.approx(abs(by)), pytest.approx(by))

    def test_four_radii_where_nothing_comes_near(self):
        found = score(thing(*BAR, flat=[1]), *path((0, 0), (5, 0)))
        assert (found.reach, found.overshoot) == (4, -4)

    @pytest.mark.parametrize(("width", "reach"), [(1, 4), (2, 0)])
    def test_what_is_beside_counts_in_wide_sections(self, width, reach):
        found = score(thing(*BAR, flat=[1], half_width=np.full(2, width)), *path((0, 0), (5, 1.5), (10, 1.5)))
        assert found.reach == pytest.approx(reach)

    def test_round_ends_and_nodes_between_have_none(self):
        axis = path((0, 0), (5, 0), (10, 0))
        for flat in ([], [1]):
            found = score(thing(*axis, flat=flat), *axis)
            assert found.reach is found.overshoot is None


class TestWiggle:
    def test_a_zigzag_is_longer(self):
        zigzag = path(
            *((x, 0.25 * (x % 1 > 0.4)) for x in np.arange(0, 10.1, 0.5))
        )  # half a unit along, a quarter aside
        assert score(thing(*BAR), *zigzag).wiggle == pytest.approx(np.hypot(0.5, 0.25) / 0.5 - 1)

    def test_what_leaves_the_object_does_not_count(self):
        away = path((0, 0), (10, 0), (10, 30))
        assert score(thing(*BAR), *away).wiggle == pytest.approx(0.1, abs=0.02)  # a radius of a tenth of the length

    def test_junctions_do_not_count(self):
        nodes = FORK[0].copy()
        nodes[0] = [0.5, -0.5, 0]  # all detours are here, and none a radius and a half away
        around = np.array([*nodes, [2, 0, 0], [-2, 0, 0], [0, 2, 0]])
        edges = np.array([[0, 4], [4, 1], [0, 5], [5, 2], [0, 6], [6, 3]])
        assert score(thing(*FORK), around, edges).wiggle == pytest.approx(0, abs=0.02)


class TestMirror:
    PLANE = ((0, 0, 0), (0, 1, 0))

    @pytest.mark.parametrize(("aside", "radius"), [(0, 1), (0.3, 1), (0.3, 0.5)])
    def test_the_image_is_twice_as_far(self, aside, radius):
        found = score(thing(*BAR, radius, mirror=self.PLANE), *path((0, aside), (10, aside)))
        assert found.mirror == pytest.approx(2 * aside / radius)


class TestJunctionOffset:
    @pytest.mark.parametrize(("by", "radius"), [(0, 1), (0.4, 1), (0.8, 0.5)])
    def test_a_junction_that_is_moved(self, by, radius):
        nodes = FORK[0].copy()
        nodes[0, 1] -= by
        assert score(thing(*FORK, radius), nodes, FORK[1]).junction_offset == pytest.approx(by / radius)

    def test_without_pairs_there_is_none(self):
        nodes = FORK[0].copy()
        nodes[0, 1] -= 2.1
        assert score(thing(*FORK), nodes, FORK[1]).junction_offset is None
        assert score(thing(*BAR), *BAR).junction_offset is None


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
    told = thing(*BAR, flat=[1], mirror=TestMirror.PLANE)
    alike = SimpleNamespace(**{name: getattr(told, name) for name in told.__dataclass_fields__})
    found = path((0, 0), (9.5, 0))
    assert score(alike, *found) == score(told, *found)
    plain = asdict(score(Truth(told.nodes, told.edges, told.radii), *found))
    assert {plain[name] for name in OF_THINGS} == {None}
    both = asdict(score(told, *found))
    assert {name: both[name] for name in plain if name not in OF_THINGS} == {
        name: value for name, value in plain.items() if name not in OF_THINGS
    }
