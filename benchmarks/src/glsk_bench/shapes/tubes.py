"""Tubes: smooth curves in space, some of them coils, of varying radius."""

from __future__ import annotations

import numpy as np

from .axis import Axis
from .curves import UP, any_rotation, log_uniform, swelling, wander


def tubes(rng: np.random.Generator) -> Axis:
    """Draw a tube; one in four is a coil."""
    radius = log_uniform(rng, 0.018, 0.07)  # a length of 1
    steps = int(np.clip(1 / (1.1 * radius), 14, 60))
    if rng.random() < 0.25:
        places, radius = _coil(rng, 2 * steps)
        swing = rng.uniform(0, 0.15)
    else:
        bend = log_uniform(rng, 0.8, min(12.0, 0.35 / radius))
        places = wander(rng, np.zeros(3), UP, 1, steps, bend)
        swing = rng.uniform(0, 0.55)
    axis = Axis()
    axis.path(places, radius * swelling(rng, len(places), swing))
    return axis.rotated(any_rotation(rng))


def _coil(rng, count):
    """Places along a coil of unit length, seen from above, and the radius of its tube."""
    turns = rng.uniform(1.3, 3.5)
    width = 1 / (2 * np.pi * turns)
    radius = width * rng.uniform(0.15, 0.4)
    pitch = radius * rng.uniform(2.8, 6)
    angle = np.linspace(0, 2 * np.pi * turns, count)
    return np.column_stack([width * np.cos(angle), width * np.sin(angle), pitch * angle / (2 * np.pi)]), radius
