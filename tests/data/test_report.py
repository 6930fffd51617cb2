"""Report, IterationRecord and Decision."""

import contextlib
import dataclasses
import json
import re
from dataclasses import dataclass, replace

import pytest

from glsk_o3d import (
    Contraction,
    Contractor,
    Decision,
    Filter,
    Pipeline,
    Report,
    RingBuilder,
    SkeletonWarning,
    pipelines,
    samples,
)


@pytest.fixture(scope="module")
def report():
    return (RingBuilder() | Contractor(max_iterations=2))(samples.torus(n=300).points).report


def test_survives_json(report):
    again = Report.from_dict(json.loads(json.dumps(report.to_dict())))
    assert again == report
    assert isinstance(again.iterations, tuple)
    assert again.iterations[1].iteration == 2
    assert Report.from_dict({}) == Report()


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(Report)])
def test_an_entry_of_another_type_is_refused_or_means_the_same(report, name):
    """Else it would be found out where it is printed."""
    for value in (None, "x", -0.5, True, 10**400, ["x", 2], [[1]], {}, {"a": []}):
        with contextlib.suppress(ValueError, TypeError, AttributeError):  # each of which a reader says in a sentence
            again = getattr(Report.from_dict({**report.to_dict(), name: value}), name)
            assert type(again) is type(getattr(report, name))
            assert json.dumps(again) in (json.dumps(value), "{}", "[]")


def test_print_says_the_main_things_in_about_ten_lines():
    report = Report(
        n_input=900,
        n_dropped=2,
        n_contracted=500,
        decisions=(Decision("loop", (0.0, 0.5, -2.0), 0.45, changed=True),),
        seconds={"Sampler": 0.25, "Refiner": 0.5},
        warnings=("sheet-like: a < b",),
    )
    lines = str(report).splitlines()
    for words in (
        "counts      900 input, 2 dropped, 500 contracted",
        "uncertain   the loop at (0, 0.5, -2) is a handle: 0.45, loop closed",
        "seconds     Sampler 0.25, Refiner 0.50",
        "warning     sheet-like: a < b",
    ):
        assert words in lines
    assert len(lines) <= 12
    html = report._repr_html_()
    assert html.count("<tr>") == len(lines) - 1
    assert re.findall("<td [^>]*>([^<]*)</td>", html)[-2:] == ["warning", "sheet-like: a &lt; b"]
    assert eval(repr(report.decisions)) == report.decisions


@dataclass(frozen=True, kw_only=True)
class Doubt(Filter[Contraction, Contraction]):
    """A filter of somebody else's that warns."""

    def run(self, given, context):
        return replace(given, report=given.report.with_warning("doubtful: so it is"))


def test_what_filters_warn_of_is_issued_once_and_kept():
    """In a pipeline and by hand, whatever the Refiner and the Tracer say of the skeleton."""
    rings, others = pipelines.rings(), pipelines.default().stages[5:]
    points = samples.sheet(900).points
    with pytest.warns(SkeletonWarning) as issued:
        skeleton = (rings | Doubt() | Pipeline(*others))(points)
    assert [message.partition(":")[0] for message in skeleton.report.warnings] == ["doubtful", "sheet-like"]
    assert [str(each.message) for each in issued] == list(skeleton.report.warnings)

    state = rings(points)
    with pytest.warns(SkeletonWarning) as issued:
        state = Doubt()(state)
    assert [str(each.message) for each in issued] == ["doubtful: so it is"]
    with pytest.warns(SkeletonWarning) as issued:
        by_hand = Pipeline(*others)(state)
    assert by_hand.report.warnings == skeleton.report.warnings
    assert [str(each.message) for each in issued] == list(skeleton.report.warnings)[1:]


JUDGEMENTS = (
    Decision("loop", (0.0, 0.5, -2.0), 0.99, changed=False),
    Decision("air", (1.0, 2.0, 3.0), 0.7, changed=True),
    Decision("gap", (1 / 3, 0.0, 1e9), 0.45, changed=False),
    Decision("limb", (0.0, 0.0, 0.0), 0.01, changed=True),
)


def test_close_calls_lie_between_a_quarter_and_three_quarters_the_closest_first():
    assert Report(decisions=JUDGEMENTS).uncertain == (JUDGEMENTS[2], JUDGEMENTS[1])
    assert Report().uncertain == ()
    for probability, close in ((0.249, False), (0.25, True), (0.75, True), (0.751, False)):
        assert Decision("gap", (0.0, 0.0, 0.0), probability, changed=False).is_uncertain == close


def test_decisions_in_words():
    assert list(map(str, JUDGEMENTS)) == [
        "the loop at (0, 0.5, -2) is a handle: 0.99, loop kept",
        "the branch at (1, 2, 3) crosses air: 0.70, branch cut",
        "the object goes on across the gap at (0.3333, 0, 1e+09): 0.45, gap left",
        "the branch at (0, 0, 0) is a limb: 0.01, spur pruned",
    ]
    other = [dataclasses.replace(it, changed=not it.changed).outcome for it in JUDGEMENTS]
    assert other == ["loop closed", "branch kept", "gap bridged", "limb kept"]
