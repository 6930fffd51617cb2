"""Many loops: what is asked of each, and of how many points."""

import numpy as np
import pytest

from glsk_o3d import Connector, Contractor, pipelines
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.merging import collapse_triangles
from glsk_o3d.curve.surface import Evidence, Surface
from glsk_o3d.curve.topology.loops import Loops, loop_facts
from glsk_o3d.curve.topology.question import ask
from glsk_o3d.geometry.cycles import minimum_cycle_basis
from glsk_o3d.samples.capsules import union_sample


def evidence_of(raw):
    curve = Curve.of(raw)
    return Evidence(curve, Surface.of(curve).oriented(curve))


def net(side, seed, per_bar=120):
    """The raw graph of a net of tubes, which are not all of one length, its evidence and its loops."""
    rng = np.random.default_rng(seed)
    x, y = np.divmod(np.arange(side * side), side)
    nodes = np.column_stack([x, y, np.zeros(side * side)]) + rng.uniform(-0.1, 0.1, (side * side, 3))
    edges = [(i, i + 1) for i in range(side * side) if y[i] < side - 1]
    edges = np.array(edges + [(i, i + side) for i in range(side * (side - 1))])
    cloud = union_sample("net", nodes, edges, np.full(len(nodes), 0.12), per_bar * len(edges), noise=0.0, seed=seed)
    raw = collapse_triangles((pipelines.rings() | Contractor() | Connector())(cloud.points))
    cycles = minimum_cycle_basis(len(raw.vertices), raw.edges, raw.edge_lengths)
    assert len(cycles) >= (side - 1) ** 2
    return raw, evidence_of(raw), cycles


@pytest.mark.parametrize("seed", range(3))
def test_points_that_are_near_say_as_much_as_all(seed, monkeypatch):
    raw, evidence, cycles = net(4, seed)
    facts = loop_facts(cycles, evidence)
    monkeypatch.setattr(Surface, "near", lambda self, place, reach: np.arange(len(self.points)))
    for loop, other in zip(facts, loop_facts(cycles, evidence_of(raw)), strict=True):
        np.testing.assert_allclose([*loop.facts.values()], [*other.facts.values()], rtol=0, atol=1e-12)
        assert loop.weakest == other.weakest


def test_a_loop_of_a_large_net_asks_no_more_points_than_one_of_a_small_one(monkeypatch):
    counts = []
    for side in (4, 8):
        raw, evidence, cycles = net(side, 0)
        asked, near = [], Surface.near
        monkeypatch.setattr(
            Surface, "near", lambda self, *given, asked=asked, near=near: asked.append(near(self, *given)) or asked[-1]
        )
        loop_facts(cycles, evidence)
        monkeypatch.undo()
        counts.append(np.median([len(rows) for rows in asked]))
        assert len(asked) == len(cycles)
    assert counts[1] < 1.5 * counts[0]


def test_a_place_is_asked_once_for_its_winding_number(monkeypatch):
    raw, evidence, cycles = net(4, 1)
    places, winding = [], Surface.winding
    monkeypatch.setattr(Surface, "winding", lambda self, q: places.extend(map(bytes, q)) or winding(self, q))
    facts = loop_facts(cycles, evidence)
    first = len(places)
    again = loop_facts(cycles[::-1], evidence)[::-1]
    on_loops = {bytes(place) for place in raw.vertices[np.concatenate(cycles)]}
    assert on_loops <= {*places[:first]}
    assert on_loops.isdisjoint(places[first:])
    assert [loop.inside for loop in facts] == [loop.inside for loop in again]


@pytest.mark.parametrize("seed", range(5))
def test_every_closed_loop_is_counted_once(seed):
    """Near the surface of a gyroid, many false loops share vertices: of these one can be cut at a time."""
    x = 4 * np.pi * np.random.default_rng(seed).random((60000, 3))
    value = (np.sin(x) * np.cos(np.roll(x, -1, axis=1))).sum(axis=1)
    cloud = x[np.argsort(np.abs(value - 0.5))[:4000]]
    raw = collapse_triangles((pipelines.rings() | Contractor() | Connector())(cloud))
    closed, decisions = ask(Loops(), Curve.of(raw), evidence_of(raw).surface, 0.5)
    changed = [each for each in decisions if each.changed]
    assert len(decisions) - len(changed) == closed.n_loops
    assert 0 < len(changed) == len(set(changed)) <= raw.n_loops - closed.n_loops
    assert all(each.probability < 0.5 for each in changed)
    assert all(each.probability >= 0.5 for each in decisions if not each.changed)
