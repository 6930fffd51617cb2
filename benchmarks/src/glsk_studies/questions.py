"""What the refiner asks about a cloud with a known axis, and what the axis answers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from glsk_bench.shapes.axis import subdivided
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra, maximum_bipartite_matching
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from glsk_o3d import Pipeline, Refiner
from glsk_o3d.analysis import Truth
from glsk_o3d.analysis.comparison import TIP_REACH
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.sampling import along_a_morton_curve, on_points
from glsk_o3d.curve.surface import Evidence, Surface
from glsk_o3d.curve.topology.false_branches import FalseBranches, branch_facts
from glsk_o3d.curve.topology.gaps import gap_facts
from glsk_o3d.curve.topology.loops import Loops, loop_facts
from glsk_o3d.curve.topology.spurs import Limbs
from glsk_o3d.geometry.cycles import minimum_cycle_basis
from glsk_o3d.geometry.vectors import norm

from .clouds import Case

DIGITS = 4  # of a fact
STEP = 0.3  # between places on the true axis, in median radii
CANDIDATES = 32  # nearest places, of which the one counts whose ball is nearest: thin parts grow out of thick ones
NEAR = 4  # edges on either side of the weakest place of a branch in which it may cross air
AIR_WAY, AIR_RADII = 2.0, 3.0  # across air is what is so many times farther along the axis, and so many radii more
BENT_WAY = 1.2  # what is so many times farther along the axis than straight on may go round and not through
NEXT_TO_NOTHING = 1e-3  # cost of a way in whose balls a place is, in least radii; outside, the distance from them
SAME_WAY, SAME_RADII = 1.5, 2.0  # and with a gap in one part the axis goes on no farther round than that


def questions(case: Case, pipeline: Pipeline) -> dict:
    """Every question about a cloud: what it is `about`, the `facts`, and whether it `is_so`."""
    points, truth = case.load()
    found = [
        dict(about=about, facts={name: round(value, DIGITS) for name, value in facts.items()}, is_so=is_so)
        for about, facts, is_so in asked(points, truth, pipeline)
    ]
    return dict(questions=found)


def asked(points: np.ndarray, truth: Truth, pipeline: Pipeline) -> list[tuple[str, dict[str, float], bool]]:
    """The questions in the order in which a pipeline's refiner asks them, each of the curve that it has then."""
    *stages, refiner, _ = pipeline.stages
    answers = []

    def ask_all(raw: Curve) -> Curve:
        answers.extend(_asked(refiner, raw, truth))
        return raw

    raw = Curve.of(Pipeline(*stages)(points))
    on_points(ask_all, raw, along_a_morton_curve(raw))
    return answers


def _asked(refiner: Refiner, raw: Curve, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    curve, surface = refiner.fitted(raw)
    if not len(curve.edges):
        return
    surface = surface.oriented(curve)
    cycles = minimum_cycle_basis(len(curve.vertices), curve.edges, curve.edge_lengths)
    if cycles:
        placed = Placed(truth, curve.vertices)
        for cycle, loop in zip(cycles, loop_facts(cycles, Evidence(curve, surface)), strict=True):
            yield "loop", loop.facts, placed.is_handle(cycle)  # also without an inside: of false ones there are few
    curve = refiner.after(Loops(), curve, surface)[0]
    yield from _limbs(curve, surface, truth)
    curve = refiner.after(Limbs(), curve, surface)[0]
    placed = Placed(truth, curve.vertices)
    for branch, k, facts in branch_facts(Evidence(curve, surface)):
        yield "air", facts, placed.crosses_air(branch, k)
    curve = refiner.after(FalseBranches(), curve, surface)[0]
    placed = Placed(truth, curve.vertices)
    for (leaf, other), facts in gap_facts(Evidence(curve, surface)):
        yield "gap", facts, bool(placed.joined(leaf, other))


def _limbs(curve: Curve, surface: Surface, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    """A branch is a limb if a true tip is lost without it.

    Of two prongs in one end either may go. That which stands out more is not asked about: once the other is pruned, it
    is how the limb goes on.
    """
    leaves = np.flatnonzero(curve.degree == 1)
    tips = np.flatnonzero(np.bincount(truth.edges.ravel(), minlength=len(truth.nodes)) == 1)
    near = cdist(curve.vertices[leaves], truth.nodes[tips]) <= TIP_REACH * truth.radii[tips]
    served = _served(near)
    facts_of = {int(limb.part[-1]): limb.facts for limb in Limbs().candidates(Evidence(curve, surface), 0)}
    asked = {leaf: (facts, _served(near[leaves != leaf]) < served) for leaf, facts in facts_of.items()}
    at = defaultdict[int, list[int]](list)
    for branch in curve.branches:
        for junction, leaf in (branch[[0, -1]], branch[[-1, 0]]):
            if leaf in asked and curve.degree[junction] == 3:
                at[junction].append(leaf)
    for prongs in at.values():
        if len(prongs) == 2 and not any(asked[leaf][1] for leaf in prongs):
            del asked[max(prongs, key=lambda leaf: asked[leaf][0]["protrusion"])]
    yield from (("limb", facts, is_so) for facts, is_so in asked.values())


def _served(near: np.ndarray) -> int:
    """Most true tips that can have a leaf of their own near them."""
    return int((maximum_bipartite_matching(csr_array(near.astype(np.int8)), perm_type="column") >= 0).sum())


class Placed:
    """Vertices, (m, 3) float array, at their places on a true axis, and the ways between these along it."""

    def __init__(self, truth: Truth, vertices: np.ndarray) -> None:
        points, links, radii = subdivided(truth.nodes, truth.edges, truth.radii, STEP * np.median(truth.radii))
        lengths = np.maximum(np.linalg.norm(points[links[:, 1]] - points[links[:, 0]], axis=1), np.finfo(float).tiny)
        near, which = cKDTree(points).query(vertices, k=range(1, 1 + min(CANDIDATES, len(points))))
        self.place = which[np.arange(len(vertices)), np.argmin(near - radii[which], axis=1)]
        graph = coo_array((lengths, links.T), shape=(len(points), len(points))).tocsr()
        starts, self._row = np.unique(self.place, return_inverse=True)
        self._way, self._before = dijkstra(graph, directed=False, indices=starts, return_predecessors=True)
        self._points, self._radii, self._vertices = points, radii, vertices
        self._links, self._lengths = links, lengths

    def apart(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Whether there is air between vertices i and j: along the axis it is much farther, bool array."""
        return self._along(i, j) > AIR_WAY * self._across(i, j) + AIR_RADII * self._thickness(i, j)

    def joined(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Whether the object goes on from vertices i to j, bool array."""
        return self._along(i, j) < SAME_WAY * self._across(i, j) + SAME_RADII * self._thickness(i, j)

    def crosses_air(self, branch: np.ndarray, k: int) -> bool:
        """Whether there is air between neighbours on a branch, near its edge k."""
        there = branch[max(k - NEAR, 0) : k + NEAR + 2]
        return bool(self.apart(there[:-1], there[1:]).any())

    def is_handle(self, cycle: np.ndarray) -> bool:
        """Whether the walk along the true axis that follows a loop goes round a loop of it, and not only to and fro.

        A loop that crosses air is none.
        """
        if not np.isfinite(self._along(cycle, np.roll(cycle, -1))).all():
            return False
        flow: dict[tuple[int, int], int] = {}
        for a, b in zip(cycle.tolist(), np.roll(cycle, -1).tolist(), strict=True):
            way = self._walk(a, b)
            thickness, across = self._radii[way].max(), float(self._across(a, b))
            if self._length(way) > AIR_WAY * across + AIR_RADII * thickness:
                return False
            for here, there in pairwise(way):
                link, to = ((here, there), 1) if here < there else ((there, here), -1)
                flow[link] = flow.get(link, 0) + to
        return any(flow.values())

    def _walk(self, a: int, b: int) -> list[int]:
        """Places on the axis from that of one vertex to that of its neighbour.

        They are on the shortest way, but where that is longer than the straight one, on that in whose balls the middle
        between the vertices is: from one foot of a handle to the other through the body, and not along the handle.
        """
        start, stop, before = int(self.place[a]), int(self.place[b]), self._before[self._row[a]]
        if self._along(a, b) > BENT_WAY * self._across(a, b):
            outside = norm((self._vertices[a] + self._vertices[b]) / 2 - self._points) - self._radii
            cost = np.maximum(outside, 0)[self._links].mean(axis=1) + NEXT_TO_NOTHING * self._radii.min()
            graph = coo_array((self._lengths * cost, self._links.T), shape=(len(self._points),) * 2).tocsr()
            before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)[1]
        way = [stop]
        while way[-1] != start:
            way.append(int(before[way[-1]]))
        return way[::-1]

    def _length(self, way: list[int]) -> float:
        return float(norm(np.diff(self._points[way], axis=0)).sum())

    def _along(self, i, j):
        return self._way[self._row[i], self.place[j]]

    def _across(self, i, j):
        return np.linalg.norm(self._points[self.place[i]] - self._points[self.place[j]], axis=-1)

    def _thickness(self, i, j):
        return np.maximum(self._radii[self.place[i]], self._radii[self.place[j]])
