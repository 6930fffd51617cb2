"""Scores are those of `compare`, which tests/analysis/test_comparison.py holds to closed forms; and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
from glsk_bench import score
from glsk_bench.scoring import MOST_ANSWER_JUNCTIONS, MOST_ANSWER_PLACES, OF_THINGS

from glsk_o3d import Skeleton
from glsk_o3d.analysis import Truth, compare
from glsk_o3d.errors import InvalidParameterError


@pytest.fixture
def star():
    """Four arms of length 1 around a junction, radius 0.1."""
    arms = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]
    edges = np.array([[0, 1], [0, 2], [0, 3], [0, 4]])
    return SimpleNamespace(nodes=np.array(arms, float), edges=edges, radii=np.full(5, 0.1))


def test_the_axis_is_perfect(star):
    told = score(star, star.nodes, star.edges).as_dict()
    assert told.pop("error") == pytest.approx(0, abs=1e-12)
    assert told.pop("length") == pytest.approx(1)
    counts = dict.fromkeys(("components", "loops", "leaves", "junctions"), 0)
    best = dict(perfect=True, topology=True, tips_f1=1, junctions_f1=1, inside=1, completeness=1, ends=0)
    assert told == best | counts | dict.fromkeys(OF_THINGS) | dict(failure=None)


def test_faults_of_every_kind_have_the_measures_of_compare(star):
    vertices = star.nodes + 0.05 * np.random.default_rng(0).normal(size=(5, 3))
    vertices, edges = [*vertices, vertices[0] + [0.3, 0.2, 0.5]], [*star.edges[:-1], [0, 5]]
    expected = compare(Skeleton(vertices, edges, np.ones(6), (), (), ()), Truth(star.nodes, star.edges, star.radii))
    found = score(star, vertices, edges).as_dict()
    assert {found.pop(name) for name in ("failure", *OF_THINGS)} == {None}
    assert found == {name: getattr(expected, name) for name in found}


@pytest.mark.parametrize(
    ("vertices", "edges", "said"),
    [
        ([], [], "empty"),
        ([[0, 0, np.nan], [1, 0, 0]], [[0, 1]], "not finite"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 2]], "missing vertex"),
        ([[0, 0, 0], [1, 0, 0]], [[0.0, 1.0]], "whole numbers"),
        ([[0, 0], [1, 0]], [[0, 1]], "invalid vertices or edges"),
        ([[0, 0, 0], [1e9, 0, 0]], [[0, 1]], "units"),
        (np.zeros((MOST_ANSWER_PLACES + 1, 3)), [], "too much for an answer"),
    ],
)
def test_what_is_no_skeleton_is_refused(star, vertices, edges, said):
    with pytest.raises(InvalidParameterError, match=said):
        score(star, vertices, edges)


def test_a_mesh_is_no_skeleton(star):
    n = MOST_ANSWER_JUNCTIONS + 10
    ring = np.arange(n)
    edges = np.vstack([np.column_stack([ring, (ring + step) % n]) for step in (1, 2)])
    places = np.column_stack([np.cos(ring), np.sin(ring), ring]) * 0.001
    with pytest.raises(InvalidParameterError, match="is it a mesh"):
        score(star, places, edges)
