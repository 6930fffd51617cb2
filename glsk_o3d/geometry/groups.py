"""Sums, medians and members of groups, and connected components."""

import math

import numpy as np
from scipy.sparse import coo_matrix, csc_array
from scipy.sparse.csgraph import connected_components

from .vectors import Floats


def by_group(group: np.ndarray, n: int) -> np.ndarray:
    """Order, (m,) int array, that sorts what is in groups 0 .. n-1, or in a negative one, and else leaves it as it is.

    NumPy sorts integers of 16 bits by their digits: ten times faster than others.
    """
    return np.argsort(group.astype(np.min_scalar_type(-n - 1)), kind="stable")


def group_median(values: np.ndarray, group: np.ndarray, n: int) -> Floats:
    """Median of the values (m,) of each group 0 .. n-1, (n,) float array; 0 for an empty group."""
    order = np.argsort(values)
    ordered = values[order[by_group(group[order], n)]]
    count = np.bincount(group, minlength=n)
    last, median = np.cumsum(count), np.zeros(n)
    has = count > 0
    low, high = (last - count + (count - 1) // 2)[has], (last - count + count // 2)[has]
    median[has] = (ordered[low] + ordered[high]) / 2
    return median


def first_in_their_place(points: np.ndarray) -> np.ndarray:
    """The first of all points with the same coordinates, bool array: which of them is linked would be chance."""
    if np.diff(np.sort(points[:, 0])).all():  # mostly, and then they need not be sorted by three coordinates
        return np.ones(len(points), bool)
    order = np.lexsort(points.T)
    again, first = (np.diff(points[order], axis=0) == 0).all(axis=1), np.ones(len(points), bool)
    first[order[1:][again]] = False
    return first


def quantile(values: np.ndarray, share: float = 0.5) -> float:
    """Quantile of some values, (n,) float array, n > 0: by default the median. NumPy takes ten times as long."""
    return float(np.interp(share * (len(values) - 1), np.arange(len(values)), np.sort(values)))


class Members:
    """The members of every group 0 .. n-1; those of a negative group have none."""

    def __init__(self, group: np.ndarray, n: int) -> None:
        self._order = by_group(group, n)
        self._first = np.searchsorted(group[self._order], np.arange(n + 1))

    def of(self, groups: np.ndarray) -> np.ndarray:
        """Members of some groups, in the order of these, (k,) int array."""
        parts = [self._order[self._first[g] : self._first[g + 1]] for g in groups.tolist()]
        return np.concatenate(parts) if parts else self._order[:0]


FEW_NUMBERS = 10000  # speed: numbers, whose sum takes less time than to make a matrix for it


def group_sum(values: np.ndarray, group: np.ndarray, n: int, weight: np.ndarray | None = None) -> np.ndarray:
    """Sum of the rows of `values` (m, ...) in each group 0 .. n-1, (n, ...) float array.

    With `weight` (m, c) every row is in c groups, (m, c), with a weight in each.
    """
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    if weight is None and flat.size < FEW_NUMBERS:
        place = group[:, None] * flat.shape[1] + np.arange(flat.shape[1])
        total = np.bincount(place.ravel(), flat.ravel(), n * flat.shape[1])
    else:  # one sweep over the rows: 3 to 7 times faster than one over every column
        weight = np.ones_like(group, float) if weight is None else weight
        each = np.arange(len(group) + 1) * (group.size // max(len(group), 1))
        members = csc_array((weight.ravel(), group.ravel(), each), shape=(n, len(group)))
        total = members @ flat
    return total.reshape(n, *values.shape[1:])


def group_rank(group: np.ndarray, n: int) -> np.ndarray:
    """Position of every row among those of its group 0 .. n-1, in their order, (m,) int array."""
    order, count = by_group(group, n), np.bincount(group, minlength=n)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    return rank


def component_labels(n: int, edges: np.ndarray) -> np.ndarray:
    """Connected component of every node, (n,) int array, numbered from 0; edges (E, 2) int array."""
    return connected_components(coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)[1]
