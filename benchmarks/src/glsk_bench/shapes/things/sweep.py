"""A section swept along a curve: how far points are from its surface, and a mesh of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d.geometry.vectors import dot, unit

from ..curves import direction
from .lines import lengths_along
from .section import outline, section_radius

AXIS_STEP = 0.2  # fitted: between samples of a bent axis, in the smaller of its greatest half axes
LEAST_SAMPLES = 8  # fitted: of a bent axis
STRAIGHT_COSINE = 1e-9  # derived: by how much directions of a straight polyline differ: roundings
SEARCH_REACH = 1.5  # fitted: how far from the samples of an axis points are looked for, in the reach of the surface
LEAST_LEVEL = 1e-9  # derived: keeps what divides by it finite on the axis
FLAT_RINGS = np.array([0.5, 0.0])  # fitted: of the mesh of a flat end, in the section
ROUND_RINGS = 16  # fitted: of the mesh of a round end


class Track(NamedTuple):
    """Close samples of the axis of a sweep, each with its directions."""

    lengths: np.ndarray
    places: np.ndarray
    ahead: np.ndarray
    aside: np.ndarray  # of the half axis a
    up: np.ndarray  # of the half axis b


class Local(NamedTuple):
    """Points near a sweep, as coordinates along its axis and across."""

    along: np.ndarray
    y: np.ndarray
    z: np.ndarray
    ahead: np.ndarray  # directions, one for all or one each
    aside: np.ndarray
    up: np.ndarray


class Distance(NamedTuple):
    """How far points are from a surface, below 0 inside, as far as first derivatives tell."""

    rows: np.ndarray  # the points that are near enough to say so
    values: np.ndarray
    gradients: np.ndarray  # of length 1


@dataclass(eq=False)
class Sweep:
    """A superellipse of changing half axes along a curve.

    Attributes
    ----------
    places : (n, 3) float array
        Along the axis.
    a, b : (n,) float arrays
        Half axes there; a is in the direction of `side`.
    power : float
        Of the superellipse.
    side : (3,) float array
    ends : tuple of str
        "flat" or "round", the first and the last.
    closed : bool
        Whether the last place is joined to the first, and there are no ends.
    """

    places: np.ndarray
    a: np.ndarray
    b: np.ndarray
    power: float
    side: np.ndarray
    ends: tuple[str, str]
    closed: bool = False

    def rotated(self, rotation: Rotation) -> Sweep:
        """The sweep turned about the origin."""
        return self._like(rotation.apply(self.places), self.a, self.b, rotation.apply(self.side))

    def scaled(self, scale: float, shift: np.ndarray) -> Sweep:
        """The sweep made larger, and then moved."""
        return self._like(self.places * scale + shift, self.a * scale, self.b * scale, self.side)

    def _like(self, places, a, b, side):
        return Sweep(places, a, b, self.power, side, self.ends, self.closed)

    @cached_property
    def knots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Lengths, places and half axes at the given places, in a closed one with the first once more at the end."""
        again = np.r_[0 : len(self.places), 0] if self.closed else np.arange(len(self.places))
        places = self.places[again]
        return lengths_along(places), places, self.a[again], self.b[again]

    @cached_property
    def length(self) -> float:
        """Of the axis."""
        return self.knots[0][-1]

    @cached_property
    def caps(self) -> tuple[np.ndarray, np.ndarray]:
        """How far round ends stand out, the first and the last: the radius of the section there."""
        _, _, a, b = self.knots
        return section_radius(a[0], b[0], self.power), section_radius(a[-1], b[-1], self.power)

    @cached_property
    def reach(self) -> float:
        """How far the surface is from the axis, at most."""
        _, _, a, b = self.knots
        farthest = np.hypot(a, b).max() if self.power > 2 else max(a.max(), b.max())
        return max(farthest, *self.caps)

    @cached_property
    def thinnest(self) -> float:
        """The least of its half axes."""
        return min(self.a.min(), self.b.min())

    @cached_property
    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """How fast the half axes grow between places."""
        lengths, _, a, b = self.knots
        step = np.diff(lengths)
        return np.diff(a) / step, np.diff(b) / step

    @cached_property
    def is_straight(self) -> bool:
        """Whether the axis is a line, and not closed."""
        places = self.places
        if self.closed or len(places) == 2:
            return not self.closed
        return np.abs(unit(np.diff(places, axis=0)) - direction(places[-1] - places[0])).max() < STRAIGHT_COSINE

    @cached_property
    def track(self) -> Track:
        """The axis in samples near each other; of a straight one the given places."""
        lengths, places, a, b = self.knots
        if not self.is_straight:
            steps = int(self.length / (AXIS_STEP * min(a.max(), b.max())))
            fine = np.linspace(0, self.length, max(LEAST_SAMPLES, steps, 2 * len(places)))
            fine = np.unique(np.concatenate([fine, lengths]))
            fine = fine[np.r_[True, np.diff(fine) > 1e-9]]
            spline = CubicSpline(lengths, places, bc_type="periodic" if self.closed else "not-a-knot")
            lengths, places = fine, spline(fine)
        if self.closed:
            lengths, places = lengths[:-1], places[:-1]
            ahead = unit(np.roll(places, -1, axis=0) - np.roll(places, 1, axis=0))
        else:
            ahead = unit(np.gradient(places, lengths, axis=0))
        if self.closed or self.is_straight:
            aside = unit(self.side - (ahead @ self.side)[:, None] * ahead)
        else:
            aside = _transported(self.side, ahead)
        return Track(lengths, places, ahead, aside, np.cross(ahead, aside))

    @cached_property
    def _tree(self):
        return cKDTree(self.track.places)

    def distance(self, points: np.ndarray, margin: float, opened: float = 0.0, edge: float = 0.0) -> Distance:
        """Distances of those points that are no farther out than `margin`; of some farther ones, too.

        The last face, if it is flat, is `opened` so much farther out. Points that are as far from a face as from the
        side, to within `edge`, have the gradient of the face, and those so near beyond an end that of the side there.
        """
        rows, at = self._local(points, self.reach + margin)
        lengths, _, knot_a, knot_b = self.knots
        slope_a, slope_b = self.slopes
        on = np.mod(at.along, self.length) if self.closed else np.clip(at.along, 0, self.length)
        k = np.clip(np.searchsorted(lengths, on, "right") - 1, 0, len(slope_a) - 1)
        a, b = knot_a[k] + slope_a[k] * (on - lengths[k]), knot_b[k] + slope_b[k] * (on - lengths[k])
        y, z = np.abs(at.y) / a, np.abs(at.z) / b
        level = np.hypot(y, z) if self.power == 2 else (y**self.power + z**self.power) ** (1 / self.power)
        level = np.maximum(level, LEAST_LEVEL)
        to_y = np.sign(at.y) * (y / level) ** (self.power - 1) / a
        to_z = np.sign(at.z) * (z / level) ** (self.power - 1) / b
        widening = np.abs(to_y) * y * slope_a[k] + np.abs(to_z) * z * slope_b[k]
        ahead = np.where(np.abs(at.along - on) <= edge, -widening / np.maximum(level, 1), 0.0)
        if not self.closed:
            self._round_off(at.along - on, level, to_y, to_z, ahead)
        steep = np.maximum(np.sqrt(to_y * to_y + to_z * to_z + ahead * ahead), LEAST_LEVEL)
        values = np.maximum((level - 1) / steep, -np.minimum(a, b))
        gradients = to_y[:, None] * at.aside + to_z[:, None] * at.up + ahead[:, None] * at.ahead
        gradients = gradients / steep[:, None]
        if self.power > 2:  # beside the corners of flat sections the box around them says more
            beside = (np.abs(at.y) - a) / np.hypot(1, slope_a[k])
            values = np.maximum(values, np.maximum(beside, (np.abs(at.z) - b) / np.hypot(1, slope_b[k])))
        if not self.closed:
            faces = -at.along, at.along - self.length - opened
            for end, face, sign in zip(self.ends, faces, (-1, 1), strict=True):
                if end == "flat":
                    gradients = np.where((face > values - edge)[:, None], sign * at.ahead, gradients)
                    values = np.maximum(face, values)
        return Distance(rows, values, gradients)

    def _local(self, points, reach):
        """The points that are no farther than `reach` from the axis, and their coordinates along and across it."""
        track = self.track
        low, high = track.places.min(axis=0) - reach, track.places.max(axis=0) + reach
        rows = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
        if self.is_straight:
            frame = track.ahead[0], track.aside[0], track.up[0]
            offset = points[rows] - track.places[0]
            along, y, z = (offset @ each for each in frame)
            return rows, Local(along, y, z, *frame)
        apart, nearest = self._tree.query(points[rows], distance_upper_bound=SEARCH_REACH * reach)
        near = np.isfinite(apart)
        rows, nearest = rows[near], nearest[near]
        frame = track.ahead[nearest], track.aside[nearest], track.up[nearest]
        along, y, z = (dot(points[rows] - track.places[nearest], each) for each in frame)
        return rows, Local(track.lengths[nearest] + along, y, z, *frame)

    def _round_off(self, beyond, level, to_y, to_z, ahead):
        """Levels and their derivatives, in place, of what is beyond round ends, which are halves of ellipsoids."""
        for end, cap, sign in zip(self.ends, self.caps, (-1, 1), strict=True):
            out = np.flatnonzero(beyond * sign > 0)
            if end == "round" and len(out):
                share = beyond[out] / cap
                whole = np.hypot(level[out], share)
                to_y[out] = to_y[out] * level[out] / whole
                to_z[out] = to_z[out] * level[out] / whole
                ahead[out] = share / cap / whole
                level[out] = whole

    def mesh(self) -> np.ndarray:
        """Corners of the triangles of the whole surface, (m, 3, 3) float array."""
        track, (lengths, _, knot_a, knot_b) = self.track, self.knots
        corners = outline(self.power, (knot_a / knot_b).max())
        a, b = (np.interp(track.lengths, lengths, each)[:, None, None] for each in (knot_a, knot_b))
        spread = a * corners[:, :1] * track.aside[:, None] + b * corners[:, 1:] * track.up[:, None]
        rings = track.places[:, None] + spread
        if self.closed:
            rings = np.concatenate([rings, rings[:1]])
        else:
            first, last = (self._end_rings(end, spread) for end in (0, -1))
            rings = np.concatenate([first[::-1], rings, last])
        here, there = rings[:-1], rings[1:]
        beside, across = np.roll(here, -1, axis=1), np.roll(there, -1, axis=1)
        halves = np.stack([here, beside, across], axis=2), np.stack([here, across, there], axis=2)
        return np.concatenate([half.reshape(-1, 3, 3) for half in halves])

    def _end_rings(self, end, spread):
        """Rings of the mesh beyond the first or last of the axis, outward; the last is a point."""
        if self.ends[end] == "flat":
            size, out = FLAT_RINGS, 0 * FLAT_RINGS
        else:
            angle = np.linspace(0, np.pi / 2, ROUND_RINGS + 1)[1:]
            size, out = np.cos(angle), (-1 if end == 0 else 1) * self.caps[end] * np.sin(angle)
        middles = self.track.places[end] + out[:, None] * self.track.ahead[end]
        return middles[:, None] + size[:, None, None] * spread[end]


def _transported(side, ahead):
    """Directions across a curve that turn about it as little as can be, from the given one on."""
    across = np.empty_like(ahead)
    now = side - (ahead[0] @ side) * ahead[0]
    for k, each in enumerate(ahead):
        now = now - (each @ now) * each
        across[k] = now = now / np.linalg.norm(now)
    return across
