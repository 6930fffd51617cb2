"""Sums, medians and members of groups, connected components and their spanning trees."""

import math

import numpy as np
from scipy.sparse import coo_matrix, csc_array, csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from .vectors import Floats


def group_median(values: np.ndarray, group: np.ndarray, n: int) -> Floats:
    """Median of the values (m,) of each group 0 .. n-1, (n,) float array; 0 for an empty group."""
    ordered = values[np.lexsort((values, group))]
    count = np.bincount(group, minlength=n)
    stop, median = np.cumsum(count), np.zeros(n)
    filled = count > 0
    low, high = (stop - count + (count - 1) // 2)[filled], (stop - count + count // 2)[filled]
    median[filled] = (ordered[low] + ordered[high]) / 2
    return median


def group_sum(values: np.ndarray, group: np.ndarray, n: int, weight: np.ndarray | None = None) -> np.ndarray:
    """Sum of the rows of `values` (m, ...) in each group 0 .. n-1, (n, ...) float array.

    With `weight` (m, c) every row is in c groups, (m, c), with a weight in each.
    """
    weight = np.ones_like(group, float) if weight is None else weight
    indptr = np.arange(len(group) + 1) * (group.size // max(len(group), 1))
    members = csc_array((weight.ravel(), group.ravel(), indptr), shape=(n, len(group)))  # faster than a sum per column
    return (members @ values.reshape(len(values), math.prod(values.shape[1:]))).reshape(n, *values.shape[1:])


def group_rank(group: np.ndarray, n: int) -> np.ndarray:
    """Position of every row among those of its group 0 .. n-1, in their order, (m,) int array."""
    order, count = np.argsort(group, kind="stable"), np.bincount(group, minlength=n)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    return rank


class Members:
    """The members of every group 0 .. n-1."""

    def __init__(self, group: np.ndarray, n: int) -> None:
        self._order = np.argsort(group, kind="stable")
        self._first = np.searchsorted(group[self._order], np.arange(n + 1))

    def of(self, groups: np.ndarray) -> np.ndarray:
        """Members of the given groups, in the order of these, (k,) int array."""
        parts = [self._order[self._first[g] : self._first[g + 1]] for g in groups.tolist()]
        return np.concatenate(parts) if parts else self._order[:0]


def first_in_their_place(points: np.ndarray) -> np.ndarray:
    """The first of all points with the same coordinates, (n,) bool array."""
    order = np.lexsort(points.T)
    copy, first = (np.diff(points[order], axis=0) == 0).all(axis=1), np.ones(len(points), bool)
    first[order[1:][copy]] = False
    return first


def quantile(values: np.ndarray, share: float = 0.5) -> float:
    """Quantile of values (n,), n > 0: by default the median. NumPy takes ten times as long."""
    return float(np.interp(share * (len(values) - 1), np.arange(len(values)), np.sort(values)))


def component_labels(n: int, edges: np.ndarray) -> np.ndarray:
    """Connected component of every node, (n,) int array, numbered from 0; edges (e, 2) int array."""
    return connected_components(coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)[1]


def breadth_first_forest(n: int, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spanning trees of a graph: its nodes from the roots on, the parent of each, n for a root, and its component.

    Three (n,) int arrays; the root of a component is its first node. Edges (e, 2) come once each, without loops.
    """
    label = component_labels(n, edges)
    roots = np.unique(label, return_index=True)[1]
    # from one more node, linked with all roots, there is one tree
    links = np.concatenate([edges, np.column_stack([np.full(len(roots), n), roots])])
    graph = csr_matrix((np.ones(len(links)), links.T), shape=(n + 1, n + 1))
    order, parent = breadth_first_order(graph, n, directed=False)
    return order[1:], parent[:n], label
