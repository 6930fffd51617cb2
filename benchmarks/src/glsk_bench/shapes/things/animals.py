"""Animals: thick trunks with legs in pairs, a neck and a head, a tail, ears; parts flow into one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..curves import UP, any_rotation, direction
from .lines import X, Y, arc, lengths_along, rounded
from .prisms import any_end
from .section import ELLIPSE, half_axes
from .solid import ROUND_ENDS, Solid

TRUNK_PLACES, HEAD_PLACES = 25, 9  # fitted: smooth enough
EARS_FROM = 3  # fitted: which node of a head


def animals(rng: np.random.Generator) -> Solid:
    """Draw an animal with four or six legs; every other one is symmetric."""
    symmetric = rng.random() < 0.5
    animal = _Animal(Solid(blend=rng.uniform(0.12, 0.35)), rng, symmetric)
    if symmetric:
        animal.solid.mirror = np.array([[0, 0, 0], Y])
    trunk = _trunk(animal)
    has_tail, pairs = rng.random() < 0.75, int(rng.choice([2, 2, 3]))
    leg = _legs(animal, trunk, has_tail, pairs)
    _head(animal, trunk)
    if has_tail:
        _tail(animal, trunk, leg)
    return animal.solid.rotated(any_rotation(rng))


@dataclass
class _Animal:
    """What its parts are put on, and how they are."""

    solid: Solid
    rng: np.random.Generator
    symmetric: bool

    def aside(self, low, high):
        """A number for what leads out of the plane of symmetry; 0 where there is one."""
        return 0 if self.symmetric else self.rng.uniform(low, high)

    def limb(self, start, corners, radius, tip, begin=0.0, aspect=1.0, end="round", bend=0.0):
        """Add a limb along a polyline with its corners rounded, bent aside without symmetry; gives its nodes."""
        t, corners = np.linspace(0, 1, 3 * len(corners)), np.asarray(corners, float)
        places = rounded(corners, len(t))
        if not self.symmetric:
            places = places + bend * np.outer(t**2 * lengths_along(corners)[-1], self.rng.normal(size=3))
        a, b = half_axes(radius + (tip - radius) * t, aspect, ELLIPSE)
        side = Y if abs(direction(places[1] - places[0])[1]) < 0.9 else UP
        return self.solid.limb(places, a, b, ELLIPSE, side, ("round", end), start, begin=begin)


@dataclass
class _Trunk:
    """What legs, neck and tail start from."""

    places: np.ndarray
    nodes: list[int]
    thick: float
    size: np.ndarray  # of the section along it, in the greatest
    a: np.ndarray
    b: np.ndarray


def _trunk(animal):
    """A bent trunk that narrows towards both ends."""
    u = animal.rng.uniform
    thick, aspect = u(0.13, 0.24), u(1, 1.6) ** animal.rng.choice([-1, 1])
    t = np.linspace(0, 1, TRUNK_PLACES)
    places = arc(1.0, u(-0.5, 0.5), TRUNK_PLACES - 1, X, UP)
    if not animal.symmetric:
        places = places + np.outer(0.25 * (t - 0.5) ** 2 * u(-1, 1), Y)
    narrowing = np.where(t < 0.5, u(0.5, 0.9), u(0.5, 0.9))
    size = np.sqrt(1 - (narrowing * (2 * t - 1)) ** 2) * np.exp(u(-0.4, 0.4) * (t - 0.5))
    size = size / size.max()
    a, b = half_axes(thick * size, aspect, ELLIPSE)
    nodes = animal.solid.limb(places, a, b, ELLIPSE, Y, ROUND_ENDS)
    return _Trunk(places, nodes, thick, size, a, b)


def _legs(animal, trunk, has_tail, pairs):
    """Pairs of legs from the sides of the trunk down; gives their radius."""
    u = animal.rng.uniform
    spots = np.linspace(u(0, 0.12) * has_tail, 1 - u(0, 0.12), pairs)
    radius, high = trunk.thick * u(0.25, 0.4), trunk.thick + u(0.25, 0.6)
    end = any_end(animal.rng)
    out, knee, slim = u(0.45, 0.75), u(-0.12, 0.12), u(0.6, 0.95)
    for k in np.round(spots * (TRUNK_PLACES - 1)).astype(int):
        start = trunk.nodes[k]
        middle = animal.solid.places[start]
        stride = u(-0.3, 0.3) if animal.symmetric else 0.0
        wide = u(0, 0.12)
        for sign in (-1, 1):
            if not animal.symmetric:
                stride, wide = u(-0.7, 0.7), u(0, 0.25)
            hip = middle + [0, sign * out * trunk.a[k], -0.45 * trunk.b[k]]
            foot = hip + [stride * high, sign * wide, -high]
            corners = [middle, hip, (hip + foot) / 2 + [knee, 0, 0], foot]
            inside = 0.5 * np.linalg.norm(hip - middle)
            animal.limb(start, corners, radius, slim * radius, inside, end=end, bend=0.12)
    return radius


def _head(animal, trunk):
    """A neck upward and a head forward, in nine of twenty with ears or horns."""
    u, solid = animal.rng.uniform, animal.solid
    up, long = u(0.2, 1.2), u(0.1, 0.45)
    ahead = np.array([np.cos(up), animal.aside(-0.4, 0.4), np.sin(up)])
    start, shoulder = trunk.places[-1], trunk.thick * trunk.size[-1]
    radius = shoulder * u(0.4, 0.65)
    top = start + ahead * (shoulder + long)
    corners = [start, start + 0.6 * (top - start), top]
    neck = animal.limb(trunk.nodes[-1], corners, radius, radius * u(0.75, 1))[-1]
    ahead = direction(np.array([1, animal.aside(-0.5, 0.5), u(-0.6, 0.2)]))
    big, t = radius * u(1.2, 1.7), np.linspace(0, 1, HEAD_PLACES)
    places = top + np.outer(t, ahead) * big * u(1.6, 3)
    size, aspect = big * np.interp(t, [0, 0.3, 1], [0.75, 1, u(0.45, 0.8)]), u(0.8, 1.2)
    a, b = half_axes(size, aspect, ELLIPSE)
    head = solid.limb(places, a, b, ELLIPSE, Y, ("round", any_end(animal.rng)), neck)
    if animal.rng.random() < 0.45:
        start, radius, tall, lean = head[EARS_FROM], big * u(0.25, 0.4), big + u(0.12, 0.35), u(-0.6, 0.2)
        aspect = u(1, 2.2)
        for sign in (-1, 1):
            ahead = direction(np.array([lean, sign * 0.8, 1.0]))
            corners = solid.places[start] + np.outer(np.linspace(0, tall, 4), ahead)
            animal.limb(start, corners, radius, radius * 0.8, 0.5 * big, aspect, bend=0.2)


def _tail(animal, trunk, leg):
    """A tail backward, up or down."""
    u = animal.rng.uniform
    ahead = direction(np.array([-1, animal.aside(-0.5, 0.5), u(-0.8, 0.6)]))
    long, radius = trunk.thick * trunk.size[0] + u(0.2, 0.7), leg * u(0.7, 1)
    sag = np.outer(np.linspace(0, 1, 5) ** 2, [0, 0, u(-0.2, 0.2)])
    corners = trunk.places[0] + np.outer(np.linspace(0, long, 5), ahead) + sag
    animal.limb(trunk.nodes[0], corners, radius, radius * u(0.6, 0.9), bend=0.3)
