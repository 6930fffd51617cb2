"""Toys: stout beasts, teddies, turtles, paws and jacks; limbs, ears and tails are short and thick for their body."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..axis import UnfitDraw
from ..curves import UP, any_rotation, direction, log_uniform
from .lines import Place, X, Y, rounded
from .section import ELLIPSE, half_axes
from .solid import FLAT_INSET, ROUND_ENDS, Solid
from .sweep import Sweep

BODY_PLACES, LIMB_PLACES = 17, 11  # fitted: smooth enough
# Fitted: how far the middle of a tip stands out of the bodies, in its radius: the least is a little more than a stub.
LEAST_OUT, MOST_OUT = 0.8, 2.5
KNEE = 0.45  # fitted: where a limb that starts beside the axis of a body turns, in the depth of its hip
LIMB_BEGIN = 0.6  # fitted: where the sweep of a limb begins, in the length of its axis up to there, or in its depth
RAY, RAY_PLACES, RAY_MARGIN = 6.0, 301, 0.1  # derived: longer than any body is, and places nearer than the margin
HANDED = np.array([[1, -1, 1], [1, 1, 1]])  # the factors of both limbs of a pair


def toys(rng: np.random.Generator) -> Solid:
    """Draw a toy: in two of six a beast, a teddy, a turtle, a paw or a jack; all but paws are symmetric."""
    draw = TOY_KINDS[int(rng.integers(len(TOY_KINDS)))]
    toy = _Toy(Solid(blend=rng.uniform(0.05, 0.3)), rng)
    draw(toy)
    if draw is not _paw:
        toy.solid.mirror = np.array([[0, 0, 0], Y])
    return toy.solid.rotated(any_rotation(rng))


@dataclass
class _Limb:
    """What a limb is like."""

    radius: float
    out: float  # how far the middle of its tip stands out of the bodies, in the radius there
    end: str
    aspect: float = 1.0
    taper: float = 1.0  # radius at its tip, in that at its start


@dataclass
class _Toy:
    """A toy while it is drawn: first bodies, whose greatest half width is about 1, and then limbs out of them."""

    solid: Solid
    rng: np.random.Generator
    bodies: list[Sweep] = field(default_factory=list)

    def any_limb(self, low, high, end=None, aspect=1.0, taper=(0.8, 1.05)):
        """A short limb of a radius between two; two of three ends are round."""
        rng = self.rng
        end = str(rng.choice(["round", "round", "flat"])) if end is None else end
        return _Limb(rng.uniform(low, high), log_uniform(rng, LEAST_OUT, MOST_OUT), end, aspect, rng.uniform(*taper))

    def body(self, place, ahead, radius, long, aspect=1.0, start=None) -> list[int]:
        """Add a body with round ends, so many widths long; its axis begins at the node `start`, if there is one."""
        t = np.linspace(0, 1, BODY_PLACES)
        first, last = self.rng.uniform(0.6, 0.85, 2)
        narrowing = np.where(t < 0.5, first, last)
        size = np.sqrt(1 - (narrowing * (2 * t - 1)) ** 2)
        places, begin = place + np.outer(t, ahead) * radius * (2 * long - size[0] - size[-1]), 0.0
        if start is not None:
            begin = float(np.linalg.norm(place - self.solid.places[start]))
            places, size = np.vstack([self.solid.places[start], places]), np.r_[size[0], size]
        a, b = half_axes(radius * size, aspect, ELLIPSE)
        nodes = self.solid.limb(places, a, b, ELLIPSE, Y, ROUND_ENDS, start, begin=begin)
        self.bodies.append(self.solid.sweeps[-1])
        return nodes

    def depth(self, place: Place, ahead: np.ndarray) -> float:
        """How far a place inside the bodies is from their surface in a direction."""
        lengths, off = np.linspace(0, RAY, RAY_PLACES), np.full(RAY_PLACES, np.inf)
        for body in self.bodies:
            near = body.distance(place + np.outer(lengths, ahead), RAY_MARGIN)
            off[near.rows] = np.minimum(off[near.rows], near.values)
        outside = int((off > 0).argmax())
        if outside == 0:
            raise UnfitDraw("hip")
        around = slice(outside - 1, outside + 1)  # between both, as a rounding must not decide which of them counts
        return float(np.interp(0, off[around], lengths[around]))

    def limb(self, limb: _Limb, start: int, ahead: Place, offset: Place = (0, 0, 0), side=Y) -> None:
        """Add a limb from a node of a body on, by way of its hip, which is so far beside the node."""
        ahead, place = direction(np.asarray(ahead, float)), self.solid.places[start]
        hip, aside = place + offset, float(np.linalg.norm(offset))
        depth, tip = self.depth(hip, ahead), limb.radius * limb.taper
        far = hip + (depth + (limb.out + FLAT_INSET * (limb.end == "flat")) * tip) * ahead
        corners = np.array([place, hip + KNEE * depth * ahead, far] if aside else [place, far])
        t = np.linspace(0, 1, LIMB_PLACES)
        a, b = half_axes(limb.radius + (tip - limb.radius) * t, limb.aspect, ELLIPSE)
        side = side if abs(ahead @ side) < 0.9 else UP
        ends = "round", limb.end
        begin = LIMB_BEGIN * (aside or depth)
        self.solid.limb(rounded(corners, LIMB_PLACES), a, b, ELLIPSE, side, ends, start, begin=begin)

    def pair(self, limb: _Limb, start: int, ahead: Place, offset: Place = (0, 0, 0), side=Y) -> None:
        """Add two limbs that are alike, one on each side of the plane of symmetry."""
        for factors in HANDED:
            self.limb(limb, start, factors * ahead, factors * offset, side)

    def head(self, start: int, ahead: Place) -> tuple[list[int], float]:
        """Add a head before the end of the trunk; gives its nodes and its half width."""
        u, ahead = self.rng.uniform, direction(np.asarray(ahead, float))
        size, top = u(0.55, 0.85), self.solid.places[start]
        place = top + ahead * (self.depth(top, ahead) + u(0.15, 0.45) * size)
        return self.body(place, ahead, size, u(1, 1.3), u(0.9, 1.15), start), size

    def ears(self, start: int, size: float, ahead: Place) -> None:
        """Add two ears, round or flat ones, to a head of this half width."""
        aspect = self.rng.uniform(1, 1.9)
        self.pair(self.any_limb(0.27 * size, 0.5 * size, "round", aspect, (0.8, 1.1)), start, ahead, side=X)


def _beast(toy):
    """A trunk on four legs, with a head, and mostly with ears, a snout and a tail."""
    u, rng = toy.rng.uniform, toy.rng
    trunk = toy.body(np.zeros(3), direction(np.array([1, 0, u(-0.15, 0.15)])), 1.0, u(1.15, 1.6), u(0.85, 1.2))
    has_tail, has_snout, has_ears = rng.random() < 0.7, rng.random() < 0.6, rng.random() < 0.75
    ahead = direction(np.array([1, 0, u(0, 0.9)]))
    head, size = toy.head(trunk[-1], ahead)
    leg, wide = toy.any_limb(0.26, 0.45), u(0.42, 0.58)
    for start in (trunk[2 if has_tail else 0], trunk[-1 - int(rng.integers(0, 3))]):
        toy.pair(leg, start, [u(-0.2, 0.2), u(0, 0.3), -1], [0, wide, -0.3])
    if has_ears:
        start = head[len(head) // 2 if has_snout else -1]
        toy.ears(start, size, [u(-0.6, 0), u(0.5, 1.2), 1])
    if has_tail:
        toy.limb(toy.any_limb(0.25, 0.4), trunk[0], [-1, 0, u(-0.5, 0.8)])
    if has_snout:
        toy.limb(toy.any_limb(0.3 * size, 0.6 * size), head[-1], ahead - UP * u(0.2, 0.9))


def _teddy(toy):
    """An upright trunk with arms, legs, which half of them stretch out, a head, and mostly ears and a snout."""
    u, rng = toy.rng.uniform, toy.rng
    trunk = toy.body(np.zeros(3), direction(np.array([u(-0.15, 0.15), 0, 1])), 1.0, u(1.15, 1.6), u(0.85, 1.2))
    has_tail, has_snout, has_ears, sits = (rng.random() < share for share in (0.2, 0.6, 0.75, 0.5))
    head, size = toy.head(trunk[-1], [u(-0.1, 0.3), 0, 1])
    ahead = [u(0.7, 1.2), u(0.35, 0.7), u(-0.4, 0)] if sits else [u(-0.1, 0.2), u(0, 0.35), -1]
    toy.pair(toy.any_limb(0.26, 0.45), trunk[2 if has_tail else 0], ahead, [0.1 * sits, u(0.42, 0.55), 0])
    shoulder = trunk[-1 - int(rng.integers(0, 3))]
    toy.pair(toy.any_limb(0.26, 0.45), shoulder, [u(0, 0.8), 1, u(-0.6, 0.5)])
    if has_ears:
        toy.ears(head[-1], size, [u(-0.3, 0.2), u(0.6, 1.1), 1])
    if has_tail:
        toy.limb(toy.any_limb(0.25, 0.4), trunk[0], [-1, 0, u(-0.5, 0.8)])
    if has_snout:
        toy.limb(toy.any_limb(0.3 * size, 0.6 * size), head[len(head) // 2], [1, 0, u(-0.2, 0.1)])


def _turtle(toy):
    """A wide trunk with four or six legs to its sides, a head, and in six of ten a tail."""
    u, rng = toy.rng.uniform, toy.rng
    trunk = toy.body(np.zeros(3), X, 1.0, u(1.05, 1.5), u(1, 1.6))
    has_tail, six = rng.random() < 0.6, rng.random() < 0.3
    leg = toy.any_limb(0.25, 0.36 if six else 0.45, aspect=u(1, 1.5), taper=(0.75, 1))
    spots, middle, drop = [2 if has_tail else 0, BODY_PLACES - 3], BODY_PLACES // 2, u(-0.7, 0)
    for k in [*spots, *([middle] if six else [])]:
        toy.pair(leg, trunk[k], [u(0.2, 0.7) * np.sign(k - middle), 1, drop], side=X)
    toy.limb(toy.any_limb(0.35, 0.6, "round"), trunk[-1], [1, 0, u(-0.1, 0.5)])
    if has_tail:
        toy.limb(toy.any_limb(0.25, 0.4), trunk[0], [-1, 0, u(-0.3, 0.3)])


def _paw(toy):
    """A flat palm with two or three fingers, a thumb and a wrist."""
    u, rng = toy.rng.uniform, toy.rng
    wide, fingers = u(1.3, 1.6), int(rng.integers(2, 4))
    palm = toy.body(np.zeros(3), X, 1.0, u(1.05, 1.35), wide)
    finger = toy.any_limb(0.25, 0.34, "round", taper=(0.85, 1))
    reach, curl = np.sqrt(wide) * u(0.6, 0.72), u(-0.7, 0.3)
    for y in np.linspace(-1, 1, fingers):
        finger.out = log_uniform(rng, LEAST_OUT, MOST_OUT)
        knuckle = [-0.1 * y * y, reach * y, 0]
        toy.limb(finger, palm[-1], [1, u(0.1, 0.35) * y, curl + u(-0.1, 0.1)], knuckle if y else (0, 0, 0))
    thumb = palm[int(rng.integers(6, 9))]
    toy.limb(toy.any_limb(finger.radius, 1.3 * finger.radius, "round"), thumb, [u(0.2, 0.8), -1, u(-0.3, 0.3)], side=UP)
    wrist = toy.any_limb(0.42, 0.6, "flat", u(1, 1.4), (1, 1))
    toy.limb(wrist, palm[0], [-1, u(-0.2, 0.2), u(-0.2, 0.2)])


def _jack(toy):
    """A ball, or a little longer, with one to four limbs along both its axes and others in pairs aside."""
    u, rng = toy.rng.uniform, toy.rng
    half = u(0.02, 0.3)
    places = np.outer(np.linspace(-half, half, 5), X)
    toy.solid.body(places, 1.0, None, ELLIPSE, Y, ROUND_ENDS)
    toy.bodies.append(toy.solid.sweeps[-1])
    middle = toy.solid.node(np.zeros(3), 1.0)
    directions = [X, -X, UP, -UP][: int(rng.integers(1, 5))]
    for ahead in directions:
        toy.limb(toy.any_limb(0.26, 0.45), middle, ahead)
    pairs = max((5 - len(directions)) // 2, int(rng.integers(1, 3)))
    for z in np.linspace(-0.7, 0.7, pairs) if pairs > 1 else [u(-0.2, 0.2)]:
        toy.pair(toy.any_limb(0.26, 0.42), middle, [u(-0.3, 0.3), 1, z], side=X)


TOY_KINDS = (_beast, _paw, _jack, _teddy, _beast, _turtle)
"""The functions that draw, each as often as it stands there."""
