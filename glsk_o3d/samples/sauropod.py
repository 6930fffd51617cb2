"""The sample object: an animal with a long neck, four legs and a handle, as two cameras see it."""

from __future__ import annotations

import numpy as np

from .capsules import union_sample
from .sample import Sample

TWO_CAMERAS = ((1.1, 1.8, 1.4), (-1.2, -1.7, 1.3))
"""Where the sauropod is scanned from: front left and rear right, a little above it."""


def sauropod(
    n: int = 8192,
    *,
    noise: float = 0.0,
    seed: int = 0,
    cameras: tuple[tuple[float, float, float], ...] | None = TWO_CAMERAS,
) -> Sample:
    """A toy dinosaur with a carrying handle on its back: one loop, six ends, nothing thinner than 0.05.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.
    cameras : tuple of points, optional
        Only points that one of these sees are kept, as in a scan: the belly and parts of the legs and of the flanks
        behind them are missing. None keeps the whole surface.

    Returns
    -------
    Sample

    Examples
    --------
    >>> sauropod(500)
    Sample('sauropod', 500 points, 54 nodes, 54 edges)
    """
    nodes, edges, radii = _sauropod_axis()
    return union_sample("sauropod", nodes, edges, radii, n, noise, seed, cameras)


def _sauropod_axis() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, edges and radii; x forward, y to its left, z up; the feet stand on z = 0."""
    nodes, edges, radii = [], [], []

    def grow(places, sizes, start=None, end=None):
        """A chain of new nodes from `start`, closed onto `end`; returns its last node."""
        for place, size in zip(places, sizes, strict=True):
            if start is not None:
                edges.append((start, len(nodes)))
            start = len(nodes)
            nodes.append(place)
            radii.append(size)
        if end is not None:
            edges.append((start, end))
        return start

    hip = grow([(-0.20, 0, 0.345)], [0.105])
    rear = grow([(-0.11, 0, 0.362)], [0.122], hip)
    front = grow([(0, 0, 0.37), (0.11, 0, 0.368)], [0.128, 0.122], rear)
    chest = grow([(0.20, 0, 0.36)], [0.1], front)
    neck = _curve([(0.20, 0, 0.36), (0.33, 0, 0.43), (0.395, 0, 0.57), (0.42, 0, 0.72), (0.47, 0, 0.80)], 8)
    head = grow(neck, np.linspace(0.08, 0.042, len(neck)), chest)
    grow([(0.525, 0, 0.803), (0.615, 0, 0.765)], [0.056, 0.04], head)
    near_hip = [(-0.20, 0, 0.345), (-0.36, 0, 0.29), (-0.50, 0.04, 0.195)]
    tail = _curve([*near_hip, (-0.64, 0.11, 0.17), (-0.75, 0.10, 0.25), (-0.80, 0, 0.35)], 14)
    grow(tail, np.linspace(0.084, 0.028, len(tail)), hip)
    for root, x, sway in ((chest, 0.20, 0.025), (hip, -0.21, -0.025)):
        for side in (1, -1):
            leg = [(x, 0.105 * side, 0.25), (x + sway, 0.125 * side, 0.14), (x + sway * 0.4, 0.13 * side, 0.046)]
            grow(leg, [0.062, 0.05, 0.046], root)
    arch = np.linspace(np.pi, 0, 15)[1:-1]
    handle = np.stack([0.14 * np.cos(arch), 0 * arch, 0.46 + 0.27 * np.sin(arch) ** 0.8], axis=1)
    grow(handle, np.full(len(handle), 0.03), rear, end=front)
    return np.array(nodes), np.array(edges, np.int64), np.array(radii)


def _curve(through, pieces: int) -> np.ndarray:
    """A Catmull-Rom spline as `pieces` points, without its first."""
    p = np.asarray(through, float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, len(p) - 3, pieces + 1)[1:]
    i = np.minimum(t.astype(int), len(p) - 4)
    u = (t - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)
