"""Frames: bars between corners, flat and in space, with one to eight loops."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import Delaunay
from scipy.spatial.distance import cdist

from .axis import Axis, UnfitDraw
from .curves import across, any_rotation, polygon

MOST_LOOPS = 8  # fitted: with more, bars are as thin as 4096 points are far apart
WIDEST_BAR = 0.14  # fitted: radius in the mean length of the bars, unless points would be too far apart then
THINNEST_BAR = 0.0022  # derived: 1.2 spacings of 4096 points on a tube as long as all bars, 1.44 * 2 pi / 4096 of that
THINNEST_SLACK = 1.35  # fitted: bars differ, and may be bowed


def frames(rng: np.random.Generator) -> Axis:
    """Draw a frame; in three of ten the bars are bowed."""
    corners, links = frame_graph(rng)
    if not 1 <= len(links) - len(corners) + 1 <= MOST_LOOPS:
        raise UnfitDraw("loops")
    lengths = np.array([np.linalg.norm(corners[i] - corners[j]) for i, j in links])
    thick = min(lengths.min() * rng.uniform(0.07, 0.2), WIDEST_BAR * lengths.mean())
    thick = max(thick, THINNEST_BAR * lengths.sum() * THINNEST_SLACK)
    axis, vary, bowed = Axis(), rng.uniform(0, 0.25), rng.random() < 0.3
    for corner in corners:
        axis.ball(corner, thick)
    for (i, j), length in zip(links, lengths, strict=True):
        radius, bow = thick * (1 + rng.uniform(-vary, vary)), None
        if bowed:
            bow = 0.12 * length * rng.uniform(0, 1) * across(corners[i] - corners[j])[0]
        axis.bar(i, j, radius, bow)
        for end in (i, j):
            axis.sizes[end] = max(axis.sizes[end], radius)
    return axis.rotated(any_rotation(rng))


Graph = tuple[np.ndarray, list[tuple[int, int]]]

GRIDS = ((2, 2), (2, 3), (3, 3), (2, 4), (3, 4), (2, 5))  # fitted: rows and columns of lattices, for one to six loops
PLACES_TRIED = 400  # fitted: for the corners of a random frame
LEAST_APART = {2: 0.55, 3: 0.75}  # fitted: corners of a random frame in a plane and in space, within a side of 2


def frame_graph(rng: np.random.Generator) -> Graph:
    """Draw the graph of a frame; not all have a permitted number of loops."""
    return GRAPHS[str(rng.choice(list(GRAPHS)))](rng)


def _around(corners, first=0):
    """Each corner of a polygon with the next."""
    return [(first + i, first + (i + 1) % corners) for i in range(corners)]


def _ladder(rng: np.random.Generator) -> Graph:
    """Two rails, which may flare, and two to seven rungs; the rails may go on beyond them."""
    rungs, flare = int(rng.integers(2, 8)), rng.uniform(0.7, 1.3)
    along = np.arange(rungs + 2) * rng.uniform(0.6, 1.2)
    goes_on = rng.random() < 0.7
    if not goes_on:
        along = along[1:-1]
    m, half = len(along), 0.5 * np.linspace(1, flare, len(along))
    corners = np.vstack([np.column_stack([side * half, along, 0 * along]) for side in (-1, 1)])
    rails = [(side * m + i, side * m + i + 1) for side in (0, 1) for i in range(m - 1)]
    return corners, rails + [(i, m + i) for i in (range(1, m - 1) if goes_on else range(m))]


def _prism(rng: np.random.Generator) -> Graph:
    """Two polygons, of which the upper one may be smaller or larger, and the bars between them."""
    n = int(rng.integers(3, 7))
    corners = np.vstack([polygon(n), polygon(n, rng.uniform(0.8, 1.8), rng.uniform(0.7, 1.2))])
    return corners, _around(n) + _around(n, n) + [(i, n + i) for i in range(n)]


def _pyramid(rng: np.random.Generator) -> Graph:
    """A polygon and a top."""
    n, high = int(rng.integers(3, 7)), rng.uniform(0.9, 1.8)
    return np.vstack([polygon(n), [[0, 0, high]]]), _around(n) + [(i, n) for i in range(n)]


def _platonic(rng: np.random.Generator) -> Graph:
    """A cube, a tetrahedron or an octahedron, stretched along the axes."""
    cube = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    corners = [cube, cube[[0, 3, 5, 6]], np.vstack([np.eye(3), -np.eye(3)])][int(rng.integers(3))]
    apart = cdist(corners, corners)
    side = apart[apart > 0].min()
    links = [(i, j) for i, j in combinations(range(len(corners)), 2) if apart[i, j] < 1.01 * side]
    return corners * rng.uniform(0.8, 1.3, 3), links


def _lattice(rng: np.random.Generator) -> Graph:
    """Squares side by side, a little out of shape."""
    a, b = GRIDS[int(rng.integers(len(GRIDS)))]
    corners = np.array([(i, j, 0) for i in range(a) for j in range(b)], float) + rng.normal(0, 0.1, (a * b, 3))
    links = [(i * b + j, i * b + j + 1) for i in range(a) for j in range(b - 1)]
    return corners, links + [(i * b + j, i * b + j + b) for i in range(a - 1) for j in range(b)]


def _stool(rng: np.random.Generator) -> Graph:
    """A seat, three or four splayed legs, and mostly bars between them."""
    n, splay = int(rng.integers(3, 5)), rng.uniform(1.1, 1.5)
    seat, bars = polygon(n), polygon(n, -rng.uniform(0.7, 1.1), (1 + splay) / 2)
    feet = polygon(n, -rng.uniform(1.5, 2), splay)
    links = _around(n) + [(i, n + i) for i in range(n)] + [(n + i, 2 * n + i) for i in range(n)]
    if rng.random() < 0.7:
        links += _around(n, n)
    return np.vstack([seat, bars, feet]), links


def _planar(rng: np.random.Generator) -> Graph:
    """Random corners in a plane, each a little out of it, and short edges of their triangulation."""
    corners, links = _random(rng, 2)
    return np.column_stack([corners, 0.12 * rng.normal(size=len(corners))]), links


def _spatial(rng: np.random.Generator) -> Graph:
    """Random corners in space, and short edges of their triangulation."""
    return _random(rng, 3)


def _random(rng, dimension):
    """Corners that keep apart; the shortest edges that join them all, and so many more as there are to be loops."""
    wanted = int(rng.integers(5, 10))
    corners = [rng.uniform(-1, 1, dimension)]
    for _ in range(PLACES_TRIED):
        new = rng.uniform(-1, 1, dimension)
        if len(corners) < wanted and cdist([new], corners).min() > LEAST_APART[dimension]:
            corners.append(new)
    corners = np.array(corners)
    near = {tuple(sorted(pair)) for simplex in Delaunay(corners).simplices for pair in combinations(simplex, 2)}
    ends, n = np.array(sorted(near)).T, len(corners)
    length = cdist(corners, corners)[tuple(ends)]
    tree = minimum_spanning_tree(coo_matrix((length, ends), (n, n)).tocsr()).toarray()[tuple(ends)] > 0
    pairs = [(int(i), int(j)) for i, j in ends.T]
    order = np.argsort(length, kind="stable")
    more = [pairs[k] for k in order if not tree[k]]
    return corners, [pairs[k] for k in order if tree[k]] + more[: int(rng.integers(1, 9))]


GRAPHS = {
    "ladder": _ladder,
    "prism": _prism,
    "pyramid": _pyramid,
    "platonic": _platonic,
    "lattice": _lattice,
    "stool": _stool,
    "planar": _planar,
    "spatial": _spatial,
}
"""The kinds of frames, each as likely as another."""
