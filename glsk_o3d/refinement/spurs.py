"""Cut branches that hardly leave the parts they grow from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.polylines import relative_distance
from ..skeleton import Skeleton
from .junctions import Limbs
from .merging import merge_vertices

SPUR_QUANTILE = 0.9  # fitted: share of a spur's points that its reach covers


def prune_spurs(skeleton: Skeleton, reach: float) -> Skeleton:
    """Cut branches whose points reach no farther than the surface around the limbs that meet there.

    What counts is the points, not the curve: the contraction shortens stubs as thick as they are long, and lets thin
    ones grow. And it is how far they leave the limbs that meet them, not how far they are from the junction: along
    a part they may be anywhere. The limbs go on, straight, to where they meet, see `Limbs.meeting`: the contraction
    draws them together in a sharp corner, and a spur into its tip is left. Another branch with an end may be a spur,
    too, far from its points: it counts as no thicker than the junction. A branch whose points have no say goes.

    A short branch between two junctions goes, too, and the two become one, if all limbs around meet in one place.

    Parameters
    ----------
    skeleton : Skeleton
    reach : float
        Least distance of a branch's points (all but a tenth) from the limbs around it, over the distance from these to
        the surface there. Of every junction the least first, until there is none.

    Returns
    -------
    Skeleton
        Points of a cut branch belong to its junction.
    """
    while True:
        limbs, owned = Limbs(skeleton, joined=True), _Owned(skeleton)
        ending = np.zeros(len(skeleton.vertices), bool)
        ends, worst = [], {}
        for branch in limbs.branches:
            ends.append([v for v in dict.fromkeys(branch[[0, -1]].tolist()) if skeleton.degree[v] > 2])
            if 1 in skeleton.degree[branch[[0, -1]]]:
                ending[branch] = skeleton.degree[branch] < 3
        for k, branch in enumerate(limbs.branches):
            inner, leaf = limbs.inner[k], 1 in skeleton.degree[branch[[0, -1]]]
            if not ends[k] or not (leaf or (inner and limbs.short[k])):
                continue
            body = branch[~np.isin(branch, ends[k])]
            far = _farthest(limbs, k, ends[k], owned.points(body), ending)
            for v in ends[k]:
                if far < worst.get(v, (reach,))[0]:
                    worst[v] = (far, k, body)
        cut = {k: body for _, k, body in worst.values() if all(v in worst and worst[v][1] == k for v in ends[k])}
        if not cut:
            return skeleton
        group, vertices = np.arange(len(skeleton.vertices)), skeleton.vertices.copy()
        for k, body in cut.items():
            group[body] = group[ends[k]] = ends[k][0]
            vertices[ends[k][0]] = vertices[ends[k]].mean(axis=0)
        stay = np.unique(group)
        # a junction stays what it was
        kept = {"vertices": vertices[stay], "radii": skeleton.radii[stay], "confidence": skeleton.confidence[stay]}
        skeleton = replace(merge_vertices(skeleton, group), **kept)


class _Owned:
    """The points that each vertex owns."""

    def __init__(self, skeleton: Skeleton) -> None:
        supporting = skeleton.supporting_points
        vertex = skeleton.vertex_of_point[supporting]
        self._points = skeleton.points[supporting[np.argsort(vertex, kind="stable")]]
        self._stop = np.cumsum(np.bincount(vertex, minlength=len(skeleton.vertices)))

    def points(self, vertices: np.ndarray) -> np.ndarray:
        parts = [self._points[self._stop[v - 1] if v else 0 : self._stop[v]] for v in vertices.tolist()]
        return np.concatenate(parts) if parts else np.empty((0, 3))


def _farthest(limbs: Limbs, k: int, ends: list[int], points: np.ndarray, ending: np.ndarray) -> float:
    """How far the points of branch k leave the limbs around it; infinitely far if it may not go."""
    around = [i for v in {int(limbs.region[v]) for v in ends} for i in limbs.at[v] if limbs.branch[i] != k]
    beside = [i for i in around if limbs.paths[i][0] in ends]
    if len(ends) == 2:
        around = beside
        if any(set(limbs.paths[i][[0, -1]].tolist()) == set(ends) for i in beside):
            return np.inf  # a loop would close
    meeting = limbs.meeting(around, limbs.vertices[ends].mean(axis=0))
    if len(ends) == 2 and not meeting.fits[meeting.say].all():
        return np.inf
    if len(points) == 0:
        return 0.0
    longer = np.flatnonzero(meeting.fits & ~limbs.short[[limbs.branch[i] for i in around]])
    radius = limbs.radius[[limbs.branch[around[i]] for i in longer]]
    surface = np.where(ending, np.minimum(limbs.surface, limbs.surface[ends].max()), limbs.surface)
    vertices = np.concatenate([limbs.vertices, meeting.anchor[longer], meeting.foot[longer]])
    more = len(limbs.vertices) + np.arange(2 * len(longer)).reshape(2, -1).T
    paths = [*(limbs.paths[i] for i in beside), *more]
    return np.quantile(relative_distance(points, vertices, np.r_[surface, radius, radius], paths), SPUR_QUANTILE)
