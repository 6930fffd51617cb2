"""Close loops that nothing passes through."""

from __future__ import annotations

import numpy as np

from ..numerics.components import component_labels
from ..numerics.cycles import inscribed_circle, minimum_cycle_basis
from ..numerics.groups import group_median
from ..numerics.vectors import TINY, norm
from ..report import Judgement
from ..skeleton import Skeleton
from .evidence import Evidence
from .merging import merge_vertices
from .scores import HANDLE_WEIGHTS, probability
from .triangles import collapse_triangles

SHORTEST_LOOP = 3  # derived: a triangle has nothing to zip up
HOLE_SHARE = 0.6  # fitted: of the largest circle in a loop, the part of it that is asked
LEAST_INSIDE = 0.2  # derived: winding number on an axis, of which next to nothing was seen
DIRECTIONS = np.column_stack([f(np.arange(6) * np.pi / 3) for f in (np.cos, np.sin)])  # derived: six, evenly


def surface_distance(skeleton: Skeleton) -> np.ndarray:
    """Median distance from each vertex to the input points it owns, (M,) float array."""
    supporting = skeleton.supporting_points
    vertex = skeleton.vertex_of_point[supporting]
    distance = norm(skeleton.points[supporting] - skeleton.vertices[vertex])
    return group_median(distance, vertex, len(skeleton.vertices))


def close_loops(skeleton: Skeleton, evidence: Evidence, least: float) -> tuple[Skeleton, list[Judgement]]:
    """Zip up the loops that are probably no handles, until there are none.

    Parameters
    ----------
    skeleton : Skeleton
        Fitted to its axis.
    evidence : Evidence
    least : float
        Probability of a handle below which a loop of a minimum cycle basis is zipped up.

    Returns
    -------
    Skeleton
        Without triangles.
    judgements : list of Judgement
        One for each loop, zipped up or left.
    """
    judgements: list[Judgement] = []
    while True:
        m = len(skeleton.vertices)
        cycles = minimum_cycle_basis(m, skeleton.edges, skeleton.edge_lengths)
        zipped, kept, found = [], [], loop_facts(skeleton, cycles, evidence)
        for cycle, (facts, centre) in zip(cycles, found, strict=True):
            chance = probability(HANDLE_WEIGHTS, facts)
            false = chance < least and len(cycle) > SHORTEST_LOOP
            (judgements if false else kept).append(Judgement("loop", tuple(centre.tolist()), chance, false))
            if false:
                zipped.append(cycle)
        if not zipped:
            return skeleton, judgements + kept
        pairs = np.concatenate([zip_pairs(skeleton.vertices[cycle], cycle) for cycle in zipped])
        skeleton = collapse_triangles(merge_vertices(skeleton, component_labels(m, pairs)))


def loop_facts(
    skeleton: Skeleton, cycles: list[np.ndarray], evidence: Evidence
) -> list[tuple[dict[str, float], np.ndarray]]:
    """What speaks for and against that each of some loops is a handle, and where the middle of its hole is.

    The facts are: how wide it opens, the radius of the largest circle inside it over the distance of the surface, as a
    logarithm; the least winding number in that circle, over the median along the loop, since a handle is one if no
    disc that spans it stays inside; and the mean confidence.

    Parameters
    ----------
    skeleton : Skeleton
    cycles : list of (n,) int array
    evidence : Evidence
    """
    if not cycles:
        return []
    surface, found = surface_distance(skeleton), []
    winding = evidence.winding(skeleton.vertices)
    for cycle in cycles:
        points = skeleton.vertices[cycle]
        centre, radius = inscribed_circle(points)
        axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][:2]
        hole = evidence.winding(centre + HOLE_SHARE * radius * np.vstack([np.zeros(3), DIRECTIONS @ axes])).min()
        inside = max(float(np.median(winding[cycle])), LEAST_INSIDE)
        facts = dict(
            opening=float(np.log(radius / max(float(np.median(surface[cycle])), TINY) + 0.1)),
            winding=float(np.clip(hole / inside, -0.5, 1.5)),
            confidence=float(np.nan_to_num(skeleton.confidence[cycle]).mean()),
        )
        found.append((facts, centre))
    return found


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
