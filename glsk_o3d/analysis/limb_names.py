"""Names of the bones of an armature: of limbs where these are plain, as in an upright biped or quadruped."""

import numpy as np

from ..data.skeleton import Skeleton
from ..geometry.groups import group_rank
from ..geometry.vectors import TINY, Floats, norm
from .mirror import Plane, mirrored_branches

LOW = 0.25  # fitted: of the height, up to which the feet reach
LEAST_ARM = 0.2  # fitted: of the height, how long an arm is, and an ear is not
THICKER_HEAD = 1.2  # fitted: radius at the end of a head over that at the end of a tail
LEAST_FOOT = 0.05  # fitted: of the height, by how much a foot points ahead
VERTICAL = {"z": np.array([0.0, 0, 1]), "y": np.array([0.0, 1, 0])}
FRONT = {"z": np.array([0.0, -1, 0]), "y": np.array([0.0, 0, 1])}  # published: glTF 2.0, 3.4, and as Blender has it


def bone_names(bones: Skeleton, plane: Plane | None = None, up: str = "z", sides: bool = False) -> list[str]:
    """Names of the bones of an armature that is numbered from its root: of their branch, and their number on it.

    With a plane of symmetry, two or four feet in mirrored pairs and a head in the plane make a body. Its parts are
    head, neck, spine, tail, leg and arm, or front_leg and hind_leg; other branches have their number. Names of limbs
    end in ``_left`` or ``_right``, and with `sides` those of all branches that are mirror images of each other.
    """
    branch, count = bones.branch_of_edge, len(bones.branches)
    labels, suffixes = {row: f"branch_{row}" for row in range(count)}, [""] * count
    partner = np.full(count, -1) if plane is None else mirrored_branches(bones, plane)
    named, ahead = ({}, FRONT[up]) if plane is None else _limbs(bones, partner, up)
    left = np.cross(VERTICAL[up], ahead)
    for i, j in enumerate(partner.tolist()):
        if i < j and (sides or i in named):
            first, second = (bones.vertices[bones.branches[row]].mean(axis=0) @ left for row in (i, j))
            suffixes[i], suffixes[j] = ("_left", "_right") if first > second else ("_right", "_left")
            labels[j] = labels[i]
    labels |= named
    label_of_bone = [labels[row] for row in branch.tolist()]
    if "neck" not in named.values():  # the bone at the end of the head's branch is the head
        for bone, label in enumerate(label_of_bone):
            if label == "head" and bones.degree[bones.edges[bone]].min() > 1:
                label_of_bone[bone] = "neck"
    group = np.unique([label + suffixes[row] for label, row in zip(label_of_bone, branch, strict=True)], False, True)[1]
    numbers = group_rank(group, len(label_of_bone)).tolist()
    return [
        f"{label}.{number:03d}{suffixes[row]}"
        for label, number, row in zip(label_of_bone, numbers, branch, strict=True)
    ]


def _limbs(bones: Skeleton, partner: np.ndarray, up: str) -> tuple[dict[int, str], Floats]:
    """Names of the branches of a biped or quadruped, none for anything else; and the direction in which it looks."""
    starts, ends = np.array([path[[0, -1]] for path in bones.branches]).T
    if bones.degree[0] == 1:  # the root is an end
        starts, ends = np.where(starts == 0, ends, starts), np.where(starts == 0, 0, ends)
    z = bones.vertices @ VERTICAL[up]
    size, lowest = max(float(np.ptp(z)), TINY), z[ends]
    for row in np.argsort(-ends, kind="stable"):  # what grows from it has greater numbers
        lowest[row] = lowest[[row, *np.flatnonzero(starts == ends[row])]].min()
    rows = np.arange(len(partner))
    centred = partner == rows
    spine = np.union1d(starts[centred], ends[centred])
    trunk = np.isin(starts, spine) | (starts == starts[partner])
    pairs = [(row, int(partner[row])) for row in np.flatnonzero((partner > rows) & trunk).tolist()]
    legs = [pair for pair in pairs if lowest[list(pair)].max() < z.min() + LOW * size]
    length = np.bincount(bones.branch_of_edge, bones.edge_lengths, len(rows))
    arms = [pair for pair in pairs if pair not in legs and length[list(pair)].min() > LEAST_ARM * size]
    tips = np.flatnonzero(bones.degree[ends] == 1)
    outside = tips[[_is_outside(bones, row, int(ends[row])) for row in tips.tolist()]]
    low = outside[(z[ends[outside]] < z.min() + LOW * size) & ~centred[outside]]
    onward = np.concatenate([starts[centred], starts[[row for row, _ in legs]]])  # beyond which the trunk goes on
    last = np.union1d(outside, np.setdiff1d(rows, tips))
    tips = last[centred[last] & ~np.isin(ends[last], onward)]
    head = _head(z[ends[tips]], bones.radii[ends[tips]], z.min() + size / 2)
    if head is None or len(legs) not in (1, 2) or len(low) != 2 * len(legs) or bones.n_components > 1:
        return {}, FRONT[up]
    head, tails = tips[head], np.delete(tips, head)

    def from_head(pair: tuple[int, int]) -> tuple[float, float]:
        route = bones.vertices[bones.path(int(starts[pair[0]]), int(ends[head]))]
        return float(norm(np.diff(route, axis=0)).sum()), float(
            norm(bones.vertices[ends[list(pair)]] - route[-1]).min()
        )

    legs, arms = sorted(legs, key=from_head), sorted(arms, key=from_head)[-1:] if len(legs) == 1 else []
    hips, shoulders = (int(starts[pair[0]]) for pair in (legs[-1], (arms or legs)[0]))
    named: dict[int, str] = {}
    for name, goal in (("neck", int(starts[head])), ("spine", hips)):
        route = bones.path(shoulders, goal)
        named |= {int(row): name for row in np.flatnonzero(np.isin(starts, route) & np.isin(ends, route))}
    kinds = ("front_leg", "hind_leg") if len(legs) == 2 else ("leg", "arm")
    for kind, pair in zip(kinds, [*legs, *arms], strict=False):
        named |= dict.fromkeys(pair, kind)
    named |= dict.fromkeys(tails.tolist() if len(tails) == 1 else (), "tail") | {int(head): "head"}
    feet = [
        bones.vertices[path[-2:]] if path[-1] == end else bones.vertices[path[1::-1]]
        for path, end in ((bones.branches[row], ends[row]) for row in legs[-1])
    ]
    ahead = bones.vertices[ends[head]] - np.mean([foot[1] for foot in feet], axis=0)
    if len(legs) == 1:
        ahead = np.mean([foot[1] - foot[0] for foot in feet], axis=0)
    ahead = ahead - ahead @ VERTICAL[up] * VERTICAL[up]
    return named, ahead if len(legs) == 2 or np.linalg.norm(ahead) > LEAST_FOOT * size else FRONT[up]


def _is_outside(bones: Skeleton, row: int, end: int) -> bool:
    """Whether the end of a branch is in no ball of another branch: that of a loop that was cut open may be."""
    others = np.delete(np.arange(len(bones.vertices)), bones.branches[row])
    return not (norm(bones.vertices[others] - bones.vertices[end]) < bones.radii[others]).any()


def _head(height: Floats, radius: Floats, middle: float) -> int | None:
    """Which of some ends in the plane is the head: the thickest, or the higher one if two are about as thick."""
    if len(height) == 1:
        return 0 if height[0] > middle else None
    order = np.argsort(-radius)
    if len(height) > 1 and radius[order[0]] > THICKER_HEAD * radius[order[1]]:
        return int(order[0])
    return int(height.argmax()) if len(height) == 2 else None
