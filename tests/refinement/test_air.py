"""Edges that cross air are cut; limbs, struts and what only one side saw are kept."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d.refinement.air import branch_facts, cut_air
from glsk_o3d.refinement.evidence import Evidence
from glsk_o3d.refinement.spurs import prune_spurs
from glsk_o3d.samples import torus

X, Y, Z = np.eye(3)
RAILS = [[(-1, 0, 0), (0, 0, 0), (1, 0, 0)], [(-1, 0.5, 0), (0, 0.5, 0), (1, 0.5, 0)]]
ACROSS = [*RAILS, [(0, 0, 0), (0, 0.5, 0)]]
"""Two parallel tubes, and an edge from one to the other."""
FORK = [[(0, 0, 0), (0, 0, -1)], [(0, 0, 0), (0.7, 0, 0.7)], [(0, 0, 0), (-0.7, 0, 0.7)]]


def cut(skeleton, least=0.5, noise=0.0):
    return cut_air(skeleton, Evidence.of(skeleton), noise, least)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_an_edge_between_two_tubes_is_cut(piped, noise):
    raw = piped(ACROSS, tubes=[0, 1])
    skeleton, judgements = cut(raw, noise=noise)
    assert (raw.n_components, skeleton.n_components, skeleton.n_loops) == (1, 2, 0)
    (false,) = (it for it in judgements if it.changed)
    assert (false.about, len(judgements)) == ("air", 5)
    assert false.probability > 0.5
    np.testing.assert_allclose(false.place, [0, 0.25, 0], atol=0.16)
    # what stays lies in the tubes, but for stubs, and has all points
    skeleton, _ = prune_spurs(skeleton, Evidence.of(skeleton), 0.5)
    off_axis = np.minimum(np.abs(skeleton.vertices[:, 1]), np.abs(skeleton.vertices[:, 1] - 0.5))
    assert off_axis.max() < 0.16
    assert skeleton.vertex_of_point.min() >= 0
    assert skeleton.vertex_of_point.max() < len(skeleton.vertices)


def test_a_strut_is_kept(piped):
    raw = piped(ACROSS)
    skeleton, judgements = cut(raw)
    assert skeleton is raw
    assert max(it.probability for it in judgements) < 0.25


@pytest.mark.parametrize(
    "lines", [FORK, [[(-1, 0, 0), (1, 0, 0)]], [[(np.cos(t), np.sin(t), 0) for t in np.arange(25) * np.pi / 12]]],
    ids=["fork", "tube", "ring"],
)  # fmt: skip
@pytest.mark.parametrize("side", [None, Y + 0.3 * Z], ids=["whole", "one side"])
def test_limbs_are_kept(piped, lines, side):
    raw = piped(lines, side=side)
    skeleton, judgements = cut(raw)
    assert skeleton is raw
    assert len(judgements) == len(raw.branches)
    assert not any(it.changed for it in judgements)


def test_a_probability_of_more_than_one_cuts_nothing(piped):
    raw = piped(ACROSS, tubes=[0, 1])
    skeleton, judgements = cut(raw, least=1.01)
    assert skeleton is raw
    assert max(it.probability for it in judgements) > 0.5


def test_goes_with_the_cloud(piped, placed):
    raw = piped(ACROSS, tubes=[0, 1], step=0.04)  # no vertex right at a limit of distance
    moved, _ = placed(raw, 4, 7, 5)
    (here, said), (there, again) = cut(raw), cut(moved)
    np.testing.assert_array_equal(here.edges, there.edges)
    np.testing.assert_allclose([it.probability for it in again], [it.probability for it in said], rtol=1e-3)


def test_the_facts_of_a_false_edge(piped):
    raw = piped(ACROSS, tubes=[0, 1])
    found = {}
    for branch, place, facts in branch_facts(raw, Evidence.of(raw), 0.25):
        ends = raw.vertices[branch[[0, -1]]]
        across = abs(ends[1, 1] - ends[0, 1]) > 0.4
        found[across] = facts
        assert 0 <= place < len(branch) - 1
        assert facts["noise"] == 0.25
    assert found[True]["deficit"] > found[False]["deficit"] + 1
    assert found[True]["surface"] == pytest.approx(np.log(0.05), abs=0.5)
    assert found[True]["bonds"] == pytest.approx(np.log(0.05), abs=0.5)
    assert found[True]["straightness"] == pytest.approx(0.15 / np.hypot(0.15, 0.05))  # turns after 2.5 of 3 radii
    assert (found[True]["inner"], found[False]["inner"]) == (1, 0)
    assert found[True]["length"] == pytest.approx(np.log(5.1), abs=1e-6)
    assert found[False]["straightness"] == pytest.approx(1, abs=1e-6)


def test_a_surface_along_a_line_without_thickness(piped):
    """Its area over that of a tube is no number then; nothing overflows."""
    raw = piped(ACROSS, tubes=[0, 1])
    thin = replace(raw, vertices=1e6 * raw.vertices, points=1e6 * raw.points, radii=np.zeros(len(raw.radii)))
    for _, _, facts in branch_facts(thin, Evidence.of(thin), 0.25):
        assert np.isfinite(list(facts.values())).all()


@pytest.mark.parametrize("turn", [0, 7, 13])
def test_a_ring_has_no_seam(around, renumbered, turn):
    """Its weakest place is where its points are fewest, and bonds cross all of it, whichever vertex is the first."""
    cloud = torus(4000)
    angle = np.arctan2(*cloud.points[:, 1::-1].T)
    thinned = (np.abs(angle - 1) > 0.2) | (np.arange(4000) % 8 == 0)
    points = cloud.points[thinned]
    axis = 0.4 * points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    way = 2 * np.pi * (np.arange(20) + turn) / 20
    vertices = 0.4 * np.column_stack([np.cos(way), np.sin(way), 0 * way])
    raw = around(vertices, [tuple(sorted((i, (i + 1) % 20))) for i in range(20)], points, (points - axis) / 0.1)
    raw = replace(raw, edges=np.unique(raw.edges, axis=0))
    ((branch, place, facts),) = branch_facts(raw, Evidence.of(raw), 0.0)
    middle = raw.vertices[branch[place : place + 2]].mean(axis=0)
    np.testing.assert_allclose(np.arctan2(middle[1], middle[0]), 1, atol=0.3)
    assert facts["bonds"] > -1
    again = renumbered(raw, np.roll(np.arange(20), -5))
    ((_, _, other),) = branch_facts(again, Evidence.of(again), 0.0)
    assert other == pytest.approx(facts, abs=1e-3)
