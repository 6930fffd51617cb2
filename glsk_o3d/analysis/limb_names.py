"""Names of the bones of an armature: of limbs where these are plain, as in an upright biped or quadruped."""

import numpy as np

from ..curve.merging import merge_into
from ..data.skeleton import Skeleton
from ..geometry.groups import group_rank
from ..geometry.vectors import AXES, TINY, Floats, norm
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
    head, neck, spine, tail, leg and arm, or front_leg and hind_leg; other branches have their number. Fingers and toes
    are part of their limb. Names of limbs end in ``_left`` or ``_right``, and with `sides` those of all branches that
    are mirror images of each other.
    """
    named: dict[int, str] = {}
    if plane is not None:
        fork = _fork_of_prongs(bones, plane, LEAST_ARM * float(np.ptp(bones.vertices @ VERTICAL[up])))
        limbs = merge_into(bones, fork)
        partner = mirrored_branches(limbs, plane)
        named, ahead = _limbs(limbs, partner, up)
    if not named:
        limbs, fork, ahead = bones, np.arange(len(bones.vertices)), FRONT[up]
        partner = np.full(len(bones.branches), -1) if plane is None else mirrored_branches(bones, plane)
    branch, count, left = limbs.branch_of_edge, len(limbs.branches), np.cross(VERTICAL[up], ahead)
    labels, suffixes = {row: f"branch_{row}" for row in range(count)}, [""] * count
    for i, j in enumerate(partner.tolist()):
        if i < j and (sides or i in named):
            first, second = (limbs.vertices[limbs.branches[row]].mean(axis=0) @ left for row in (i, j))
            suffixes[i], suffixes[j] = ("_left", "_right") if first > second else ("_right", "_left")
            labels[j] = labels[i]
    labels |= named
    named_bones = [(labels[row], suffixes[row]) for row in branch.tolist()]
    of_head = [bone for bone, (label, _) in enumerate(named_bones) if label == "head"]
    at_end = [bone for bone in of_head if limbs.degree[limbs.edges[bone]].min() == 1]
    if at_end and "neck" not in named.values():  # the head's branch begins at the shoulders
        for bone in {*of_head} - {*at_end}:
            named_bones[bone] = "neck", ""
    # a prong is called as the bone that leads to its fork
    ends = bones.edges[:, 1]
    of_vertex = dict(zip(ends[fork[ends] == ends].tolist(), named_bones, strict=True))
    named_bones = [of_vertex[end] for end in fork[ends].tolist()]
    numbers = group_rank(np.unique(named_bones, axis=0, return_inverse=True)[1].reshape(-1), len(named_bones))
    return [f"{label}.{number:03d}{side}" for (label, side), number in zip(named_bones, numbers.tolist(), strict=True)]


def axes_of_body(bones: Skeleton, plane: Plane) -> list[str]:
    """Which of `AXES`, pointing up, make a body with two pairs of limbs of it."""
    found = []
    for axis in AXES:
        sign, shift = -1 if axis[0] == "-" else 1, 2 - "xyz".index(axis[-1])
        vertices, point, normal = (sign * np.roll(it, shift, axis=-1) for it in (bones.vertices, *plane))
        names = bone_names(bones.changed(vertices=vertices), Plane(point, normal))
        found += [axis] * any(name.startswith(("arm", "front_leg")) for name in names)
    return found


def _fork_of_prongs(bones: Skeleton, plane: Plane, least: float) -> np.ndarray:
    """The vertex where each prong leaves its limb, of other vertices itself, (M,) int array.

    A limb forks at its end, beside the plane, where no way to a tip is as long as an arm at least is. It goes on in the
    longest one; others are prongs, such as fingers.
    """
    fork, longest = np.arange(len(bones.vertices)), np.arange(len(bones.vertices))
    reach, outwards = np.zeros(len(fork)), np.argsort(bones.edges[:, 1], kind="stable")
    for edge in outwards[::-1].tolist():
        (start, end), length = bones.edges[edge].tolist(), bones.edge_lengths[edge]
        if reach[end] + length > reach[start]:
            reach[start], longest[start] = reach[end] + length, end
    beside = np.abs((bones.vertices - plane.point) @ plane.normal) > bones.radii
    forks = (bones.degree > 2) & (reach < least) & beside & (fork > 0)  # no limb leads to the root
    for start, end in bones.edges[outwards].tolist():
        if fork[start] != start or (forks[start] and longest[start] != end):
            fork[end] = fork[start]
    return fork


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
    tips = [row for row in rows[bones.degree[ends] == 1].tolist() if _is_outside(bones, row, int(ends[row]))]
    feet = [row for row in tips if z[ends[row]] < z.min() + LOW * size and not centred[row]]
    beyond = [*starts[centred], *(starts[row] for row, _ in legs)]  # from there on the trunk goes on
    tips = [row for row in {*tips, *rows[bones.degree[ends] > 1].tolist()} if centred[row] and ends[row] not in beyond]
    chosen = _head(z[ends[tips]], bones.radii[ends[tips]], z.min() + size / 2)
    if chosen is None or len(legs) not in (1, 2) or len(feet) != 2 * len(legs) or bones.n_components > 1:
        return {}, FRONT[up]
    head = tips.pop(chosen)
    legs, arms = (sorted(found, key=lambda pair: _gap(bones, ends, pair, head)) for found in (legs, arms))
    arms = arms[-1:] if len(legs) == 1 else []
    hips, shoulders = (int(starts[pair[0]]) for pair in (legs[-1], (arms or legs)[0]))
    named: dict[int, str] = {}
    for name, goal in (("neck", int(starts[head])), ("spine", hips)):
        route = bones.path(shoulders, goal)
        named |= dict.fromkeys(rows[np.isin(starts, route) & np.isin(ends, route)].tolist(), name)
    kinds = ("front_leg", "hind_leg") if len(legs) == 2 else ("leg", "arm")
    for kind, pair in zip(kinds, [*legs, *arms], strict=False):
        named |= dict.fromkeys(pair, kind)
    named |= dict.fromkeys(tips if len(tips) == 1 else (), "tail") | {head: "head"}
    return named, _ahead(bones, ends, legs, head, up)


def _gap(bones: Skeleton, ends: np.ndarray, pair: tuple[int, int], head: int) -> float:
    """Mean distance of the ends of a pair of limbs from that of the head."""
    return float(norm(bones.vertices[ends[list(pair)]] - bones.vertices[ends[head]]).mean())


def _ahead(bones: Skeleton, ends: np.ndarray, legs: list[tuple[int, int]], head: int, up: str) -> Floats:
    """The level direction in which a body looks: that of a biped's feet, or from the hind feet to the head."""
    feet, goal = ends[list(legs[-1])], bones.vertices[ends[head]]
    if len(legs) == 1:
        last = bones.edges[np.argsort(bones.edges[:, 1], kind="stable"), 0]  # joints before those but the root
        feet, goal = last[feet - 1], bones.vertices[feet].mean(axis=0)
    ahead: Floats = goal - bones.vertices[feet].mean(axis=0)
    ahead = ahead - ahead @ VERTICAL[up] * VERTICAL[up]
    least = LEAST_FOOT * np.ptp(bones.vertices @ VERTICAL[up]) if len(legs) == 1 else 0
    return ahead if np.linalg.norm(ahead) > least else FRONT[up]


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
