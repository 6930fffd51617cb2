"""Samples of tubes that close on themselves."""

from __future__ import annotations

import numpy as np

from ..errors import InvalidParameterError
from .sample import Sample, check, collect, noisy


def torus(n: int = 4096, *, ring_radius: float = 0.4, radius: float = 0.1, noise: float = 0.0, seed: int = 0) -> Sample:
    """A torus around z.

    Parameters
    ----------
    n : int
        Number of points.
    ring_radius : float
        Radius of the axis, a circle.
    radius : float
        Radius of the tube, smaller than `ring_radius`.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> torus(500)
    Sample('torus', 500 points, 128 nodes, 128 edges)
    """
    check(n, noise, ring_radius=ring_radius, radius=radius)
    if radius >= ring_radius:
        raise InvalidParameterError(f"radius = {radius}: must be below ring_radius = {ring_radius}")
    rng = np.random.default_rng(seed)
    points = _torus_points(n, ring_radius, radius, rng)
    nodes, edges, radii = _circle(ring_radius, radius)
    return Sample(noisy(points, noise, rng), nodes, edges, radii, "torus")


def two_rings(
    n: int = 4096, *, ring_radius: float = 0.3, radius: float = 0.06, noise: float = 0.0, seed: int = 0
) -> Sample:
    """Two links of a chain, which do not touch: two components, two loops.

    Parameters
    ----------
    n : int
        Number of points.
    ring_radius : float
        Radius of each axis; the second circle goes through the middle of the first.
    radius : float
        Radius of the tubes, below half of `ring_radius`.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> two_rings(500)
    Sample('two_rings', 500 points, 256 nodes, 256 edges)
    """
    check(n, noise, ring_radius=ring_radius, radius=radius)
    if 2 * radius >= ring_radius:
        raise InvalidParameterError(f"radius = {radius}: must be below half of ring_radius = {ring_radius}")
    rng = np.random.default_rng(seed)
    points = _torus_points(n, ring_radius, radius, rng)
    nodes, edges, radii = _circle(ring_radius, radius)

    def second(x):  # turned about x, and moved by one ring radius
        return np.stack([x[:, 0] + ring_radius, -x[:, 2], x[:, 1]], axis=1)

    points = np.where(rng.random(n)[:, None] < 0.5, points, second(points))
    nodes, edges = np.concatenate([nodes, second(nodes)]), np.concatenate([edges, edges + len(nodes)])
    return Sample(noisy(points, noise, rng), nodes, edges, np.concatenate([radii, radii]), "two_rings")


def _circle(ring_radius: float, radius: float, pieces: int = 128) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle = np.arange(pieces) * 2 * np.pi / pieces
    nodes = ring_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    start = np.arange(pieces)
    return nodes, np.stack([start, (start + 1) % pieces], axis=1), np.full(pieces, float(radius))


def _torus_points(n: int, ring_radius: float, radius: float, rng) -> np.ndarray:
    def draw(m):
        around, tube_angle = rng.uniform(0, 2 * np.pi, (2, m))
        out = ring_radius + radius * np.cos(tube_angle)
        points = np.stack([out * np.cos(around), out * np.sin(around), radius * np.sin(tube_angle)], axis=1)
        return points[rng.uniform(0, ring_radius + radius, m) < out]

    return collect(draw, n)
