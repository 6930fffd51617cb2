"""The verdict and the score of a skeleton, and the reasons for them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Decision, InvalidParameterError, Reason, Report, Skeleton, Verdict, samples, skeletonize
from glsk_o3d.data.verdict import CODES, as_verdict, graph_score, verdict_of


def decision(about, probability):
    return Decision(about, (0.0, 0.0, 0.0), probability, False)


def test_verdicts_have_an_order():
    for (i, a), (j, b) in itertools.product(enumerate(Verdict), repeat=2):
        assert (a >= b, a > b, a <= b, a < b) == (i <= j, i < j, i >= j, i > j)
        assert (a >= b.value) == (i <= j)
    assert as_verdict("doubtful") is Verdict.DOUBTFUL
    assert as_verdict(None) is None
    with pytest.raises(InvalidParameterError, match="'good', 'doubtful'"):
        as_verdict("bad")


@pytest.mark.parametrize("code", CODES)
def test_the_worst_reason_decides(code):
    best = Reason("option", "an option was not taken")
    assert verdict_of([best, Reason(code, "text"), best]) is CODES[code]
    assert verdict_of([]) is Verdict.GOOD


@pytest.mark.parametrize("about", ["loop", "air", "gap", "limb"])
def test_the_least_certain_decision_counts_whatever_its_answer(about):
    sure = graph_score([], np.ones(5))
    scores = [graph_score([decision(about, 0.99), decision(about, p)], np.ones(5)) for p in (0.01, 0.3, 0.5, 0.7, 0.99)]
    np.testing.assert_allclose(scores, scores[::-1])
    assert scores[2] < scores[1] < scores[0] < sure


def test_confidence_counts_by_its_tenth_percentile():
    few, many = np.r_[np.zeros(5), np.ones(95)], np.r_[np.zeros(20), np.ones(80)]
    assert graph_score([], few) == graph_score([], np.ones(100))
    assert graph_score([], many) == graph_score([], np.zeros(100)) < graph_score([], np.ones(100))


def test_what_is_unknown_is_doubtful():
    lines = Skeleton([[0, 0, 0], [1, 0, 0]], [[0, 1]], np.ones(2), (), (), ())
    assert np.isnan(lines.score)
    assert [reason.code for reason in lines.reasons] == ["unknown score"]
    assert lines.verdict is Verdict.DOUBTFUL


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
def test_skeletons_have_verdicts():
    """Of each kind one; the text of a reason is the warning, and it survives a file."""
    cases = [(samples.torus, Verdict.GOOD), (samples.sheet, Verdict.NO_CURVE_SKELETON)]
    for make, verdict in [*cases, (samples.sphere, Verdict.NO_CURVE_SKELETON)]:
        skeleton = skeletonize(make(1000).points)
        assert skeleton.verdict is verdict
        assert skeleton.report.warnings == tuple(reason.text for reason in skeleton.report.reasons)
        assert Report.from_dict(skeleton.report.to_dict()) == skeleton.report
    noisy = skeletonize(samples.sauropod(400, noise=0.03).points)
    assert noisy.verdict is Verdict.DOUBTFUL
    ring = skeletonize(samples.torus(1000).points)
    unsure = replace(ring, report=replace(ring.report, decisions=(decision("loop", 0.5), decision("limb", 0.6))))
    (reason,) = unsure.reasons
    assert (reason.code, reason.place, unsure.verdict) == ("low score", (0.0, 0.0, 0.0), Verdict.DOUBTFUL)
    assert "the loop at (0, 0, 0) is a handle: 0.50" in reason.text


def test_files_of_earlier_versions_have_warnings():
    report = Report.from_dict({"warnings": ["sheet-like: all of it"]})
    assert report.reasons == (Reason("other", "sheet-like: all of it"),)
    with pytest.raises(ValueError, match="unknown code"):
        Report.from_dict({"reasons": [{"code": "weather", "text": "rain"}]})


def test_the_score_follows_the_decisions_of_an_edited_skeleton():
    ring = skeletonize(samples.torus(1000).points)
    report = replace(ring.report, decisions=(*ring.report.decisions, decision("loop", 0.5)))
    before, other = ring.score, ring.with_report(report)
    assert other.score < before
    assert (other.score, ring.score) == (replace(ring, report=report).score, before)


def test_a_doubt_is_about_the_branch_that_it_is_at():
    fork = skeletonize(samples.y_junction(1500).points)
    row = 1
    middle = fork.places(row, 0.5 * fork.edge_lengths[fork.branch_of_edge == row].sum()).position[0]
    doubt = Decision("air", tuple(middle.tolist()), 0.5, False)
    unsure = replace(fork, report=replace(fork.report, decisions=(*fork.report.decisions, doubt)))
    assert np.flatnonzero(unsure.branch_scores < fork.branch_scores).tolist() == [row]
    assert Skeleton([[0, 0, 0]], (), [1], (), (), ()).branch_scores.shape == (0,)
