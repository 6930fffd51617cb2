"""Degenerate clouds, of the kinds that geometry codes break on: everything is drawn from one generator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glsk_o3d import samples

Draw = Callable[[np.random.Generator], np.ndarray]


def cloud(rng: np.random.Generator) -> tuple[str, np.ndarray]:
    """A kind from `KINDS`, and a cloud of it; of every fourth the coordinates went through float32.

    Parameters
    ----------
    rng : numpy.random.Generator

    Returns
    -------
    kind : str
    points : (n, 3) float array
    """
    kind = str(rng.choice([*KINDS]))
    points = KINDS[kind](rng)
    if rng.random() < 0.25:
        with np.errstate(over="ignore", under="ignore"):
            points = points.astype(np.float32).astype(float)
    return kind, points


def _plain(rng: np.random.Generator) -> np.ndarray:
    """A shape, or a heap of points."""
    n = int(rng.integers(20, 400))
    if rng.random() < 0.3:
        return rng.normal(size=(n, 3))
    shape = str(rng.choice(["tube", "torus", "y_junction", "helix", "sheet", "two_rings"]))
    return getattr(samples, shape)(n, seed=int(rng.integers(2**31))).points


def _dense(rng: np.random.Generator) -> np.ndarray:
    """So many points that some are merged before they are contracted."""
    return samples.torus(int(rng.integers(1000, 2500)), seed=int(rng.integers(2**31))).points


def _tiny(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(int(rng.integers(0, 21)), 3))


def _duplicates(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    return points[rng.integers(0, len(points), int(rng.integers(1, 4)) * len(points))]


def _mostly_duplicates(rng: np.random.Generator) -> np.ndarray:
    """In one place, or in few: 99 % and more."""
    points = _plain(rng)
    if rng.random() < 0.5:
        return np.concatenate([np.repeat(points[:1], 2000, axis=0), points[:30]])
    return np.repeat(points[:30], 100, axis=0)


def _collinear(rng: np.random.Generator) -> np.ndarray:
    n = int(rng.integers(2, 200))
    along = np.arange(n) if rng.random() < 0.3 else rng.random(n)
    way = np.eye(3)[rng.integers(3)] if rng.random() < 0.5 else rng.normal(size=3)
    return along[:, None] * way + rng.choice([0, 0, 1, 1e4]) * rng.normal(size=3)


def _planar(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    flat = rng.choice([0, 0, 1e-15, 1e-12, 1e-9, 1e-6])
    return points * rng.permutation([1, 1, flat])


def _lattice(rng: np.random.Generator) -> np.ndarray:
    """Whole numbers along one, two or three axes, some of them missing."""
    sides = [rng.integers(1, most + 1, 3) for most in (7, 20)]
    sides = sides[0] if rng.random() < 0.7 else sides[1] * rng.permutation([1, 1, 0])
    points = np.stack(np.meshgrid(*(np.arange(max(side, 1)) for side in sides)), -1).reshape(-1, 3).astype(float)
    return points[rng.random(len(points)) < rng.choice([1, 1, 0.9, 0.5])]


def _surface_lattice(rng: np.random.Generator) -> np.ndarray:
    """The border of a box of whole numbers: equal distances on a surface that has an axis."""
    sides = rng.integers(3, 12, 3) + [0, 0, int(rng.integers(20))]
    points = np.stack(np.meshgrid(*map(np.arange, sides)), -1).reshape(-1, 3)
    return points[((points == 0) | (points == sides - 1)).any(axis=1)].astype(float)


def _rounded(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    return np.round(points * rng.integers(1, 12))


def _circle(rng: np.random.Generator) -> np.ndarray:
    """Equal spacing around, perhaps on a torus or a tube."""
    n, rows = int(rng.integers(3, 40)), int(rng.integers(1, 12))
    angle, row = np.meshgrid(2 * np.pi * np.arange(n) / n, np.arange(rows) * rng.choice([0.1, 1, 2 * np.pi / n]))
    return np.column_stack([np.cos(angle.ravel()), np.sin(angle.ravel()), row.ravel()])


def _two_places(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    few = points[: int(rng.integers(1, len(points)))]
    return np.concatenate([points, few + 10.0 ** rng.integers(1, 13) * rng.normal(size=3)])


def _two_points(rng: np.random.Generator) -> np.ndarray:
    """Two places far apart, each as wide as some roundings, or not at all."""
    places = np.array([[0.0, 0, 0], 10.0 ** rng.integers(-3, 8) * rng.normal(size=3)])
    points = places[rng.integers(0, 2, int(rng.integers(2, 100)))]
    return points + rng.choice([0, 1e-15, 1e-12, 1e-6]) * rng.normal(size=points.shape)


def _offset(rng: np.random.Generator) -> np.ndarray:
    return _plain(rng) + 10.0 ** rng.uniform(3, 16) * rng.normal(size=3)


def _extreme(rng: np.random.Generator) -> np.ndarray:
    with np.errstate(over="ignore", under="ignore"):
        return _plain(rng) * 10.0 ** rng.uniform(-308, 308)


def _near_extreme(rng: np.random.Generator) -> np.ndarray:
    """At the limits of what is taken."""
    return _plain(rng) * 10.0 ** (rng.choice([-1, 1]) * rng.uniform(100, 125))


def _invalid(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    points[rng.random(points.shape) < rng.choice([0.001, 0.1, 0.9])] = rng.choice([np.nan, np.inf, -np.inf, 1e308])
    return points


def _denormal(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    small = rng.random(points.shape) < rng.choice([0.1, 0.5, 1])
    return np.where(small, points * 5e-324 * rng.choice([1, 10, 1e5]), points)


def _roundings(rng: np.random.Generator) -> np.ndarray:
    """Some roundings wide, far from the origin, or with some points so near to others."""
    points = _plain(rng)
    if rng.random() < 0.5:
        points = np.broadcast_to(points[0], points.shape)
    return points + np.spacing(np.abs(points)) * rng.integers(0, 10 ** int(rng.integers(1, 6)), points.shape)


def _clusters(rng: np.random.Generator) -> np.ndarray:
    centres = rng.normal(size=(int(rng.integers(2, 12)), 3))
    n = int(rng.integers(20, 400))
    wide = 10.0 ** rng.uniform(-14, -1)
    return centres[rng.integers(0, len(centres), n)] + wide * rng.normal(size=(n, 3))


def _outlier(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    few = int(rng.integers(1, 4))
    return np.concatenate([points, 10.0 ** rng.uniform(1, 15) * rng.normal(size=(few, 3))])


def _sphere(rng: np.random.Generator) -> np.ndarray:
    points = rng.normal(size=(int(rng.integers(10, 400)), 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True) * rng.choice([1, 1e-9, 1e9])


def _spiral(rng: np.random.Generator) -> np.ndarray:
    """On a sphere, or flat; points in no order of space, with a spacing that changes."""
    n = int(rng.integers(10, 400))
    t = np.linspace(0, 1, n) ** rng.choice([0.5, 1, 3])
    angle = t * rng.uniform(1, 200)
    if rng.random() < 0.5:
        return np.column_stack([t * np.cos(angle), t * np.sin(angle), np.zeros(n)])
    across = np.sqrt(np.maximum(1 - (2 * t - 1) ** 2, 0))
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), 2 * t - 1])


def _squeezed(rng: np.random.Generator) -> np.ndarray:
    return _plain(rng) * rng.permutation([1, 10.0 ** rng.uniform(-16, 0), 10.0 ** rng.uniform(-16, 0)])


KINDS: dict[str, Draw] = {
    "plain": _plain,
    "dense": _dense,
    "tiny": _tiny,
    "duplicates": _duplicates,
    "mostly duplicates": _mostly_duplicates,
    "collinear": _collinear,
    "planar": _planar,
    "lattice": _lattice,
    "surface lattice": _surface_lattice,
    "rounded": _rounded,
    "circle": _circle,
    "two places": _two_places,
    "two points": _two_points,
    "offset": _offset,
    "extreme": _extreme,
    "near extreme": _near_extreme,
    "invalid": _invalid,
    "denormal": _denormal,
    "roundings": _roundings,
    "clusters": _clusters,
    "outlier": _outlier,
    "sphere": _sphere,
    "spiral": _spiral,
    "squeezed": _squeezed,
}
"""What draws a cloud of a kind."""
