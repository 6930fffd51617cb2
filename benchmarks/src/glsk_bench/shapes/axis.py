"""The axis of a shape while it is drawn: balls joined by round cones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from glsk_o3d.geometry.vectors import norm

from .curves import wander

# Fitted, as all of this page: joints and bends as round as those of things that people scan.
# A part keeps its own radius if what it starts in is thicker than so many of its radii. It has that radius from there
# on, as a share of the bar, and of the limb's first step.
BAR_THICKER, LIMB_THICKER = 1.3, 1.2
BAR_STARTS, LIMB_STARTS = 0.02, 0.03
BOW_STEP = 1.5  # between the nodes of a bar that is bowed, in radii
LIMB_STEP = 1.3  # between the nodes of a limb, in the mean of its radii at both ends
LEAST_STEPS = 4  # of a curved part


class UnfitDraw(Exception):
    """A draw that cannot be finished, or is not what its family promises; says why in a word."""


@dataclass(eq=False)
class Draft:
    """The axis of a shape while families draw on it; `nodes`, `edges` and `radii` are what comes of it."""

    places: list[np.ndarray] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)
    links: list[tuple[int, int]] = field(default_factory=list)

    @property
    def nodes(self) -> np.ndarray:
        """(M, 3) float64 array."""
        return np.array(self.places, float).reshape(-1, 3)

    @property
    def edges(self) -> np.ndarray:
        """(E, 2) int64 array."""
        return np.array(self.links, np.int64).reshape(-1, 2)

    @property
    def radii(self) -> np.ndarray:
        """(M,) float64 array."""
        return np.array(self.sizes, float)

    def ball(self, place: Sequence[float] | np.ndarray, radius: float) -> int:
        """Add a ball; gives its node."""
        self.places.append(np.asarray(place, float))
        self.sizes.append(float(radius))
        return len(self.places) - 1


@dataclass(eq=False)
class Axis(Draft):
    """Balls joined by round cones, the convex hulls of two balls each: a shape and, at once, its true axis."""

    def path(
        self, places: np.ndarray, radii: float | np.ndarray, start: int | None = None, end: int | None = None
    ) -> list[int]:
        """Add a polyline, (p, 3) float array, with a radius for all or one each; gives its nodes.

        The nodes `start` and `end`, where they are given, take the place of its first and its last.
        """
        known = {0: start, len(places) - 1: end}
        radii = np.broadcast_to(np.asarray(radii, float), len(places))
        nodes = []
        for k, (place, radius) in enumerate(zip(places, radii, strict=True)):
            old = known.get(k)
            nodes.append(self.ball(place, radius) if old is None else old)
        self.links += pairwise(nodes)
        return nodes

    def ring(self, places: np.ndarray, radii: float | np.ndarray) -> list[int]:
        """Add a polyline whose last place is joined to its first; gives its nodes."""
        nodes = self.path(places, radii)
        self.links.append((nodes[-1], nodes[0]))
        return nodes

    def bar(self, i: int, j: int, radius: float, bow: np.ndarray | None = None) -> None:
        """Add a bar between two nodes, straight, or bowed aside by a vector in its middle."""
        a, b = self.places[i], self.places[j]
        steps = 1 if bow is None else max(LEAST_STEPS, int(np.linalg.norm(b - a) / (BOW_STEP * radius)))
        t = np.linspace(0, 1, steps + 1)[:, None]
        places = a + t * (b - a)
        if bow is not None:
            places = places + 4 * t * (1 - t) * bow
        if max(self.sizes[i], self.sizes[j]) > BAR_THICKER * radius:
            short = BAR_STARTS * (b - a)
            places = np.vstack([places[:1], places[:1] + short, places[1:-1], places[-1:] - short, places[-1:]])
        self.path(places, radius, i, j)

    def limb(
        self,
        rng: np.random.Generator,
        start: int,
        ahead: np.ndarray,
        length: float,
        radius: float,
        tip: float,
        bend: float = 0.5,
    ) -> int:
        """Add a curved part from a node on, of `radius` there and of radius `tip` at its end; gives its last node."""
        steps = max(LEAST_STEPS, int(np.ceil(length / (LIMB_STEP / 2 * (radius + tip)))))
        places = wander(rng, self.places[start], ahead, length, steps, bend)
        if self.sizes[start] > LIMB_THICKER * radius:
            near = places[:1] * (1 - LIMB_STARTS) + places[1:2] * LIMB_STARTS
            places = np.vstack([places[:1], near, places[1:]])
        return self.path(places, np.linspace(radius, tip, len(places)), start=start)[-1]

    def rotated(self, rotation: Rotation) -> Axis:
        """The axis turned about the origin."""
        return Axis(list(rotation.apply(self.nodes)), self.sizes, self.links)

    def normalised(self) -> Axis:
        """The axis of the shape whose bounding box has its middle in the origin and a diagonal of 1."""
        nodes, radii = self.nodes, self.radii
        low, high = (nodes - radii[:, None]).min(axis=0), (nodes + radii[:, None]).max(axis=0)
        scale = 1 / np.linalg.norm(high - low)
        return Axis(list((nodes - (low + high) / 2) * scale), list(radii * scale), self.links)


def joined(parts: Sequence[Axis]) -> Axis:
    """All parts as one axis."""
    whole = Axis()
    for part in parts:
        first = len(whole.places)
        whole.places += part.places
        whole.sizes += part.sizes
        whole.links += [(i + first, j + first) for i, j in part.links]
    return whole


FINE_STEP = 0.5  # fitted: pieces of an axis, in the radius: their balls differ from the cone by a few percent of it


def subdivided(
    nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, longest: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, edges and radii once every edge is cut in equal pieces, by default of half its smaller radius at most.

    The new nodes come after those there were, edge by edge, and the pieces of each edge one after another.
    """
    a, b = edges.T
    span, swell = nodes[b] - nodes[a], radii[b] - radii[a]
    most = FINE_STEP * np.minimum(radii[a], radii[b]) if longest is None else longest
    pieces = np.maximum(np.ceil(norm(span) / most).astype(int), 1)
    new = pieces - 1
    edge = np.repeat(np.arange(len(edges)), new)
    t = (_counted(new) + 1) / pieces[edge]
    inner = nodes[a[edge]] + t[:, None] * span[edge]
    all_radii = np.concatenate([radii, radii[a[edge]] + t * swell[edge]])
    # piece k of an edge, of those in a row, begins at new node k - 1 of this edge: but for the first, at the old one
    piece_edge, k = np.repeat(np.arange(len(edges)), pieces), _counted(pieces)
    after = len(nodes) + (np.cumsum(new) - new)[piece_edge] + k
    start = np.where(k == 0, a[piece_edge], after - 1)
    end = np.where(k == pieces[piece_edge] - 1, b[piece_edge], after)
    return np.vstack([nodes, inner]), np.column_stack([start, end]), all_radii


def _counted(sizes):
    """0, 1, 2, ... for each of groups that lie one behind the other."""
    return np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
