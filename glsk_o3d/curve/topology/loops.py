"""Loops: which are handles of the object?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...data.decisions import logistic
from ...geometry.cycles import minimum_cycle_basis, places_inside
from ...geometry.groups import component_labels, group_rank, quantile
from ...geometry.near_links import link_growth
from ...geometry.numbers import fitted, precision, speed
from ...geometry.polylines import arc_lengths
from ...geometry.vectors import TINY
from ..curve import Curve
from ..merging import collapse_triangles, drop_edges, merge_vertices
from ..numbers import CURVE
from ..surface import Evidence, Memo, Surface
from ..thin.detect import SpacedPoints
from .question import Candidate, Question


@dataclass(frozen=True)
class LoopNumbers:
    """Numbers of `Loops`."""

    wide: float = fitted(1.4, "radius of a loop over the surface distance of more than two strands in one part")
    wide_open: float = fitted(6.0, "spacings beyond which its radius says no more: crowns have wide false loops")
    clear_sight: float = fitted(3.0, "spacings beyond which the radius of what one sees through it says no more")
    grid: int = precision(15, "places of a grid across a loop, either way")
    widest_first: int = speed(8, "places in a loop, with the widest sight, that are asked before others")
    wires_on_loops: float = fitted(0.9, "share of wires that is on wide loops in a frame; in crowns .8")
    sectors: int = precision(16, "directions around a place in which walls are looked for")
    least_opening: float = fitted(0.5, "spacings below which an opening says no more")
    least_passage: float = fitted(0.3, "spacings below which a passage says no more")


LOOP = LoopNumbers()


class Loops(Question):
    """Which loops are handles of the object? Others are closed, until there are none.

    Narrow ones, two strands in one part, are collapsed; wide ones are cut where the fewest bonds cross. Those that
    share a vertex with one that is cut are asked about later, if they are still there. There is one decision for each
    loop that was closed, and for each of the minimum cycle basis that remains.
    """

    about, repeats = "loop", True
    weights: ClassVar[Mapping[str, float]] = dict(constant=-0.3, opening=1.5, passage=4.5, bonds=2.4)  # fitted

    def __init__(self) -> None:
        self._known = Memo[LoopFacts]()
        self._wires: bool | None = None

    def candidates(self, evidence: Evidence, least: float) -> list[Candidate]:
        """One for each loop of the minimum cycle basis that no cut may open, see `loop_facts`."""
        curve, surface = evidence.curve, evidence.surface
        cycles = minimum_cycle_basis(len(curve.vertices), curve.edges, curve.edge_lengths)
        keys, thickness = [curve.vertices[cycle].tobytes() for cycle in cycles], evidence.thickness(cycles)
        radii = [surface.circle(curve.vertices[cycle])[1] for cycle in cycles]
        narrow = [radius < LOOP.wide * thick for radius, thick in zip(radii, thickness, strict=True)]
        members = [set() if slim else set(cycle.tolist()) for cycle, slim in zip(cycles, narrow, strict=True)]
        if self._wires is None:
            self._wires = _is_frame_of_wires(curve, [*set[int]().union(*members)])
        answers, used, remaining = dict[int, Candidate](), set[int](), [*range(len(cycles))]
        while remaining:  # each waits for those before it: cuts in what two share would tear a piece out
            asked, waiting, before = list[int](), list[int](), set[int]()
            for i in remaining:
                (asked if before.isdisjoint(members[i]) else waiting).append(i)
                before |= members[i]
            facts = partial(loop_facts, evidence=evidence)
            answered = self._known.of([keys[i] for i in asked], [cycles[i] for i in asked], facts)
            for i, loop in zip(asked, answered, strict=True):
                if self._wires and (curve.confidence[cycles[i]] < CURVE.unsure).mean() > CURVE.majority:
                    loop = loop.without_normals()
                probability = logistic(self.weights, loop.facts) * loop.certainty
                part = cycles[i], narrow[i], loop.weakest
                answers[i] = Candidate(part, loop.centre, loop.facts, probability, self.changes(probability, least))
                if answers[i].changes:
                    used |= members[i]
            remaining = [i for i in waiting if used.isdisjoint(members[i])]
        return [answer for _, answer in sorted(answers.items())]

    def change(self, evidence: Evidence, chosen: Sequence[Candidate]) -> Curve:
        """Collapse the narrow loops, and cut the wide ones."""
        curve, pairs, cut = evidence.curve, list[np.ndarray](), list[np.ndarray]()
        for cycle, narrow, weakest in (candidate.part for candidate in chosen):
            if narrow:
                pairs.append(facing_pairs(curve.vertices[cycle], cycle))
            else:
                cut.append(np.sort(cycle[[weakest, (weakest + 1) % len(cycle)]]))
        if cut:
            curve = drop_edges(curve, cut)
        if pairs:
            labels = component_labels(len(curve.vertices), np.concatenate(pairs))
            curve = collapse_triangles(merge_vertices(curve, labels))
        return curve


class LoopFacts(NamedTuple):
    """What speaks for and against that a loop is a handle."""

    facts: dict[str, float]
    inside: float  # median winding number along it
    centre: np.ndarray  # of its hole
    weakest: int  # position of the edge, from there to the next vertex, that the fewest bonds cross

    @property
    def certainty(self) -> float:
        """A factor of the probability: less where the loop has little inside, nothing as in sparse crowns."""
        return float(np.clip(2 * self.inside / CURVE.inside - 1, 0, 1))

    def without_normals(self) -> LoopFacts:
        """The same with bonds all around, and something inside."""
        return self._replace(facts=self.facts | dict(bonds=float(np.log(1 + CURVE.little))), inside=CURVE.inside)


def _is_frame_of_wires(curve: Curve, wide: list[int]) -> bool:
    """Whether most has no surface and is on `wide` loops, as in no crown, and does not fill space, as noise does."""
    thin = curve.confidence < CURVE.unsure
    if thin.mean() <= CURVE.majority or thin[wide].sum() <= LOOP.wires_on_loops * thin.sum():
        return False
    cloud = SpacedPoints(curve)
    return bool(np.median(link_growth(cloud.links)[thin[cloud.vertex]]) < CURVE.surface_growth)


def loop_facts(cycles: list[np.ndarray], evidence: Evidence) -> list[LoopFacts]:
    """What speaks for and against that each of some loops is a handle.

    The facts are logarithms: of the radius of the largest circle inside it, in spacings of the points, at most six; of
    how wide the passage through it is, below; and of the least bonds that cross it somewhere, over their median.

    A loop is a handle if no disc that spans it stays inside. So the passage is at the place in its plane where the
    radius of the widest empty cylinder across it, as long either way as the circle and the distance of the surface
    together, times the share by which the winding number falls from the median along the loop, is largest. There it is
    that radius, in spacings, at most three, times the share or, if that is less, times how far the points around face
    the place. Those around a hole in the data do not.
    """
    if not cycles:
        return []
    curve, surface = evidence.curve, evidence.surface
    bonds, spacing = evidence.bonds, max(surface.spacing, TINY)
    loops, thickness = [curve.vertices[cycle] for cycle in cycles], evidence.thickness(cycles)
    views = [_View(loop, thick, surface) for loop, thick in zip(loops, thickness, strict=True)]
    vertices, which = np.unique(np.concatenate(cycles), return_inverse=True)  # loops of a lattice share most of theirs
    along = surface.winding_at(curve.vertices[vertices])[which]
    medians = [quantile(each) for each in np.split(along, np.cumsum([len(loop) for loop in loops[:-1]]))]
    falls = _falls(views, np.array(medians), surface)
    answers = []
    for cycle, view, inside, fall in zip(cycles, views, medians, falls, strict=True):
        crossing = crossings(positions(cycle, len(curve.vertices)), len(cycle), bonds, closed=True)
        best = int(np.argmax(view.sight * fall))
        passage = min(view.sight[best] / spacing, LOOP.clear_sight) * min(fall[best], view.walls(best))
        facts = dict(
            opening=float(np.log(min(view.radius / spacing, LOOP.wide_open) + LOOP.least_opening)),
            passage=float(np.log(passage + LOOP.least_passage)),
            bonds=float(np.log(crossing.min() / max(quantile(crossing), TINY) + CURVE.little)),
        )
        answers.append(LoopFacts(facts, inside, view.centre, int(np.argmin(crossing))))
    return answers


class _View:
    """Through a loop, along the normal of its plane.

    Attributes
    ----------
    centre, radius
        Of the largest circle in the loop.
    places : (g, 3) float array
        On a grid in its plane, inside of it.
    sight : (g,) float array
        Radius of the widest cylinder without points that stands on each.
    """

    def __init__(self, loop: np.ndarray, thickness: float, surface: Surface) -> None:
        self.centre, self.radius = surface.circle(loop)
        self.places, axes = places_inside(loop, LOOP.grid)
        if not len(self.places):
            self.places = self.centre[None]
        self._places, self._surface, self._axes = (self.places - self.centre) @ axes[:2].T, surface, axes
        extent = np.linalg.norm(loop - self.centre, axis=1).max() + thickness
        self._half = self.radius + thickness  # of what stands in the way, along the normal
        self._reaches = iter((extent, 2 * extent, np.inf))
        self._see()
        while (self.sight > self._clear).any():
            self._see()

    def _see(self) -> None:
        """Take up points farther from the centre in the plane: from each place all in a circle, which is `_clear`."""
        reach = next(self._reaches)
        rows = self._surface.near(self.centre, float(np.hypot(reach, self._half)))
        points = (self._surface.points[rows] - self.centre) @ self._axes.T
        near = np.abs(points[:, 2]) < self._half
        self._points, self._normals = points[near, :2], self._surface.normals[rows[near]] @ self._axes[:2].T
        self.sight = np.full(len(self.places), np.inf if reach < np.inf else 0.0)
        if near.any():
            self.sight = cKDTree(self._points).query(self._places)[0]
        self._clear = reach - np.hypot(*self._places.T)

    def walls(self, place: int) -> float:
        """How far the nearest points all around a place face it: the mean cosine, of no points 0."""
        offset = self._points - self._places[place]
        distance = np.hypot(*offset.T)
        sector = (LOOP.sectors * (np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) + 0.5)).astype(
            int
        ) % LOOP.sectors
        order = np.lexsort([distance, sector])
        nearest = order[np.unique(sector[order], return_index=True)[1]]
        clear = self._clear[place]
        if clear < np.inf and (len(nearest) < LOOP.sectors or distance[nearest].max() >= clear):
            self._see()
            return self.walls(place)
        cosine = np.abs((self._normals[nearest] * offset[nearest]).sum(axis=1)) / np.maximum(distance[nearest], TINY)
        return float(cosine.sum() / LOOP.sectors)


def _falls(views: list[_View], inside: np.ndarray, surface: Surface) -> list[np.ndarray]:
    """By what share the winding number falls from that `inside` each loop to the places that it is seen through.

    Those with the widest sight are asked first, and of the others only those whose sight could make them the best; the
    rest counts as no fall.
    """
    places, sight = (np.concatenate([getattr(view, name) for view in views]) for name in ("places", "sight"))
    sizes = [len(view.places) for view in views]
    loop, fall, unasked = np.repeat(np.arange(len(views)), sizes), np.zeros(len(places)), np.ones(len(places), bool)
    order = np.lexsort([-sight, loop])
    first = order[group_rank(loop, len(views)) < LOOP.widest_first]
    for _ in range(2):
        unasked[first] = False
        winding = surface.winding(places[first])
        fall[first] = np.clip(1 - winding / np.maximum(inside[loop[first]], CURVE.inside), 0, 1)
        best = np.zeros(len(views))
        np.maximum.at(best, loop, sight * fall)
        first = np.flatnonzero(unasked & (sight >= best[loop]))
    return np.split(fall, np.cumsum(sizes[:-1]))


def crossings(place: np.ndarray, n: int, bonds: tuple[np.ndarray, np.ndarray], closed: bool) -> np.ndarray:
    """Weight of the `Evidence.bonds` across each edge of a path, from what is on its one side to the other, (n,).

    `place` (M,) are the positions 0 to n - 1 of the graph's vertices along it, -1 of those that do not count. If it is
    closed, edges lead from each position to the next, and bonds the shorter way; else the last one is none.
    """
    pairs, weight = bonds
    on_path = np.flatnonzero(place >= 0)
    start, stop = np.searchsorted(pairs[:, 0], [on_path, on_path + 1])  # bonds are in the order of their first vertices
    rows = np.arange((stop - start).sum()) + np.repeat(stop - np.cumsum(stop - start), stop - start)
    (first, last), weight = np.sort(place[pairs[rows]], axis=1).T, weight[rows]
    inside = first >= 0
    first, last, weight = first[inside], last[inside], weight[inside]
    around = closed & (last - first > n / 2)
    start, stop = np.where(around, last, first), np.where(around, first, last)
    steps = np.bincount(start, weight, n) - np.bincount(stop, weight, n)
    return np.maximum(np.cumsum(steps) + weight[around].sum(), 0)  # rounding leaves less than nothing


def positions(path: np.ndarray, m: int) -> np.ndarray:
    """The position of each of m vertices in a path, (m,) int array; -1 of those that are not in it."""
    place = np.full(m, -1)
    place[path] = np.arange(len(path))
    return place


def facing_pairs(points: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Pairs of vertices, (p, 2), that meet when a loop collapses onto a line between those farthest apart.

    Every inner vertex of either side meets the vertex of the other side that is as far along.
    """
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    first, last = np.unravel_index(np.argmax(distance), distance.shape)
    n = len(points)
    if first == last:  # all in one place
        return np.column_stack([np.repeat(labels[:1], n - 1), labels[1:]])
    sides = [
        np.arange(first, first + (last - first) % n + 1) % n,
        np.arange(first, first - (first - last) % n - 1, -1) % n,
    ]
    travelled = [arc_lengths(points[side]) for side in sides]
    along = [lengths / lengths[-1] for lengths in travelled]
    nearest = np.abs(along[0][:, None] - along[1][None])
    pairs = [(i, int(np.argmin(nearest[i]))) for i in range(1, len(sides[0]) - 1)]
    pairs += [(int(np.argmin(nearest[:, j])), j) for j in range(1, len(sides[1]) - 1)]
    return np.array([(labels[sides[0][i]], labels[sides[1][j]]) for i, j in pairs])
