"""Samples of simple shapes: tubes, with ends or closed, and what has no axis worth the name.

`n`, `noise` and `seed` are everywhere as in `sample_object`.
"""

from typing import Any

import numpy as np

from ..errors import InvalidParameterError
from ..geometry.vectors import Floats
from .capsules import Axis, Sample, checked_generator, collect, directions, noisy, union_sample


def tube(
    n: int = 4096, *, length: float = 1.0, radius: float = 0.1, capped: bool = True, noise: float = 0.0, seed: int = 0
) -> Sample:
    """A straight tube along x, centred on the origin.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.
    length, radius : float
        Of the axis and around it; half balls at the ends come on top.
    capped : bool
        Whether the ends are closed by half balls.

    Examples
    --------
    >>> tube(500)
    Sample('tube', 500 points, 2 nodes, 1 edges)
    """
    rng = checked_generator(n, noise, seed, length=length, radius=radius)
    axis = Axis()
    axis.grow([(-length / 2, 0, 0), (length / 2, 0, 0)], radius)
    if capped:
        return union_sample("tube", *axis.arrays(), n, noise, seed)
    angle = rng.uniform(0, 2 * np.pi, n)
    points = np.stack([rng.uniform(-length / 2, length / 2, n), radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return Sample(noisy(points, noise, rng), *axis.arrays(), "tube")


def helix(n: int = 4096, *, noise: float = 0.0, seed: int = 0) -> Sample:
    """A coil spring of two turns around z, its ends closed by half balls.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.

    Examples
    --------
    >>> helix(500)
    Sample('helix', 500 points, 193 nodes, 192 edges)
    """
    rng = checked_generator(n, noise, seed)
    coil, radius, pitch, turns = 0.3, 0.06, 0.35, 2.0  # of the axis, of the wire, rise per turn
    climb = pitch / (2 * np.pi)
    speed = np.hypot(coil, climb)
    curvature, end = coil / speed**2, 2 * np.pi * turns
    wire, cap = speed * end * 2 * np.pi * radius, 2 * np.pi * radius**2

    def frame(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        centre = np.stack([coil * np.cos(t), coil * np.sin(t), climb * (t - end / 2)], axis=-1)
        inward = np.stack([-np.cos(t), -np.sin(t), np.zeros_like(t)], axis=-1)
        tangent = np.stack([-coil * np.sin(t), coil * np.cos(t), np.full_like(t, climb)], axis=-1) / speed
        return centre, inward, tangent

    def draw(m: int) -> Any:
        which = rng.choice(3, m, p=np.array([wire, cap, cap]) / (wire + 2 * cap))
        t, angle = rng.uniform(0, end, m), rng.uniform(0, 2 * np.pi, m)
        centre, inward, tangent = frame(t)
        across = np.cross(tangent, inward)
        points = centre + radius * (np.cos(angle)[:, None] * inward + np.sin(angle)[:, None] * across)
        for piece, (at, sign) in enumerate(((0.0, -1), (end, 1)), start=1):
            rows = np.flatnonzero(which == piece)
            centre, _, tangent = frame(np.array(at))
            out = directions(len(rows), rng)
            out *= np.where(sign * (out @ tangent) < 0, -1, 1)[:, None]
            points[rows] = centre + radius * out
        density = np.where(which == 0, 1 - radius * curvature * np.cos(angle), 1)  # area element of a bent tube
        return points[rng.uniform(0, 1 + radius * curvature, m) < density]

    axis = Axis()
    axis.grow(frame(np.linspace(0, end, 193))[0], radius)
    return Sample(noisy(collect(draw, n), noise, rng), *axis.arrays(), "helix")


def torus(n: int = 4096, *, ring_radius: float = 0.4, radius: float = 0.1, noise: float = 0.0, seed: int = 0) -> Sample:
    """A torus around z.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.
    ring_radius, radius : float
        Of the axis, a circle, and of the tube, which is smaller.

    Examples
    --------
    >>> torus(500)
    Sample('torus', 500 points, 128 nodes, 128 edges)
    """
    rng = checked_generator(n, noise, seed, ring_radius=ring_radius, radius=radius)
    if radius >= ring_radius:
        raise InvalidParameterError(f"radius = {radius}: must be below ring_radius = {ring_radius}")
    points, circle = _ring(n, ring_radius, radius, rng)
    axis = Axis()
    axis.grow(circle, radius, end=0)
    return Sample(noisy(points, noise, rng), *axis.arrays(), "torus")


def two_rings(n: int = 4096, *, noise: float = 0.0, seed: int = 0) -> Sample:
    """Two links of a chain, which do not touch: two components, two loops.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.

    Examples
    --------
    >>> two_rings(500)
    Sample('two_rings', 500 points, 256 nodes, 256 edges)
    """
    rng = checked_generator(n, noise, seed)
    points, circle = _ring(n, 0.3, 0.06, rng)

    def second(x: Floats) -> Floats:  # turned about x, and moved so that it goes through the middle of the first
        return np.stack([x[:, 0] + 0.3, -x[:, 2], x[:, 1]], axis=1)

    points = np.where(rng.random(n)[:, None] < 0.5, points, second(points))
    axis = Axis()
    axis.grow(circle, 0.06, end=0)
    axis.grow(second(circle), 0.06, end=len(circle))
    return Sample(noisy(points, noise, rng), *axis.arrays(), "two_rings")


def _ring(n: int, ring_radius: float, radius: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points of a torus around z, (n, 3), and nodes of its axis, (128, 3)."""

    def draw(m: int) -> Any:
        around, tube_angle = rng.uniform(0, 2 * np.pi, (2, m))
        out = ring_radius + radius * np.cos(tube_angle)
        points = np.stack([out * np.cos(around), out * np.sin(around), radius * np.sin(tube_angle)], axis=1)
        return points[rng.uniform(0, ring_radius + radius, m) < out]

    angle = np.arange(128) * 2 * np.pi / 128
    circle = ring_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return collect(draw, n), circle


def sphere(n: int = 4096, *, noise: float = 0.0, seed: int = 0) -> Sample:
    """A sphere of radius 0.5 about the origin. Its axis is one node; its curve skeleton is meaningless.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.

    Examples
    --------
    >>> sphere(500)
    Sample('sphere', 500 points, 1 nodes, 0 edges)
    """
    rng = checked_generator(n, noise, seed)
    points = 0.5 * directions(n, rng)
    axis = Axis()
    axis.grow(np.zeros((1, 3)), 0.5)
    return Sample(noisy(points, noise, rng), *axis.arrays(), "sphere")


def sheet(n: int = 4096, *, bend: float = 60.0, noise: float = 0.0, seed: int = 0) -> Sample:
    """A sheet of paper of 1.0 x 0.7, rolled along x. It has no axis; its curve skeleton is meaningless.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.
    bend : float
        Angle between the two ends in degrees, below 360; 0 leaves the sheet flat.

    Examples
    --------
    >>> sheet(500)
    Sample('sheet', 500 points, 0 nodes, 0 edges)
    """
    rng = checked_generator(n, noise, seed)
    if not 0 <= bend < 360:
        raise InvalidParameterError(f"bend = {bend}: must be at least 0 and below 360 degrees")
    along, across = rng.uniform(-0.5, 0.5, n), rng.uniform(-0.35, 0.35, n)
    points = np.stack([along, across, np.zeros(n)], axis=1)
    if bend:
        curvature = np.deg2rad(bend)
        turn = curvature * along
        points = np.stack([np.sin(turn) / curvature, across, (np.cos(turn) - 1) / curvature], axis=1)
    return Sample(noisy(points, noise, rng), *Axis().arrays(), "sheet")
