"""False branches: which cross empty space?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import ClassVar

import numpy as np

from ...data.decisions import logistic
from ...geometry.groups import quantile
from ...geometry.numbers import derived, fitted
from ...geometry.polylines import place_at
from ...geometry.vectors import TINY
from ..curve import Curve
from ..merging import drop_edges, drop_vertices
from ..numbers import CURVE
from ..surface import Evidence
from .loops import crossings, positions
from .question import Candidate, Question


@dataclass(frozen=True)
class FalseBranchNumbers:
    """Numbers of `FalseBranches`."""

    window: float = derived(1.0, "radii of a branch along which evidence is averaged; false edges have two or more")
    deviation: float = derived(1.4826, "standard deviation of a normal distribution over its median absolute one")
    least: float = fitted(
        0.05, "share of a tube's area or points, or scatter over a median, below which it says no more"
    )


FALSE_BRANCH = FalseBranchNumbers()

CROSSING_HOPS = int(2 * CURVE.heading)  # derived: edges as long, of half a radius, whose vertices count to their side


class FalseBranches(Question):
    """Which branches cross empty space, between parts that noise or flying points join? They are cut there.

    The curve was fitted to its axis. There is one decision for each branch.
    """

    about, repeats = "air", False
    weights: ClassVar[Mapping[str, float]] = dict(  # fitted
        constant=-5.8, deficit=1.7, surface=-0.5, straightness=-3.2, noise=1.9, bonds=-0.9, inner=3.4, length=-0.5
    )

    def candidates(self, evidence: Evidence, least: float) -> list[Candidate]:
        """One for the weakest edge of each branch, see `branch_facts`."""
        answers = []
        for branch, k, facts in branch_facts(evidence):
            weakest, probability = branch[k : k + 2], logistic(self.weights, facts)
            place = evidence.curve.vertices[weakest].mean(axis=0)
            answers.append(Candidate(np.sort(weakest), place, facts, probability, self.changes(probability, least)))
        return answers

    def change(self, evidence: Evidence, chosen: Sequence[Candidate]) -> Curve:
        """Drop the weakest edges, and vertices that are alone then."""
        cut = drop_edges(evidence.curve, [candidate.part for candidate in chosen])
        return drop_vertices(cut, cut.degree == 0)


def branch_facts(evidence: Evidence) -> Iterator[tuple[np.ndarray, int, dict[str, float]]]:
    """What the evidence says about the weakest place of every branch.

    The weakest place is where the winding number, averaged over a window of one radius, is least. The facts, of which
    all but straightness, noise and inner are logarithms, are

    - deficit: by how much it is less than the median over all edges, in units of their scatter;
    - surface: area along the window, over that of a tube, and this over the same of the whole curve;
    - straightness: cosine between the edge and how the curve goes on beyond, at the better end;
    - noise: mean share of it in the cloud, from 0 to 1;
    - bonds: the least that cross the branch, over the points around a tube, 2 pi r over their spacing;
    - inner: whether both ends have other branches;
    - length: in radii.

    With them comes the branch, (p,) int array, of which a ring begins where its winding number is greatest, and the
    position in it of the first end of the weakest edge.
    """
    curve, winding = evidence.curve, evidence.winding
    vertices, edges, m = curve.vertices, curve.edges, len(curve.vertices)
    length = np.maximum(curve.edge_lengths, TINY)
    typical = quantile(winding)
    scatter = FALSE_BRANCH.deviation * quantile(np.abs(winding - typical)) + FALSE_BRANCH.least * abs(typical)
    tubes = 2 * np.pi * np.maximum(curve.radii[edges].mean(axis=1), TINY) @ length
    area = evidence.area.sum()
    seen = max(area / max(tubes, area * TINY, TINY), TINY)  # a line has no tubes
    keys = edges @ [m, 1]
    around: list[list[tuple[int, float]]] = [[] for _ in vertices]
    for (a, b), step in zip(edges.tolist(), curve.edge_lengths.tolist(), strict=True):
        around[a].append((b, step))
        around[b].append((a, step))

    def numbers(path: np.ndarray) -> np.ndarray:
        return np.searchsorted(keys, np.sort(np.column_stack([path[:-1], path[1:]]), axis=1) @ [m, 1])

    for branch in curve.branches:
        if branch[0] == branch[-1]:
            ring = np.roll(branch[:-1], -int(np.argmax(winding[numbers(branch)])))
            branch = np.append(ring, ring[0])
            bonded = crossings(positions(ring, m), len(ring), evidence.bonds, closed=True)
        else:
            bonded = crossings(_sides(branch, around, m), len(branch), evidence.bonds, closed=False)[:-1]
        edge = numbers(branch)
        # of a line, which has no thickness, what rounding leaves
        radius = max(quantile(curve.radii[branch]), float(np.finfo(float).eps * length.sum()), TINY)
        ends = np.append(0, np.cumsum(length[edge]))
        amounts = winding[edge] * length[edge], evidence.area[edge]
        smooth, areas = _window_means(ends, ends[1:] - length[edge] / 2, FALSE_BRANCH.window * radius, *amounts)
        k = int(np.argmin(smooth))
        tube = 2 * np.pi * radius
        surface = areas[k] / tube
        facts = dict(
            deficit=np.log1p(max((typical - smooth[k]) / max(scatter, TINY), 0)),
            surface=np.log(max(surface / seen, 0) + FALSE_BRANCH.least),
            straightness=_straightness(vertices, around, branch, k, radius),
            noise=curve.report.noise,
            bonds=np.log(float(bonded.min()) / 2 * evidence.surface.spacing / tube + FALSE_BRANCH.least),
            inner=float((curve.degree[branch[[0, -1]]] > 1).all()),
            length=np.log(ends[-1] / radius + CURVE.little),
        )
        yield branch, k, facts


def _window_means(ends: np.ndarray, places: np.ndarray, width: float, *amounts: np.ndarray) -> Iterator[np.ndarray]:
    """Amounts per length in a window around places on a path; they are spread evenly over its edges, between `ends`."""
    low, high = np.maximum(places - width / 2, 0), np.minimum(places + width / 2, ends[-1])
    for each in amounts:
        total = np.append(0, np.cumsum(each))
        yield (np.interp(high, ends, total) - np.interp(low, ends, total)) / np.maximum(high - low, TINY)


def _sides(branch: np.ndarray, around: list[list[tuple[int, float]]], m: int) -> np.ndarray:
    """Positions of m vertices in a branch, (m,) int array; -1 of those that do not count.

    Vertices beyond its ends, a few edges away, count to their side, but those that are near both.
    """
    inner, sides = set(branch[1:-1].tolist()), []
    for start, stop in ((int(branch[0]), int(branch[-1])), (int(branch[-1]), int(branch[0]))):
        reached, front = {start}, [start]
        for _ in range(CROSSING_HOPS):
            front = [v for u in front for v, _ in around[u] if v not in reached and v not in inner and v != stop]
            reached.update(front)
        sides.append(reached)
    place = positions(branch, m)
    place[list(sides[0] - sides[1])] = 0
    place[list(sides[1] - sides[0])] = len(branch) - 1
    return place


def _straightness(
    vertices: np.ndarray, around: list[list[tuple[int, float]]], branch: np.ndarray, k: int, radius: float
) -> float:
    """Cosine between an edge of a branch and how the curve goes on beyond, at the better of both ends."""
    low, high = branch[max(k - 1, 0)], branch[min(k + 2, len(branch) - 1)]
    direction = vertices[high] - vertices[low]
    direction = direction / max(np.linalg.norm(direction), TINY)
    best = []
    for vertex, previous, sign in ((int(branch[k + 1]), int(branch[k]), 1), (int(branch[k]), int(branch[k + 1]), -1)):
        onwards = _beyond(vertices, around, vertex, previous, CURVE.heading * radius)
        best.append(max((sign * float(direction @ onward) for onward in onwards), default=1.0))
    return max(best)


def _beyond(
    vertices: np.ndarray, around: list[list[tuple[int, float]]], start: int, previous: int, reach: float
) -> list[np.ndarray]:
    """Directions in which a graph goes on from a vertex, along all its shortest ways: over their last two thirds."""
    before: dict[int, int] = {previous: -1}
    travelled: dict[int, float] = {}
    heap = [(0.0, start, -1)]
    while heap:
        far, vertex, origin = heappop(heap)
        if vertex in before:
            continue
        before[vertex], travelled[vertex] = origin, far
        if far < reach:
            for onward, length in around[vertex]:
                heappush(heap, (far + length, onward, vertex))
    directions = []
    for tip in travelled.keys() - before.values() - {start}:
        path = [tip]
        while path[-1] != start:
            path.append(before[path[-1]])
        along, places = np.array([travelled[v] for v in reversed(path)]), vertices[path[::-1]]
        stop = min(along[-1], reach)
        first, last = place_at(places, along, stop / 3), place_at(places, along, stop)
        directions.append((last - first) / max(float(np.linalg.norm(last - first)), TINY))
    return directions
