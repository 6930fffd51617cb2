"""Statistics of groups of values."""

import math

import numpy as np
from scipy.sparse import csc_array


def group_median(values, group, n):
    """Median of the values of each group.

    Parameters
    ----------
    values : (m,) float array
    group : (m,) int array
        Group 0 .. n-1 of each value.
    n : int

    Returns
    -------
    (n,) float array
        0 for an empty group.
    """
    order = np.lexsort((values, group))
    count = np.bincount(group, minlength=n)
    last = np.cumsum(count)
    median = np.zeros(n)
    has = count > 0
    low, high = (last - count + (count - 1) // 2)[has], (last - count + count // 2)[has]
    ordered = values[order]
    median[has] = (ordered[low] + ordered[high]) / 2
    return median


def group_sum(values, group, n):
    """Sum of the rows of each group.

    Parameters
    ----------
    values : (m, ...) float array
    group : (m,) int array
        Group 0 .. n-1 of each row.
    n : int

    Returns
    -------
    (n, ...) float array
    """
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    if flat.shape[1] < 4:
        total = np.stack([np.bincount(group, column, n) for column in flat.T], axis=1)
    else:  # one sweep over the rows: 3 to 7 times faster than one over every column
        members = csc_array((np.ones(len(group)), group, np.arange(len(group) + 1)), shape=(n, len(group)))
        total = members @ flat
    return total.reshape(n, *values.shape[1:])
