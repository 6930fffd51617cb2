"""Blades: leaves and flowers on stems, propellers, aeroplanes: thin flat limbs, whose midrib is the axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..curves import UP, any_rotation, direction, polygon, wander
from .lines import X, Y, arc, straight
from .prisms import any_bevel, any_end
from .section import ELLIPSE
from .solid import Solid

LEAF_STEPS, STEM_STEPS, FLOWER_STEM_STEPS = 25, 10, 16  # fitted: smooth enough
FUSELAGE_PLACES, WING_PLACES = 33, 14  # fitted: as many as ends and roots need
LEAST_THICKNESS = 0.5  # fitted: width below which a leaf is as thick as there, in its greatest
WING_POWER, WING_THINS = 2.5, 0.6  # fitted: of a wing's section; thickness falls so much slower than width
BOTH_SIDES = np.array([[0, 0, 0], [0, 1.0, 0]])
"""The plane of symmetry of a leaf and of an aeroplane."""


class _Wing(NamedTuple):
    """A pair of wings, or a fin."""

    spot: float  # along the fuselage
    long: float
    wide: float
    aspect: float
    taper: float


def blades(rng: np.random.Generator) -> Solid:
    """Draw a leaf, a flower, a propeller or an aeroplane."""
    solid, kind = Solid(), str(rng.choice(["leaf", "flower", "propeller", "plane"]))
    {"leaf": _leaf, "flower": _flower, "propeller": _propeller, "plane": _aeroplane}[kind](solid, rng)
    return solid.rotated(any_rotation(rng))


def _blade(solid, rng, places, wide, aspect, base, start, begin, side=Y):
    """Add a limb that is at least `base` wide where it starts, widest before its middle, and narrow at its tip."""
    widest = rng.uniform(0.35, 0.6)
    t = 0.02 + rng.uniform(0.88, 0.93) * np.linspace(0, 1, len(places))
    size = np.sin(np.pi * t ** (np.log(0.5) / np.log(widest))) ** rng.uniform(0.7, 1.0)
    size = np.where(t < widest, np.maximum(size, base / wide), size)
    thick = wide / aspect * np.maximum(size, LEAST_THICKNESS) ** 0.5
    solid.limb(places, wide * size, thick, ELLIPSE, side, ("round", "round"), start, begin=begin)


def _leaf(solid, rng):
    """A bent leaf on a bent stem."""
    u = rng.uniform
    wide, aspect, bend = u(0.13, 0.26), u(3.5, 9), u(-1, 1)
    radius = max(wide / aspect * u(0.7, 1), 0.018)
    long, stem = u(0.7, 1), u(0.15, 0.45)
    places = arc(long, bend, LEAF_STEPS, X, UP)
    stalk = arc(stem, u(-1, 1), STEM_STEPS, -X, UP)[::-1]
    size = radius * np.linspace(u(1, 1.4), 1, STEM_STEPS + 1)
    end = solid.limb(stalk, size, None, ELLIPSE, Y, (any_end(rng), "flat"), faces=(True, False))[-1]
    _blade(solid, rng, places, wide, aspect, radius, end, -0.5 * radius)
    solid.mirror = BOTH_SIDES


def _flower(solid, rng):
    """Three to six petals around a flat hub, mostly on a stem."""
    u = rng.uniform
    petals, aspect, tilt, hub = int(rng.integers(3, 7)), u(3, 7), u(0, 0.8), u(0.09, 0.15)
    long = u(0.5, 0.8)
    wide = min(0.4 * (long + hub) * np.sin(np.pi / petals) * u(0.55, 0.8), 0.2)
    base, high = max(0.5 * wide, 1.2 * (wide / aspect)), hub * u(0.35, 0.6)
    centre = solid.node([0, 0, 0], hub)
    solid.body(straight([0, 0, -high], [0, 0, high]), hub, None, ELLIPSE, X, bevel=0.3)
    for around in polygon(petals):
        out, more = direction(around + 0.05 * rng.normal(size=3) * [1, 1, 0]), u(-0.1, 0.1)
        ahead = np.cos(tilt + more) * out + np.sin(tilt + more) * UP
        places = arc(long + hub, u(-0.6, 0.4), LEAF_STEPS, ahead, np.cos(tilt) * UP - np.sin(tilt) * out)
        _blade(solid, rng, places, wide, aspect, base, centre, 0.5 * hub, np.cross(UP, out))
    if rng.random() < 0.6:
        radius = u(0.022, 0.04)
        length, bend = u(0.5, 0.9), u(0, 0.6)
        places = wander(rng, np.zeros(3), -UP, length, FLOWER_STEM_STEPS, bend)
        solid.limb(places, radius, None, ELLIPSE, X, start=centre)


def _propeller(solid, rng):
    """Two to five twisted blades around a shaft."""
    u = rng.uniform
    blades, aspect, radius = int(rng.integers(2, 6)), u(3.5, 8), u(0.06, 0.1)
    back, front, pitch = u(0.15, 0.5), radius * u(1.2, 2), u(0.1, 0.8)
    z = np.unique(np.concatenate([np.linspace(-back, 0, 8), np.linspace(0, front, 4)]))
    size = np.interp(z, [-back, -0.3 * back, 0], [u(0.5, 1), 1, 1])
    ends = ("flat", any_end(rng))
    places = np.column_stack([0 * z, 0 * z, z])
    shaft = solid.limb(places, radius * size, None, ELLIPSE, X, ends, bevel=any_bevel(rng))
    start, wide, long = solid.nearest(shaft, [0, 0, 0]), u(0.07, 0.13), u(0.45, 0.7)
    sweep_back, t = u(-0.5, 0.5) * wide, np.linspace(0, 1, LEAF_STEPS + 1)
    for out in polygon(blades):
        aside = np.cross(UP, out)
        places = np.outer(t * (long + radius), out) + np.outer(t**2 * sweep_back, aside)
        side = np.cos(pitch) * aside + np.sin(pitch) * UP
        _blade(solid, rng, places, wide, aspect, 0.45 * wide, start, 0.5 * radius, side)


def _aeroplane(solid, rng):
    """A fuselage with wings, tail wings and mostly a fin."""
    u = rng.uniform
    solid.mirror = BOTH_SIDES
    radius, x = u(0.045, 0.08), np.linspace(0, 1, FUSELAGE_PLACES)
    nose, tail = u(0.1, 0.25), u(0.5, 0.7)
    size = radius * np.interp(x, [0, nose, tail, 1], [u(0.5, 0.9), 1, 1, u(0.4, 0.7)])
    high, power = size * u(0.9, 1.2), u(2, 4)
    places = np.column_stack([x, 0 * x, 0 * x])
    ends = rng.choice(["round", "flat"]), rng.choice(["round", "flat"])
    fuselage = solid.limb(places, size, high, power, Y, ends)
    tip, lean, rise = any_end(rng), u(-0.1, 0.5), u(-0.1, 0.25)

    def add(wing, *ahead):
        start, along = fuselage[int(wing.spot * (len(fuselage) - 1))], np.linspace(0, 1, WING_PLACES)
        ahead = direction(np.array(ahead))
        narrower = (wing.taper - 1) * along
        a, b = wing.wide * (1 + narrower), wing.wide / wing.aspect * (1 + WING_THINS * narrower)
        places = solid.places[start] + np.outer(along * wing.long, ahead)
        side = direction(X - ahead * ahead[0])
        solid.limb(places, a, b, WING_POWER, side, ("flat", tip), start, begin=0.4 * radius)

    wing = _Wing(u(0.33, 0.48), u(0.4, 0.75), u(0.07, 0.13), u(4, 8), u(0.45, 1))
    for sign in (-1, 1):
        add(wing, lean, sign, rise)
    wing = _Wing(u(0.88, 0.95), u(0.18, 0.3), u(0.05, 0.07), u(3, 4.5), u(0.6, 1))
    for sign in (-1, 1):
        add(wing, lean, sign, 0)
    if rng.random() < 0.8:
        lean = u(0, 0.6)
        add(wing._replace(long=wing.long * u(0.7, 1)), lean, 0, 1)
