"""Cut the edges that cross air: between parts that noise or flying points join."""

from collections.abc import Iterator
from heapq import heappop, heappush

import numpy as np

from ...data.decisions import QUESTIONS, Decision
from ..curve import Curve
from ...geometry.groups import quantile
from ...geometry.polylines import place_at
from ...geometry.vectors import TINY
from .collapse import drop_edges, drop_vertices
from .evidence import Evidence
from .loops import crossings, positions

AIR_WINDOW = 1.0  # derived: radii of a branch along which evidence is averaged; a false edge is two radii long or more
# fitted: radii over which it is seen where a curve goes: beyond an edge, but the first third, or to an end
HEADING_RADII = 3.0
CROSSING_HOPS = int(2 * HEADING_RADII)  # derived: edges as long, of half a radius, whose vertices count to their side
LEAST_SCATTER = 0.05  # fitted: of winding numbers along a curve


def cut_air(curve: Curve, evidence: Evidence, least: float) -> tuple[Curve, list[Decision]]:
    """Cut every branch where it crosses air with a probability of `least` or more; one decision for each branch.

    The curve was fitted to its axis.
    """
    decisions, gone = [], []
    for branch, place, facts in branch_facts(curve, evidence):
        weakest, chance = branch[place : place + 2], QUESTIONS["air"].probability(facts)
        middle = curve.vertices[weakest].mean(axis=0)
        decisions.append(Decision("air", tuple(middle.tolist()), chance, chance >= least))
        if chance >= least:
            gone.append(sorted(weakest.tolist()))
    if not gone:
        return curve, decisions
    cut = drop_edges(curve, gone)
    return drop_vertices(cut, cut.degree == 0), decisions


def branch_facts(curve: Curve, evidence: Evidence) -> Iterator[tuple[np.ndarray, int, dict[str, float]]]:
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
    vertices, edges, m = curve.vertices, curve.edges, len(curve.vertices)
    length = np.maximum(curve.edge_lengths, TINY)
    winding = evidence.winding_along(curve)
    typical = quantile(winding)
    scatter = 1.4826 * quantile(np.abs(winding - typical)) + LEAST_SCATTER * abs(typical)
    along = evidence.surface_around(curve)
    tubes = 2 * np.pi * np.maximum(curve.radii[edges].mean(axis=1), TINY) @ length
    area = along.sum()
    seen = max(area / max(tubes, area * TINY, TINY), TINY)  # a line has no tubes
    bonds = evidence.bonds(curve)
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
            branch, bonded = np.append(ring, ring[0]), crossings(positions(ring, m), len(ring), bonds, closed=True)
        else:
            bonded = crossings(_sides(branch, around, m), len(branch), bonds, closed=False)[:-1]
        edge = numbers(branch)
        # of a line, which has no thickness, what rounding leaves
        radius = max(quantile(curve.radii[branch]), float(np.finfo(float).eps * length.sum()), TINY)
        ends = np.append(0, np.cumsum(length[edge]))
        amounts = winding[edge] * length[edge], along[edge]
        smooth, areas = _window_means(ends, ends[1:] - length[edge] / 2, AIR_WINDOW * radius, *amounts)
        k = int(np.argmin(smooth))
        surface = areas[k] / (2 * np.pi * radius)
        facts = dict(
            deficit=np.log1p(max((typical - smooth[k]) / max(scatter, TINY), 0)),
            surface=np.log(max(surface / seen, 0) + 0.05),
            straightness=_straightness(vertices, around, branch, k, radius),
            noise=curve.report.noise,
            bonds=np.log(float(bonded.min()) / 2 * evidence.spacing / (2 * np.pi * radius) + 0.05),
            inner=float((curve.degree[branch[[0, -1]]] > 1).all()),
            length=np.log(ends[-1] / radius + 0.1),
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
        found, front = {start}, [start]
        for _ in range(CROSSING_HOPS):
            front = [v for u in front for v, _ in around[u] if v not in found and v not in inner and v != stop]
            found.update(front)
        sides.append(found)
    place = positions(branch, m)
    place[list(sides[0] - sides[1])] = 0
    place[list(sides[1] - sides[0])] = len(branch) - 1
    return place


def _straightness(
    vertices: np.ndarray, around: list[list[tuple[int, float]]], branch: np.ndarray, k: int, radius: float
) -> float:
    """Cosine between an edge of a branch and how the curve goes on beyond, at the better of both ends."""
    low, high = branch[max(k - 1, 0)], branch[min(k + 2, len(branch) - 1)]
    way = vertices[high] - vertices[low]
    way = way / max(np.linalg.norm(way), TINY)
    best = []
    for here, came, sign in ((int(branch[k + 1]), int(branch[k]), 1), (int(branch[k]), int(branch[k + 1]), -1)):
        ways = _beyond(vertices, around, here, came, HEADING_RADII * radius)
        best.append(max((sign * float(way @ onward) for onward in ways), default=1.0))
    return max(best)


def _beyond(
    vertices: np.ndarray, around: list[list[tuple[int, float]]], start: int, came: int, reach: float
) -> list[np.ndarray]:
    """Directions in which a graph goes on from a vertex, along all its shortest ways: over their last two thirds."""
    before: dict[int, int] = {came: -1}
    travelled: dict[int, float] = {}
    heap = [(0.0, start, -1)]
    while heap:
        far, here, origin = heappop(heap)
        if here in before:
            continue
        before[here], travelled[here] = origin, far
        if far < reach:
            for onward, length in around[here]:
                heappush(heap, (far + length, onward, here))
    found = []
    for tip in travelled.keys() - before.values() - {start}:
        path = [tip]
        while path[-1] != start:
            path.append(before[path[-1]])
        along, places = np.array([travelled[v] for v in reversed(path)]), vertices[path[::-1]]
        stop = min(along[-1], reach)
        first, last = place_at(places, along, stop / 3), place_at(places, along, stop)
        found.append((last - first) / max(float(np.linalg.norm(last - first)), TINY))
    return found
