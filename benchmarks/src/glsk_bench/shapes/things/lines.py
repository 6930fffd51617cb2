"""Polylines by their length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..curves import direction

ROUNDED = 2  # fitted: how often the corners of a limb are
Place = Sequence[float] | np.ndarray
X, Y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
"""Directions while a thing is drawn: mostly X is along it and Y across."""


def lengths_along(places: np.ndarray) -> np.ndarray:
    """Length of a polyline up to each of its places, (n,) float array."""
    return np.r_[0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]


def at_lengths(places: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Places of a polyline at some lengths; it goes on straight beyond both ends."""
    along = lengths_along(places)
    found = np.column_stack([np.interp(lengths, along, column) for column in places.T])
    found += np.minimum(lengths, 0)[:, None] * direction(places[1] - places[0])
    found += np.maximum(lengths - along[-1], 0)[:, None] * direction(places[-1] - places[-2])
    return found


def rounded(corners: np.ndarray, count: int) -> np.ndarray:
    """Places evenly along a polyline, (count, 3) float array, with its corners rounded."""
    places = at_lengths(corners, np.linspace(0, 1, count) * lengths_along(corners)[-1])
    for _ in range(ROUNDED):
        places[1:-1] = (places[:-2] + 2 * places[1:-1] + places[2:]) / 4
    return places


def straight(start: Place, end: Place, count: int = 2) -> np.ndarray:
    """Places evenly along a line, (count, 3) float array."""
    return np.linspace(np.asarray(start, float), np.asarray(end, float), count)


def arc(length: float, bend: float, steps: int, ahead: Place = (0, 0, 1.0), towards: Place = X) -> np.ndarray:
    """Places along an arc from the origin that turns by `bend` radians in all, (steps + 1, 3) float array."""
    angle = (np.arange(steps) + 0.5) / steps * bend
    step = np.outer(np.cos(angle), ahead) + np.outer(np.sin(angle), towards)
    return np.vstack([np.zeros(3), np.cumsum(step * length / steps, axis=0)])
