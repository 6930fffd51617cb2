"""Means with intervals: against the binomial distribution and SciPy's bootstrap, and what counts as evidence."""

import numpy as np
import pytest
from glsk_bench.table import mean_with_interval, told
from scipy import stats


@pytest.mark.parametrize(("right", "of"), [(3, 20), (18, 20), (250, 300)])
def test_of_a_share_is_binomial(right, of):
    mean, *ends = mean_with_interval([*map(str, range(of))], [True] * right + [False] * (of - right))
    assert mean == right / of
    np.testing.assert_allclose(ends, stats.binom.ppf([0.025, 0.975], of, mean) / of, atol=1.001 / of)


def test_is_that_of_scipy():
    values = np.random.default_rng(3).gamma(1.5, size=40)
    found = mean_with_interval([*map(str, range(40))], values)
    options = dict(method="percentile", n_resamples=20_000, rng=np.random.default_rng(4))
    expected = stats.bootstrap((values,), np.mean, **options).confidence_interval
    np.testing.assert_allclose(found, [values.mean(), *expected], atol=0.04)


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
