"""Samples with limbs, unions of tapered capsules: a Y, an animal as two cameras see it, and a tree drawn at random."""

from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from ..errors import InvalidParameterError
from ..geometry.vectors import Floats
from .capsules import Axis, Sample, checked_generator, directions, union_sample

TWO_CAMERAS = ((1.1, 1.8, 1.4), (-1.2, -1.7, 1.3))
"""Where the sauropod is scanned from: front left and rear right, a little above it."""

LIMB_NODES = 6  # fitted: of each limb of a tree
CANDIDATE_LIMBS = 40  # fitted: of which the one farthest from all others grows
LENGTH_RATIO = 0.76  # fitted: of a limb to the one that it grows from
TAPER = np.sqrt(0.5)  # derived: end over beginning, so that the two limbs of a fork have the cross-section of one
LEAN, BEND, UPWARDS = 0.7, 0.3, 0.2  # fitted: turns of limbs at a fork, along their length, and towards the light


def y_junction(
    n: int = 4096, *, radii: tuple[float, float, float] = (0.09, 0.07, 0.07), noise: float = 0.0, seed: int = 0
) -> Sample:
    """Three straight tubes of length 0.5 that meet in the origin: a stem downwards and two arms, 80 degrees apart.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`.
    radii : tuple of three floats
        At the ends of the stem and of the two arms; all have the stem's radius in the middle.

    Examples
    --------
    >>> y_junction(500)
    Sample('y_junction', 500 points, 4 nodes, 3 edges)
    """
    checked_generator(n, noise, seed, stem=radii[0], left=radii[1], right=radii[2])
    sine, cosine = np.sin(np.deg2rad(40)), np.cos(np.deg2rad(40))
    axis = Axis()
    middle = axis.grow(np.zeros((1, 3)), radii[0])
    for end, radius in zip(0.5 * np.array([[0, 0, -1], [-sine, 0, cosine], [sine, 0, cosine]]), radii, strict=True):
        axis.grow([end], radius, middle)
    return union_sample("y_junction", *axis.arrays(), n, noise, seed)


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
        Keep only points that one of these cameras sees, as in a scan: the belly and parts of the legs and of the flanks
        behind them are missing. None keeps the whole surface.

    Examples
    --------
    >>> sauropod(500)
    Sample('sauropod', 500 points, 54 nodes, 54 edges)
    """
    axis = Axis()  # x forward, y to its left, z up; the feet stand on z = 0
    hip = axis.grow([(-0.20, 0, 0.345)], 0.105)
    rear = axis.grow([(-0.11, 0, 0.362)], 0.122, hip)
    front = axis.grow([(0, 0, 0.37), (0.11, 0, 0.368)], [0.128, 0.122], rear)
    chest = axis.grow([(0.20, 0, 0.36)], 0.1, front)
    neck = _curve([(0.20, 0, 0.36), (0.33, 0, 0.43), (0.395, 0, 0.57), (0.42, 0, 0.72), (0.47, 0, 0.80)], 8)
    head = axis.grow(neck, np.linspace(0.08, 0.042, len(neck)), chest)
    axis.grow([(0.525, 0, 0.803), (0.615, 0, 0.765)], [0.056, 0.04], head)
    near_hip = [(-0.20, 0, 0.345), (-0.36, 0, 0.29), (-0.50, 0.04, 0.195)]
    tail = _curve([*near_hip, (-0.64, 0.11, 0.17), (-0.75, 0.10, 0.25), (-0.80, 0, 0.35)], 14)
    axis.grow(tail, np.linspace(0.084, 0.028, len(tail)), hip)
    for root, x, sway in ((chest, 0.20, 0.025), (hip, -0.21, -0.025)):
        for side in (1, -1):
            leg = [(x, 0.105 * side, 0.25), (x + sway, 0.125 * side, 0.14), (x + sway * 0.4, 0.13 * side, 0.046)]
            axis.grow(leg, [0.062, 0.05, 0.046], root)
    arch = np.linspace(np.pi, 0, 15)[1:-1]
    handle = np.stack([0.14 * np.cos(arch), 0 * arch, 0.46 + 0.27 * np.sin(arch) ** 0.8], axis=1)
    axis.grow(handle, 0.03, rear, end=front)
    return union_sample("sauropod", *axis.arrays(), n, noise, seed, cameras)


def _curve(through: Any, pieces: int) -> Any:
    """A Catmull-Rom spline as `pieces` points, without its first."""
    p = np.asarray(through, float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, len(p) - 3, pieces + 1)[1:]
    i = np.minimum(t.astype(int), len(p) - 4)
    u = (t - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)


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

    The first node is the foot, and each edge leads away from it. Tips are ``2 * radius / 2 ** ((forks + 1) / 2)``
    thick. If the point spacing is larger, as with 5 forks and 4096 points, twigs are only rows of points.

    Parameters
    ----------
    n, noise, seed : int, float, int
        As in `sample_object`; the seed is of the shape, too.
    forks : int
        From the foot to a tip; the tree has ``2 ** forks`` tips.
    length, radius : float
        Of the trunk, which stands upright in the origin; in metres it is a small tree.
    cameras : (k, 3) array, optional
        Places of the scanners: points that none of them sees are missing.

    Examples
    --------
    >>> tree(500, forks=2)
    Sample('tree', 500 points, 43 nodes, 42 edges)
    """
    rng = checked_generator(n, noise, [seed, 1], length=length, radius=radius)
    if isinstance(forks, bool) or not isinstance(forks, int | np.integer) or not 0 <= forks <= 8:
        raise InvalidParameterError(f"forks = {forks!r}: must be an int from 0 to 8")
    axis = Axis()
    tips = [(axis.grow(np.zeros((1, 3)), radius), np.array([0.0, 0.0, 1.0]))]
    for order in range(forks + 1):
        forked = tips if order == 0 else [tip for tip in tips for _ in range(2)]
        tips = []
        for root, heading in forked:
            nodes, _, radii = axis.arrays()
            candidates = nodes[root] + length * LENGTH_RATIO**order * _limbs(heading, LEAN if order else 0.0, rng)
            gaps = [(cdist(limb[1:], nodes) - radii).min() for limb in candidates]
            limb = candidates[np.argmax(gaps)]
            tip = axis.grow(limb, np.linspace(radii[root], radii[root] * TAPER, LIMB_NODES + 1)[1:], root)
            tips.append((tip, limb[-1] - limb[-2]))
    return union_sample("tree", *axis.arrays(), n, noise, seed, cameras)


def _limbs(heading: np.ndarray, lean: float, rng: np.random.Generator) -> np.ndarray:
    """Candidate limbs of unit length, (c, LIMB_NODES, 3), that leave the origin, lean aside, and bend up a little."""
    start = directions(CANDIDATE_LIMBS, rng) * lean + heading / np.linalg.norm(heading)
    bend = directions(CANDIDATE_LIMBS, rng) * BEND + [0, 0, UPWARDS * (lean > 0)]
    along = np.linspace(0, 1, LIMB_NODES)[:, None, None]
    steps: Floats = start + along * bend
    steps /= np.linalg.norm(steps, axis=2, keepdims=True)
    return np.cumsum(steps, axis=0).swapaxes(0, 1) / LIMB_NODES
