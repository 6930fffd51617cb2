"""Rings: washers, rolls of tape, nuts, wheels, rocker arms, blocks with holes; no hole is much wider than its bars."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from scipy.spatial.transform import Rotation

from ..curves import UP, any_rotation, direction, log_uniform, polygon
from .lines import X, Y, straight
from .plates import ROUNDISH, WIDER_BESIDE
from .prisms import any_bevel
from .section import ELLIPSE, NEARLY_BOX
from .solid import Solid

# Fitted, as all of this page. Lengths are in half the width of the bars around a hole.
RING_GAP = (
    0.12  # by what the solid must not close its holes, in the least radius: less than usual, as the holes are narrow
)
NARROWEST_HOLE, WIDEST_HOLE = 0.35, 1.2  # radius of a hole
RING_STEP = 12  # places of a ring for each spoke of a wheel
ROUND_PLACES, EYE_PLACES, ARM_PLACES = 48, 36, 13  # round and smooth enough
NUT_CORNERS, NUT_CUT = 30, 1.05  # power of its section, and how much of its bars is beyond its flats
CORNER_PLACES = 6  # of the rounded corner of a block's axis
SHARP_TURN, ROUND_TURN = 0.2, 0.3  # its radius, in the pitch of the holes: of holes with corners, and of round ones


def rings(rng: np.random.Generator) -> Solid:
    """Draw a washer, a roll of tape, a nut, in two of ten each a wheel or a rocker arm, in three a block with holes."""
    draw = RING_KINDS[int(rng.integers(len(RING_KINDS)))]
    power = rng.uniform(8, 20) if rng.random() < 0.5 else rng.uniform(3, 5)  # sharp or worn edges
    ring = _Ring(Solid(gap=RING_GAP), rng, rng.uniform(NARROWEST_HOLE, WIDEST_HOLE), power)
    draw(ring)
    return ring.solid.rotated(any_rotation(rng))


@dataclass
class _Ring:
    """A solid with holes while it is drawn, and what its first hole and the sections of its bars are like."""

    solid: Solid
    rng: np.random.Generator
    hole: float  # its radius
    power: float

    def eye(self, hole, half, count=EYE_PLACES, narrow=1.0, bar=1.0, middle=(0, 0, 0), turned=0.0):
        """Add a ring around a hole, of bars of this half width, so much half height; gives its nodes."""
        circle = Rotation.from_euler("z", turned).apply(polygon(count, radius=bar + hole) * [1, narrow, 1])
        self.solid.openings.append(2 * hole)
        return self.solid.ring(circle + middle, half, bar, self.power)

    def bore(self, hole, deep):
        """Take a round hole through the origin away."""
        self.solid.openings.append(2 * hole)
        self.solid.void(_upright(deep), hole, hole, ELLIPSE, X)

    def disc(self, half, a, b=None, power: float = ELLIPSE, side=X, bevel=0.0):
        """Add a body of this half height around the origin, without an axis."""
        self.solid.body(_upright(half), a, b, power, side, bevel=bevel)


def _upright(half):
    """Two places on the z axis."""
    return straight([0, 0, -half], [0, 0, half])


def _washer(ring):
    """A flat ring, round or a little oval."""
    half = ring.rng.uniform(0.12, 0.4)
    ring.eye(ring.hole, half, ROUND_PLACES, ring.rng.uniform(0.85, 1) if ring.hole > 0.7 else 1.0)


def _tape(ring):
    """A round ring, half as high as its bar is wide up to twice as high."""
    ring.eye(ring.hole, log_uniform(ring.rng, 0.5, 2), ROUND_PLACES)


def _nut(ring):
    """A nut with six sides, in three of ten with four."""
    u = ring.rng.uniform
    half, flats, bevel = u(0.4, 1.3), ring.hole + 2 / NUT_CUT, any_bevel(ring.rng)
    if ring.rng.random() < 0.7:  # a hexagon is the union of three rectangles
        for side in polygon(6)[:3]:
            ring.disc(half, flats, flats / np.sqrt(3), NUT_CORNERS, side, bevel / 2)
    else:
        ring.disc(half, flats, None, u(8, NUT_CORNERS), bevel=bevel)
    ring.bore(ring.hole, 2 * half + 1)
    ring.solid.path(polygon(ROUND_PLACES, radius=1 + ring.hole), 1.0, half, NEARLY_BOX, closed=True)


def _wheel(ring):
    """A rim, three to six spokes and a hub, in six of ten with a bore; the hole fits between two spokes."""
    u, rng, solid, hole = ring.rng.uniform, ring.rng, ring.solid, ring.hole
    spokes, half, high = int(rng.integers(3, 7)), u(0.5, 1), u(0.25, 1.2)
    wall, is_bored = u(0.6, 1), rng.random() < 0.6
    eye = wall * u(NARROWEST_HOLE, WIDEST_HOLE) * is_bored
    hub = eye + 2 * wall if is_bored else u(0.9, 1.6)
    middle = max((half + hole) / np.sin(np.pi / spokes), hub + hole)  # of each hole
    count, size, flange = RING_STEP * spokes, middle + hole + 1, high * u(0.8, 1.3)
    rim = solid.ring(polygon(count, radius=size), high, 1.0, ring.power)
    solid.openings.append(2 * hole)
    ring.disc(flange, hub, bevel=any_bevel(rng))
    if is_bored:
        ring.bore(eye, 2 * flange + 1)
        inner = solid.path(polygon(count, radius=eye + wall), wall, flange, ring.power, closed=True)
    else:
        inner = [solid.node(np.zeros(3), 0.8 * hub, hub, flange)] * count
    thick = high * u(0.6, 1)
    for k in range(0, count, RING_STEP):
        places = straight(solid.places[inner[k]], solid.places[rim[k]], 7)
        across, begin = np.cross(UP, direction(solid.places[rim[k]])), 0.0 if is_bored else hub / 2
        solid.limb(places, half, thick, ring.power, across, start=inner[k], end=rim[k], begin=begin)


def _rocker(ring):
    """An arm with an eye at each end, or an eye with an arm, in every other one on both sides."""
    u, rng, solid = ring.rng.uniform, ring.rng, ring.solid
    high, half, t = u(0.3, 1.3), u(0.55, 1.1), np.linspace(0, 1, ARM_PLACES)
    first = ring.eye(ring.hole, high)
    thick, long = high * u(0.7, 1), u(1.8, 4.5)
    if rng.random() < 0.5:
        other, bar, bow = u(NARROWEST_HOLE, WIDEST_HOLE), u(0.75, 1), u(-0.15, 0.15)
        far = np.array([1 + ring.hole + long + bar * (1 + other), 0, 0])
        second = ring.eye(bar * other, high * u(0.8, 1.2), bar=bar, middle=far + X, turned=np.pi)
        start, end = solid.places[first[0]], solid.places[second[0]]
        curved = straight(start, end, ARM_PLACES) + np.outer(4 * t * (1 - t) * bow * np.linalg.norm(end - start), Y)
        wide = half * (1 + u(-0.2, 0.35) * np.sin(np.pi * t))
        solid.limb(curved, wide, thick, ring.power, Y, start=first[0], end=second[0])
        return
    spots = [0, EYE_PLACES // 2 + int(rng.integers(-3, 4))]
    for k in spots[: int(rng.integers(1, 3))]:
        start, long, bow = solid.places[first[k]], u(1.8, 4.5), u(-0.2, 0.2)
        ahead = direction(start)
        across, end = np.cross(UP, ahead), str(rng.choice(["flat", "round"]))
        places = start + np.outer((1 + long) * t, ahead) + np.outer(bow * long * t**2, across)
        wide = half * (1 + u(-0.4, 0) * t)
        solid.limb(places, wide, thick, ring.power, across, ("flat", end), first[k])


def _block(ring):
    """A block with one to four holes in a row, or with two times two."""
    u, rng, solid = ring.rng.uniform, ring.rng, ring.solid
    counts = np.array([(1, 1), (2, 1), (3, 1), (4, 1), (2, 2)][int(rng.integers(5))])
    corner = float(ELLIPSE) if rng.random() < 0.6 else u(4, 8)
    hole = 2 * ring.hole * (np.ones(2) if corner == ELLIPSE else np.array([1, u(0.8, 1.25)]))
    half, pitch = u(0.3, 2), hole + 2
    ring.disc(half, *((counts * pitch + 2) / 2), u(8, 24), bevel=any_bevel(rng) / 2)
    for spot in product(*map(range, counts)):
        middle = (np.array(spot) - (counts - 1) / 2) * pitch
        solid.void(_upright(2 * half + 1) + [*middle, 0], *(hole / 2), corner, X)
    solid.openings += list(hole)
    wide = 1 + (WIDER_BESIDE * hole.mean() / 2 if corner < ROUNDISH else 0)
    bars = [(np.arange(1, count) - count / 2) * each for count, each in zip(counts, pitch, strict=True)]
    turn = (ROUND_TURN if corner < ROUNDISH else SHARP_TURN) * pitch.min()
    size = counts * pitch / 2
    rim = solid.path(_rounded_rectangle(size, turn, bars), wide, half, NEARLY_BOX, closed=True)
    crossing = None
    for along, across in ((1, 0), (0, 1)):
        for at in bars[across]:
            ends = np.zeros((2, 3))
            ends[:, across], ends[:, along] = at, [-size[along], size[along]]
            nodes = [solid.nearest(rim, end) for end in ends]
            if (counts > 1).all():  # the bars between two times two holes meet
                crossing = solid.node(np.zeros(3), solid.sizes[rim[0]], wide, half) if crossing is None else crossing
                nodes.insert(1, crossing)
            for start, end in pairwise(nodes):
                solid.path(solid.nodes[[start, end]], wide, half, NEARLY_BOX, start, end)


def _rounded_rectangle(size, turn, stops):
    """Places around a rectangle of these half sides, and where bars end at them: at `stops` along x, and along y."""
    angle, places = np.linspace(0, np.pi / 2, CORNER_PLACES), []
    for k, signs in enumerate(np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])):
        arc = turn * np.column_stack([np.cos(angle + k * np.pi / 2), np.sin(angle + k * np.pi / 2)])
        places += list(signs * (size - turn) + arc)
        along = k % 2
        side = np.tile(signs * size, (len(stops[along]), 1))
        side[:, along] = -signs[along] * stops[along]  # on the way to the next corner; they are symmetric
        places += list(side)
    return np.column_stack([places, np.zeros(len(places))])


RING_KINDS = (_block, _wheel, _nut, _block, _wheel, _rocker, _tape, _rocker, _block, _washer)
"""The functions that draw, each as often as it stands there."""
