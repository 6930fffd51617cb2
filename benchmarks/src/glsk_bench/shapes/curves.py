"""Random numbers, and the curves that shapes are drawn along."""

from __future__ import annotations

import zlib

import numpy as np
from scipy.spatial.transform import Rotation


def generator(*key: str | int) -> np.random.Generator:
    """Random numbers that follow from some words and whole numbers."""
    return np.random.default_rng([zlib.crc32(part.encode()) if isinstance(part, str) else int(part) for part in key])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A positive number whose logarithm is uniform: as many between 1 and 2 as between 2 and 4."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def any_rotation(rng: np.random.Generator) -> Rotation:
    """A rotation of which none is likelier than another."""
    return Rotation.from_quat(rng.normal(size=4))


UP = np.array([0.0, 0.0, 1.0])
"""Which way is up while a shape is drawn, and for the scanners around it."""
HARMONICS = (1, 2, 3)  # fitted: half waves along a curve, of which each counts less than the one before


def direction(vector: np.ndarray) -> np.ndarray:
    """One vector, (3,) float array, over its length."""
    return vector / np.sqrt((vector * vector).sum())


def across(ahead: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors at right angles to a vector and to each other, (3,) float arrays."""
    aside = [1, 0, 0] if abs(ahead[0]) < 0.6 * np.linalg.norm(ahead) else [0, 1, 0]
    u = direction(np.cross(ahead, aside))
    return u, direction(np.cross(ahead, u))


def wander(
    rng: np.random.Generator, start: np.ndarray, ahead: np.ndarray, length: float, steps: int, bend: float
) -> np.ndarray:
    """A smooth random curve."""
    t = (np.arange(steps) + 0.5) / steps
    waves = []
    for f in HARMONICS:
        size = rng.normal(size=(2, 1)) / f
        waves.append(size * np.cos(np.pi * f * t + rng.uniform(0, 2 * np.pi, (2, 1))))
    wave = np.sum(waves, axis=0)
    turns = bend * wave / np.abs(np.hypot(*wave)).mean() / steps
    ahead = direction(np.asarray(ahead, float))
    u, v = across(ahead)
    places = [np.asarray(start, float)]
    for to_u, to_v in turns.T:
        places.append(places[-1] + ahead * length / steps)
        ahead = direction(ahead + to_u * u + to_v * v)
        u = direction(u - ahead * (u @ ahead))
        v = np.cross(ahead, u)
    return np.array(places)


def swelling(rng: np.random.Generator, count: int, swing: float) -> np.ndarray:
    """Smooth random factors for the radii of a path, (count,) float array, one of them exp(swing) or exp(-swing)."""
    t = np.linspace(0, 1, count)
    waves = []
    for f in HARMONICS:
        size = rng.normal() / f
        waves.append(size * np.cos(np.pi * f * t + rng.uniform(0, 6)))
    wave = np.sum(waves, axis=0)
    return np.exp(swing * wave / np.abs(wave).max())


def polygon(corners: int, height: float = 0.0, radius: float = 1.0) -> np.ndarray:
    """Corners of a regular polygon around the z axis, (corners, 3) float array."""
    angle = np.arange(corners) * 2 * np.pi / corners
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + [0, 0, height]


def oval(rng: np.random.Generator, count: int, radius: float, narrowest: float = 0.6, wave: float = 0.15) -> np.ndarray:
    """Places along a closed curve: an ellipse that leaves its plane a little."""
    places = polygon(count, radius=radius) * [1, rng.uniform(narrowest, 1), 1]
    angle = np.arange(count) * 2 * np.pi / count
    places[:, 2] += radius * wave * rng.uniform(-1, 1) * np.cos(2 * angle + rng.uniform(0, 6))
    return places
