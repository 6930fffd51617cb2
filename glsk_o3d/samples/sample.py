"""A sample: a cloud and its axis, and what all shapes need to draw one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidParameterError


@dataclass(frozen=True, eq=False, repr=False)
class Sample:
    """A cloud and the axis it was made from.

    Attributes
    ----------
    points : (n, 3) float64 array
    nodes : (M, 3) float64 array
        Nodes of the true axis; none for a shape that has no axis.
    edges : (E, 2) int64 array
    radii : (M,) float64 array
        Distance from each node to the surface of its own part.
    name : str

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(1000)
    >>> ring.points.shape, float(ring.radii.max())
    ((1000, 3), 0.1)
    """

    points: np.ndarray
    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    name: str

    def __repr__(self):
        counts = f"{len(self.points)} points, {len(self.nodes)} nodes, {len(self.edges)} edges"
        return f"Sample({self.name!r}, {counts})"


def check(n, noise, **positive) -> None:
    """Raise InvalidParameterError for a wrong number of points, noise, or length or angle by its name."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidParameterError(f"n = {n!r}: must be an int of at least 1")
    if not (np.isfinite(noise) and noise >= 0):
        raise InvalidParameterError(f"noise = {noise!r}: must be finite and not negative")
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidParameterError(f"{name} = {value!r}: must be finite and above 0")


def collect(draw, n: int) -> np.ndarray:
    """Exactly n rows from a function that draws at most as many as it is asked for."""
    found, total, batch = [], 0, max(n, 256)
    while total < n:
        found.append(draw(batch))
        total += len(found[-1])
        batch = max(256, int(1.1 * batch * (n - total) / max(len(found[-1]), 1)))
    return np.concatenate(found)[:n]


def noisy(points, noise: float, rng) -> np.ndarray:
    """The points with Gaussian noise, which is a share of the diagonal of their box."""
    if noise == 0:
        return points
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    return points + rng.normal(scale=noise * diagonal, size=points.shape)


def directions(n: int, rng) -> np.ndarray:
    """Random unit vectors, (n, 3)."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def chain(nodes, radius: float, closed: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, edges and radii of a tube through the nodes, and back to the first if it is closed."""
    nodes = np.asarray(nodes, float)
    start = np.arange(len(nodes) - (not closed))
    return nodes, np.stack([start, (start + 1) % len(nodes)], axis=1), np.full(len(nodes), float(radius))
