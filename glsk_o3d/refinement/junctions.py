"""Where limbs meet: their axes, taken where nothing disturbs them, say it, and not the contraction."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ..numerics.components import component_labels
from ..numerics.groups import Members
from ..numerics.polylines import arc_lengths, place_at, relative_distance
from ..numerics.vectors import TINY, dot, norm
from ..skeleton import Skeleton
from .axis_fit import axis_box
from .loops import surface_distance
from .meeting import AXIS_LEAVES, AXIS_LENGTH, Line, limb_line, meet
from .merging import merge_into

# All fitted.
AXIS_SHORT = 2.0  # length in radii, from each junction, below which a branch has no undisturbed place
MEETING_STAY = 0.1  # weight of where the junction was, per meeting: lines that are nearly one meet anywhere


class Meeting(NamedTuple):
    """Where limbs meet that go on straight on."""

    anchor: np.ndarray  # (k, 3), the last undisturbed place of each limb
    foot: np.ndarray  # (k, 3), where each limb passes the meeting place, or its anchor if that is behind it
    fits: np.ndarray  # (k,), whether the limb passes within the radius of the thickest


class Limbs:
    """The branches of a skeleton seen from their junctions.

    Attributes
    ----------
    surface : (M,) float array
        Distance from each vertex to the surface; the radius of vertices without points.
    branches : tuple of (p,) int array
        `Skeleton.branches`.
    radius : (B,) float array
        Of every branch, the median along it.
    short : (B,) bool array
        Branches that the contraction disturbs all along.
    inner : (B,) bool array
        Branches between two junctions.
    paths : list of (p,) int array
        Once for each junction at an end of a branch, from there.
    branch : list of int
        The branch of each path.
    at : dict
        Of every region the numbers of the paths that start there.
    region : (M,) int array
        What short branches between junctions join is one region, if asked for.
    """

    def __init__(self, skeleton: Skeleton, joined: bool) -> None:
        self.vertices, degree = skeleton.vertices, skeleton.degree
        surface = surface_distance(skeleton)
        self.surface = np.where(surface > 0, surface, skeleton.radii)
        self.branches = skeleton.branches
        ends = np.array([branch[[0, -1]] for branch in self.branches], int).reshape(-1, 2)
        self.radius = np.array([np.median(self.surface[branch]) for branch in self.branches], float)
        self.inner = (degree[ends] > 2).all(axis=1) & (ends[:, 0] != ends[:, 1])
        length = np.array([arc_lengths(self.vertices[branch])[-1] for branch in self.branches], float)
        self.short = joined & (length < AXIS_SHORT * self.radius * np.where(self.inner, 2, 1))
        self.region = np.arange(len(degree))
        if joined:
            self.region = component_labels(len(degree), ends[self.short & self.inner])
        self.paths, self.branch, self.at = [], [], defaultdict(list)
        for number, branch in enumerate(self.branches):
            for path in (branch, branch[::-1]):
                if degree[path[0]] > 2:
                    self.at[self.region[path[0]]].append(len(self.paths))
                    self.paths.append(path)
                    self.branch.append(number)
        self.axis = cache(self._axis)

    def _axis(self, limb: int) -> tuple[np.ndarray, np.ndarray, float]:
        """The last undisturbed place of a limb, its direction there, towards the junction, and how far along it is."""
        path, radius = self.paths[limb], self.radius[self.branch[limb]]
        places = self.vertices[path]
        along = arc_lengths(places)
        half = along[-1] / 2  # the other end may be disturbed, too
        others = [
            self.paths[k]
            for k in self.at[self.region[path[0]]]
            if self.branch[k] != self.branch[limb] and not self.short[self.branch[k]]
        ]
        start = 0.0
        if others:
            near = places[: max(np.searchsorted(along, half), 1)]
            ratio, _ = relative_distance(near, self.vertices, self.surface, others)
            inside = np.flatnonzero(ratio <= AXIS_LEAVES)
            start = min(along[inside[-1] + 1], half) if len(inside) else start
        stop = min(start + AXIS_LENGTH * radius, along[-1])
        anchor, back = place_at(places, along, start), place_at(places, along, stop)
        return anchor, (anchor - back) / max(np.linalg.norm(anchor - back), TINY), start

    def meeting(self, limbs: list[int], near: np.ndarray) -> Meeting:
        """The place nearest to the axes of some limbs, in the sense of least squares.

        Parameters
        ----------
        limbs : list of int
            Numbers of paths, at least one. Short ones have no say if there are two others.
        near : (3,) float array
            Where lines meet that are nearly one.
        """
        anchor, way, _ = (np.array(values) for values in zip(*map(self.axis, limbs), strict=True))
        radius = self.radius[[self.branch[limb] for limb in limbs]]
        long = ~self.short[[self.branch[limb] for limb in limbs]]
        say = long if long.sum() > 1 else np.ones(len(long), bool)
        across = say[:, None, None] * (np.eye(3) - way[:, :, None] * way[:, None])
        weight = across.sum(axis=0) + MEETING_STAY * np.eye(3)
        place = near + np.linalg.solve(weight, np.einsum("kij,kj->i", across, anchor - near))
        along = dot(place - anchor, way)
        fits = norm(place - anchor - along[:, None] * way) <= radius.max()
        return Meeting(anchor, anchor + np.maximum(along, 0)[:, None] * way, fits)


class _Place(NamedTuple):
    """Where a junction belongs."""

    place: np.ndarray
    radius: float  # of the sphere that touches the surface there
    lines: list[Line]  # of its limbs, as in `Limbs.at`


def move_junctions(skeleton: Skeleton) -> Skeleton:
    """Move junctions to where their limbs meet, merge those within one radius, and make the limbs straight from there.

    The contraction draws limbs together before they meet: the junction of a sharp corner lies inside it, limbs that
    leave a part bend, and limbs that enter a thick part nearly at one place have junctions of their own, in any order.
    The lines of limbs where they are undisturbed, and the surface around, say where they meet, see `meet`; all by
    weights, so that the place moves little if the points do. Of two junctions that are then less than a radius apart,
    nearest first, one is made, unless a loop would close.

    Returns
    -------
    Skeleton
        With other places of the junctions and of the vertices beside them, perhaps fewer.
    """
    while len(skeleton.junctions):
        limbs = Limbs(skeleton, joined=False)
        places = _places(skeleton, limbs)
        merged = _merged(skeleton, limbs, places)
        if merged is None:
            return _straightened(skeleton, limbs, places)
        skeleton = merged
    return skeleton


def _places(skeleton: Skeleton, limbs: Limbs) -> dict[int, _Place]:
    """Where every junction belongs."""
    supporting = skeleton.supporting_points
    points, normals = skeleton.points[supporting], skeleton.normals.take(supporting, axis=0)
    members = Members(skeleton.vertex_of_point[supporting], len(skeleton.vertices))
    low, high = axis_box(points if len(points) else skeleton.vertices)
    found = {}
    for junction in skeleton.junctions.tolist():
        here, lines, radius, around = limbs.at[junction], [], 0.0, []
        for limb in here:
            path, along = limbs.paths[limb], arc_lengths(limbs.vertices[limbs.paths[limb]])
            others = [limbs.paths[k] for k in here if limbs.branch[k] != limbs.branch[limb]]
            line = limb_line(limbs.vertices, limbs.surface, path, limbs.radius[limbs.branch[limb]], others)
            lines.append(line)
            radius = max(radius, float(np.interp(line.start, along, limbs.surface[path])))
            around.append(path[along <= along[-1] / 2])
        own = members.of(np.unique(np.concatenate(around)))
        place, touching = meet(lines, skeleton.vertices[junction], radius, points[own], normals[own])
        # normals that mean nothing may meet anywhere
        found[junction] = _Place(np.clip(place, low, high), touching, lines)
    return found


def _merged(skeleton: Skeleton, limbs: Limbs, places: dict[int, _Place]) -> Skeleton | None:
    """Merge pairs of junctions, each the other's nearest, that a branch joins and a radius parts; None if none are."""
    ends = [tuple(sorted(branch[[0, -1]].tolist())) for branch in limbs.branches]
    near: dict[int, tuple[float, int]] = {}
    for k in np.flatnonzero(limbs.inner).tolist():
        (a, b) = (places[v] for v in ends[k])
        apart = float(np.linalg.norm(a.place - b.place)) / max(a.radius, b.radius, TINY)
        if apart < 1 and ends.count(ends[k]) == 1:
            for v in ends[k]:
                near[v] = min(near.get(v, (np.inf, k)), (apart, k))
    pairs = [k for k in {k for _, k in near.values()} if all(near[v][1] == k for v in ends[k])]
    if not pairs:
        return None
    group, vertices, radii = np.arange(len(skeleton.vertices)), skeleton.vertices.copy(), skeleton.radii.copy()
    for k in pairs:
        stays = ends[k][0]
        group[limbs.branches[k]] = stays
        vertices[stays] = np.mean([places[v].place for v in ends[k]], axis=0)
        radii[stays] = radii[list(ends[k])].max()
    merged = merge_into(replace(skeleton, vertices=vertices, radii=radii), group)
    return merged if merged.n_loops == skeleton.n_loops else None


def _straightened(skeleton: Skeleton, limbs: Limbs, places: dict[int, _Place]) -> Skeleton:
    """Put junctions in their places, and the disturbed parts of limbs on straight lines from there."""
    vertices, radii = skeleton.vertices.copy(), skeleton.radii.copy()
    for junction, (place, _, lines) in places.items():
        vertices[junction] = place
        radii[junction] = 0
        for limb, line in zip(limbs.at[junction], lines, strict=True):
            path = limbs.paths[limb]
            along = arc_lengths(skeleton.vertices[path])
            start, anchor = line.start, line.anchor
            if (anchor - place) @ line.way > 0:  # the place lies ahead of where the limb is joined: it would turn back
                ahead = np.flatnonzero((along > start) & ((skeleton.vertices[path] - place) @ line.way < 0))
                if len(ahead):
                    start, anchor = along[ahead[0]], skeleton.vertices[path[ahead[0]]]
            moved = np.flatnonzero((along > 0) & (along < start))
            share = (along[moved] / max(start, TINY))[:, None]
            vertices[path[moved]] = (1 - share) * place + share * anchor
            # a junction owns points of everything around: what it measured itself does not count
            radius = np.interp(start, along, skeleton.radii[path])
            radii[path[moved]] = radius
            radii[junction] = max(radii[junction], radius)
    return replace(skeleton, vertices=vertices, radii=radii)
