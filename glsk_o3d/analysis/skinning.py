"""How a surface follows the bones of a skeleton."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..numerics.polylines import incident_edges, nearest_on_edges

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def skin_weights(forest: Skeleton, points: np.ndarray, vertex: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which bones move each point, and how much, for linear blend skinning.

    Each edge is a bone with its joint at the end that is nearer to the root. A point goes with the edge nearest to it
    among those of its vertex. Over the first half of an edge its motion fades in, from that of the bone before it: so
    the motion is continuous along the curve and at junctions.

    Parameters
    ----------
    forest : Skeleton
        Without loops, numbered from its roots outwards.
    points : (N, 3) float array
    vertex : (N,) int array
        The vertex of each point, as `Skeleton.vertex_of_point`.

    Returns
    -------
    bones : (N, 2) int array
        Rows of `forest.edges`: the one before and its own; twice the same where nothing comes before.
    weights : (N, 2) float array
        Not negative, with the sum 1.
    """
    around = incident_edges(forest.edges, len(forest.vertices))
    bone, along = nearest_on_edges(forest.vertices, forest.edges, around[vertex], points)
    parent = bone_before(forest)[bone]
    own = np.where(parent >= 0, np.minimum(2 * along, 1), 1)
    return np.column_stack([np.where(parent >= 0, parent, bone), bone]), np.column_stack([1 - own, own])


def bone_before(forest: Skeleton) -> np.ndarray:
    """The bone that each bone hangs on.

    Parameters
    ----------
    forest : Skeleton
        Without loops, numbered from its roots outwards.

    Returns
    -------
    (E,) int array
        Rows of `forest.edges`; -1 for bones at a root.
    """
    leading = np.full(len(forest.vertices), -1)
    leading[forest.edges[:, 1]] = np.arange(len(forest.edges))
    return leading[forest.edges[:, 0]]
