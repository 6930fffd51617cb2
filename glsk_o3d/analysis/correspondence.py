"""Which branches of two skeletons of one object, one after the other in time, are the same."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..data.skeleton import Skeleton
from ..geometry.polylines import arc_lengths
from ..geometry.vectors import TINY, dot

ON_RADII = 1.5  # fitted: radii around a branch within which a curve lies on it
ALONG = np.sqrt(0.5)  # derived: cosine of 45 degrees, with which a curve runs along a branch
ON_SHARE = 0.25  # fitted: least share of a branch on an earlier one, which has grown to at most four times its length
STUB_RADII = 2.0  # fitted: length of a branch, over its radius, that is too short to have a direction
SWAYED = 0.25  # fitted: of its length, by which a branch may have moved aside, on average, and be the same


def same_branches(upper: Skeleton, lower: Skeleton) -> np.ndarray:
    """The branch of `lower` that every branch of `upper` is, (B,) int array: on which it lies, or near; -1 if new."""
    under = _branch_under(upper, lower)
    fresh, bare = np.flatnonzero(under < 0), np.setdiff1d(np.arange(len(lower.branches)), under)
    offset = np.empty((len(fresh), len(bare)))
    for row, column in np.ndindex(offset.shape):
        a, b = upper.vertices[upper.branches[fresh[row]]], lower.vertices[lower.branches[bare[column]]]
        distance = [cKDTree(b).query(a)[0].mean(), cKDTree(a).query(b)[0].mean()]
        offset[row, column] = np.mean(distance) / max(arc_lengths(b)[-1], TINY)
    rows, columns = linear_sum_assignment(offset)
    near = offset[rows, columns] <= SWAYED
    under[fresh[rows[near]]] = bare[columns[near]]
    return under


def _branch_under(upper: Skeleton, lower: Skeleton) -> np.ndarray:
    """The branch of `lower` on which every branch of `upper` lies, (B,) int array; -1 if on none."""
    edge, branch, count = upper.edge_lengths, upper.branch_of_edge, len(upper.branches)
    place = lower.nearest(upper.vertices[upper.edges].mean(axis=1))
    length = np.bincount(branch, edge, count)
    radius = np.bincount(branch, edge * upper.radii[upper.edges].mean(axis=1), count) / np.maximum(length, TINY)
    is_stub = length < STUB_RADII * radius
    direction = upper.vertices[upper.edges[:, 1]] - upper.vertices[upper.edges[:, 0]]
    runs_along = np.abs(dot(direction, place.tangent)) >= ALONG * edge
    is_on = (place.distance <= ON_RADII * place.radius) & (runs_along | is_stub[branch]) & (place.branch >= 0)
    shared = np.zeros((count, len(lower.branches) + 1))
    np.add.at(shared, (branch[is_on], place.branch[is_on]), edge[is_on])
    return np.where(shared.sum(axis=1) > ON_SHARE * length, shared.argmax(axis=1), -1)


def same_one_by_one(a: Skeleton, b: Skeleton) -> bool:
    """Whether every branch of each is one of the other, and no two are the same."""
    known = [len(np.setdiff1d(same_branches(*pair), [-1])) for pair in ((a, b), (b, a))]
    return known == [len(a.branches), len(b.branches)] and len(a.branches) == len(b.branches)
