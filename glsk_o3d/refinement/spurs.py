"""Tell limbs from branches that hardly leave the parts they grow from, and cut these."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..decisions import QUESTIONS, Decision
from ..numerics.polylines import arc_lengths, relative_distance
from ..numerics.vectors import TINY
from ..skeleton import Skeleton
from .evidence import Evidence
from .limbs import Limbs
from .merging import merge_into
from .sections import VertexPoints, measure_sections

SPUR_POINTS = 128  # speed: of a branch that are enough to say how far it reaches
SPUR_QUANTILE = 0.9  # fitted: share of a spur's points that its reach covers
FAR_OUT = 20.0  # fitted: half widths beyond which a protrusion says no more


def prune_spurs(skeleton: Skeleton, evidence: Evidence, least: float) -> tuple[Skeleton, list[Decision]]:
    """Cut branches whose points hardly stand out of the surface around the limbs that meet there.

    The points count, not the curve, since contraction shortens stubs as thick as they are long, and lets thin ones
    grow; and how far they leave the limbs that meet them, since along a part they may be anywhere. The limbs go on,
    straight, to where they meet: contraction draws them together in a sharp corner, and a spur into its tip is left.
    Another branch with an end may be a spur, too: it counts as no thicker than the junction.

    Of every junction the least probable limb goes first, until none is less probable than `least`; its points belong to
    the junction and have no normals any more. There is one decision for each branch that leaves a junction and has an
    end, cut or left; at its end.
    """
    decisions: list[Decision] = []
    given = skeleton
    while True:
        found = _with_forks(skeleton, list(_twigs(skeleton, evidence)))
        worst: dict[int, _Twig] = {}
        for twig in found:
            before = worst.get(twig.junction)
            if twig.probability < (before.probability if before else least):
                worst[twig.junction] = twig
        decisions += [
            Decision("limb", tuple(skeleton.vertices[twig.tip].tolist()), twig.probability, bool(worst))
            for twig in worst.values() or found
        ]
        if not worst:
            return replace(skeleton, normals=given.normals), decisions
        group = np.arange(len(skeleton.vertices))
        for twig in worst.values():
            group[twig.body] = twig.junction
        # points of a cut branch are farther from its junction than the surface there is: they have no say any more
        gone = np.isin(skeleton.vertex_of_point, np.concatenate([twig.body for twig in worst.values()]))
        normals = np.where(gone[:, None], np.nan, skeleton.normals)
        skeleton = merge_into(replace(skeleton, normals=normals), group)


def limb_facts(skeleton: Skeleton, evidence: Evidence) -> Iterator[tuple[int, dict[str, float]]]:
    """What speaks for every branch that leaves a junction and has an end: its leaf, and facts.

    The facts are: how far its points (all but a tenth) stand out of the surface around the other limbs, over its own
    half width, as a logarithm; how far along it the surface goes over to others; its mean confidence; and how round the
    part is at the junction.
    """
    return ((twig.tip, twig.facts) for twig in _twigs(skeleton, evidence))


class _Twig(NamedTuple):
    """A branch that leaves a junction and has an end."""

    junction: int
    body: np.ndarray  # its other vertices
    tip: int
    facts: dict[str, float]
    other: float = 1.0  # probability that the other prong is a limb

    @property
    def probability(self) -> float:
        return self.other * QUESTIONS["limb"].probability(self.facts)


def _twigs(skeleton: Skeleton, evidence: Evidence) -> Iterator[_Twig]:
    limbs, bonds = Limbs(skeleton, joined=True), evidence.bonds(skeleton)
    cloud, sections = VertexPoints(skeleton), measure_sections(skeleton)
    count = cloud.mass
    wide = sections.half_width
    roundness = np.nan_to_num(sections.half_thickness / np.maximum(wide, TINY))
    confidence, degree = np.nan_to_num(skeleton.confidence), skeleton.degree
    ending = np.zeros(len(degree), bool)
    for branch in limbs.branches:
        if 1 in degree[branch[[0, -1]]]:
            ending[branch] = degree[branch] < 3
    for k, branch in enumerate(limbs.branches):
        path = branch[::-1] if degree[branch[0]] == 1 else branch
        junction, tip = path[[0, -1]].tolist()
        if degree[tip] != 1 or degree[junction] < 3:
            continue
        body = branch[branch != junction]
        share = count[body] / count[body].sum()
        half = float(share @ wide[body])
        own = cloud.members.of(body)
        points = cloud.points[own[:: len(own) // SPUR_POINTS + 1]]
        out = np.clip(_standing_out(limbs, k, junction, points, ending), 0, FAR_OUT * half)
        facts = dict(
            protrusion=float(np.log(out / max(half, TINY) + 0.3)),
            web=_web(skeleton.vertices, path, *bonds),
            confidence=float(share @ confidence[body]),
            roundness=float(roundness[junction]),
        )
        yield _Twig(junction, body, tip, facts)


def _with_forks(skeleton: Skeleton, twigs: list[_Twig]) -> list[_Twig]:
    """Twigs, the less probable prong of every fork with the probability that both are limbs.

    A flat end draws two prongs of the curve into its corners, and each stands out of the other: where three branches
    meet, one of two with ends is a limb only if the other is one, too.
    """
    at: defaultdict[int, list[int]] = defaultdict(list)
    for number, twig in enumerate(twigs):
        if skeleton.degree[twig.junction] == 3:
            at[twig.junction].append(number)
    found = list(twigs)
    for numbers in at.values():
        less, *others = sorted(numbers, key=lambda number: twigs[number].probability)
        if others:
            found[less] = twigs[less]._replace(other=twigs[others[0]].probability)
    return found


def _web(vertices: np.ndarray, path: np.ndarray, pairs: np.ndarray, weight: np.ndarray) -> float:
    """Mean share of the way from its junction to its end at which a branch has bonds with others.

    Of a limb it is little, since the surface closes around it; of a strand in a flat part one half.
    """
    along, share = arc_lengths(vertices[path]), np.full(len(vertices), np.nan)
    share[path[1:]] = along[1:] / max(along[-1], TINY)
    shares = share[pairs]
    # those with the junction itself say nothing
    out = (np.isfinite(shares).sum(axis=1) == 1) & (pairs != path[0]).all(axis=1)
    return float(weight[out] @ np.nansum(shares[out], axis=1) / max(weight[out].sum(), TINY))


def _standing_out(limbs: Limbs, k: int, junction: int, points: np.ndarray, ending: np.ndarray) -> float:
    """How far the points of branch k stand out of the surface around the other limbs."""
    if len(points) == 0:
        return 0.0
    around = [i for i in limbs.at[limbs.region[junction]] if limbs.branch[i] != k]
    beside = [i for i in around if limbs.paths[i][0] == junction]
    anchor, foot, fits = limbs.meeting(around, limbs.vertices[junction])
    longer = np.flatnonzero(fits & ~limbs.short[[limbs.branch[i] for i in around]])
    radius = limbs.radius[[limbs.branch[around[i]] for i in longer]]
    surface = np.where(ending, np.minimum(limbs.surface, limbs.surface[junction]), limbs.surface)
    vertices = np.concatenate([limbs.vertices, anchor[longer], foot[longer]])
    more = len(limbs.vertices) + np.arange(2 * len(longer)).reshape(2, -1).T
    paths = [*(limbs.paths[i] for i in beside), *more]
    ratio, there = relative_distance(points, vertices, np.r_[surface, radius, radius], paths)
    return float(np.quantile((ratio - 1) * there, SPUR_QUANTILE))
