"""Figures: a torso with limbs, a neck and a head, ears, a tail."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .axis import Axis
from .curves import UP, across, direction, swelling, wander

SKULL = np.array([0.5, 0.6, 0.85, 1, 1, 1, 0.95])  # fitted: radii along a head, in its largest
SKULL_STEP = 0.42  # fitted: between them
EARS_AT = 5  # fitted: which of them


class Torso(NamedTuple):
    """What the other parts of a figure are put on."""

    places: np.ndarray
    spine: list[int]
    side: np.ndarray
    ahead: np.ndarray


def figures(rng: np.random.Generator) -> Axis:
    """Draw a figure: one to three pairs of limbs, the last of which meet in one figure of five."""
    axis = Axis()
    length, thick = rng.uniform(0.6, 1.4), rng.uniform(0.13, 0.26)
    stations = int(rng.integers(5, 9))
    places = wander(rng, np.zeros(3), UP, length, stations, rng.uniform(0, 0.5))
    swing = rng.uniform(0, 0.25)
    spine = axis.path(places, thick * swelling(rng, len(places), swing))
    u, v = across(places[-1] - places[0])
    pairs = int(rng.integers(1, 4))
    spots = np.unique(np.linspace(0, stations, pairs).round().astype(int)) if pairs > 1 else [stations]
    front = rng.uniform(0, 2 * np.pi)
    side, ahead = np.cos(front) * u + np.sin(front) * v, -np.sin(front) * u + np.cos(front) * v
    torso = Torso(places, spine, side, ahead)
    for spot in spots:
        _pair(axis, rng, torso, spot, last=spot == spots[-1])
    if rng.random() < 0.75:
        _head(axis, rng, torso)
    if rng.random() < 0.5:
        _tail(axis, rng, torso)
    return axis


def _pair(axis, rng, torso, spot, last):
    """Two limbs at one place of the spine, to both sides."""
    start = torso.spine[spot]
    length = axis.sizes[start] + rng.uniform(0.5, 1.2)
    radius = min(axis.sizes[start] * rng.uniform(0.3, 0.55), 0.12)
    taper = rng.uniform(0.55, 0.95)
    onward = {0: -0.9, len(torso.places) - 1: 0.9}.get(int(spot), 0)  # at its ends also lengthwise
    lean = rng.uniform(-0.5, 0.5) * torso.ahead
    lean = lean + onward * rng.uniform(0, 1) * direction(torso.places[-1] - torso.places[0])
    hands = []
    for sign in (-1, 1):
        bend = rng.uniform(0.1, 1.2)
        hands.append(axis.limb(rng, start, sign * torso.side + lean, length, radius, radius * taper, bend))
    if last and rng.random() < 0.2:
        axis.bar(*hands, radius * taper, torso.ahead * rng.uniform(0.3, 0.6))


def _head(axis, rng, torso):
    """A neck and a head, in two of five with ears."""
    shoulders, places = torso.spine[-1], torso.places
    radius = axis.sizes[shoulders] * rng.uniform(0.35, 0.55)
    upward = direction(places[-1] - places[-2]) + 0.3 * rng.normal(size=3)
    neck = _tapered(axis, rng, shoulders, upward, axis.sizes[shoulders] + rng.uniform(0.12, 0.4), radius)
    head = radius * rng.uniform(1.5, 2.2)
    ahead = direction(axis.places[neck] - places[-1])
    line = axis.places[neck] + ahead * head * SKULL_STEP * np.arange(len(SKULL))[:, None]
    skull = axis.path(line, head * SKULL, start=neck)
    if rng.random() < 0.4:
        for sign in (-1, 1):
            length, radius = head * rng.uniform(2.4, 3.4), head * rng.uniform(0.25, 0.4)
            _tapered(axis, rng, skull[EARS_AT], sign * torso.side + 0.7 * ahead, length, radius, bend=0.3)


def _tail(axis, rng, torso):
    """A tail that goes down and forward."""
    start, places = torso.spine[0], torso.places
    thick = axis.sizes[start]
    down = -direction(places[1] - places[0]) + 0.4 * torso.ahead
    length, radius = thick + rng.uniform(0.4, 1.2), thick * rng.uniform(0.22, 0.45)
    _tapered(axis, rng, start, down, length, radius, bend=1.2)


def _tapered(axis, rng, start, ahead, length, radius, bend=0.5):
    """A limb that is a little or much thinner at its end; gives its last node."""
    return axis.limb(rng, start, ahead, length, radius, radius * rng.uniform(0.55, 0.95), bend)
