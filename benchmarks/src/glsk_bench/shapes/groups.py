"""Groups: two or three parts that do not touch, side by side or linked."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.spatial.distance import cdist

from .axis import Axis, UnfitDraw, joined, subdivided
from .curves import UP, across, any_rotation, direction, oval, swelling, wander

GAP_RANGE = (0.7, 2.0)  # fitted: between two parts, in the thinner one's least radius
GAP_SLACK = 0.05  # fitted: more is permitted to the nearest two
RING_NODES, PIECE_RING_NODES = 36, 32  # fitted: round enough
TUBE_STEPS, BESIDE_STEPS = 14, 18  # fitted: smooth enough


def groups(rng: np.random.Generator) -> Axis:
    """Draw a group: parts anywhere, in two of five; tubes along each other; rings linked; a tube through a ring."""
    kind = rng.choice(["beside", "beside", "offset", "linked", "threaded"])
    parts = {"beside": _beside, "offset": _offset, "linked": _linked, "threaded": _threaded}[str(kind)](rng)
    gaps = [_distance(_finely(a), _finely(b)) / min(*a.sizes, *b.sizes) for a, b in combinations(parts, 2)]
    if not GAP_RANGE[0] <= min(gaps) <= GAP_RANGE[1] + GAP_SLACK:
        raise UnfitDraw("gap")
    return joined(parts).rotated(any_rotation(rng))


def _linked(rng):
    """Two rings, the one through the other."""
    a, b = Axis(), Axis()
    places = oval(rng, RING_NODES, 0.5, narrowest=0.8)
    a.ring(places, rng.uniform(0.06, 0.11))
    places = oval(rng, RING_NODES, rng.uniform(0.4, 0.5), narrowest=0.8)
    radius = rng.uniform(0.06, 0.11)
    b.ring(places[:, [0, 2, 1]] + [rng.uniform(0.35, 0.55), 0, 0], radius)
    return [a, b]


def _threaded(rng):
    """A ring, and a tube through it."""
    a, b = Axis(), Axis()
    places = oval(rng, RING_NODES, 0.4, narrowest=0.8)
    a.ring(places, rng.uniform(0.06, 0.09))
    ahead = UP + 0.3 * rng.normal(size=3)
    places = wander(rng, np.zeros(3), ahead, 1.4, TUBE_STEPS, 0.4)
    b.path(places - places[TUBE_STEPS // 2], rng.uniform(0.06, 0.12))
    return [a, b]


def _offset(rng):
    """Two or three tubes along each other, of which some begin later or end sooner."""
    radius, count = rng.uniform(0.035, 0.07), int(rng.integers(2, 4))
    places = wander(rng, np.zeros(3), UP, 1.2, BESIDE_STEPS, rng.uniform(0, 1.0))
    side = across(places[-1] - places[0])[0]
    parts, at = [], 0.0
    for _ in range(count):
        first, left_out = int(rng.integers(0, 4)), int(rng.integers(0, 4))
        part = Axis()
        part.path(places[first : len(places) - left_out] + at * side, radius)
        at += 2 * radius + rng.uniform(*GAP_RANGE) * radius
        parts.append(part)
    return parts


def _beside(rng):
    """Two or three parts, each of which slid towards the ones before until it was near."""
    parts = [_part(rng)]
    for _ in range(int(rng.integers(1, 3))):
        new, way = _part(rng), direction(rng.normal(size=3))
        before = joined(parts)
        wanted = rng.uniform(*GAP_RANGE) * min(*before.sizes, *new.sizes)
        new.places = list(new.nodes + _slid(_finely(before), _finely(new), way, wanted) * way)
        parts.append(new)
    return parts


def _slid(before, new, way, wanted):
    """How far out along a way something stands that came from afar and stopped when it was as near as wanted."""

    def gap(t):
        return _distance(before, (new[0] + t * way, new[1]))

    inward = np.linspace(2.0, 0, 101)
    t = next((t for t in inward if gap(t) < wanted), inward[-1])
    back = np.linspace(t, t + 0.02, 9)[1:]
    return next((t for t in back if gap(t) >= wanted), back[-1])


def _part(rng):
    """A tube, in half of them, or a fork, or a ring."""
    kind, radius = rng.choice(["tube", "tube", "fork", "ring"]), rng.uniform(0.05, 0.1)
    axis = Axis()
    if kind == "tube":
        length = rng.uniform(0.8, 1.4)
        places = wander(rng, np.zeros(3), UP, length, TUBE_STEPS, rng.uniform(0, 1.5))
        swing = rng.uniform(0, 0.25)
        axis.path(places, radius * swelling(rng, len(places), swing))
    elif kind == "fork":
        fork = axis.ball([0, 0, 0], radius)
        for k in range(3):
            angle = 2 * np.pi * k / 3 + rng.normal(0, 0.25)
            ahead = np.array([np.cos(angle), np.sin(angle), rng.normal(0, 0.25)])
            length = rng.uniform(0.4, 0.8)
            axis.limb(rng, fork, ahead, length, radius, radius * rng.uniform(0.7, 1), bend=0.4)
    else:
        axis.ring(oval(rng, PIECE_RING_NODES, rng.uniform(0.35, 0.6)), radius)
    return axis.rotated(any_rotation(rng))


def _finely(axis):
    """Places all along an axis, and the radii there."""
    places, _, radii = subdivided(axis.nodes, axis.edges, axis.radii)
    return places, radii


def _distance(one, other):
    """Between two surfaces, told by places and radii along their axes."""
    (a, radius_a), (b, radius_b) = one, other
    return (cdist(a, b) - radius_a[:, None] - radius_b).min()
