"""Report, IterationRecord and Decision."""

import contextlib
import dataclasses
import json
import re
from dataclasses import dataclass, replace

import pytest

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples
from glsk_o3d.data.verdict import Reason


@pytest.fixture(scope="module")
def report():
    return (glsk.RingBuilder() | glsk.Contractor(max_iterations=2))(samples.torus(n=300).points).report


def test_a_report_survives_json(report):
    again = glsk.Report.from_dict(json.loads(json.dumps(report.to_dict())))
    assert again == report
    assert isinstance(again.iterations, tuple)
    assert again.iterations[1].iteration == 2
    assert glsk.Report.from_dict({}) == glsk.Report()


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(glsk.Report)])
def test_an_entry_of_another_type_is_refused_or_means_the_same(report, name):
    """Else it would be found out where it is printed."""
    for value in (None, "x", -0.5, True, 10**400, ["x", 2], [[1]], {}, {"a": []}):
        with contextlib.suppress(ValueError, TypeError, AttributeError):  # each of which a reader says in a sentence
            again = getattr(glsk.Report.from_dict({**report.to_dict(), name: value}), name)
            assert type(again) is type(getattr(report, name))
            assert json.dumps(again) in (json.dumps(value), "{}", "[]")


def test_a_printed_report_has_the_main_facts_in_twelve_lines():
    report = glsk.Report(
        n_input=900,
        n_dropped=2,
        n_contracted=500,
        decisions=(glsk.Decision("loop", (0.0, 0.5, -2.0), 0.45, changed=True),),
        seconds={"Sampler": 0.25, "Refiner": 0.5},
        reasons=(Reason("sheet", "sheet-like: a < b"),),
    )
    lines = str(report).splitlines()
    assert all(word in str(report) for word in ("900 input", "500 contracted", "0.45", "Refiner 0.50", "a < b"))
    assert len(lines) <= 12
    html = report._repr_html_()
    assert html.count("<tr>") == len(lines) - 1
    assert re.findall("<td [^>]*>([^<]*)</td>", html)[-2:] == ["warning", "sheet-like: a &lt; b"]
    assert eval(repr(report.decisions), {"Decision": glsk.Decision}) == report.decisions


@dataclass(frozen=True, kw_only=True)
class Doubt(glsk.Filter[glsk.Contraction, glsk.Contraction]):
    """A filter of somebody else's that warns."""

    def run(self, given, context):
        return replace(given, report=given.report.with_warning("doubtful: so it is"))


def test_a_warning_of_a_filter_is_issued_once_and_kept():
    """In a pipeline and by hand, whatever the Refiner and the Tracer say of the skeleton."""
    rings, others = pipelines.rings(), pipelines.default().stages[5:]
    points = samples.sheet(900).points
    with pytest.warns(glsk.SkeletonWarning) as issued:
        skeleton = (rings | Doubt() | glsk.Pipeline(*others))(points)
    assert [message.partition(":")[0] for message in skeleton.report.warnings] == ["doubtful", "sheet-like"]
    assert [str(each.message) for each in issued] == list(skeleton.report.warnings)

    state = rings(points)
    with pytest.warns(glsk.SkeletonWarning) as issued:
        state = Doubt()(state)
    assert [str(each.message) for each in issued] == ["doubtful: so it is"]
    with pytest.warns(glsk.SkeletonWarning) as issued:
        by_hand = glsk.Pipeline(*others)(state)
    assert by_hand.report.warnings == skeleton.report.warnings
    assert [str(each.message) for each in issued] == list(skeleton.report.warnings)[1:]


DECISIONS = (
    glsk.Decision("loop", (0.0, 0.5, -2.0), 0.99, changed=False),
    glsk.Decision("air", (1.0, 2.0, 3.0), 0.7, changed=True),
    glsk.Decision("gap", (1 / 3, 0.0, 1e9), 0.45, changed=False),
    glsk.Decision("limb", (0.0, 0.0, 0.0), 0.01, changed=True),
)


def test_close_calls_lie_between_a_quarter_and_three_quarters_the_closest_first():
    assert glsk.Report(decisions=DECISIONS).uncertain == (DECISIONS[2], DECISIONS[1])
    assert glsk.Report().uncertain == ()
    for probability, close in ((0.249, False), (0.25, True), (0.75, True), (0.751, False)):
        assert glsk.Decision("gap", (0.0, 0.0, 0.0), probability, changed=False).is_uncertain == close


def test_a_decision_says_what_became_of_it():
    outcomes = ["loop kept", "branch cut", "gap left", "spur pruned"]
    assert [it.outcome for it in DECISIONS] == outcomes
    assert all(it.outcome in str(it) for it in DECISIONS)
    other = [dataclasses.replace(it, changed=not it.changed).outcome for it in DECISIONS]
    assert other == ["loop closed", "branch kept", "gap bridged", "limb kept"]


def test_a_report_says_that_the_graph_is_on_the_medial_axis(report):
    assert "medial" not in str(report)
    assert "graph       on the medial axis of the solid" in str(replace(report, on_medial_axis=True)).splitlines()
