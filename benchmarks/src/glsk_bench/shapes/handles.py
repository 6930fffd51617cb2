"""Handles: thick bodies with one to three handles, rings with spokes, knots."""

from __future__ import annotations

import numpy as np

from .axis import Axis
from .curves import UP, across, any_rotation, oval, swelling, wander

# fitted: round enough; of the rim there are as many a spoke
KNOT_NODES, SPOKE_NODES, BODY_STEPS, HANDLE_NODES = 90, 8, 14, 16
HANDLE_STARTS = 0.03  # fitted: where a handle has its own radius, as a share of its first step


def handles(rng: np.random.Generator) -> Axis:
    """Draw a body with handles, in three of five, or a wheel, or a knot."""
    kind = rng.choice(["body", "body", "body", "wheel", "knot"])
    axis = {"body": _body, "wheel": _wheel, "knot": _knot}[str(kind)](rng)
    return axis.rotated(any_rotation(rng))


def _knot(rng):
    """A trefoil or a figure-eight knot."""
    t = np.arange(KNOT_NODES) * 2 * np.pi / KNOT_NODES
    if rng.random() < 0.5:
        high = -rng.uniform(1.0, 1.8)
        places = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), high * np.sin(3 * t)]
    else:
        wide = 2 + np.cos(2 * t)
        places = [wide * np.cos(3 * t), wide * np.sin(3 * t), rng.uniform(1.0, 1.6) * np.sin(4 * t)]
    axis = Axis()
    axis.ring(np.column_stack(places), rng.uniform(0.2, 0.36))
    return axis


def _wheel(rng):
    """A rim, two to six spokes to a hub that may stand above it, and in half of them an axle."""
    axis = Axis()
    spokes, radius = int(rng.integers(2, 7)), rng.uniform(0.05, 0.12)
    places = oval(rng, SPOKE_NODES * spokes, 1.0, narrowest=0.75, wave=0.05)
    rim = axis.ring(places, radius * rng.uniform(1, 1.6))
    hub = axis.ball([0, 0, rng.uniform(0, 0.35)], radius * rng.uniform(1.1, 2.4))
    for spoke in range(spokes):
        axis.bar(hub, rim[SPOKE_NODES * spoke], radius)
    if rng.random() < 0.5:
        axis.limb(rng, hub, UP, rng.uniform(0.6, 1.4), radius * 1.05, radius, bend=0.2)
    return axis


def _body(rng):
    """A thick, hardly bent body, and handles around it."""
    axis, thick = Axis(), rng.uniform(0.22, 0.42)
    length = rng.uniform(1.5, 2.6)
    places = wander(rng, np.zeros(3), UP, length, BODY_STEPS, rng.uniform(0, 0.4))
    swing = rng.uniform(0, 0.2)
    body = axis.path(places, thick * swelling(rng, len(places), swing))
    u, v = across(places[-1] - places[0])
    count, spin = int(rng.integers(1, 4)), rng.uniform(0, 6)
    for k in range(count):
        low, high = int(rng.integers(3, 5)), int(rng.integers(9, 12))
        radius = thick * rng.uniform(0.18, 0.4)
        angle = spin + 2 * np.pi * k / count + rng.normal(0, 0.15)
        out = np.cos(angle) * u + np.sin(angle) * v
        far = thick * 1.15 + radius + rng.uniform(2.2, 4.5) * radius
        curve = _handle(places[low], places[high], far * out, rng.uniform(0.5, 1))
        axis.path(curve, radius, body[low], body[high])
    return axis


def _handle(start, end, out, fullness):
    """Places along a handle from one place of the body to another; the fuller, the lower the power."""
    t = np.linspace(0, np.pi, HANDLE_NODES)[:, None]
    places = start + (end - start) * (1 - np.cos(t)) / 2 + out * np.sin(t) ** fullness
    near = places[[0, -1]] + HANDLE_STARTS * (places[[1, -2]] - places[[0, -1]])
    return np.vstack([places[:1], near[:1], places[1:-1], near[1:], places[-1:]])
