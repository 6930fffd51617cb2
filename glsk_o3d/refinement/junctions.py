"""Where limbs meet: their axes, taken where nothing disturbs them, say it, and not the contraction."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ..numerics.components import component_labels
from ..numerics.polylines import arc_lengths, place_at, relative_distance
from ..numerics.vectors import TINY, dot, norm
from ..skeleton import Skeleton
from .axis_fit import axis_box
from .loops import surface_distance

# All fitted.
AXIS_LEAVES = 1.3  # distance from the other limbs, over that from them to the surface, from which a limb is undisturbed
AXIS_LENGTH = 2.5  # radii from there over which its axis is taken
AXIS_SHORT = 2.0  # length in radii, from each junction, below which a branch has no undisturbed place
MEETING_STAY = 0.1  # weight of where the junction was, per meeting: lines that are nearly one meet anywhere


class Meeting(NamedTuple):
    """Where limbs meet that go on straight on."""

    place: np.ndarray
    anchor: np.ndarray  # (k, 3), the last undisturbed place of each limb
    foot: np.ndarray  # (k, 3), where each limb passes the meeting place, or its anchor if that is behind it
    start: np.ndarray  # (k,), length along each limb from its junction to the anchor
    say: np.ndarray  # (k,), whether the limb was asked
    fits: np.ndarray  # (k,), whether the limb passes within the radius of the thickest
    ahead: np.ndarray  # (k,), whether it goes towards the place


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
            inside = np.flatnonzero(relative_distance(near, self.vertices, self.surface, others) <= AXIS_LEAVES)
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
        anchor, way, start = (np.array(values) for values in zip(*map(self.axis, limbs), strict=True))
        radius = self.radius[[self.branch[limb] for limb in limbs]]
        long = ~self.short[[self.branch[limb] for limb in limbs]]
        say = long if long.sum() > 1 else np.ones(len(long), bool)
        across = say[:, None, None] * (np.eye(3) - way[:, :, None] * way[:, None])
        weight = across.sum(axis=0) + MEETING_STAY * np.eye(3)
        place = near + np.linalg.solve(weight, np.einsum("kij,kj->i", across, anchor - near))
        along = dot(place - anchor, way)
        fits = norm(place - anchor - along[:, None] * way) <= radius.max()
        return Meeting(place, anchor, anchor + np.maximum(along, 0)[:, None] * way, start, say, fits, along >= 0)


def move_junctions(skeleton: Skeleton) -> Skeleton:
    """Move junctions to where the axes of their limbs meet, and make the limbs straight from there on.

    The contraction draws limbs together before they meet: the junction of a sharp corner lies inside it, and limbs that
    leave a part bend. Where a limb has left the others its curve is undisturbed; the axes taken there meet where the
    limbs do. A junction stays if they do not: if one passes by farther away than the thickest limb's radius, or they
    meet outside of the cloud, as those of limbs that are nearly parallel may, farther than an axis can be.

    Returns
    -------
    Skeleton
        With other places of the junctions and of the vertices beside them.
    """
    if not len(skeleton.junctions):
        return skeleton
    limbs = Limbs(skeleton, joined=False)
    vertices, radii = skeleton.vertices.copy(), skeleton.radii.copy()
    supporting = skeleton.points[skeleton.supporting_points]
    low, high = axis_box(supporting if len(supporting) else vertices)
    for junction in skeleton.junctions.tolist():
        here = limbs.at[junction]
        meeting = limbs.meeting(here, skeleton.vertices[junction])
        inside = (low <= meeting.place).all() and (meeting.place <= high).all()
        if not (inside and (meeting.fits & meeting.ahead).all()):
            continue
        vertices[junction] = meeting.place
        radii[junction] = 0
        for limb, anchor, start in zip(here, meeting.anchor, meeting.start, strict=True):
            along = arc_lengths(skeleton.vertices[limbs.paths[limb]])
            moved = np.flatnonzero((along > 0) & (along < start))
            share = (along[moved] / start)[:, None]
            vertices[limbs.paths[limb][moved]] = (1 - share) * meeting.place + share * anchor
            radius = np.interp(start, along, skeleton.radii[limbs.paths[limb]])
            radii[limbs.paths[limb][moved]] = radius
            radii[junction] = max(radii[junction], radius)
    return replace(skeleton, vertices=vertices, radii=radii)


def level_tips(skeleton: Skeleton) -> Skeleton:
    """Give every leaf the radius that its branch has one radius back, or half-way if it is shorter.

    A leaf owns few points, and those of the end that closes the tube: they say little about its radius.
    """
    radii = skeleton.radii.copy()
    for branch in skeleton.branches:
        along = arc_lengths(skeleton.vertices[branch])
        own = skeleton.radii[branch]
        back = min(np.median(own), along[-1] / 2)
        for end, place in ((0, back), (-1, along[-1] - back)):
            if skeleton.degree[branch[end]] == 1:
                radii[branch[end]] = np.interp(place, along, own)
    return replace(skeleton, radii=radii)
