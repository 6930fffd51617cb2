"""Trees with known axes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from ..errors import InvalidParameterError
from .capsules import union_sample
from .sample import Sample, check, directions

PIECES = 6  # of which a limb is made
TRIED = 40  # limbs drawn for each that grows
SHORTER = 0.76  # a limb than the one before
THINNER = np.sqrt(0.5)  # at its end than at its beginning, so that two that fork have the cross-section of one
LEAN, BEND, UPWARDS = 0.7, 0.3, 0.2  # how far limbs turn aside at a fork, on their way, and towards the light


def tree(
    n: int = 16384,
    *,
    forks: int = 4,
    length: float = 1.4,
    radius: float = 0.1,
    noise: float = 0.0,
    seed: int = 0,
    cameras: np.ndarray | None = None,
) -> Sample:
    """A tree drawn at random: a trunk that forks in two and forks again, each limb tapering to half its cross-section.

    Points are uniform by area. Tips are ``2 * radius / 2 ** ((forks + 1) / 2)`` thick; where points are farther
    apart than that, as with 5 forks and 4096 points, twigs have no surface and are no more than rows of points.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`; the seed is of the shape, too.
    forks : int
        From the foot to a tip; the tree has ``2 ** forks`` tips.
    length, radius : float
        Of the trunk, which stands upright in the origin; in metres it is a small tree.
    cameras : (k, 3) array, optional
        Where the tree was scanned from: points that none of them sees are missing.

    Returns
    -------
    Sample
        Its first node is the foot, and each edge leads away from it.

    Examples
    --------
    >>> tree(500, forks=2)
    Sample('tree', 500 points, 43 nodes, 42 edges)
    """
    check(n, noise, length=length, radius=radius)
    if isinstance(forks, bool) or not isinstance(forks, int | np.integer) or not 0 <= forks <= 8:
        raise InvalidParameterError(f"forks = {forks!r}: must be an int from 0 to 8")
    nodes, edges, radii = _grown(forks, length, radius, np.random.default_rng([seed, 1]))
    return union_sample("tree", nodes, edges, radii, n, noise, seed, cameras)


def _grown(forks, length, radius, rng):
    """Nodes, edges and radii, order by order; of many limbs drawn the one farthest from all others grows."""
    nodes, edges, radii = np.zeros((1, 3)), [], np.array([radius])
    tips = [(0, np.array([0.0, 0.0, 1.0]))]
    for order in range(forks + 1):
        grown = []
        for root, heading in [tip for tip in tips for _ in range(2 if order else 1)]:
            drawn = nodes[root] + length * SHORTER**order * _limbs(heading, LEAN if order else 0.0, rng)
            clear = [(cdist(limb[1:], nodes) - radii).min() for limb in drawn]
            limb, first = drawn[np.argmax(clear)], len(nodes)
            edges += [(root, first), *((at, at + 1) for at in range(first, first + PIECES - 1))]
            nodes = np.concatenate([nodes, limb])
            radii = np.append(radii, np.linspace(radii[root], radii[root] * THINNER, PIECES + 1)[1:])
            grown.append((len(nodes) - 1, limb[-1] - limb[-2]))
        tips = grown
    return nodes, np.array(edges, np.int64), radii


def _limbs(heading, lean, rng):
    """Limbs of unit length, (TRIED, PIECES, 3), that leave the origin, lean aside, and bend up a little."""
    start = directions(TRIED, rng) * lean + heading / np.linalg.norm(heading)
    bend = directions(TRIED, rng) * BEND + [0, 0, UPWARDS * (lean > 0)]
    along = np.linspace(0, 1, PIECES)[:, None, None]
    steps = start + along * bend
    steps /= np.linalg.norm(steps, axis=2, keepdims=True)
    return np.cumsum(steps, axis=0).swapaxes(0, 1) / PIECES
