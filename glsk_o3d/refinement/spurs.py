"""Tell limbs from spurs, which hardly leave the part they grow from, and cut these."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..numerics.vectors import TINY, dot, norm
from ..report import Judgement
from ..skeleton import Skeleton
from .loops import surface_distance
from .merging import merge_vertices
from .scores import LIMB_WEIGHTS, probability

SPUR_QUANTILE = 0.9  # fitted: share of a spur's points that its reach covers
SPUR_CHUNK = 2**20  # measured: pairs of a point and an edge at a time: memory stays flat


def prune_spurs(skeleton: Skeleton, reach: float) -> Skeleton:
    """Cut branches that end in a leaf and whose points reach no farther than the surface around what they grow from.

    What counts is the points, not the curve: the contraction shortens stubs as thick as they are long, and lets thin
    ones grow. And it is how far they leave the branches that meet them, not how far they are from the junction: along
    a part they may be anywhere. Another branch with an end may be a spur, too, far from its points: it counts as no
    thicker than the junction. A branch whose points have no say goes.

    Parameters
    ----------
    skeleton : Skeleton
    reach : float
        Least distance of a branch's points (all but a tenth) from the other branches at its junction, over the distance
        from these to the surface there. Of every junction the least first, until there is none.

    Returns
    -------
    Skeleton
        Points of a cut spur belong to its junction.
    """
    while True:
        worst: dict[int, tuple[float, np.ndarray]] = {}
        for path, far in limb_reaches(skeleton):
            junction = int(path[0])
            if far < worst.get(junction, (reach,))[0]:
                worst[junction] = (far, path[1:])
        if not worst:
            return skeleton
        group, m = np.arange(len(skeleton.vertices)), len(skeleton.vertices)
        for junction, (_, spur) in worst.items():
            group[spur] = junction
        stay = np.flatnonzero(group == np.arange(m))
        # a junction stays what it was
        kept = {name: getattr(skeleton, name)[stay] for name in ("vertices", "radii", "confidence")}
        skeleton = replace(merge_vertices(skeleton, group), **kept)


def judge_limbs(skeleton: Skeleton) -> list[Judgement]:
    """How probably each branch that leaves a junction and has an end is a limb; at its end."""
    return [
        Judgement("limb", tuple(skeleton.vertices[path[-1]].tolist()), probability(LIMB_WEIGHTS, facts), False)
        for path, facts in limb_facts(skeleton)
    ]


def limb_facts(skeleton: Skeleton) -> Iterator[tuple[np.ndarray, dict[str, float]]]:
    """What speaks for every branch that leaves a junction and has an end: its reach, as a logarithm.

    Yields
    ------
    path : (p,) int array
        From the junction to the end.
    facts : dict of str to float
    """
    for path, far in limb_reaches(skeleton):
        yield path, dict(reach=float(np.log(far + 0.1)))


def limb_reaches(skeleton: Skeleton) -> Iterator[tuple[np.ndarray, float]]:
    """The reach, as `prune_spurs` defines it, of every branch that leaves a junction and has an end.

    Yields
    ------
    path : (p,) int array
        From the junction to the end.
    reach : float
        0 without points.
    """
    surface, degree = surface_distance(skeleton), skeleton.degree
    surface = np.where(surface > 0, surface, skeleton.radii)  # of vertices without points
    supporting = skeleton.supporting_points
    supporting = supporting[np.argsort(skeleton.vertex_of_point[supporting], kind="stable")]
    stop = np.cumsum(np.bincount(skeleton.vertex_of_point[supporting], minlength=len(degree)))
    start = np.concatenate([[0], stop[:-1]])
    branches, at = skeleton.branches, defaultdict(list)
    ending = np.zeros(len(degree), bool)
    for branch in branches:
        at[branch[0]].append(branch)
        at[branch[-1]].append(branch)
        if 1 in degree[branch[[0, -1]]]:
            ending[branch] = degree[branch] < 3
    for branch in branches:
        if sorted((degree[branch[[0, -1]]] == 1).tolist()) != [False, True]:
            continue
        path = branch if degree[branch[-1]] == 1 else branch[::-1]
        points = skeleton.points[np.concatenate([supporting[start[v] : stop[v]] for v in path[1:]])]
        others = [other for other in at[path[0]] if other is not branch]
        tubes = np.where(ending, np.minimum(surface, surface[path[0]]), surface)
        if not len(points):
            yield path, 0.0
            continue
        yield path, float(np.quantile(relative_distance(points, skeleton.vertices, tubes, others), SPUR_QUANTILE))


def relative_distance(
    points: np.ndarray, vertices: np.ndarray, surface: np.ndarray, paths: list[np.ndarray]
) -> np.ndarray:
    """Distance from the edge of some paths from which it is least over that to the surface, linear along an edge.

    Parameters
    ----------
    points : (n, 3) float array
    vertices : (M, 3) float array
    surface : (M,) float array
        Distance from each vertex to the surface.
    paths : list of (p,) int array

    Returns
    -------
    (n,) float array
        Over the distance to the surface at the nearest place of that edge.
    """
    a, b = (np.concatenate([path[part] for path in paths]) for part in (slice(-1), slice(1, None)))
    start, step = vertices[a], vertices[b] - vertices[a]
    length, tiny = norm(step), TINY
    direction = step / np.maximum(length, tiny)[:, None]
    # relative to one of them: products of coordinates far from the origin would cancel
    points, start = points - start[0], start - start[0]
    least = max(np.finfo(float).eps * np.abs(points).max(), tiny)  # of a line, which has no thickness but roundings
    found = np.empty(len(points))
    rows = max(SPUR_CHUNK // len(a), 1)
    for first in range(0, len(points), rows):
        p = points[first : first + rows]
        along = p @ direction.T - dot(start, direction)
        squared = (p**2).sum(axis=1)[:, None] - 2 * p @ start.T + (start**2).sum(axis=1)
        foot = np.clip(along, 0, length)
        distance = np.sqrt(np.maximum(squared + foot * (foot - 2 * along), 0))
        there = surface[a] + foot / np.maximum(length, tiny) * (surface[b] - surface[a])
        found[first : first + rows] = (distance / np.maximum(there, least)).min(axis=1)
    return found
