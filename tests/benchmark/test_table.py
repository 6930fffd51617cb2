"""The table: its numbers, its words, its intervals, and what cannot be compared."""

import json
from dataclasses import replace

import numpy as np
import pytest
from glsk_bench import Results, Scores, leaderboard
from glsk_bench.table import mean_with_interval, told
from scipy import stats

from glsk_o3d.errors import InvalidParameterError

BEST = Scores(True, True, 1.0, 1.0, 0.1, 1.0, 1.0, 1.0, None, 0, 0, 0, 0)
WRONG = Scores(False, False, 0.5, 0.0, 0.3, 0.8, 0.9, 1.2, 0.4, 1, 0, 0, 0)
FAILED = Scores.of_failure("no answer")


def results(name, *scores, seconds=(None,) * 4, whole=False):
    places = [(shape, variant) for shape in ("tubes_100", "tubes_101") for variant in ("clean", "scan2")]
    rows = [
        {"shape": shape, "family": "tubes", "variant": variant, **each.as_dict(), "seconds": time}
        for (shape, variant), each, time in zip(places, scores, seconds, strict=True)
    ]
    return Results("v1", name, whole, rows)


@pytest.fixture
def two():
    good = results("good", BEST, BEST, BEST, WRONG, seconds=(1.0, 2.0, 3.0, 4.0))
    return [results("a | bad", BEST, FAILED, FAILED, FAILED, seconds=(None, 9.0, None, None)), good]


def test_in_markdown(two, tmp_path):
    board = leaderboard(two)
    board.save(tmp_path / "table.md")
    text = (tmp_path / "table.md").read_text()
    assert text == board.markdown()
    intro, title, first, name, of_good, other, of_bad = text.split("\n\n")
    assert intro.startswith("Benchmark v1, not all of it, or other shapes. Means")
    assert (title, name, other) == ("**4 clouds of 2 shapes**", "**good**", "**a \\| bad**")
    heads, _, *lines = ([cell.strip() for cell in line.split(" | ")] for line in first.splitlines())
    cells = {line[0]: dict(zip(heads, line, strict=True)) for line in lines}
    good, bad = cells["| good"], cells["| a \\| bad"]
    assert (good["failures"], good["perfect"], good["error"]) == ("0", "0.75 [0.50, 1.00]", "0.150 [0.100, 0.200]")
    assert (bad["failures"], bad["perfect"], bad["error"]) == ("3", "0.25 [0.00, 0.50]", "0.100 [0.100, 0.100]")
    assert (good["s |"], bad["s |"]) == ("2.50 |", "- |")
    assert [line.split(" | ")[1] for line in of_good.splitlines()[2:]] == ["2", "2"]  # clouds of a variant
    assert of_bad.splitlines()[3].endswith("| - | - | - | - |")  # none of which could be scored


def test_what_only_things_have_has_columns_where_it_is_known(two):
    thing = replace(BEST, hooks=0.25, wiggle=-0.0123)
    board = leaderboard([*two, results("thing", thing, thing, FAILED, FAILED)])
    heads, _, *lines = board.markdown().split("\n\n")[2].splitlines()
    assert heads.endswith("| completeness | hooks | wiggle | s |")
    cells = {line.split(" | ")[0]: line.split(" | ")[-3:-1] for line in lines}
    assert cells["| thing"] == ["0.25 [0.25, 0.25]", "-0.012 [-0.012, -0.012]"]
    assert cells["| good"] == ["-", "-"]


def test_in_json(two, tmp_path):
    board = leaderboard(two)
    board.save(tmp_path / "table.json")
    told = json.loads((tmp_path / "table.json").read_text())
    assert told == board.as_dict()
    good, bad = told["entries"]
    assert (good["name"], bad["name"]) == ("good", "a | bad")
    assert (bad["all"]["failures"], bad["all"]["clouds"], bad["all"]["shapes"]) == (3, 4, 2)
    assert bad["variants"]["scan2"]["error"] is bad["variants"]["scan2"]["seconds"] is None
    assert good["all"]["ends"] == [0.4, 0.4, 0.4]  # of those that have one
    assert good["all"]["length"][0] == pytest.approx(1.05)


def test_the_order_is_by_perfect_then_by_topology():
    close = Scores(False, True, 0.5, 1.0, 0.1, 1.0, 1.0)
    made = [results(name, *[scores] * 4) for name, scores in (("c", FAILED), ("b", close), ("a", WRONG), ("d", BEST))]
    assert [entry["name"] for entry in leaderboard(made).entries] == ["d", "b", "c", "a"]


def test_what_cannot_be_compared(two):
    bad, good = two
    for other in (Results("v1", "fewer", False, good.rows[1:]), Results("v2", "other", False, good.rows)):
        with pytest.raises(InvalidParameterError, match="scored on different clouds"):
            leaderboard([bad, other])
    with pytest.raises(InvalidParameterError, match="two programs are called 'good'"):
        leaderboard([good, bad, good])
    for none in ([], [Results("v1", "a", False, [])]):
        with pytest.raises(InvalidParameterError, match="no scores"):
            leaderboard(none)


@pytest.mark.parametrize(("right", "of"), [(3, 20), (18, 20), (250, 300)])
def test_of_a_share_is_binomial(right, of):
    mean, *ends = mean_with_interval([*map(str, range(of))], [True] * right + [False] * (of - right))
    assert mean == right / of
    np.testing.assert_allclose(ends, stats.binom.ppf([0.025, 0.975], of, mean) / of, atol=1.001 / of)


def test_more_clouds_of_a_shape_are_no_more_evidence():
    shapes, values = [*map(str, range(30))], np.random.default_rng(5).random(30)
    once = mean_with_interval(shapes, values)
    assert mean_with_interval(shapes * 4, [*values] * 4) == pytest.approx(once, rel=1e-12)
    apart = mean_with_interval([*map(str, range(120))], [*values] * 4)
    assert apart[2] - apart[1] == pytest.approx((once[2] - once[1]) / 2, rel=0.15)


def test_in_words():
    assert told(0.984, 0.9, 1) == "0.98 [0.90, 1.00]"
    assert told(-0.001, -0.0123, 0.0006, 3, "+") == "-0.001 [-0.012, +0.001]"
    assert told(-0.001, -0.001, 0.0, sign="+") == "+0.00 [+0.00, +0.00]"
    assert told(*mean_with_interval([], [])) == "-"
