"""Close loops that nothing passes through."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from ..decisions import QUESTIONS, Decision
from ..numerics.cycles import inscribed_circle, minimum_cycle_basis
from ..numerics.groups import component_labels
from ..numerics.polylines import arc_lengths
from ..numerics.vectors import TINY
from ..skeleton import Skeleton
from .evidence import LEAST_INSIDE, Evidence
from .merging import collapse_triangles, drop_edges, merge_vertices
from .sections import VertexPoints

WIDE_LOOP = 1.5  # fitted: opening of a loop that is more than two strands in one part
WIDE_OPEN = 3.0  # fitted: opening, and sight in spacings, beyond which they say no more: crowns have wide false loops
RINGS = [(k / 4, np.arange(6 * k) * np.pi / (3 * k)) for k in range(1, 5)]  # derived: evenly spaced places in a circle
VIEWS = np.vstack([[0, 0], *(r * np.column_stack([np.cos(a), np.sin(a)]) for r, a in RINGS)])


def close_loops(skeleton: Skeleton, evidence: Evidence, least: float) -> tuple[Skeleton, list[Decision]]:
    """Close the loops that are handles with a probability of less than `least`, until there are none.

    Narrow ones, two strands in one part, are collapsed; wide ones are cut where the fewest bonds cross. There is one
    decision for each loop of the minimum cycle bases, closed or left.
    """
    decisions: list[Decision] = []
    while True:
        cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
        kept, narrow, cut, used = list[Decision](), [], [], set[int]()
        for cycle, loop in zip(cycles, loop_facts(skeleton, cycles, evidence), strict=True):
            false = loop.probability < least
            where = tuple(loop.centre.tolist())
            (decisions if false else kept).append(Decision("loop", where, loop.probability, false))
            if not false:
                continue
            if loop.facts["opening"] < np.log(WIDE_LOOP):
                narrow.append(cycle)
            elif used.isdisjoint(cycle.tolist()):  # two cuts in what two loops share would tear a piece out of it
                cut.append(sorted((cycle[loop.weakest], cycle[(loop.weakest + 1) % len(cycle)])))
                used.update(cycle.tolist())
        if not narrow and not cut:
            return skeleton, decisions + kept
        if cut:
            skeleton = drop_edges(skeleton, cut)
        if narrow:
            pairs = np.concatenate([facing_pairs(skeleton.vertices[cycle], cycle) for cycle in narrow])
            labels = component_labels(len(skeleton.vertices), pairs)
            skeleton = collapse_triangles(merge_vertices(skeleton, labels))


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


def loop_facts(skeleton: Skeleton, cycles: list[np.ndarray], evidence: Evidence) -> list[LoopEvidence]:
    """What speaks for and against that each of some loops is a handle.

    The facts are: how wide it opens, the radius of the largest circle inside it over the distance of the surface, as a
    logarithm; how well one sees through it, the radius in spacings of the points of the widest empty cylinder that
    stands on a place in that circle, as long either way as both together; the share by which the winding number falls
    from the median along the loop to that place, since a handle is one if no disc that spans it stays inside; and the
    least bonds that cross it somewhere, over their median, as a logarithm.
    """
    if not cycles:
        return []
    surface = VertexPoints(skeleton).distance
    tubes = [max(float(np.median(surface[cycle])), TINY) for cycle in cycles]
    bonds = evidence.bonds(skeleton)
    loops = [skeleton.vertices[cycle] for cycle in cycles]
    views = [_view(loop, tube, evidence) for loop, tube in zip(loops, tubes, strict=True)]
    winding = evidence.winding(np.concatenate([[view.place for view in views], *loops]))
    there, *along = np.split(winding, np.cumsum([len(cycles), *map(len, cycles[:-1])]))
    found = []
    for cycle, tube, view, outside, inside in zip(cycles, tubes, views, there, map(np.median, along), strict=True):
        crossing = crossings(positions(cycle, len(surface)), len(cycle), bonds, closed=True)
        facts = dict(
            opening=float(np.log(min(view.radius, WIDE_OPEN * tube) / tube + 0.1)),
            sight=min(view.sight, WIDE_OPEN),
            fall=float(1 - outside / max(inside, LEAST_INSIDE)),
            bonds=float(np.log(crossing.min() / max(np.median(crossing), TINY) + 0.01)),
        )
        found.append(LoopEvidence(facts, float(inside), view.centre, int(np.argmin(crossing))))
    return found


class _View(NamedTuple):
    """Through a loop."""

    centre: np.ndarray  # of the largest circle in it
    radius: float
    place: np.ndarray  # in that circle, where one sees best
    sight: float  # radius of the widest empty cylinder across it there, in spacings of the points


def _view(loop: np.ndarray, tube: float, evidence: Evidence) -> _View:
    centre, radius = inscribed_circle(loop)
    axes = np.linalg.svd(loop - loop.mean(axis=0), full_matrices=False)[2]
    aside = radius + WIDE_OPEN * evidence.spacing
    points = (evidence.points - centre) @ axes.T
    points = points[(np.abs(points) < [aside, aside, radius + tube]).all(axis=1)]
    sight = cdist(radius * VIEWS, points[:, :2]).min(axis=1, initial=np.inf) / max(evidence.spacing, TINY)
    best = np.argmax(sight)
    return _View(centre, radius, centre + radius * VIEWS[best] @ axes[:2], float(sight[best]))


def crossings(place: np.ndarray, n: int, bonds: tuple[np.ndarray, np.ndarray], closed: bool) -> np.ndarray:
    """Weight of the `Evidence.bonds` across each edge of a path, from what is on its one side to the other, (n,).

    `place` (M,) are the positions 0 to n - 1 of the graph's vertices along it, -1 of those that do not count. If it is
    closed, edges lead from each position to the next, and bonds the shorter way; else the last one is none.
    """
    pairs, weight = bonds
    first, last = np.sort(place[pairs], axis=1).T
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
    along = []
    for side in sides:
        travelled = arc_lengths(points[side])
        along.append(travelled / travelled[-1])
    nearest = np.abs(along[0][:, None] - along[1][None])
    pairs = [(i, int(np.argmin(nearest[i]))) for i in range(1, len(sides[0]) - 1)]
    pairs += [(int(np.argmin(nearest[:, j])), j) for j in range(1, len(sides[1]) - 1)]
    return np.array([(labels[sides[0][i]], labels[sides[1][j]]) for i, j in pairs])
