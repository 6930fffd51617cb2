"""Gaps are bridged where the object goes on, and not where it ends."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Refiner, Report, Skeleton
from glsk_o3d.refinement.bridging import BRIDGE_REACH, bridge_gaps, gap_facts
from glsk_o3d.refinement.evidence import Evidence

X, Y, Z = np.eye(3)
ARC = [[(np.cos(t), np.sin(t), 0) for t in np.linspace(0.15, 2 * np.pi - 0.15, 30)]]
LIMB = [[(-1, 0, 0), (-0.15, 0, 0)], [(0.15, 0, 0), (1, 0, 0)]]
"""A tube of which a stretch of three radii was not seen."""
TIP = [[(0.3, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 0, 0), (0, 1, 0)]]
"""A limb that ends a radius and more away from the side of a tube."""


def bridged(skeleton, least=0.5):
    return bridge_gaps(skeleton, Evidence.of(skeleton), least)


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


def new_edges(raw, skeleton):
    return sorted(set(map(tuple, skeleton.edges.tolist())) - set(map(tuple, raw.edges.tolist())))


@pytest.mark.parametrize("side", [None, Z], ids=["whole", "one side"])
def test_an_open_ring_is_closed(piped, side):
    raw = piped(ARC, side=side)
    skeleton, judgements = bridged(raw)
    assert (raw.n_loops, skeleton.n_loops, len(skeleton.leaves)) == (0, 1, 0)
    ((about, changed),) = [(it.about, it.changed) for it in judgements]
    assert (about, changed) == ("gap", True)
    np.testing.assert_allclose(judgements[0].place, [1, 0, 0], atol=0.05)
    assert new_edges(raw, skeleton) == [tuple(sorted(raw.leaves.tolist()))]


@pytest.mark.parametrize("side", [None, Z], ids=["whole", "one side"])
def test_a_limb_with_an_unseen_stretch_is_joined(piped, side):
    raw = piped(LIMB, side=side)
    skeleton, judgements = bridged(raw)
    assert (raw.n_components, skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (2, 1, 0, 2)
    assert [it.changed for it in judgements] == [True]
    np.testing.assert_allclose(judgements[0].place, 0, atol=1e-9)
    for name in ("vertices", "radii", "vertex_of_point"):
        np.testing.assert_array_equal(getattr(skeleton, name), getattr(raw, name))


def test_two_capsules_end_to_end_stay_two(piped):
    raw = capped(piped(LIMB), (-0.15 * X, X), (0.15 * X, -X))
    skeleton, judgements = bridged(raw)
    assert skeleton is raw
    assert len(judgements) == 1
    assert judgements[0].probability < 0.25
    assert not judgements[0].changed


def test_a_tip_that_points_at_the_side_of_a_tube_stays(piped):
    raw = capped(piped(TIP), (0.3 * X, -X))
    skeleton, judgements = bridged(raw)
    assert skeleton is raw
    assert all(it.probability < 0.5 for it in judgements)


@pytest.mark.parametrize(("share", "asked"), [(0.99, 1), (1.2, 0)])
def test_gaps_are_at_most_so_many_radii_long(piped, share, asked):
    half = share * BRIDGE_REACH * 0.1 / 2
    raw = piped([[(-2, 0, 0), (-half, 0, 0)], [(half, 0, 0), (2, 0, 0)]])
    assert len(bridged(raw)[1]) == asked


@pytest.mark.parametrize(
    "other",
    [
        [(0.1, 0.2, 0), (0.1, 1, 0)],  # at a right angle to the end, and beside it
        [(-1, 0.3, 0), (0, 0.3, 0)],  # side by side
    ],
)
def test_an_end_asks_what_it_points_at_alone(piped, other):
    raw = piped([[(-1, 0, 0), (0, 0, 0)], other])
    end = int(np.argmin(np.linalg.norm(raw.vertices, axis=1)))
    assert not any(pair[0] == end for pair, _ in gap_facts(raw, Evidence.of(raw)))


def test_what_is_near_along_the_skeleton_is_not_asked(piped):
    """A hook whose end points back at its own shank."""
    raw = piped([[(-1, 0, 0), (0.1, 0, 0), (0.1, 0.25, 0), (0, 0.25, 0), (0, 0.15, 0)]])
    assert bridged(raw)[1] == []


def test_every_end_is_joined_once(piped):
    """Three ends meet: the two in line are surer."""
    raw = piped([*LIMB, [(0, 0.3, 0), (0, 1, 0)]])
    skeleton, _ = bridged(raw, least=0.01)
    assert skeleton.degree.max() <= 3
    inner = [v for v in raw.leaves.tolist() if np.linalg.norm(raw.vertices[v]) < 0.2]
    assert tuple(sorted(inner)) in new_edges(raw, skeleton)


def test_the_facts_of_a_gap(piped):
    def facts(raw):
        evidence = Evidence.of(raw)
        return max((each for _, each in gap_facts(raw, evidence)), key=lambda each: each["straightness"])

    seen = facts(piped(LIMB))
    ends = facts(capped(piped(LIMB), (-0.15 * X, X), (0.15 * X, -X)))
    assert seen["straightness"] == pytest.approx(1)
    assert seen["cap"] < np.log(0.4)
    assert ends["cap"] == pytest.approx(np.log(1.1), abs=0.3)


def test_where_there_is_nothing_to_ask():
    nothing = np.empty((0, 3))
    evidence = Evidence(np.empty(0, int), nothing, np.empty((0, 1), int), nothing, np.empty(0))
    path = Skeleton(np.eye(3), [(0, 1), (1, 2)], np.full(3, 0.1), [], [], [])
    ring = Skeleton(np.eye(3), [(0, 1), (0, 2), (1, 2)], np.full(3, 0.1), [], [], [])
    specks = Skeleton(np.eye(3), [], np.full(3, 0.1), [], [], [])
    for raw in (path, ring, specks, Skeleton([], [], [], [], [], [])):
        assert bridge_gaps(raw, evidence, 0.5) == (raw, [])


def test_no_thickness_no_bridge(piped):
    raw = replace(piped(LIMB), radii=np.zeros(len(piped(LIMB).radii)))
    assert bridged(raw) == (raw, [])


@settings(max_examples=10)
@given(st.integers(0, 10**6))
def test_numbers_do_not_matter(piped, renumbered, seed):
    raw = piped(LIMB)
    name = np.random.default_rng(seed).permutation(len(raw.vertices))
    renamed = renumbered(raw, name)
    skeleton, again = bridged(raw)[0], bridged(renamed)[0]
    named = {tuple(sorted(name[list(edge)].tolist())) for edge in new_edges(raw, skeleton)}
    assert set(new_edges(renamed, again)) == named


@pytest.mark.parametrize(("least", "bridges"), [(0.5, 1), (0, 0)])
def test_the_report_counts_the_bridges(piped, least, bridges):
    skeleton = Refiner(bridge=least)(piped(LIMB))
    assert skeleton.report.n_bridges == bridges
    assert skeleton.n_components == 2 - bridges
    np.testing.assert_allclose(skeleton.vertices[:, 1:], 0, atol=0.02)
    assert Report.from_dict(skeleton.report.to_dict()).n_bridges == bridges
