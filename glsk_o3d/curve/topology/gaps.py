"""Gaps that a scan or the contraction leaves: across which does the object go on?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ...data.decisions import logistic
from ...geometry.groups import quantile
from ...geometry.near_links import linked
from ...geometry.numbers import derived, fitted
from ...geometry.polylines import arc_lengths
from ...geometry.vectors import TINY, dot, norm
from ..curve import Curve
from ..numbers import CURVE
from ..surface import Evidence, Surface
from .question import Candidate, Question


@dataclass(frozen=True)
class GapNumbers:
    """Numbers of `Gaps`."""

    reach: float = fitted(6.0, "longest gap, in radii of the end")
    cosine: float = fitted(0.5, "least cosine between the bridge and the end")
    detour: float = fitted(3.0, "least way along the curve over that across the gap")
    least_winding: float = derived(-0.5, "relative winding number below which it says no more")
    most_winding: float = derived(1.3, "relative winding number above which it says no more")


GAPS = GapNumbers()

BRIDGE_SAMPLES = np.arange(1, 8)[:, None] / 8  # derived: places along a bridge, evenly


class _End(NamedTuple):
    """An end of the curve, in the units of the cloud."""

    leaf: int
    place: np.ndarray
    outward: np.ndarray  # unit vector, on along the branch
    radius: float  # median of the branch


class Gaps(Question):
    """Which ends go on across a gap, to other ends or to the side of something? An edge bridges it.

    The surest are bridged first. There is one decision for each end that points at something, of its likeliest bridge.
    """

    about, repeats = "gap", False
    weights: ClassVar[Mapping[str, float]] = dict(constant=-1.7, winding=3.7, cap=-1.2)  # fitted

    def candidates(self, evidence: Evidence, least: float) -> list[Candidate]:
        """One for each end, see `gap_facts`, the likeliest first."""
        asked = [(logistic(self.weights, facts), pair, facts) for pair, facts in gap_facts(evidence)]
        answers, used = list[Candidate](), set[int]()
        for probability, pair, facts in sorted(asked, key=lambda candidate: -candidate[0]):
            if used.isdisjoint(pair):
                used.update(pair)
                place = evidence.curve.vertices[list(pair)].mean(axis=0)
                answers.append(Candidate(sorted(pair), place, facts, probability, self.changes(probability, least)))
        return answers

    def change(self, evidence: Evidence, chosen: Sequence[Candidate]) -> Curve:
        """Add the bridges."""
        curve, bridges = evidence.curve, np.array([candidate.part for candidate in chosen])
        edges = np.unique(np.concatenate([curve.edges, bridges]), axis=0)
        return curve.changed(edges=edges).with_gaps(curve.vertices[bridges])


def gap_facts(evidence: Evidence) -> Iterator[tuple[tuple[int, int], dict[str, float]]]:
    """What speaks for and against a bridge, for every end and the places that it points at: (leaf, vertex), and facts.

    The facts are: the least winding number along the bridge, over the median on the curve; and how far the end is
    closed: the flux of its outward normals through its cross-section, 1 for a cap and 0 for a tube cut open, as a
    logarithm.
    """
    curve, surface = evidence.curve, evidence.surface
    ends = list(_ends(curve))
    if not ends or not len(surface.points):
        return
    typical = quantile(evidence.winding)
    if typical < CURVE.inside:
        return  # parts too thin to have an inside, which could go on across a gap
    travelled = dijkstra(linked(curve.vertices, curve.edges), indices=[end.leaf for end in ends])
    bridges = [(end, other) for i, end in enumerate(ends) for other in _aims(curve, ends, i, travelled)]
    if not bridges:
        return
    across = [curve.vertices[other] - end.place for end, other in bridges]
    samples = [end.place + BRIDGE_SAMPLES * gap for (end, *_), gap in zip(bridges, across, strict=True)]
    winding = surface.winding(np.concatenate(samples)).reshape(len(bridges), -1).min(axis=1) / typical
    for (end, other), least in zip(bridges, winding, strict=True):
        facts = dict(
            winding=float(np.clip(least, GAPS.least_winding, GAPS.most_winding)),
            cap=float(np.log(_cap(end, surface) + CURVE.little)),
        )
        yield (end.leaf, other), facts


def _aims(curve: Curve, ends: list[_End], i: int, travelled: np.ndarray) -> Iterator[int]:
    """Vertices that end i points at across a gap: the nearest other end, and the nearest place else.

    `travelled` (e, M) are the lengths along the curve from every end to every vertex.
    """
    end, leaves = ends[i], [other.leaf for other in ends]
    across = curve.vertices - end.place
    away = np.maximum(norm(across), TINY)
    cosine = across @ end.outward / away
    is_end = curve.degree == 1
    empty = away - np.where(is_end, 0, curve.radii)  # of the way across, what is outside of the curve's ball there
    is_near = (empty < GAPS.reach * end.radius) & (cosine > GAPS.cosine) & (curve.degree > 0)
    aims = is_near & _is_detour(travelled[i], away)
    # a place that is reached by way of another end lies behind that end, and is not asked for itself
    by_ends = (away[leaves][:, None] + travelled)[aims[leaves]]
    behind = ~_is_detour(by_ends, away).all(axis=0)
    cost = empty + away * (1 - cosine) / 2
    for kind in (is_end, ~is_end & ~behind):
        rows = np.flatnonzero(aims & kind)
        if len(rows):
            yield int(rows[np.argmin(cost[rows])])


def _is_detour(length: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Whether a way of some length is long for how far away its end is."""
    detour: np.ndarray = length > GAPS.detour * away
    return detour


def _cap(end: _End, surface: Surface) -> float:
    """Flux of the normals that look out of an end, through its cross-section, at least 0."""
    offset = surface.points - end.place
    ahead = offset @ end.outward
    beside = dot(offset, offset) - ahead**2
    near = (ahead > -end.radius) & (ahead < CURVE.beside * end.radius)
    near &= beside < (CURVE.beside * end.radius) ** 2
    facing = np.maximum(surface.normals[near] @ end.outward, 0)
    return float(surface.areas[near] @ facing / max(np.pi * end.radius**2, TINY))


def _ends(curve: Curve) -> Iterator[_End]:
    """Leaves, with the directions in which their branches end, and the median radii of these."""
    for branch in curve.branches:
        radius = quantile(curve.radii[branch])
        for path in (branch, branch[::-1]):
            if curve.degree[path[0]] == 1 and radius > 0:
                places = curve.vertices[path]
                back = int(np.searchsorted(arc_lengths(places)[1:], CURVE.heading * radius)) + 1
                direction = places[0] - places[min(back, len(path) - 1)]
                yield _End(int(path[0]), places[0], direction / max(np.linalg.norm(direction), TINY), radius)
