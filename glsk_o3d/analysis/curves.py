"""Curves as arrays of edges, and places along these."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..geometry.vectors import norm

MOST_ON_A_CURVE = 10**7  # derived: on a curve; the arrays of so many take a gigabyte


def pieces(nodes: np.ndarray, edges: np.ndarray, step: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Edges cut into equal pieces no longer than `step`: the edge of each piece, and how far along it its middle is.

    Each edge may have a step of its own. Without edges every node stands for itself, also in `along`.
    """
    if len(edges) == 0:
        return np.arange(len(nodes)), np.zeros(len(nodes))
    length = norm(nodes[edges[:, 1]] - nodes[edges[:, 0]])
    check_places(length, step)
    count = np.maximum(np.ceil(length / step).astype(int), 1)
    row = np.repeat(np.arange(len(edges)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    return row, (np.arange(len(row)) - first + 0.5) / count[row]


def check_places(length: np.ndarray | float, step: np.ndarray | float) -> None:
    """Raise InvalidParameterError where curves are so long that places on them, `step` apart, would fill the memory."""
    with np.errstate(all="ignore"):
        places = np.sum(length / step)
    if not places <= MOST_ON_A_CURVE:
        size = f"{np.sum(length):.3g} long, too long for places {np.min(step):.3g} apart on it"
        raise InvalidParameterError(f"the skeleton is {size}: are all its coordinates and radii right?")


def along(edges: np.ndarray, row: np.ndarray, part: np.ndarray, values: np.ndarray) -> Any:
    """Values at the nodes, interpolated to the middles of the pieces."""
    if len(edges) == 0:
        return values[row]
    start, end = values[edges[row]].swapaxes(0, 1)
    return start + (end - start) * part.reshape(-1, *[1] * (values.ndim - 1))


def distances(curve: Skeleton, other: Skeleton, step: float) -> tuple[np.ndarray, np.ndarray]:
    """From places along a curve to the nearest places along another, and the mean of the two radii there.

    Two (n,) float arrays; the places are `step` apart, and the radius is at least that.
    """
    (_, places, radius), (_, targets, target_radius) = (places_along(skeleton, step) for skeleton in (curve, other))
    distance, nearest = cKDTree(targets).query(places)
    return distance, np.maximum((radius + target_radius[nearest]) / 2, step)


def places_along(skeleton: Skeleton, step: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places along a skeleton, at most `step` apart: the edge of each, (n,), where it is, (n, 3), and its radius, (n,).

    Each edge may have a step of its own. Without edges these are the vertices.
    """
    row, part = pieces(skeleton.vertices, skeleton.edges, step)
    place, radius = (along(skeleton.edges, row, part, values) for values in (skeleton.vertices, skeleton.radii))
    return row, place, radius


def check_graph(vertices: np.ndarray, edges: Any, name: str) -> np.ndarray:
    """Edges as an (E, 2) int64 array; an InvalidParameterError says what is wrong with the graph, called `name`."""
    edges = np.asarray(edges)
    edges = edges if edges.size else np.empty((0, 2), np.int64)
    if len(vertices) == 0:
        raise InvalidParameterError(f"the {name} is empty")
    if not np.isfinite(vertices).all():
        raise InvalidParameterError(f"the {name} has coordinates that are not finite")
    if edges.ndim != 2 or edges.shape[1] != 2 or edges.dtype.kind not in "iu":
        raise InvalidParameterError(f"the {name}'s edges must be an (E, 2) array of whole numbers")
    if edges.size and (edges.min() < 0 or edges.max() >= len(vertices)):
        raise InvalidParameterError(f"an edge of the {name} names a missing vertex")
    return edges.astype(np.int64)


def simple_edges(edges: np.ndarray) -> np.ndarray:
    """Edges, (E, 2) int array, as pairs i < j, sorted, each once, and none from a node to itself."""
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    return edges[edges[:, 0] != edges[:, 1]]
