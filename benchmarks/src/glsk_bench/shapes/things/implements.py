"""Implements: hammers, screwdrivers, spoons, spatulas, forks, wrenches, brushes, drills, glasses, keys."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..curves import UP, any_rotation, polygon
from .lines import X, Y, at_lengths, lengths_along, straight
from .prisms import any_bevel, any_end
from .section import any_power, half_axes
from .solid import Solid

RING_PLACES, JAW_PLACES = 36, 22  # fitted: round enough
LENS_CORNERS, LENS_PLACES = 40, 48  # fitted: of a superellipse, and evenly along it


def implements(rng: np.random.Generator) -> Solid:
    """Draw an implement: one of ten kinds, each as likely as another."""
    kind, solid = str(rng.choice(list(KINDS))), Solid()
    KINDS[kind](solid, rng)
    return solid.rotated(any_rotation(rng))


def _grip(solid, rng, length, radius, aspect, free, swell=0.25):
    """A handle along x that ends at the origin; gives its last node."""
    t = np.linspace(0, 1, 14)
    waves, phase = rng.uniform(0.6, 1.4), rng.uniform(0, 2)
    size, power = 1 + swell * np.sin(waves * np.pi * t + phase), rng.uniform(2, 6)
    a, b = half_axes(radius * size, aspect, power)
    places = straight([-length, 0, 0], [0, 0, 0], 14)
    return solid.limb(places, a, b, power, Y, (free, "flat"), bevel=0.3, faces=(True, False))[-1]


def _row(x, y=0.0, z=0.0):
    """Places of which some coordinates are the same for all."""
    return np.column_stack(np.broadcast_arrays(x, y, z))


def _from_origin(back, front):
    """Coordinates from so far behind the origin to so far before it, 17 with the origin itself."""
    return np.concatenate([np.linspace(-back, 0, 8), np.linspace(0, front, 10)[1:]])


def _hammer(solid, rng):
    """A head, mostly with a peen or a claw, and a handle downward."""
    u = rng.uniform
    radius, long = u(0.028, 0.05), u(0.26, 0.45)
    half, power = radius * u(1.3, 2.3), any_power(rng)
    front = u(0.35, 0.65) * long
    back = long - front
    x, a = _from_origin(front, back), np.full(17, half)
    b, z = np.full(17, half * u(0.75, 1)), np.zeros(17)
    if rng.random() < 0.6:
        t = np.clip((x - 1.2 * radius) / (back - 1.2 * radius), 0, 1)
        b = b * (1 - u(0.4, 0.65) * t)
        a = a * (1 + u(-0.1, 0.4) * t)
        z = -u(0, 0.5) * back * t**2
    head = solid.limb(_row(x, 0, z), a, b, power, Y, bevel=any_bevel(rng))
    t = np.linspace(0, 1, 16)
    size = radius * (1 + u(-0.2, 0.25) * t + 0.15 * np.sin(u(3, 9) * t))
    aspect, power = u(1, 1.6), u(2, 6)
    a, b = half_axes(size, aspect, power)
    places = straight([0, 0, 0], [0, 0, -u(0.7, 1)], 16)
    foot = solid.nearest(head, [0, 0, 0])
    solid.limb(places, a, b, power, X, ("flat", any_end(rng)), foot, bevel=0.2)


def _screwdriver(solid, rng):
    """A thick grip and a thin shaft with a flat blade."""
    u = rng.uniform
    radius = u(0.05, 0.075)
    end = _grip(solid, rng, u(0.38, 0.5), radius, 1.0, any_end(rng))
    thin, long, flare = radius * u(0.3, 0.45), u(0.4, 0.7), u(1, 1.8)
    a, b = np.full(14, thin), np.full(14, thin)
    a[-3:], b[-3:] = thin * np.array([1, flare, flare]), thin * np.array([1, 0.7, 0.45])
    solid.limb(straight([0, 0, 0], [long, 0, 0], 14), a, b, u(2, 4), Y, start=end, begin=-0.5 * thin)


def _spoon(solid, rng):
    """A flat handle that widens into an oval bowl, which is a flat plate."""
    u = rng.uniform
    long, bowl, wide, thick = u(0.55, 0.8), u(0.13, 0.19), u(0.085, 0.13), u(0.016, 0.026)
    round_places = long + bowl * (1 - np.cos(np.linspace(0, 0.79 * np.pi, 22)))
    x = np.concatenate([np.linspace(0, long, 18), round_places[1:]])
    across = (x - long - bowl) / bowl
    neck = thick * u(1, 1.6)
    oval = np.where(x > long, wide * np.sqrt(np.maximum(1 - across**2, 0)), 0)
    a = np.maximum(oval, np.where(x < long + bowl, neck, 0))
    a += neck * u(0, 1.2) * np.clip(1 - x / long * u(1, 2), 0, 1)
    z = 0.05 * u(-1, 1) * np.sin(x * u(2, 5)) + u(0, 0.12) * np.maximum(x - long, 0)
    power, end = u(2, 5), any_end(rng)
    solid.limb(_row(x, 0, z), a, thick, power, Y, (end, "round"))


def _spatula(solid, rng):
    """A grip and a thin blade, in six of ten at an angle."""
    u = rng.uniform
    radius = u(0.022, 0.036)
    long, aspect = u(0.5, 0.7), u(1, 2)
    end = _grip(solid, rng, long, radius, aspect, any_end(rng), 0.15)
    wide, thick, long = u(0.09, 0.17), u(0.016, 0.024), u(0.25, 0.42)
    tilt = u(-0.5, 0.5) * (rng.random() < 0.6)
    places = straight([0, 0, 0], long * np.array([np.cos(tilt), 0, np.sin(tilt)]), 12)
    shoulder, neck, tip = u(0.02, 0.35), max(u(0.2, 1), radius / wide), u(0.8, 1.25)
    a = wide * np.interp(np.linspace(0, 1, 12), [0, shoulder, 1], [neck, 1, tip])
    power = u(5, 10)
    solid.limb(places, a, thick, power, Y, start=end, begin=-0.4 * radius, bevel=any_bevel(rng))


def _fork(solid, rng):
    """A bar with three or four tines before it and a handle behind."""
    u = rng.uniform
    a, tines = u(0.02, 0.032), int(rng.integers(3, 5))
    b, pitch, long = a * u(0.6, 1), a * u(3.2, 4.2), u(0.24, 0.4)
    spots = (np.arange(tines) - (tines - 1) / 2) * pitch
    y = np.unique(np.append(spots, 0.0))
    bar = solid.limb(_row(0, y), a * u(1, 1.7), b * 1.1, 6, X, begin=-a, beyond=a, faces=(False, False))
    rise = u(-0.15, 0.15)
    x = np.linspace(0, long, 9)
    for spot in spots:
        size, power = np.linspace(1, u(0.75, 1), 9), u(2, 8)
        ends, start = ("flat", any_end(rng)), solid.nearest(bar, [0, spot, 0])
        solid.limb(_row(x, spot, rise * x**2 / long), a * size, b * size, power, Y, ends, start)
    t = np.linspace(0, 1, 16)
    size = 1 + u(0, 1.2) * t + 0.2 * np.sin(3 * t)
    places = straight([0, 0, 0], [-u(0.6, 0.9), 0, 0], 16)
    power, ends = u(2, 8), ("flat", any_end(rng))
    solid.limb(places, 1.3 * a * size, b, power, Y, ends, solid.nearest(bar, [0, 0, 0]))


def _wrench(solid, rng):
    """A handle with a ring or two jaws at each end."""
    u = rng.uniform
    a, b, long, power = u(0.035, 0.055), u(0.018, 0.032), u(0.5, 0.8), u(4, 10)
    ends = []
    for sign in (-1, 1):
        size = a * u(1.8, 2.6)
        wide, half = size * u(0.32, 0.5), b * u(1, 1.5)
        middle = sign * (long / 2 + size)
        if rng.random() < 0.5:
            places = polygon(RING_PLACES, radius=size) * [-sign, 1, 1] + [middle, 0, 0]
            ends.append(solid.ring(places, half, wide, power)[0])
            continue
        angle, start = np.linspace(0, np.pi - u(0.5, 0.85), JAW_PLACES), None
        for way in (-1, 1):
            x = sign * (long / 2 + size - size * np.cos(angle))
            side = Y if way * sign < 0 else -Y
            places = _row(x, way * size * np.sin(angle))
            start = solid.limb(places, wide, half, power, side, start=start, faces=(False, True))[0]
        ends.append(start)
    places = straight([-long / 2, 0, 0], [long / 2, 0, 0], 12)
    solid.limb(places, a, b, power, Y, start=ends[0], end=ends[1])


def _brush(solid, rng):
    """A grip, a ferrule, and bristles a little thinner than it."""
    u = rng.uniform
    radius = u(0.03, 0.05)
    long, aspect = u(0.45, 0.65), u(1, 2.2)
    end = _grip(solid, rng, long, radius, aspect, any_end(rng), 0.3)
    wide, thick, long = radius * u(1.8, 3.2), radius * u(0.8, 1.5), u(0.1, 0.2)
    power = u(4, 10)
    places = straight([0, 0, 0], [long, 0, 0], 6)
    end = solid.limb(places, wide, thick, power, Y, start=end, begin=-0.3 * radius, faces=(True, False))[-1]
    size = np.linspace(1, u(0.7, 1.3), 8)
    places = straight([0, 0, 0], [u(0.15, 0.32), 0, 0], 8) + [long, 0, 0]
    solid.limb(places, 0.96 * wide * size, 0.9 * thick * size, power, Y, start=end, begin=-0.02)


def _drill(solid, rng):
    """A barrel with a chuck, and a grip downward that ends in a battery."""
    u = rng.uniform
    radius, back, front = u(0.075, 0.11), u(0.2, 0.35), u(0.2, 0.4)
    x = _from_origin(back, front)
    size = 1 - u(0, 0.3) * np.clip(x / front, 0, 1)
    a = radius * u(0.8, 1) * size
    barrel = solid.limb(_row(x), a, radius * size, any_power(rng), Y, bevel=0.3, faces=(True, False))
    thin, more = radius * u(0.35, 0.6), u(0.12, 0.25)
    places, half = straight([front, 0, 0], [front + more, 0, 0], 6), thin * u(0.9, 1)
    solid.limb(places, thin, half, 2, Y, start=barrel[-1], bevel=any_bevel(rng))
    t, high = np.linspace(0, 1, 24), u(0.45, 0.7)
    flare, battery = u(0.2, 0.8), u(0.72, 0.85)
    size = 1 + flare / (1 + np.exp(-(t - battery) * 60))
    places = _row(u(-0.25, 0.05) * high * t, 0, -high * t)
    start = solid.nearest(barrel, [0, 0, 0])
    solid.limb(places, 0.8 * radius * size, 0.6 * radius * size, u(3, 10), X, start=start, bevel=0.25)


def _glasses(solid, rng):
    """Two rings, a bridge, and temples that bend down at their ends."""
    u = rng.uniform
    wide, high, radius = u(0.19, 0.24), u(0.14, 0.19), u(0.02, 0.03)
    gap, power = u(0.07, 0.12), u(2, 8)
    lens = _lens(wide, high, 2 / u(2, 4.5))
    deep = u(0.9, 1.5)
    rings = []
    for sign in (-1, 1):
        places = lens * [-sign, 1, 1] + [sign * (wide + gap / 2), 0, 0]
        rings.append(solid.ring(places, radius, deep * radius, power, Y))
    bridge = straight([-gap / 2, 0, 0], [gap / 2, 0, 0], 3)
    solid.limb(bridge, radius, radius * 0.9, power, Y, start=rings[0][0], end=rings[1][0])
    long, fold = u(0.7, 1), u(-0.1, 0.25)
    t = np.linspace(0, 1, 22)
    z = -0.25 * long * np.clip((t - 0.72) / 0.28, 0, 1) ** 2
    for sign, ring in zip((-1, 1), rings, strict=True):
        out = sign * (2 * wide + gap / 2)
        places = _row(out - sign * fold * t * long, long * t, z)
        start = solid.nearest(ring, [out, 0, 0])
        solid.limb(places, radius * 1.2, 0.8 * radius, power, UP, start=start, begin=-0.7 * radius)


def _lens(wide, high, power):
    """Places evenly around a superellipse in the plane of x and z."""
    angle = np.arange(LENS_CORNERS) * 2 * np.pi / LENS_CORNERS
    x, z = (
        size * np.sign(wave) * np.abs(wave) ** power for size, wave in ((wide, np.cos(angle)), (high, np.sin(angle)))
    )
    closed = _row(x, 0, z)[np.r_[0:LENS_CORNERS, 0]]
    return at_lengths(closed, np.linspace(0, lengths_along(closed)[-1], LENS_PLACES, endpoint=False))


def _key(solid, rng):
    """A ring, a shaft, and two or three teeth aside."""
    u = rng.uniform
    radius, long, power = u(0.028, 0.042), u(0.5, 0.75), u(3, 10)
    size, b = u(0.11, 0.17), radius * u(0.6, 1)
    wide = size * u(0.25, 0.45)
    places = polygon(RING_PLACES, radius=size) * [1, u(0.8, 1.2), 1] - [size, 0, 0]
    bow = solid.ring(places, b, wide, power)
    teeth = int(rng.integers(2, 4))
    last, pitch = u(0.02, 0.08), u(3.2, 4.5, teeth - 1) * radius
    spots = long - np.cumsum(np.append(last, pitch))
    x = np.unique(np.concatenate([np.linspace(0, long, 14), spots]))
    shaft = solid.limb(_row(x), radius, b, power, Y, start=bow[0])
    for spot in spots:
        places = straight([spot, 0, 0], [spot, -u(3.2, 4.6) * radius, 0], 5)
        start = solid.nearest(shaft, [spot, 0, 0])
        solid.limb(places, radius * u(0.75, 1), 0.9 * b, power, X, start=start)


KINDS: dict[str, Callable[[Solid, np.random.Generator], None]] = {
    "hammer": _hammer,
    "screwdriver": _screwdriver,
    "spoon": _spoon,
    "spatula": _spatula,
    "fork": _fork,
    "wrench": _wrench,
    "brush": _brush,
    "drill": _drill,
    "glasses": _glasses,
    "key": _key,
}
"""The kinds of implements, each as likely as another."""
