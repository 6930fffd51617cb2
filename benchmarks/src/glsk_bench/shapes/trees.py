"""Trees: curved limbs that fork, with 3 to 40 tips."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from .axis import Axis, UnfitDraw
from .curves import UP, across, direction, log_uniform, wander

# Fitted: trees that grow freely and whose limbs can be told apart.
LIMBS_TRIED = 40  # before there is no room for a limb
HALF_ROOM = 1.8  # between the middle of a limb and what else there is, in the limb's radius
NEAR_FORK, NEAR_START = 2.2, 2.0  # parts, and places on a limb, so near its start may touch; in the sum of both radii
SHORTER_BY = 0.35  # a limb is as long as its share of the tips to this power
LIMB_TAPER = 0.92  # radius at the end of a limb, in that at its start
LEAST_SIDES, MOST_SIDES = 2, 3  # limbs at a fork


class Habit(NamedTuple):
    """How a tree grows."""

    leaves: int  # tips of the whole tree
    length: float  # of the trunk, about
    tip: float  # radius at the start of a last limb
    power: float  # the radius of a limb to this power is the sum of those it forks into; 2 is da Vinci's rule
    bend: float  # how far a limb turns at most, about, in radians
    spread: tuple[float, float]  # how far limbs lean aside at a fork, least and most, in degrees


def trees(rng: np.random.Generator) -> Axis:
    """Draw a tree that stands upright."""
    leaves = round(log_uniform(rng, 3, 40))
    power = rng.uniform(2.0, 2.8)
    tip = 0.013 * leaves**0.42 * rng.uniform(1.0, 1.7)
    axis = Axis()
    root = axis.ball([0, 0, 0], tip * leaves ** (1 / power))
    ahead = UP + 0.15 * rng.normal(size=3)
    habit = Habit(leaves, rng.uniform(0.75, 1.1), tip, power, rng.uniform(0.1, 0.9), (32, 62))
    _grow(axis, rng, habit, root, ahead, leaves)
    return axis


def _grow(axis, rng, habit, start, ahead, leaves):
    """Add a limb with so many tips, and what it forks into."""
    radius = habit.tip * leaves ** (1 / habit.power)
    places = _limb(axis, rng, habit, start, ahead, leaves, radius)
    end = axis.path(places, np.linspace(radius, LIMB_TAPER * radius, len(places)), start=start)[-1]
    if leaves == 1:
        return
    ahead = direction(places[-1] - places[-2])
    sides = min(leaves, int(rng.integers(LEAST_SIDES, MOST_SIDES + 1)))
    cuts = np.sort(rng.choice(np.arange(1, leaves), sides - 1, replace=False))
    u, v = across(ahead)
    spin = rng.uniform(0, 2 * np.pi)
    for side, share in enumerate(np.diff([0, *cuts, leaves])):
        angle = spin + 2 * np.pi * side / sides + rng.normal(0, 0.12)
        tilt = np.radians(rng.uniform(*habit.spread)) * (1 - 0.4 * share / leaves)  # the thickest goes straightest
        aside = np.cos(angle) * u + np.sin(angle) * v
        _grow(axis, rng, habit, end, np.cos(tilt) * ahead + np.sin(tilt) * aside, share)


def _limb(axis, rng, habit, start, ahead, leaves, radius):
    """Places along a limb that comes near nothing else; the more have been tried, the more it leans aside."""
    for attempt in range(LIMBS_TRIED):
        length = habit.length * (leaves / habit.leaves) ** SHORTER_BY * rng.uniform(0.75, 1.25) * (1 + 0.01 * attempt)
        steps = max(4, int(length / (1.3 * radius)))
        way = direction(direction(ahead) + 0.05 * attempt**0.7 * rng.normal(size=3))
        places = wander(rng, axis.places[start], way, length, steps, habit.bend * rng.uniform(0.3, 1))
        if _has_room(axis, start, np.vstack([places[1:], (places[1:] + places[:-1]) / 2]), radius):
            return places
    raise UnfitDraw("no room")


def _has_room(axis, start, places, radius):
    """Whether places on a limb, but for those near its start, keep away from what is not near its start."""
    fork, both = axis.places[start], axis.sizes[start] + radius
    far = np.linalg.norm(axis.nodes - fork, axis=1) > NEAR_FORK * both
    out = np.linalg.norm(places - fork, axis=1) > NEAR_START * both
    if not far.any() or not out.any():
        return True
    return (cdist(places[out], axis.nodes[far]) - axis.radii[far]).min() > HALF_ROOM * radius
