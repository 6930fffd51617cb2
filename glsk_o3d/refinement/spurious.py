"""Drop spurious twigs: traced ones that are no more than the scatter of the points around what they grow from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..numerics.groups import group_median
from ..numerics.near_links import linked, steps
from ..numerics.nearest_edges import incident_edges, nearest_on_edges
from ..numerics.vectors import norm
from ..skeleton import Skeleton
from .merging import merge_into


def spread_around(skeleton: Skeleton) -> np.ndarray:
    """Median distance from the curve to the points around every vertex and its neighbours, (M,) float array.

    Of points on a tube its radius, and outliers have little say.
    """
    m, edges = len(skeleton.vertices), skeleton.edges
    some = np.flatnonzero(skeleton.vertex_of_point >= 0)
    vertex, points = skeleton.vertex_of_point[some], skeleton.points[some]
    edge, t = nearest_on_edges(skeleton.vertices, edges, incident_edges(edges, m)[vertex], points)
    start, stop = skeleton.vertices[edges[edge]].transpose(1, 0, 2)
    away = norm(points - start - t[:, None] * (stop - start))
    around = steps(linked(skeleton.vertices, edges))[vertex]
    return group_median(np.repeat(away, np.diff(around.indptr)), around.indices, m)


def drop_spurious(
    skeleton: Skeleton, traced: np.ndarray, radii: float, root: int | None = None
) -> tuple[Skeleton, np.ndarray]:
    """Drop twigs whose tip is as near to the rest as points scatter there; say which vertices stay, in their order.

    Of N points that scatter normally around a curve, with a median distance of r, one is expected to be farther off
    than ``r sqrt(log2 N)``. Only twigs of `traced` (M,) vertices, whose radius is the spread of their points, are
    dropped, and not the vertex `root`. From a part that has a surface a tip must be `radii` of its radii away. Points
    of a twig belong to the vertex that it grew from.
    """
    stays = np.arange(len(skeleton.vertices))
    scatter = math.sqrt(math.log2(max(int((skeleton.vertex_of_point >= 0).sum()), 1)))
    while True:
        forks, tips, twigs = _twigs(skeleton, traced, root)
        if not twigs:
            return skeleton, stays
        rest = np.setdiff1d(np.arange(len(traced)), np.concatenate(twigs))
        away, nearest = cKDTree(skeleton.vertices[rest]).query(skeleton.vertices[tips])
        beside = rest[nearest]
        beyond = away - np.where(traced[beside], scatter, radii) * skeleton.radii[beside]
        order = np.argsort(beyond)
        # of each fork the least, since the others may be what is left of the limb
        order = order[np.unique(forks[order], return_index=True)[1]]
        chosen = order[beyond[order] < 0].tolist()
        if not chosen:
            return skeleton, stays
        group = np.arange(len(traced))
        for twig in chosen:
            group[twigs[twig]] = forks[twig]
        left = np.unique(group)
        skeleton, traced, stays = merge_into(skeleton, group), traced[left], stays[left]
        skeleton = replace(skeleton, radii=np.where(traced, spread_around(skeleton), skeleton.radii))


def _twigs(skeleton: Skeleton, traced: np.ndarray, root: int | None) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Of traced branches that end the junction that they leave, their tip, and their vertices but for the junction."""
    found = []
    for path in skeleton.branches:
        path = path[::-1] if skeleton.degree[path[0]] == 1 else path
        if skeleton.degree[path[0]] > 2 and skeleton.degree[path[-1]] == 1 and traced[path[1:]].all():
            found.append(path)
    found = [path for path in found if root not in path[1:]]
    forks, tips = np.array([(path[0], path[-1]) for path in found], int).reshape(-1, 2).T
    return forks, tips, [path[1:] for path in found]
