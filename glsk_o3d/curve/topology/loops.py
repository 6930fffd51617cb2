"""Close loops that nothing passes through."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...data.decisions import QUESTIONS, Decision
from ..curve import Curve
from ...geometry.cycles import minimum_cycle_basis, places_inside
from ...geometry.groups import component_labels, group_rank, quantile
from ...geometry.near_links import link_growth
from ...geometry.polylines import arc_lengths
from ...geometry.vectors import TINY
from ..diagnostics import MAJORITY
from ..thin.detect import SURFACE_GROWTH, UNSURE_CONFIDENCE, SpacedPoints
from .collapse import collapse_triangles, drop_edges, merge_vertices
from .evidence import LEAST_INSIDE, Evidence, ask_once

WIDE_LOOP = 1.4  # fitted: surface distances, the radius of a loop that is more than two strands in one part
WIDE_OPEN = 6.0  # fitted: spacings, its radius beyond which that says no more: crowns have wide false loops
CLEAR_SIGHT = 3.0  # fitted: spacings, the radius of what one sees through it beyond which that says no more
LOOP_GRID = 15  # precision: of a grid across a loop, either way
WIDEST_FIRST = 8  # speed: places in a loop, with the widest sight, whose winding numbers are asked before others
WIRES_ON_LOOPS = 0.9  # fitted: share of what has no surface that is on wide loops in a frame of wires; in crowns .8
WALL_SECTORS = 16  # precision: directions around a place in which walls are looked for


def close_loops(curve: Curve, evidence: Evidence, least: float) -> tuple[Curve, list[Decision]]:
    """Close the loops that are handles with a probability of less than `least`, until there are none.

    Narrow ones, two strands in one part, are collapsed; wide ones are cut where the fewest bonds cross. Those that
    share a vertex with one that is cut are asked about later, if they are still there. There is one decision for each
    loop that was closed, and for each of the minimum cycle basis that is left.
    """
    decisions: list[Decision] = []
    known, wires = dict[bytes, LoopEvidence](), None
    while True:
        cycles = minimum_cycle_basis(len(curve.vertices), curve.edges, curve.edge_lengths)
        names, tubes = [curve.vertices[cycle].tobytes() for cycle in cycles], evidence.tubes(curve, cycles)
        narrow = [evidence.circle(curve.vertices[c])[1] < WIDE_LOOP * t for c, t in zip(cycles, tubes, strict=True)]
        members = [set() if slim else set(c.tolist()) for c, slim in zip(cycles, narrow, strict=True)]
        wires = _is_frame_of_wires(curve, [*set[int]().union(*members)]) if wires is None else wires
        loops, cut, used, left = dict[int, LoopEvidence](), [], set[int](), [*range(len(cycles))]
        while left:  # each waits for those before it; two cuts in what two loops share would tear a piece out of it
            asked, waiting, before = list[int](), list[int](), set[int]()
            for i in left:
                (asked if before.isdisjoint(members[i]) else waiting).append(i)
                before |= members[i]
            ask = partial(loop_facts, curve, evidence=evidence)
            answers = ask_once(known, [names[i] for i in asked], [cycles[i] for i in asked], ask)
            for i, loop in zip(asked, answers, strict=True):
                if wires and (curve.confidence[cycles[i]] < UNSURE_CONFIDENCE).mean() > MAJORITY:
                    loop = loop.without_normals()
                loops[i] = loop
                if loop.probability < least and not narrow[i]:
                    cut.append(np.sort(cycles[i][[loop.weakest, (loop.weakest + 1) % len(cycles[i])]]))
                    used |= members[i]
            left = [i for i in waiting if used.isdisjoint(members[i])]
        rows = [(i, loop, loop.probability < least) for i, loop in sorted(loops.items())]
        found = [Decision("loop", tuple(loop.centre.tolist()), loop.probability, false) for _, loop, false in rows]
        decisions += [each for each in found if each.changed]
        closed = [cycles[i] for i, _, false in rows if false and narrow[i]]
        if not closed and not cut:
            return curve, decisions + found
        if cut:
            curve = drop_edges(curve, cut)
        if closed:
            pairs = np.concatenate([facing_pairs(curve.vertices[cycle], cycle) for cycle in closed])
            labels = component_labels(len(curve.vertices), pairs)
            curve = collapse_triangles(merge_vertices(curve, labels))


class LoopEvidence(NamedTuple):
    """What speaks for and against that a loop is a handle."""

    facts: dict[str, float]
    inside: float  # median winding number along it
    centre: np.ndarray  # of its hole
    weakest: int  # position of the edge, from there to the next vertex, that the fewest bonds cross

    @property
    def probability(self) -> float:
        """That it is one: what the facts say, and less where it has little inside, nothing as in sparse crowns."""
        return QUESTIONS["loop"].probability(self.facts) * float(np.clip(2 * self.inside / LEAST_INSIDE - 1, 0, 1))

    def without_normals(self) -> LoopEvidence:
        """The same with bonds all around, and something inside."""
        return self._replace(facts=self.facts | dict(bonds=float(np.log(1 + 0.1))), inside=LEAST_INSIDE)


def _is_frame_of_wires(curve: Curve, wide: list[int]) -> bool:
    """Whether most has no surface and is on `wide` loops, as in no crown, and does not fill space, as noise does."""
    thin = curve.confidence < UNSURE_CONFIDENCE
    if thin.mean() <= MAJORITY or thin[wide].sum() <= WIRES_ON_LOOPS * thin.sum():
        return False
    cloud = SpacedPoints(curve)
    return bool(np.median(link_growth(cloud.links)[thin[cloud.vertex]]) < SURFACE_GROWTH)


def loop_facts(curve: Curve, cycles: list[np.ndarray], evidence: Evidence) -> list[LoopEvidence]:
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
    bonds, spacing = evidence.bonds(curve), max(evidence.spacing, TINY)
    loops, tubes = [curve.vertices[cycle] for cycle in cycles], evidence.tubes(curve, cycles)
    views = [_View(loop, tube, evidence) for loop, tube in zip(loops, tubes, strict=True)]
    vertices, which = np.unique(np.concatenate(cycles), return_inverse=True)  # loops of a lattice share most of theirs
    along = evidence.winding_at(curve.vertices[vertices])[which]
    medians = [quantile(each) for each in np.split(along, np.cumsum([len(loop) for loop in loops[:-1]]))]
    falls = _falls(views, np.array(medians), evidence)
    found = []
    for cycle, view, inside, fall in zip(cycles, views, medians, falls, strict=True):
        crossing = crossings(positions(cycle, len(curve.vertices)), len(cycle), bonds, closed=True)
        best = int(np.argmax(view.sight * fall))
        passage = min(view.sight[best] / spacing, CLEAR_SIGHT) * min(fall[best], view.walls(best))
        facts = dict(
            opening=float(np.log(min(view.radius / spacing, WIDE_OPEN) + 0.5)),
            passage=float(np.log(passage + 0.3)),
            bonds=float(np.log(crossing.min() / max(quantile(crossing), TINY) + 0.1)),
        )
        found.append(LoopEvidence(facts, inside, view.centre, int(np.argmin(crossing))))
    return found


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

    def __init__(self, loop: np.ndarray, tube: float, evidence: Evidence) -> None:
        self.centre, self.radius = evidence.circle(loop)
        self.places, axes = places_inside(loop, LOOP_GRID)
        if not len(self.places):
            self.places = self.centre[None]
        self._places, self._evidence, self._axes = (self.places - self.centre) @ axes[:2].T, evidence, axes
        extent = np.linalg.norm(loop - self.centre, axis=1).max() + tube
        self._half = self.radius + tube  # of what stands in the way, along the normal
        self._reaches = iter((extent, 2 * extent, np.inf))
        self._see()
        while (self.sight > self._clear).any():
            self._see()

    def _see(self) -> None:
        """Take up points farther from the centre in the plane: from each place all in a circle, which is `_clear`."""
        reach = next(self._reaches)
        rows = self._evidence.near(self.centre, float(np.hypot(reach, self._half)))
        points = (self._evidence.points[rows] - self.centre) @ self._axes.T
        near = np.abs(points[:, 2]) < self._half
        self._points, self._normals = points[near, :2], self._evidence.normals[rows[near]] @ self._axes[:2].T
        self.sight = np.full(len(self.places), np.inf if reach < np.inf else 0.0)
        if near.any():
            self.sight = cKDTree(self._points).query(self._places)[0]
        self._clear = reach - np.hypot(*self._places.T)

    def walls(self, place: int) -> float:
        """How far the nearest points all around a place face it: the mean cosine, of no points 0."""
        way = self._points - self._places[place]
        distance = np.hypot(*way.T)
        sector = (WALL_SECTORS * (np.arctan2(way[:, 1], way[:, 0]) / (2 * np.pi) + 0.5)).astype(int) % WALL_SECTORS
        order = np.lexsort([distance, sector])
        nearest = order[np.unique(sector[order], return_index=True)[1]]
        clear = self._clear[place]
        if clear < np.inf and (len(nearest) < WALL_SECTORS or distance[nearest].max() >= clear):
            self._see()
            return self.walls(place)
        cosine = np.abs((self._normals[nearest] * way[nearest]).sum(axis=1)) / np.maximum(distance[nearest], TINY)
        return float(cosine.sum() / WALL_SECTORS)


def _falls(views: list[_View], inside: np.ndarray, evidence: Evidence) -> list[np.ndarray]:
    """By what share the winding number falls from that `inside` each loop to the places that it is seen through.

    Those with the widest sight are asked first, and of the others only those whose sight could make them the best; the
    rest counts as no fall.
    """
    places, sight = (np.concatenate([getattr(view, name) for view in views]) for name in ("places", "sight"))
    sizes = [len(view.places) for view in views]
    loop, fall, left = np.repeat(np.arange(len(views)), sizes), np.zeros(len(places)), np.ones(len(places), bool)
    order = np.lexsort([-sight, loop])
    first = order[group_rank(loop, len(views)) < WIDEST_FIRST]
    for _ in range(2):
        left[first] = False
        there = evidence.winding(places[first])
        fall[first] = np.clip(1 - there / np.maximum(inside[loop[first]], LEAST_INSIDE), 0, 1)
        best = np.zeros(len(views))
        np.maximum.at(best, loop, sight * fall)
        first = np.flatnonzero(left & (sight >= best[loop]))
    return np.split(fall, np.cumsum(sizes[:-1]))


def crossings(place: np.ndarray, n: int, bonds: tuple[np.ndarray, np.ndarray], closed: bool) -> np.ndarray:
    """Weight of the `Evidence.bonds` across each edge of a path, from what is on its one side to the other, (n,).

    `place` (M,) are the positions 0 to n - 1 of the graph's vertices along it, -1 of those that do not count. If it is
    closed, edges lead from each position to the next, and bonds the shorter way; else the last one is none.
    """
    pairs, weight = bonds
    some = np.flatnonzero(place >= 0)
    start, stop = np.searchsorted(pairs[:, 0], [some, some + 1])  # bonds are in the order of their first vertices
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
    along = [each / each[-1] for each in travelled]
    nearest = np.abs(along[0][:, None] - along[1][None])
    pairs = [(i, int(np.argmin(nearest[i]))) for i in range(1, len(sides[0]) - 1)]
    pairs += [(int(np.argmin(nearest[:, j])), j) for j in range(1, len(sides[1]) - 1)]
    return np.array([(labels[sides[0][i]], labels[sides[1][j]]) for i, j in pairs])
