"""Open or close loops that are not there."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..numerics.cycles import inscribed_circle, minimum_cycle_basis
from ..numerics.groups import group_median
from ..numerics.neighbourhoods import nearest_neighbours
from .merging import merge_vertices
from .triangles import collapse_triangles

NEAR = 8  # points, itself included, that are near to a point
THREAD = 5  # pairs of near points, each seen from both sides; fewer are a thread


def surface_distance(skeleton):
    """Median distance from each vertex to the input points it owns, (M,) float array."""
    owned = skeleton.witnesses
    owner = skeleton.vertex_of_point[owned]
    distance = np.linalg.norm(skeleton.points[owned] - skeleton.vertices[owner], axis=1)
    return group_median(distance, owner, len(skeleton.vertices))


def links(skeleton):
    """Pairs of near points whose vertices each edge joins, (E,) int array; a point's nearest 7 are near to it."""
    owned = skeleton.witnesses
    owner, m = skeleton.vertex_of_point[owned], len(skeleton.vertices)
    if len(owned) == 0:
        return np.zeros(len(skeleton.edges), int)
    near = owner[nearest_neighbours(skeleton.points[owned], min(NEAR, len(owned)))[1].reshape(len(owned), -1)]
    pairs = np.sort(np.column_stack([np.repeat(owner, near.shape[1]), near.ravel()]), axis=1)
    keys, count = np.unique(pairs @ [m, 1], return_counts=True)
    edges = skeleton.edges @ [m, 1]
    at = np.minimum(np.searchsorted(keys, edges), len(keys) - 1)
    return np.where(keys[at] == edges, count[at], 0)


def close_loops(skeleton, opening, weak):
    """Zip up the loops whose opening is not wider than the tube that makes them; cut those held by a thread.

    The opening of a loop is the radius of the largest circle inside it; the tube's is the median over the loop of the
    distance from its vertices to the surface. A wide loop hangs by a thread where it has an edge that hardly any near
    points cross: there two parts touch, or an outlier lies between them. All false loops of a minimum cycle basis are
    treated at once, until there are none.

    Parameters
    ----------
    skeleton : Skeleton
    opening : float
        Least opening of a true loop over the radius of its tube.
    weak : float
        Pairs of near points across an edge over the median of its loop, below which it is cut if they are few.

    Returns
    -------
    Skeleton
        Without triangles.
    """
    while True:
        cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
        if not cycles:
            return skeleton
        thickness = surface_distance(skeleton)
        narrow = [
            inscribed_circle(skeleton.vertices[cycle])[1] < opening * np.median(thickness[cycle]) for cycle in cycles
        ]
        cut = _threads(skeleton, [c for c, shut in zip(cycles, narrow, strict=True) if not shut], weak) if weak else []
        if len(cut):
            skeleton = replace(skeleton, edges=np.delete(skeleton.edges, cut, axis=0))
            continue
        false = [cycle for cycle, shut in zip(cycles, narrow, strict=True) if shut]
        if not false:
            return skeleton
        pairs = np.concatenate([zip_pairs(skeleton.vertices[cycle], cycle) for cycle in false])
        n = len(skeleton.vertices)
        joined = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n))
        skeleton = collapse_triangles(merge_vertices(skeleton, connected_components(joined, directed=False)[1]))


def _threads(skeleton, cycles, weak):
    """The weakest edge of each cycle that hangs by a thread."""
    count, m = links(skeleton), len(skeleton.vertices)
    keys = skeleton.edges @ [m, 1]
    cut = []
    for cycle in cycles:
        steps = np.searchsorted(keys, np.sort(np.column_stack([cycle, np.roll(cycle, -1)]), axis=1) @ [m, 1])
        weakest = steps[np.lexsort((steps, count[steps]))[0]]
        if count[weakest] < min(weak * np.median(count[steps]), THREAD):
            cut.append(weakest)
    return np.unique(cut)


def zip_pairs(points, labels):
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
        travelled = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points[side], axis=0), axis=1))])
        along.append(travelled / travelled[-1])
    nearest = np.abs(along[0][:, None] - along[1][None])
    pairs = [(i, int(np.argmin(nearest[i]))) for i in range(1, len(sides[0]) - 1)]
    pairs += [(int(np.argmin(nearest[:, j])), j) for j in range(1, len(sides[1]) - 1)]
    return np.array([(labels[sides[0][i]], labels[sides[1][j]]) for i, j in pairs])
