"""Means with confidence intervals, from drawing the shapes anew."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

RESAMPLES = 4000  # fitted: enough for two digits of an interval's ends
LEVEL = 95  # published: by habit, % of the resampled means that lie in the interval


def mean_with_interval(shapes: Sequence[str], values: Sequence[float]) -> tuple[float, float, float]:
    """The mean of values, and the ends of its percentile bootstrap interval (Efron 1979).

    Shapes are drawn with replacement, each with all its values, since several clouds of one shape are no independent
    evidence. Means are over the values. The draws are the same every time.

    Parameters
    ----------
    shapes : sequence of str, length n
        The shape that each value is of.
    values : sequence of float, length n

    Returns
    -------
    tuple of three floats
        NaN without any value.

    Examples
    --------
    >>> mean_with_interval(["ring", "ring", "tree"], [1, 1, 0])
    (0.6666666666666666, 0.0, 1.0)
    """
    if len(values) == 0:
        return np.nan, np.nan, np.nan
    names, of = np.unique(shapes, return_inverse=True)
    total, count = np.bincount(of, np.asarray(values, float)), np.bincount(of)
    times = _drawn(len(names))
    low, high = np.percentile((times @ total) / (times @ count), [50 - LEVEL / 2, 50 + LEVEL / 2])
    return float(total.sum() / count.sum()), float(low), float(high)


@lru_cache(maxsize=16)
def _drawn(n: int) -> np.ndarray:
    """(RESAMPLES, n) array: how often each of n shapes is drawn, which takes longer than all that follows."""
    return np.random.default_rng(0).multinomial(n, np.full(n, 1 / n), RESAMPLES)


def told(mean: float, low: float, high: float, digits: int = 2, sign: str = "") -> str:
    """A mean and its interval as tables show them; a dash for NaN. With the sign "+" positive ones have it."""
    if np.isnan(mean):
        return "-"
    words = [f"{round(value, digits) + 0.0:{sign}.{digits}f}" for value in (mean, low, high)]  # no -0.00
    return f"{words[0]} [{words[1]}, {words[2]}]"
