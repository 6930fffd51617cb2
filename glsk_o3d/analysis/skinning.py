"""The bones that move each point of a surface, and how much."""

import itertools
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ..data.skeleton import Skeleton
from ..geometry.polylines import incident_edges, nearest_on_edges
from ..geometry.vectors import TINY, norm
from .surface import Surface

MOST_WEIGHTS = 4  # published: glTF 2.0, 3.7.3.3, joints of a vertex in one set
BLEND = 1.5  # fitted: radii beyond its end at which a bone ceases to move a tube; with 1 a bent elbow has a dent
ALONG_SURFACE = 3.0  # derived: twice as far along the surface, which only limits what is near through empty space
JOINTS_BETWEEN = 3  # derived: from the bone beyond a limb's root over the trunk's joint to that beyond another's
MOST_PRODUCTS = 10**8  # speed: a second's; only where thousands of bones meet are there more
MOST_SURFACE = 10**9  # speed: bones times points, a minute's; with more, weights are by distance in space alone


def skin_weights(
    forest: Skeleton, points: np.ndarray, vertex: np.ndarray, surface: Surface | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The bones that move each point, and their weights, for linear blend skinning: (N, 4) int and (N, 4) float array.

    The forest has no loops and is numbered from its roots outwards; each edge is a bone, a row of `forest.edges`, with
    its joint at the end that is nearer to the root. `vertex`, (N,), says which part of the curve a point is on. The
    farther away a bone is than the nearest one, the less it moves the point: not at all one and a half radii beyond the
    joint, on a tube, or where the fifth bone is. So weights are continuous along the curve and across the creases
    at junctions, but not between bones more than three joints apart, nor where five are equally near. They sum to 1.

    With a `surface`, a bone moves no point that is farther than three radii from the bone's own points along it: limbs
    that touch move by themselves. Points are where the surface around them is, though the cloud may put them elsewhere.
    """
    around, table = incident_edges(forest.edges, len(forest.vertices)), _bones_around(forest)
    if surface is not None:
        vertex = surface.continued(vertex, around[:, 0], table)
    own, _ = nearest_on_edges(forest.vertices, forest.edges, around[vertex], points)
    own, along = nearest_on_edges(forest.vertices, forest.edges, table[own], points)  # the vertex may be another part's
    bones = table[own]
    squared = np.stack([_squared_distance(forest, np.where(bone < 0, own, bone), points) for bone in bones.T], axis=1)
    squared[bones < 0] = np.inf
    least = squared.min(axis=1, keepdims=True)
    start, end = forest.radii[forest.edges[own]].T
    radius = (start + along * (end - start))[:, None]
    widest = 2 * BLEND**2 * np.fmax(radius**2, least)
    if surface is not None and len(forest.edges) * len(points) <= MOST_SURFACE:
        beyond = _distances_from_bones(surface, own, bones, ALONG_SURFACE * np.nanmax(radius, initial=0))
        farther = np.maximum(squared, least + widest * (beyond / np.fmax(ALONG_SURFACE * radius, TINY)) ** 2)
        # where bones are shorter than the mesh is fine, none may have points of its own: then the surface says nothing
        squared = np.where(farther.min(axis=1, keepdims=True) < least + widest, farther, squared)
    order = np.argsort(squared, axis=1, kind="stable")[:, : MOST_WEIGHTS + 1]
    bones, squared = (np.take_along_axis(values, order, axis=1) for values in (bones, squared))
    fifth = squared[:, MOST_WEIGHTS:].min(axis=1, initial=np.inf, keepdims=True)
    reach = np.minimum(widest, fifth - least)
    # on a tube at s beyond the joint the squares of the distances are r^2 + 2 s^2 and r^2: what counts is (s / r)^2
    share = np.clip(1 - (squared - least) / np.maximum(reach, TINY), 0, 1) ** 2
    bones, share = (np.pad(values, ((0, 0), (0, MOST_WEIGHTS)))[:, :MOST_WEIGHTS] for values in (bones, share))
    return np.where(share > 0, bones, 0), share / share.sum(axis=1, keepdims=True)


def _distances_from_bones(surface: Surface, own: np.ndarray, bones: np.ndarray, limit: float) -> np.ndarray:
    """Distance along a surface of every point from the points that are nearest to each of some bones, infinite beyond
    a limit: `own` (N,) and `bones` (N, c), padded with -1, to (N, c) float array.
    """
    distance = np.full(bones.shape, np.inf)
    order = np.argsort(bones, axis=None, kind="stable")
    rows, columns = np.unravel_index(order, bones.shape)
    first = np.searchsorted(bones[rows, columns], np.arange(bones.max() + 2))
    for bone, part in enumerate(itertools.pairwise(first.tolist())):
        asked = slice(*part)
        if (own == bone).any():
            distance[rows[asked], columns[asked]] = surface.distances(own == bone, limit)[rows[asked]]
    return distance


def _bones_around(forest: Skeleton) -> np.ndarray:
    """The bones that may move the same points as each bone, itself among them, (E, c) int array, filled up with -1."""
    n = len(forest.edges)
    ends = csr_array((np.ones(2 * n), (forest.edges.ravel(), np.repeat(np.arange(n), 2))))
    linked = (ends.T @ ends).astype(bool)
    near = linked
    for _ in range(JOINTS_BETWEEN - 1):
        if np.diff(near.indptr) @ np.diff(linked.indptr) > MOST_PRODUCTS:
            break
        near = near @ linked
    count = np.diff(near.indptr)
    table = np.full((n, count.max()), -1)
    table[np.repeat(np.arange(n), count), np.arange(near.nnz) - np.repeat(near.indptr[:-1], count)] = near.indices
    return table


def _squared_distance(forest: Skeleton, bone: np.ndarray, points: np.ndarray) -> Any:
    """From each point to a bone of its own, (N,) float array; what is beyond an end counts twice."""
    # else all bones of a joint would be equally near behind it, also those that point away
    _, along = nearest_on_edges(forest.vertices, forest.edges, bone[:, None], points)
    start, end = forest.vertices[forest.edges[bone]].swapaxes(0, 1)
    offset, axis = points - start - along[:, None] * (end - start), end - start
    beyond = (offset * axis).sum(axis=1) / np.maximum(norm(axis), TINY)
    return (offset**2).sum(axis=1) + beyond**2
