"""Limbs that run beside another one begin where they leave it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..numerics.polylines import arc_lengths, relative_distance
from ..numerics.vectors import dot, norm
from ..skeleton import Skeleton
from .junctions import AXIS_LEAVES, Limbs
from .merging import drop_edges, merge_into

# derived: how far from its junction, in radii of the other, a limb's axis passes at least: a tube's width
REATTACH_FROM = 2.0


class _Beside(NamedTuple):
    """A limb that runs beside another one from their junction."""

    gain: float  # how much shorter the skeleton gets
    inside: np.ndarray  # the vertices of the limb beside the other, from the junction
    first: int  # the vertex after these
    other: np.ndarray  # the path of the other limb
    foot: int  # the vertex of the other where the limb's axis passes


def reattach_limbs(skeleton: Skeleton) -> Skeleton:
    """Let limbs that run beside a thicker one, inside its tube, begin where their axis meets the axis of the other.

    The contraction draws a limb that leaves a part along it, and the limb's own curve goes on inside. The straight line
    on from where it leaves says where it belongs. Those that shorten the skeleton most go first; a limb that has to do
    with one of these waits for the next round.

    Returns
    -------
    Skeleton
        Points of the vertices inside belong to the nearest vertices of the other limb.
    """
    while True:
        limbs = Limbs(skeleton, joined=False)
        found = [
            beside
            for here in [limbs.at[junction] for junction in skeleton.junctions.tolist()]
            for limb in here
            for other in here
            if (beside := _beside(limbs, limb, other)) is not None
        ]
        if not found:
            return skeleton
        chosen: list[_Beside] = []
        used: set[int] = set()
        for beside in sorted(found, key=lambda beside: -beside.gain):
            touched = {beside.first, *beside.inside.tolist(), *beside.other.tolist()}
            if used.isdisjoint(touched):
                chosen.append(beside)
                used |= touched
        skeleton = _reattached(skeleton, chosen)


def _beside(limbs: Limbs, limb: int, other: int) -> _Beside | None:
    radius = limbs.radius[limbs.branch[other]]
    path, along_path = limbs.paths[limb], limbs.paths[other]
    if limbs.branch[limb] == limbs.branch[other] or limbs.radius[limbs.branch[limb]] > radius:
        return None
    if path[-1] == along_path[-1]:
        return None  # a loop would close
    anchor, way, start = limbs.axis(limb)
    places = limbs.vertices[along_path]
    further = np.maximum(dot(places - anchor, way), 0)
    miss = norm(places - anchor - further[:, None] * way)
    foot = int(np.argmin(miss))
    far = arc_lengths(places)[foot]
    length = arc_lengths(limbs.vertices[path])
    inside = path[length <= start]
    gain = start - float(np.linalg.norm(places[foot] - anchor))
    if miss[foot] > radius or far <= REATTACH_FROM * radius or gain <= 0 or not 1 < len(inside) < len(path):
        return None
    run = limbs.vertices[path[length <= min(start, far)]]
    if (relative_distance(run, limbs.vertices, limbs.surface, [along_path]) > AXIS_LEAVES).any():
        return None
    return _Beside(gain, inside, int(path[len(inside)]), along_path, int(along_path[foot]))


def _reattached(skeleton: Skeleton, chosen: list[_Beside]) -> Skeleton:
    group, gone, new = np.arange(len(skeleton.vertices)), [], []
    for beside in chosen:
        chain = np.append(beside.inside, beside.first)
        gone.append(np.sort(np.column_stack([chain[:-1], chain[1:]]), axis=1))
        new.append(sorted((beside.first, beside.foot)))
        _, nearest = cKDTree(skeleton.vertices[beside.other]).query(skeleton.vertices[beside.inside[1:]])
        group[beside.inside[1:]] = beside.other[nearest]
    left = drop_edges(skeleton, np.concatenate(gone)).edges
    edges = np.unique(np.concatenate([left, new]), axis=0)
    return merge_into(replace(skeleton, edges=edges), group)
