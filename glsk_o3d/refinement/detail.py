"""Take limbs out and in again by their probability, after a Refiner has judged them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..decisions import Decision
from ..numerics.vectors import norm
from ..skeleton import OF_VERTICES, Skeleton
from .merging import merge_into
from .spurs import limb_decision

END_MOVES = 3.0  # derived: radii within which an end stays that grows anew, and the junction that a branch has left


def judged_branches(skeleton: Skeleton) -> dict[int, Decision]:
    """The decision nearest to its end, by number, for each branch between a junction and an end that is a limb."""
    kept = [it for it in skeleton.report.decisions if it.about == "limb" and not it.changed]
    ends = np.array([branch[[0, -1]] for branch in skeleton.branches], int).reshape(-1, 2)
    degree = skeleton.degree[ends]
    numbers = np.flatnonzero((degree.min(axis=1) == 1) & (degree.max(axis=1) > 2))
    if not kept or not len(numbers):
        return {}
    tips = ends[numbers, degree[numbers].argmin(axis=1)]
    distance, nearest = cKDTree(skeleton.vertices[tips]).query([it.place for it in kept])
    found: dict[int, Decision] = {}
    for k in np.argsort(-distance, kind="stable").tolist():  # so that the nearest is the last
        if distance[k] <= END_MOVES * skeleton.radii[tips[nearest[k]]]:
            found[int(numbers[nearest[k]])] = kept[k]
    return found


def grafts(skeleton: Skeleton, least: float) -> Iterator[tuple[Decision, np.ndarray]]:
    """Pruned branches that are limbs with a probability of at least `least`, and where they belong.

    A branch is the path from the vertex nearest to the junction that it left, (k,) int array: its own vertices have the
    numbers after those of the skeleton and of the branches before it. The last one to be pruned is the first, since
    others may have left it.
    """
    vertices, radii = skeleton.vertices, skeleton.radii
    for limb in reversed(skeleton.report.decisions):
        if limb.about != "limb" or not limb.branch or limb.probability < least:
            continue
        places = np.array(limb.branch)
        away = norm(vertices - places[0])
        junction = int(away.argmin())
        if away[junction] <= END_MOVES * max(limb.radii[0], radii[junction]):
            yield limb, np.r_[junction, len(vertices) + np.arange(len(places) - 1)]
            vertices, radii = np.concatenate([vertices, places[1:]]), np.r_[radii, limb.radii[1:]]


def restored(skeleton: Skeleton, least: float) -> Skeleton:
    """A skeleton with those pruned branches that are limbs with a probability of at least `least`.

    Points nearer to their vertices than to the vertex that they have belong to them.
    """
    limbs, paths = [], []
    for limb, path in grafts(skeleton, least):
        limbs.append(limb)
        paths.append(path)
    if not limbs:
        return skeleton
    more = np.concatenate([limb.branch[1:] for limb in limbs])
    known = {name: np.r_[getattr(skeleton, name), np.full(len(more), np.nan)] for name in OF_VERTICES}
    m, radii = len(skeleton.vertices), np.concatenate([limb.radii[1:] for limb in limbs])
    for name in ("radii", "half_width", "half_thickness"):
        known[name][m:] = radii
    owner = skeleton.vertex_of_point.copy()
    rows = np.flatnonzero(owner >= 0)
    points = skeleton.points[rows]
    distance, nearest = cKDTree(more).query(points)
    nearer = distance < norm(points - skeleton.vertices[owner[rows]])
    owner[rows[nearer]] = m + nearest[nearer]
    back = set(limbs)
    decisions = [
        replace(it, changed=False, branch=(), radii=()) if it in back else it for it in skeleton.report.decisions
    ]
    return replace(
        skeleton,
        **known,
        vertices=np.concatenate([skeleton.vertices, more]),
        edges=np.concatenate([skeleton.edges, *(np.column_stack([path[:-1], path[1:]]) for path in paths)]),
        vertex_of_point=owner,
        report=replace(skeleton.report, decisions=tuple(decisions)),
    )


def without_limbs(skeleton: Skeleton, least: float) -> Skeleton:
    """A skeleton without branches that are limbs with a probability below `least`, at each junction the least first."""
    while True:
        worst: dict[int, tuple[Decision, np.ndarray]] = {}
        for number, limb in judged_branches(skeleton).items():
            path = skeleton.branches[number]
            path = path[::-1] if skeleton.degree[path[0]] == 1 else path
            before = worst.get(int(path[0]))
            if limb.probability < (before[0].probability if before else least):
                worst[int(path[0])] = limb, path
        if not worst:
            return skeleton
        group, gone = np.arange(len(skeleton.vertices)), {limb for limb, _ in worst.values()}
        for _, path in worst.values():
            group[path] = path[0]
        stays = [it for it in skeleton.report.decisions if it not in gone]
        cut = [limb_decision(skeleton, limb.probability, path, pruned=True) for limb, path in worst.values()]
        skeleton = replace(merge_into(skeleton, group), report=replace(skeleton.report, decisions=(*stays, *cut)))
