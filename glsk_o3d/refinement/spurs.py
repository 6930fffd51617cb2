"""Tell limbs from branches that hardly leave the parts they grow from, and cut these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..numerics.polylines import arc_lengths, relative_distance
from ..numerics.vectors import TINY, dot
from ..report import Judgement
from ..skeleton import Skeleton
from .evidence import Evidence
from .junctions import AXIS_LENGTH, Limbs
from .merging import merge_into
from .scores import LIMB_WEIGHTS, probability
from .sections import measure_sections

SPUR_POINTS = 128  # measured: of a branch that are enough to say how far it reaches
LEAST_THICKNESS = 1e-6  # derived: over the half width; of a flat sheet without any
SPUR_QUANTILE = 0.9  # fitted: share of a spur's points that its reach covers


def prune_spurs(skeleton: Skeleton, evidence: Evidence, least: float) -> tuple[Skeleton, list[Judgement]]:
    """Cut branches whose points hardly reach farther than the surface around the limbs that meet there.

    What counts is the points, not the curve: the contraction shortens stubs as thick as they are long, and lets thin
    ones grow. And it is how far they leave the limbs that meet them, not how far they are from the junction: along
    a part they may be anywhere. The limbs go on, straight, to where they meet, see `Limbs.meeting`: the contraction
    draws them together in a sharp corner, and a spur into its tip is left. Another branch with an end may be a spur,
    too, far from its points: it counts as no thicker than the junction. A branch whose points have no say goes.

    A short branch between two junctions goes, too, and the two become one, if all limbs around meet in one place.

    Parameters
    ----------
    skeleton : Skeleton
    least : float
        Probability of a limb below which a branch is cut. Of every junction the least probable first, until there is
        none.

    Returns
    -------
    Skeleton
        Points of a cut branch belong to its junction.
    judgements : list of Judgement
        One for each branch that leaves a junction and has an end, cut or left; at its end.
    """
    judgements: list[Judgement] = []
    while True:
        worst: dict[int, tuple[float, int]] = {}
        found = list(_reaches(skeleton, evidence))
        for i, branch in enumerate(found):
            for v in branch.ends:
                if branch.probability < least and branch.alone < worst.get(v, (np.inf,))[0]:
                    worst[v] = (branch.alone, i)
        chosen = {i for _, i in worst.values() if all(v in worst and worst[v][1] == i for v in found[i].ends)}
        some = [found[i] for i in chosen] if chosen else found
        judgements += [
            Judgement("limb", tuple(skeleton.vertices[branch.tip].tolist()), branch.probability, bool(chosen))
            for branch in some
            if branch.tip is not None
        ]
        if not chosen:
            return skeleton, judgements
        group, vertices = np.arange(len(skeleton.vertices)), skeleton.vertices.copy()
        for branch in some:
            ends = branch.ends
            group[branch.body] = group[ends] = ends[0]
            vertices[ends[0]] = vertices[ends].mean(axis=0)
        skeleton = merge_into(replace(skeleton, vertices=vertices), group)


def limb_facts(skeleton: Skeleton, evidence: Evidence) -> Iterator[tuple[int, dict[str, float]]]:
    """What speaks for every branch that leaves a junction and has an end: its reach, as a logarithm.

    The reach is the distance of the branch's points (all but a tenth) from the limbs around it, over the distance from
    these to the surface there.

    Yields
    ------
    leaf : int
    facts : dict of str to float
    """
    return ((branch.tip, branch.facts) for branch in _reaches(skeleton, evidence) if branch.tip is not None)


class _Reach(NamedTuple):
    """How far the points of a branch that may go leave the limbs around it."""

    ends: list[int]  # its junctions
    body: np.ndarray  # its other vertices
    tip: int | None
    reach: float
    fork: float  # how far the farthest prong of the fork that it is part of does
    web: float  # 0 between two junctions

    @property
    def facts(self) -> dict[str, float]:
        return dict(reach=float(np.log(min(self.reach, self.fork) + 0.1)), web=self.web)

    @property
    def probability(self) -> float:
        return probability(LIMB_WEIGHTS, self.facts)

    @property
    def alone(self) -> float:
        """The probability without the fork: of its prongs the least goes, and not what goes straight on."""
        return probability(LIMB_WEIGHTS, {**self.facts, "reach": float(np.log(self.reach + 0.1))})


def _reaches(skeleton: Skeleton, evidence: Evidence) -> Iterator[_Reach]:
    limbs, owned, web = Limbs(skeleton, joined=True), _Owned(skeleton), _Web(skeleton, evidence)
    forks = _forks(skeleton, limbs, owned)
    ending = np.zeros(len(skeleton.vertices), bool)
    leaves = [1 in skeleton.degree[branch[[0, -1]]] for branch in limbs.branches]
    for branch, leaf in zip(limbs.branches, leaves, strict=True):
        if leaf:
            ending[branch] = skeleton.degree[branch] < 3
    for k, (branch, leaf) in enumerate(zip(limbs.branches, leaves, strict=True)):
        ends = [v for v in dict.fromkeys(branch[[0, -1]].tolist()) if skeleton.degree[v] > 2]
        if ends and (leaf or (limbs.inner[k] and limbs.short[k])):
            body = branch[~np.isin(branch, ends)]
            tip = next((v for v in branch[[0, -1]].tolist() if skeleton.degree[v] == 1), None)
            reach = float(_farthest(limbs, k, ends, owned.points(body), ending))
            along = web.of(branch) if tip is not None else 0.0
            yield _Reach(ends, body, tip, reach, forks.get(k, np.inf), along)


def _forks(skeleton: Skeleton, limbs: Limbs, owned: _Owned) -> dict[int, float]:
    """Of branches that a limb ends in how far the one of them that leaves it farthest does, straight on.

    The contraction draws a flat end into its corners: what is left of it is a fork, of which no prong leaves the
    section of the limb before it. Distances are over the half axes of that section.
    """
    sections, degree = measure_sections(skeleton), skeleton.degree
    found: dict[int, float] = {}
    for junction in skeleton.junctions.tolist():
        here = [k for k in limbs.at[limbs.region[junction]] if limbs.paths[k][0] == junction]
        leaf = [degree[limbs.paths[k][-1]] == 1 for k in here]
        length = [arc_lengths(skeleton.vertices[limbs.paths[k]])[-1] for k in here]
        for k, own in zip(here, leaf, strict=True):
            if sum(leaf) - own < len(here) - 1 or length[here.index(k)] < max(length):
                continue
            anchor, way, start = limbs.axis(k)
            path = limbs.paths[k]
            along = arc_lengths(skeleton.vertices[path])
            run = path[(along >= start) & (along <= start + AXIS_LENGTH * limbs.radius[limbs.branch[k]])]
            if not len(run):
                continue
            wide, thick = np.median(sections.half_width[run]), np.median(sections.half_thickness[run])
            if not wide > 0:  # a line has no section that anything could be inside
                continue
            thick = max(thick, LEAST_THICKNESS * wide)
            middle = run[len(run) // 2]
            reach = 0.0
            for prong in (limbs.paths[other][1:] for other in here if other != k):
                off = owned.points(prong) - anchor
                off = off - (off @ way)[:, None] * way
                aside = off @ sections.across[middle]
                rest = np.sqrt(np.maximum(dot(off, off) - aside**2, 0))
                far = np.hypot(aside / wide, rest / thick)
                reach = max(reach, float(np.quantile(far, SPUR_QUANTILE)) if len(off) else 0.0)
            found.update((limbs.branch[other], reach) for other in here if other != k)
    return found


class _Web:
    """How far along a branch the surface goes over to others."""

    def __init__(self, skeleton: Skeleton, evidence: Evidence) -> None:
        self._skeleton = skeleton
        self._pairs, self._weight = evidence.bonds(skeleton)

    def of(self, branch: np.ndarray) -> float:
        """Mean share of the way from its junction to its end at which a branch is bonded to others.

        Of a limb it is little, since the surface closes around it; of a strand in a flat part one half.
        """
        if self._skeleton.degree[branch[0]] == 1:
            branch = branch[::-1]
        along = arc_lengths(self._skeleton.vertices[branch])
        share = np.full(len(self._skeleton.vertices), np.nan)
        share[branch[1:]] = along[1:] / max(along[-1], TINY)
        shares = share[self._pairs]
        # those with the junction itself say nothing
        out = (np.isfinite(shares).sum(axis=1) == 1) & (self._pairs != branch[0]).all(axis=1)
        weight = self._weight[out]
        return float(weight @ np.nansum(shares[out], axis=1) / max(weight.sum(), TINY))


class _Owned:
    """The points that each vertex owns."""

    def __init__(self, skeleton: Skeleton) -> None:
        supporting = skeleton.supporting_points
        vertex = skeleton.vertex_of_point[supporting]
        self._points = skeleton.points[supporting[np.argsort(vertex, kind="stable")]]
        self._stop = np.cumsum(np.bincount(vertex, minlength=len(skeleton.vertices)))

    def points(self, vertices: np.ndarray) -> np.ndarray:
        """Those of some vertices; of many every so-manieth."""
        parts = [self._points[self._stop[v - 1] if v else 0 : self._stop[v]] for v in vertices.tolist()]
        found = np.concatenate(parts) if parts else np.empty((0, 3))
        return found[:: len(found) // SPUR_POINTS + 1]


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
