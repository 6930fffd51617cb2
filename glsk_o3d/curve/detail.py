"""Turn the detail of a skeleton up and down: limbs by their probability, after a Refiner has judged them."""

import heapq
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..data.decisions import Decision
from ..data.graph import OF_VERTICES
from ..data.skeleton import Skeleton
from ..geometry.numbers import derived, speed
from ..geometry.pairing import final_representatives
from ..geometry.polylines import arc_lengths, maximal_paths
from ..geometry.vectors import TINY, norm
from .topology.spurs import limb_candidate


@dataclass(frozen=True)
class DetailNumbers:
    """Numbers of `with_limbs`."""

    moved: float = derived(2.0, "radii that an end or a junction moves while the curve is refined")
    even: float = derived(0.5, "probability from which something is more likely than not")
    tips: int = speed(8, "tips of which a decision may be about one")


DETAIL = DetailNumbers()


class JudgedLimbs(NamedTuple):
    """A skeleton with all branches that were pruned, and the decisions about its limbs."""

    vertices: np.ndarray  # (n, 3) those of the skeleton, and then those of pruned branches
    radii: np.ndarray  # (n,)
    edges: np.ndarray  # (e, 2) in the same order
    judged: dict[int, Decision]  # by the vertex at the end


def all_limbs(skeleton: Skeleton) -> JudgedLimbs:
    """A skeleton with its pruned branches, each joined to a vertex near the junction that it left, but no end.

    It is that whose ball, of its radius, has the old junction deepest inside. The last branch to be pruned is the first
    to come back, since others may have left it. Those that left a place where nothing is any more are left out.
    """
    vertices, radii, edges, judged = skeleton.vertices, skeleton.radii, [skeleton.edges], _judged_ends(skeleton)
    inner = skeleton.degree > 1
    for limb in reversed(skeleton.report.decisions):
        if limb.about != "limb" or not limb.changed or not limb.branch or not inner.any():
            continue
        places = np.array(limb.branch)
        away = np.where(inner, norm(vertices - places[0]) / np.fmax(radii, TINY), np.inf)
        junction = int(away.argmin())
        if away[junction] <= DETAIL.moved:
            path = np.r_[junction, len(vertices) + np.arange(len(places) - 1)]
            edges.append(np.column_stack([path[:-1], path[1:]]))
            vertices, radii = np.concatenate([vertices, places[1:]]), np.r_[radii, limb.radii[1:]]
            inner = np.r_[inner, np.arange(len(places) - 1) < len(places) - 2]
            judged[int(path[-1])] = limb
    return JudgedLimbs(vertices, radii, np.concatenate(edges), judged)


def pruning_order(limbs: JudgedLimbs) -> Iterator[tuple[Decision, float, list[int]]]:
    """The branches that leave a junction and end, as paths from there, with their probability, as they go.

    The least probable limb goes first. Where two branches are left at a junction they are one from then on: a limb if
    one of those beyond the junction is, 1 - prod (1 - p), of which only those more probable than not count.
    """
    branches = dict(enumerate(path for path, _ in maximal_paths(len(limbs.vertices), limbs.edges)))
    limbs_at = defaultdict[int, list[int]](list)
    for number, path in branches.items():
        limbs_at[path[0]].append(number)
        limbs_at[path[-1]].append(number)
    chance = {tip: limb.probability for tip, limb in limbs.judged.items()}
    waiting, none = [(probability, tip) for tip, probability in chance.items()], defaultdict[int, float](lambda: 1.0)
    heapq.heapify(waiting)
    while waiting:
        before, tip = heapq.heappop(waiting)
        if before < chance[tip]:
            heapq.heappush(waiting, (chance[tip], tip))
            continue
        number = limbs_at[tip][0]
        path = branches[number] if branches[number][-1] == tip else branches[number][::-1]
        junction = path[0]
        if len(limbs_at[junction]) < 3:
            continue
        yield limbs.judged[tip], chance[tip], path
        limbs_at[junction].remove(number)
        if chance[tip] > DETAIL.even:  # others were mostly gone when the rest was judged
            none[junction] *= 1 - chance[tip]
        if len(limbs_at[junction]) == 2 and limbs_at[junction][0] != limbs_at[junction][1]:
            one, other = limbs_at.pop(junction)
            first, second = branches[one], branches.pop(other)
            first = first if first[-1] == junction else first[::-1]
            second = second if second[0] == junction else second[::-1]
            branches[one] = first + second[1:]
            limbs_at[second[-1]][limbs_at[second[-1]].index(other)] = one
            for end in (first[0], second[-1]):
                if end in chance:
                    chance[end] = 1 - (1 - chance[end]) * none[junction]


def with_limbs(skeleton: Skeleton, least: float) -> Skeleton:
    """A skeleton with all branches that are limbs with a probability of at least `least`, and without others.

    Points of branches that go belong to the junction; those nearer to a branch that comes than to their vertex to it.
    What samples of the cloud said about its parts is dropped.
    """
    limbs, m = all_limbs(skeleton), len(skeleton.vertices)
    into, gone = np.arange(len(limbs.vertices)), dict[Decision, tuple[float, list[int]]]()
    for limb, chance, path in takewhile(lambda entry: entry[1] < least, pruning_order(limbs)):
        into[path[1:]] = path[0]
        gone[limb] = chance, path
    stays = into == np.arange(len(into))
    if stays[:m].all() and not stays[m:].any():
        return skeleton
    owner = np.append(final_representatives(into)[:m], -1)[skeleton.vertex_of_point]
    more, rows = m + np.flatnonzero(stays[m:]), np.flatnonzero(owner >= 0)
    if len(more) and len(rows):
        points = skeleton.points[rows]
        distance, nearest = cKDTree(limbs.vertices[more]).query(points)
        nearer = distance < norm(points - limbs.vertices[owner[rows]])
        owner[rows[nearer]] = more[nearest[nearer]]
    unknown = np.full(len(into) - m, np.nan)
    known = {name: np.r_[getattr(skeleton, name), unknown] for name in OF_VERTICES}
    for name in ("radii", "half_width", "half_thickness"):
        known[name][m:] = limbs.radii[m:]
    decisions, back = [], {limb for limb in limbs.judged.values() if limb.changed} - set(gone)
    for decision in skeleton.report.decisions:
        if decision.changed or decision not in gone:
            decisions.append(replace(decision, changed=False, branch=(), radii=()) if decision in back else decision)
    decisions += [
        limb_candidate(limbs.vertices, limbs.radii, np.array(path), {}, chance, True).decision("limb")
        for limb, (chance, path) in gone.items()
        if not limb.changed
    ]
    index = np.append(np.cumsum(stays) - 1, -1)
    return skeleton.changed(
        **{name: values[stays] for name, values in known.items()},
        vertices=limbs.vertices[stays],
        edges=index[limbs.edges[stays[limbs.edges].all(axis=1)]],
        vertex_of_point=index[owner],
        report=replace(skeleton.report, decisions=tuple(decisions), support=(), n_draws=0, n_agreeing=0),
    )


def _judged_ends(skeleton: Skeleton) -> dict[int, Decision]:
    """The decisions about limbs that were kept, each by the vertex at the end that it is about.

    Ends have moved since: the nearest decisions and ends belong together. The root of a tree is no limb's end.
    """
    kept = [decision for decision in skeleton.report.decisions if decision.about == "limb" and not decision.changed]
    reach: dict[int, float] = {}
    for path in skeleton.branches:
        path = path if skeleton.degree[path[-1]] == 1 else path[::-1]
        if skeleton.degree[path[-1]] == 1 and skeleton.degree[path[0]] > 2:
            tip, length = int(path[-1]), float(arc_lengths(skeleton.vertices[path])[-1])
            reach[tip] = max(DETAIL.moved * float(skeleton.radii[tip]), length)
    if root := skeleton.report.root:
        reach.pop(int(norm(skeleton.vertices - root).argmin()), None)
    if not kept or not reach:
        return {}
    tips = list(reach)
    near = min(DETAIL.tips, len(tips))
    distance, nearest = cKDTree(skeleton.vertices[tips]).query(
        [decision.place for decision in kept], range(1, near + 1)
    )
    decision_of_tip: dict[int, Decision] = {}
    free = set(range(len(kept)))
    for pair in np.argsort(distance, axis=None, kind="stable").tolist():
        k, tip = pair // near, tips[nearest.flat[pair]]
        if k in free and tip not in decision_of_tip and distance.flat[pair] <= reach[tip]:
            decision_of_tip[tip] = kept[k]
            free.discard(k)
    return decision_of_tip
