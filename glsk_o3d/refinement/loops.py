"""Close loops that nothing passes through."""

from __future__ import annotations

import numpy as np

from ..numerics.components import component_labels
from ..numerics.cycles import minimum_cycle_basis, opens_wider
from ..numerics.groups import group_median
from ..numerics.vectors import norm
from ..skeleton import Skeleton
from .merging import merge_vertices
from .triangles import collapse_triangles


def surface_distance(skeleton: Skeleton) -> np.ndarray:
    """Median distance from each vertex to the input points it owns, (M,) float array."""
    supporting = skeleton.supporting_points
    vertex = skeleton.vertex_of_point[supporting]
    distance = norm(skeleton.points[supporting] - skeleton.vertices[vertex])
    return group_median(distance, vertex, len(skeleton.vertices))


def close_loops(skeleton: Skeleton, opening: float) -> Skeleton:
    """Zip up the loops whose opening is not wider than the tube that makes them.

    The opening of a loop is the radius of the largest circle inside it; the tube's is the median over the loop of the
    distance from its vertices to the surface. All false loops of a minimum cycle basis are zipped up at once, until
    there are none.

    Parameters
    ----------
    skeleton : Skeleton
    opening : float
        Least opening of a true loop over the radius of its tube.

    Returns
    -------
    Skeleton
        Without triangles.
    """
    while True:
        cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
        if not cycles:
            return skeleton
        distance = surface_distance(skeleton)
        false = [
            cycle for cycle in cycles if not opens_wider(skeleton.vertices[cycle], opening * np.median(distance[cycle]))
        ]
        if not false:
            return skeleton
        pairs = np.concatenate([zip_pairs(skeleton.vertices[cycle], cycle) for cycle in false])
        group = component_labels(len(skeleton.vertices), pairs)
        skeleton = collapse_triangles(merge_vertices(skeleton, group))


def zip_pairs(points: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Pairs of vertices that meet when a loop is zipped up between its two ends, those farthest apart.

    Parameters
    ----------
    points : (n, 3) float array
        The loop, in order.
    labels : (n,) int array
        What to call its vertices.

    Returns
    -------
    (p, 2) int array
        Every inner vertex of either side with the vertex of the other side that is as far along.
    """
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    first, last = np.unravel_index(np.argmax(distance), distance.shape)
    n = len(points)
    sides = [
        np.arange(first, first + (last - first) % n + 1) % n,
        np.arange(first, first - (first - last) % n - 1, -1) % n,
    ]
    along = []
    for side in sides:
        travelled = np.concatenate([[0], np.cumsum(norm(np.diff(points[side], axis=0)))])
        along.append(travelled / travelled[-1])
    nearest = np.abs(along[0][:, None] - along[1][None])
    pairs = [(i, int(np.argmin(nearest[i]))) for i in range(1, len(sides[0]) - 1)]
    pairs += [(int(np.argmin(nearest[:, j])), j) for j in range(1, len(sides[1]) - 1)]
    return np.array([(labels[sides[0][i]], labels[sides[1][j]]) for i, j in pairs])
