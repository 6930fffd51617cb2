"""The stopping rules on hand-made records."""

from dataclasses import fields

import pytest

from glsk_o3d import ExplainedScore, IterationRecord, RingSizeRatio


def records(**columns):
    """Iteration records with the given columns; everything else is as far from a stop as can be."""
    rest = dict.fromkeys((f.name for f in fields(IterationRecord)), 1) | dict(explained_change=9.0, ring_ratio=0.5)
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return tuple(IterationRecord(**(rest | row | dict(iteration=i))) for i, row in enumerate(rows, start=1))


@pytest.mark.parametrize(
    ("rule", "values", "stops_after"),
    [
        (ExplainedScore(), [0.5, 0.001, 0.5, 0.5, 0.03, 0.019, 0.001], 6),
        (ExplainedScore(), [0.0, 0.0, 0.0, 0.0], 4),
        (ExplainedScore(), [0.5, 0.5, 0.5, 0.03], None),
        (ExplainedScore(0.1), [0.5, 0.09, 0.5, 0.2, 0.09], 5),
        (ExplainedScore(min_iterations=1), [0.019], 1),
        (RingSizeRatio(), [0.6, 0.4, 0.3, 0.2901], 4),
        (RingSizeRatio(), [0.995], 1),  # the uncontracted cloud has 1
        (RingSizeRatio(), [0.98, 0.5], None),
        (RingSizeRatio(), [0.5, 0.6], 2),  # rings that grow
        (RingSizeRatio(0.25), [0.5, 0.25], None),  # not below
        (RingSizeRatio(0.25), [0.5, 0.251], 2),
    ],
)
def test_a_rule_stops_at_its_threshold(rule, values, stops_after):
    name = "explained_change" if isinstance(rule, ExplainedScore) else "ring_ratio"
    history = records(**{name: values})
    stops = [i + 1 for i in range(len(history)) if rule(history[: i + 1]) is not None]
    assert stops[:1] == ([] if stops_after is None else [stops_after])
