"""Edges that cross air are cut; limbs, struts and what only one side saw are kept."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d.refinement.air import branch_facts, cut_air
from glsk_o3d.refinement.evidence import Evidence

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
    # what stays lies in the tubes, and has all points
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


def test_goes_with_the_cloud(piped):
    raw = piped(ACROSS, tubes=[0, 1], step=0.04)  # no vertex right at a limit of distance
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    moved = replace(
        raw,
        vertices=7 * raw.vertices @ turn + 5,
        radii=7 * raw.radii,
        points=7 * raw.points @ turn + 5,
        normals=raw.normals @ turn,
    )
    (here, said), (there, again) = cut(raw), cut(moved)
    np.testing.assert_array_equal(here.edges, there.edges)
    np.testing.assert_allclose([it.probability for it in again], [it.probability for it in said], rtol=1e-3)


def test_the_facts_of_a_false_edge(piped):
    raw = piped(ACROSS, tubes=[0, 1])
    found = {}
    for branch, facts, place, stretch in branch_facts(raw, Evidence.of(raw), 0.25):
        ends = raw.vertices[branch[[0, -1]]]
        across = abs(ends[1, 1] - ends[0, 1]) > 0.4
        found[across] = facts
        assert 0 <= place < len(branch) - 1
        assert len(stretch) >= 1
        assert facts["noise"] == 0.25
    assert found[True]["deficit"] > found[False]["deficit"] + 1
    assert found[True]["surface"] == pytest.approx(np.log(0.05), abs=0.5)
    assert found[True]["bonds"] == pytest.approx(np.log(0.05), abs=0.5)
    assert found[True]["straightness"] < 0.9
    assert found[True]["inner"], not found[False]["inner"]
    assert found[True]["length"] == pytest.approx(np.log(5.1), abs=1e-6)
    assert found[False]["straightness"] == pytest.approx(1, abs=1e-6)
