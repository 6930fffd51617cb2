"""The logistic model."""

import math

import pytest
from glsk_o3d.refinement.scores import probability

from glsk_o3d.refinement import scores

WEIGHTS = {"constant": -1.0, "a": 2.0, "b": -0.5}


@pytest.mark.parametrize(("a", "b", "total"), [(0, 0, -1), (0.5, 0, 0), (1, 4, -1), (3, 2, 4)])
def test_by_its_definition(a, b, total):
    assert probability(WEIGHTS, {"a": a, "b": b}) == pytest.approx(1 / (1 + math.exp(-total)))


def test_facts_without_a_weight_do_not_matter():
    assert probability(WEIGHTS, {"a": 1, "b": 1, "c": 9}) == probability(WEIGHTS, {"a": 1, "b": 1})
    with pytest.raises(KeyError, match="b"):
        probability(WEIGHTS, {"a": 1})


@pytest.mark.parametrize(("a", "limit"), [(1e300, 1), (-1e300, 0)])
def test_extreme_facts_overflow_nothing(a, limit):
    found = probability(WEIGHTS, {"a": a, "b": 0})
    assert type(found) is float
    assert found == pytest.approx(limit, abs=1e-20)


@pytest.mark.parametrize(
    ("name", "more", "less"),
    [
        ("AIR_WEIGHTS", {"deficit", "noise", "inner"}, {"surface", "straightness", "bonds", "length"}),
        ("HANDLE_WEIGHTS", {"opening", "bonds", "confidence"}, {"winding"}),
        ("BRIDGE_WEIGHTS", {"winding", "straightness"}, {"cap"}),
        ("LIMB_WEIGHTS", {"protrusion", "confidence", "roundness"}, {"web"}),
    ],
)
def test_every_fact_speaks_the_way_it_should(name, more, less):
    weights = getattr(scores, name)
    assert weights.keys() == {"constant", *more, *less}
    assert all(weights[fact] > 0 for fact in more)
    assert all(weights[fact] < 0 for fact in less)
