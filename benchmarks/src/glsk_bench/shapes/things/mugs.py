"""Mugs: cups, pitchers, pots, buckets and teapots, hollow; only the axes of handles and spouts are judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..curves import any_rotation
from .lines import X, Y
from .section import ELLIPSE, half_axes, section_radius
from .solid import ROUND_ENDS, Solid

HEIGHTS = {"cup": (0.7, 1.2), "pitcher": (1.2, 1.8), "pot": (0.6, 1.1), "bucket": (0.7, 1.1), "teapot": (0.7, 1)}
"""How high each kind is, at least and at most, in its greatest width."""
BUCKET_HANDLE_PLACES, HANDLE_PLACES, SPOUT_PLACES = 34, 30, 16  # fitted: smooth enough
VESSEL_PLACES = 15  # fitted: along its height
VESSEL_NODES = 9  # fitted: along its axis, besides the heights of handles and spouts
BUCKET_HOLDS, TO_RIM, SPOUT_AT = 0.9, 0.1, 0.4  # fitted: heights of a bucket's handle, the rim over it, and a spout
WIDEST_BUCKET_HANDLE = 0.09  # fitted: half an axis of its section
BOTTOM, BOTTOM_ROOM = 1.2, 0.3  # fitted: thickness of a bottom, and nearer places of the wall left out, in the wall
ABOVE_RIM = 1e-3  # derived: the void ends a little outside


def mugs(rng: np.random.Generator) -> Solid:
    """Draw a vessel: a cup in two of six, with one handle, or with two, or with a spout."""
    u = rng.uniform
    kind = str(rng.choice(["cup", "cup", "pitcher", "pot", "bucket", "teapot"]))
    high = {each: u(*limits) for each, limits in HEIGHTS.items()}[kind]
    t, wall = np.linspace(0, 1, VESSEL_PLACES), u(0.05, 0.09)
    if kind in ("cup", "bucket"):
        size = 1 + u(-0.25, 0.25) * (t - 1) - u(0, 0.12) * np.sin(np.pi * t) * rng.choice([-1, 1])
    else:
        size = u(0.6, 0.8) + (1 - u(0.6, 0.8)) * np.sin(np.pi * t ** u(0.7, 1.4)) ** 1.2
    radius, aspect, power = u(0.05, 0.085), u(1, 2.5), u(2, 6)
    a, b = map(float, half_axes(radius, aspect, power))
    vessel = _Vessel(Solid(), t * high, 0.5 * size / size.max(), wall, power, a, b)
    low, top = high * u(0.15, 0.3), high * u(0.7, 0.88)
    if kind == "bucket":
        _bucket(vessel, rng, high)
    else:
        _pot(vessel, rng, kind, high, low, top)
    return vessel.solid.rotated(any_rotation(rng))


@dataclass
class _Vessel:
    """A hollow body around the z axis, open at the top, and what its handles are like."""

    solid: Solid
    z: np.ndarray
    radius: np.ndarray  # of its outside at these heights
    wall: float
    power: float  # of a handle's section
    a: float  # half axes of it
    b: float
    nodes: Sequence[int] = ()

    def middle_of_wall(self, height):
        """How far the wall is from the axis."""
        return float(np.interp(height, self.z, self.radius)) - 0.5 * self.wall

    def build(self, feet, squash=1.0):
        """Add the body, the void, and an axis that is not judged, with nodes at the heights `feet`."""
        z, wall, solid = self.z, self.wall, self.solid
        solid.hollow = True
        solid.body(_upright(z), self.radius, self.radius / squash, ELLIPSE, X)
        low = z[0] + BOTTOM * wall
        heights = np.unique(np.append(z[z > low + BOTTOM_ROOM * wall], low))
        inner = np.interp(heights, z, self.radius)
        heights, inner = np.append(heights, z[-1] + ABOVE_RIM), np.append(inner, inner[-1])
        solid.void(_upright(heights), inner - wall, inner / squash - wall, ELLIPSE, X)
        heights = np.linspace(z[0] + 0.6 * wall, z[-1] - 0.5 * wall, VESSEL_NODES)
        heights = np.unique(np.append(heights, feet))
        outer = np.interp(heights, z, self.radius)
        self.nodes = solid.path(_upright(heights), outer, outer / squash, ELLIPSE, judged=False)

    def foot(self, place, radius, a, b, power):
        """Add a node in the wall, and an edge to the axis that is not judged; gives the node."""
        start = self.solid.nearest(self.nodes, [0, 0, place[2]])
        node = self.solid.node(place, radius, a, b)
        self.solid.path([self.solid.places[start], place], a, b, power, start, node, judged=False)
        return node

    def handle(self, places, a, b):
        """Add a handle with both ends in the wall."""
        radius = float(section_radius(a, b, self.power))
        feet = [self.foot(places[k], radius, a, b, self.power) for k in (0, -1)]
        self.solid.limb(places, a, b, self.power, Y, ROUND_ENDS, *feet)


def _upright(heights):
    """Places on the z axis."""
    return np.column_stack([np.zeros((len(heights), 2)), heights])


def _bucket(vessel, rng, high):
    """A bucket with a bow over its top."""
    holds = BUCKET_HOLDS * high
    vessel.build([holds])
    angle = np.linspace(0, np.pi, BUCKET_HANDLE_PLACES)
    span, tall = vessel.middle_of_wall(holds), rng.uniform(0.5, 0.9)
    x = -span * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** rng.uniform(0.7, 1)
    z = holds + (tall + TO_RIM * high) * np.sin(angle)
    half = (min(each, WIDEST_BUCKET_HANDLE) for each in (vessel.a, vessel.b))
    vessel.handle(np.column_stack([x, 0 * angle, z]), *half)


def _pot(vessel, rng, kind, high, low, top):
    """A vessel with a handle from one height to another, or two; a teapot also has a spout."""
    u = rng.uniform
    spout = SPOUT_AT * high
    vessel.build([low, top, spout] if kind == "teapot" else [low, top], u(1, 1.15) if kind == "cup" else 1.0)
    out, fullness = u(0.22, 0.4) + vessel.b, u(0.6, 1)
    angle = np.linspace(-np.pi / 2, np.pi / 2, HANDLE_PLACES)
    inner = vessel.middle_of_wall(low), vessel.middle_of_wall(top)
    x = inner[0] + (inner[1] - inner[0]) * (np.sin(angle) + 1) / 2 + out * np.cos(angle) ** fullness
    x[[0, -1]] = inner
    places = np.column_stack([x, 0 * angle, (low + top) / 2 + (top - low) / 2 * np.sin(angle)])
    for turn in (0.0, np.pi) if kind == "pot" else (0.0,):
        vessel.handle(Rotation.from_euler("z", turn).apply(places), vessel.a, vessel.b)
    if kind == "teapot":
        radius, start = vessel.a * u(0.9, 1.3), np.array([-vessel.middle_of_wall(spout), 0, spout])
        foot = vessel.foot(start, radius, radius, radius, ELLIPSE)
        t = np.linspace(0, 1, SPOUT_PLACES)
        x, tall = -u(0.35, 0.5) * t, high * u(0.85, 1.1) - spout
        places = start + np.column_stack([x, 0 * t, tall * t ** u(1.2, 2)])
        vessel.solid.limb(places, radius * (1.25 - 0.5 * t), None, ELLIPSE, Y, ("round", "flat"), foot)
