"""The armature of a skeleton for animation: its joints, and the bone that each bone hangs on."""

import itertools
from typing import Any, NamedTuple

import numpy as np

from ..curve.merging import merge_into
from ..curve.rooted import numbered_from
from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..geometry.polylines import arc_lengths, place_at, significance
from ..geometry.vectors import TINY, Floats, norm
from .mirror import Plane, mirrored_branches

CLOSEST_JOINTS = 0.5  # fitted: radii between joints whose number is given
LONG_BONE = 0.07  # fitted: of the length of the shorter part, which counts as much as the distance of a bend


class _MirroredSet(NamedTuple):
    """Branches that have joints in the same places: one, or two that are mirror images of each other."""

    rows: list[int]
    path: np.ndarray  # of the first
    centred: bool
    curve: Floats  # through its vertices, in the middle between it and the mirror image
    radii: Floats


def armature(forest: Skeleton, joints: int | None = None, plane: Plane | None = None) -> Skeleton:
    """The same forest with joints that can bend: none is nearer to another than the radius there.

    Junctions inside the ball of a thicker one share its joint. Each limb begins there, on the axis of the trunk, and
    has its next joint where it leaves the junction's ball, a pair of limbs equally far from it. Unknown radii count as
    0: then all vertices are joints. Vertex 0 stays the root, and numbers lead outwards.

    If a number of `joints` is given, there are so many bones, each of which turns about its joint: between the root,
    the ends, the junctions, and the places that tell most of the curve: the farthest bends, middles of long bones. With
    a `plane` of symmetry, joints of two branches that are mirror images of each other are, too, and those of a branch
    that is its own image are in the plane.
    """
    whole, root = _without_junctions_in_balls(forest)
    sets, ends = _mirrored_sets(whole, plane), whole.degree != 2
    if joints is None:
        forks = [whole.degree[each.path[[0, -1]]] > 2 for each in sets]
        lengths = [_joints_along(each, fork, each.path == root) for each, fork in zip(sets, forks, strict=True)]
    else:
        lengths = _telling_lengths(sets, int(ends.sum()) - whole.n_components, root, joints)
    joint = np.where(ends, np.cumsum(ends) - 1, -1)  # of each vertex
    end_places = whole.vertices.copy()
    places, radii, edges, n = [], [whole.radii[ends]], [np.empty((0, 2), int)], int(ends.sum())
    for each, at in sorted(zip(sets, lengths, strict=True), key=lambda pair: (pair[0].centred, len(pair[0].rows))):
        along = arc_lengths(each.curve)
        inner = np.concatenate([each.curve[[0, -1]], place_at(each.curve, along, at[1:-1])])
        for row in each.rows:
            path = whole.branches[row]
            own = arc_lengths(whole.vertices[path])
            number = np.concatenate([joint[path[:1]], n + np.arange(len(at) - 2), joint[path[-1:]]])
            middles = (at[1:] + at[:-1]) / 2 / max(along[-1], TINY)
            joint[path[1:-1]] = number[np.searchsorted(middles, own[1:-1] / max(own[-1], TINY))]
            shown = inner if plane is None or row == each.rows[0] else plane.mirrored(inner)
            end_places[path[[0, -1]]] = shown[:2]  # branches in the plane come last and put their ends there
            places.append(shown[2:])
            radii.append(np.interp(at[1:-1], along, each.radii))
            edges.append(np.sort(np.column_stack([number[:-1], number[1:]]), axis=1))
            n += len(at) - 2
    vertex = np.append(joint, -1)[whole.vertex_of_point]
    all_places = np.concatenate([end_places[ends], *places])
    jointed = Skeleton(all_places, np.concatenate(edges), np.concatenate(radii), vertex, whole.points, whole.normals)
    return numbered_from(jointed, int(joint[root]))


def _mirrored_sets(skeleton: Skeleton, plane: Plane | None) -> list[_MirroredSet]:
    """All branches, each alone, or with its mirror image in a plane."""
    curves, radii = ([values[path] for path in skeleton.branches] for values in (skeleton.vertices, skeleton.radii))
    partner, sets = [-1] * len(curves) if plane is None else mirrored_branches(skeleton, plane).tolist(), []
    for row, other in enumerate(partner):
        curve, radius = curves[row], radii[row]
        if plane is not None and other >= row:
            share, lengths = arc_lengths(curve), arc_lengths(curves[other])
            share *= lengths[-1] / max(share[-1], TINY)
            curve = (curve + plane.mirrored(place_at(curves[other], lengths, share))) / 2
            radius = (radius + np.interp(share, lengths, radii[other])) / 2
        if other >= row or other < 0:
            rows = [row, other] if other > row else [row]
            sets.append(_MirroredSet(rows, skeleton.branches[row], other == row, curve, radius))
    return sets


def _telling_lengths(sets: list[_MirroredSet], n: int, root: int, joints: int) -> list[np.ndarray]:
    """Lengths along the curves of sets of branches of the places that tell most of the curve.

    There are so many bones as `joints`; with only the ends, the junctions and the root there would be n, or one more.
    """
    kept = [np.union1d([0, len(each.curve) - 1], np.flatnonzero(each.path == root)) for each in sets]
    n += sum((len(rows) - 2) * len(each.rows) for rows, each in zip(kept, sets, strict=True))
    if joints < n:
        raise InvalidParameterError(
            f"joints = {joints}: between its ends, junctions and root the skeleton has {n} bones: ask for as many, "
            "or drop branches first (editing.prune, --prune-length)"
        )
    weights = [
        significance(each.curve, rows, LONG_BONE, CLOSEST_JOINTS * np.nan_to_num(each.radii))
        for each, rows in zip(sets, kept, strict=True)
    ]
    number = np.repeat(np.arange(len(sets)), list(map(len, weights)))
    place, weight = np.concatenate([np.arange(len(each)) for each in weights]), np.concatenate(weights)
    for k in np.argsort(-weight, kind="stable").tolist():
        if 0 < weight[k] < np.inf and n + len(sets[number[k]].rows) <= joints:
            n += len(sets[number[k]].rows)
            kept[number[k]] = np.append(kept[number[k]], place[k])
    return [arc_lengths(each.curve)[np.sort(rows)] for each, rows in zip(sets, kept, strict=True)]


def _without_junctions_in_balls(forest: Skeleton) -> tuple[Skeleton, int]:
    """Without branches from a junction to another in whose ball they are; and the vertex that replaces vertex 0."""
    root = 0
    while True:
        radii, group, inside = np.nan_to_num(forest.radii), np.arange(len(forest.vertices)), []
        for path in forest.branches:
            path = path if radii[path[0]] >= radii[path[-1]] else path[::-1]
            far = norm(forest.vertices[path] - forest.vertices[path[0]]).max()
            if (forest.degree[path[[0, -1]]] > 2).all() and far <= radii[path[0]]:
                inside.append(path)
        if not inside:
            return forest, root
        joined: set[int] = set()
        for path in sorted(inside, key=lambda path: -radii[path[0]]):
            if joined.isdisjoint(path[[0, -1]].tolist()):  # else in the next round
                joined |= {path[0], path[-1]}
                group[path] = path[0]
        root = int(np.searchsorted(np.unique(group), group[root]))
        forest = merge_into(forest, group)


def _joints_along(branch: _MirroredSet, forks: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Lengths along a branch of its joints, with its ends and the vertices `kept` among them, (k,) float array."""
    curve, radii, lengths = branch.curve, np.nan_to_num(branch.radii), arc_lengths(branch.curve)
    low = _length_in_ball(curve, radii[0]) if forks[0] else 0.0
    high = lengths[-1] - (_length_in_ball(curve[::-1], radii[-1]) if forks[1] else 0.0)
    inner = np.array([low, high])[forks] if low <= high else []
    if low <= high and high - low < np.interp((low + high) / 2, lengths, radii):  # no room for a bone in between
        inner = [(low + high) / 2] if forks.all() else []
    fixed = np.unique([*lengths[[0, -1]], *inner, *lengths[kept]])
    joints = [fixed[0]]
    for start, end in itertools.pairwise(fixed):
        if low <= start and end <= high:
            for length, radius in zip(lengths, radii, strict=True):
                if joints[-1] < length < end and joints[-1] + radius <= length <= end - radius:
                    joints.append(length)
        joints.append(end)
    return np.array(joints)


def _length_in_ball(curve: np.ndarray, radius: float) -> Any:
    """Length of a curve up to where it leaves the ball around its first place; infinite if it never does."""
    offset = curve - curve[0]
    outside = np.flatnonzero(norm(offset) > radius)
    if len(outside) == 0:
        return np.inf
    start, step = offset[outside[0] - 1], offset[outside[0]] - offset[outside[0] - 1]
    before, size = start @ step, norm(step)
    root = np.sqrt(before**2 - size**2 * (start @ start - radius**2))
    return arc_lengths(curve)[outside[0] - 1] + (root - before) / size


def bone_before(forest: Skeleton) -> np.ndarray:
    """The bone that each bone hangs on, (E,) int array of rows of `forest.edges`; -1 for bones at a root."""
    leading = np.full(len(forest.vertices), -1)
    leading[forest.edges[:, 1]] = np.arange(len(forest.edges))
    return leading[forest.edges[:, 0]]
