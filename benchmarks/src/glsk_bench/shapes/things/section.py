"""Sections of limbs: superellipses, |y / a|^p + |z / b|^p = 1, from an ellipse to nearly a rectangle."""

from __future__ import annotations

from math import gamma

import numpy as np

from ..curves import log_uniform
from .lines import lengths_along

ELLIPSE, NEARLY_BOX = 2, 10  # fitted: the powers between which most sections are
OUTLINE_STEPS = 1600  # fitted: along which the corners of a mesh are spread
MESH_CORNERS = 96  # fitted: around a section


def unit_area(power: float) -> float:
    """Area of the superellipse with half axes of 1: pi for an ellipse, up to 4 for a square."""
    return 4 * gamma(1 + 1 / power) ** 2 / gamma(1 + 2 / power)


def half_axes(radius: float | np.ndarray, aspect: float, power: float) -> tuple[np.ndarray, np.ndarray]:
    """Half axes, longer ones first, of sections that have this aspect and the area of a circle."""
    mean = np.asarray(radius, float) * np.sqrt(np.pi / unit_area(power))
    return mean * np.sqrt(aspect), mean / np.sqrt(aspect)


def section_radius(a: float | np.ndarray, b: float | np.ndarray, power: float) -> np.ndarray:
    """Radius of the circle with the area of a section."""
    return np.sqrt(np.asarray(a) * b * unit_area(power) / np.pi)


def any_power(rng: np.random.Generator) -> float:
    """A power for a section; one of three is an ellipse or nearly a rectangle."""
    if rng.random() < 0.7:
        return log_uniform(rng, ELLIPSE, NEARLY_BOX)
    return float(rng.choice([ELLIPSE, NEARLY_BOX]))


def outline(power: float, aspect: float) -> np.ndarray:
    """Corners around the superellipse with half axes of 1, (n, 2) float array, evenly apart once it has this aspect."""
    angle = np.linspace(0, 2 * np.pi, OUTLINE_STEPS, endpoint=False)
    wave = np.array([np.cos(angle), np.sin(angle)])
    y, z = np.sign(wave) * np.abs(wave) ** (2 / power)
    wide = max(aspect, 1.0) ** 0.5
    closed = np.r_[0:OUTLINE_STEPS, 0]
    along = lengths_along(np.column_stack([y * wide, z / wide])[closed])
    place = np.arange(OUTLINE_STEPS + 1)
    picked = np.interp(np.linspace(0, along[-1], MESH_CORNERS, endpoint=False), along, place)
    return np.column_stack([np.interp(picked, place, each[closed]) for each in (y, z)])
