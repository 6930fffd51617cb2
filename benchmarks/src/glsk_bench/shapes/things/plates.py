"""Plates with holes, washers, gears, paddles, brackets; the axis is that of the bars around the holes."""

from __future__ import annotations

from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from ..axis import UnfitDraw
from ..curves import UP, any_rotation, log_uniform, polygon
from .lines import X, Y, straight
from .section import ELLIPSE, section_radius
from .solid import FLAT_INSET, Solid

WASHER_PLACES = 48  # fitted: round enough
ROUNDISH, WIDER_BESIDE = 4, 0.15  # fitted: below this power bars beside holes are wider, by so much of the hole
EDGE_POWER = 16  # fitted: of the edge along which a bracket is bent


class _Sheet(NamedTuple):
    """What the plates of a thing have in common."""

    bars: np.ndarray  # widths of the bars, along x and y
    hole: np.ndarray  # widths of the holes
    thick: float
    power: float  # of the section of a bar
    corner: float  # power of the superellipse that a hole is

    def size(self, nx, ny):
        """Of a plate with so many holes."""
        return np.array([nx, ny]) * (self.bars + self.hole) + self.bars

    def node(self, solid, place, half):
        """Add a node in a bar of this half width."""
        return solid.node(place, section_radius(half, self.thick / 2, self.power), half, self.thick / 2)

    def path(self, solid, places, half, start, end=None):
        """Add a path in a bar of this half width."""
        return solid.path(places, half, self.thick / 2, self.power, start, end)

    def stem(self, solid, places, half, start):
        """Add a path whose last place is at the flat end of a bar."""
        places = np.array(places, float)
        inset = FLAT_INSET * section_radius(half, self.thick / 2, self.power)
        along = np.abs(places[-1] - places[-2]).argmax()
        places[-1, along] = places[-1, along] - inset
        solid.flat.append(self.path(solid, places, half, start)[-1])


def plates(rng: np.random.Generator) -> Solid:
    """Draw a plate: with a row of holes in two of seven, or with four; a washer, a gear, a paddle, a bracket."""
    solid, kind = Solid(), str(rng.choice(["row", "row", "grid", "washer", "gear", "paddle", "bracket"]))
    power, corner = rng.uniform(10, 24), float(ELLIPSE) if rng.random() < 0.4 else rng.uniform(4, 10)
    bars = rng.uniform(0.8, 1.25, 2)
    hole = bars.mean() * log_uniform(rng, 0.5, 3)
    hole = hole * (np.ones(2) if corner == ELLIPSE else rng.uniform(0.75, 1.3, 2))
    sheet = _Sheet(bars, np.clip(hole, 0.5 * bars.max(), 3 * bars.min()), 0.0, power, corner)
    if kind in ("washer", "gear"):
        _washer(solid, rng, kind)
    else:
        {"row": _row_of_holes, "grid": _four_holes, "paddle": _paddle, "bracket": _bracket}[kind](solid, rng, sheet)
    return solid.rotated(any_rotation(rng))


def _row_of_holes(solid, rng, sheet):
    """One to five holes side by side."""
    _holes(solid, rng, sheet, int(rng.integers(1, 6)), 1)


def _four_holes(solid, rng, sheet):
    """Two rows of two holes."""
    _holes(solid, rng, sheet, 2, 2)


def _holes(solid, rng, sheet, nx, ny):
    sheet = sheet._replace(thick=max(sheet.size(nx, ny).max(), 1) * rng.uniform(0.04, 0.12))
    _plate(solid, sheet, nx, ny)


def _washer(solid, rng, kind):
    """A flat ring, round or a little oval; of a gear, with teeth around."""
    u = rng.uniform
    size = u(1.6, 4)  # in half widths of its bar
    narrow = u(0.8, 1) if size > 2.2 and kind == "washer" else 1
    half = (size + 1) * u(0.06, 0.14)
    solid.ring(polygon(WASHER_PLACES, radius=size) * [1, narrow, 1], half, 1.0, u(6, 16))
    solid.openings = [2 * (size - 1)]
    if kind == "gear":
        teeth, high = int(rng.integers(8, 16)), u(0.25, 0.5)
        wide = np.pi * (size + 1) / teeth * u(0.35, 0.5)
        for out in polygon(teeth):
            places = straight(out * size, out * (size + 1 + high), 3)
            solid.body(places, wide * np.array([1, 1, 0.75]), 0.97 * half, 8, np.cross(UP, out))


def _paddle(solid, rng, sheet):
    """A plate with one hole, and a stem as wide or narrower."""
    u, size = rng.uniform, sheet.size(1, 1)
    long = size[0] + size[1] * u(0.8, 2.2)
    sheet = sheet._replace(thick=long * u(0.04, 0.12))
    middle = size[1] / 2
    half = middle * u(0.55, 1)
    low, high = _plate(solid, sheet, 1, 1, body=False)[1]
    if (low, high) not in solid.links:  # the bars differ so much that this one keeps its own width
        raise UnfitDraw("bars")
    fork = sheet.node(solid, [sheet.bars[0] * 1.5 + sheet.hole[0], middle, 0], sheet.bars[0] / 2)
    k = solid.links.index((low, high))
    solid.links[k : k + 1] = [(low, fork), (fork, high)]
    solid.paths[solid.paths.index([low, high])] = [low, fork, high]
    x = [0, size[0], size[0] + (0.02 if half < 0.8 * middle else 0.4 * size[1]), long]
    places = np.column_stack([x, np.full(4, middle), np.zeros(4)])
    solid.body(places, [middle, middle, half, half], sheet.thick / 2, sheet.power, Y)
    sheet.stem(solid, [solid.places[fork], [size[0], middle, 0], [long, middle, 0]], half, fork)


def _bracket(solid, rng, sheet):
    """Two plates at right angles, of which the second may have no hole."""
    u = rng.uniform
    counts = int(rng.integers(1, 3)), int(rng.integers(0, 3))
    size = sheet.size(max(counts), 1)
    sheet = sheet._replace(thick=size.max() * u(0.05, 0.12))
    edge, half = sheet.bars[0] / 4, sheet.bars[0] / 2
    ys = sheet.bars[1] / 2, sheet.bars[1] * 1.5 + sheet.hole[1]
    bend = [sheet.node(solid, [edge, y, edge], half) for y in (ys[0], sum(ys) / 2, ys[1])]
    for low, high in pairwise(bend):
        sheet.path(solid, solid.nodes[[low, high]], half, low, high)
    for count, order in zip(counts, ([0, 1, 2], [2, 1, 0]), strict=True):
        if count:
            _plate(solid, sheet, count, 1, order, first=(bend[0], bend[2]))
            continue
        long, middle = size[1] * u(0.6, 1.5), size[1] / 2
        places = straight([0, middle, 0], [long, middle, 0])[:, order]
        solid.body(places, middle, sheet.thick / 2, sheet.power, Y)
        places = np.array([[edge, middle, edge], [2 * edge, middle, 0], [long, middle, 0]])[:, order]
        sheet.stem(solid, places, middle, bend[1])
    solid.body(straight([0, 0, 0], [0, size[1], 0]), sheet.thick / 2, sheet.thick / 2, EDGE_POWER, X)


def _plate(solid, sheet, nx, ny, order=(0, 1, 2), first=None, body=True):
    """Add a plate with nx times ny holes, from the origin along x and y, or along the axes that these are in `order`.

    Gives the nodes between holes, by column. `first` are those of the first column, where they are there.
    """
    order = list(order)
    bars, hole, half = sheet.bars, sheet.hole, sheet.thick / 2
    size, pitch = sheet.size(nx, ny), bars + hole
    if body:
        places = straight([0, size[1] / 2, 0], [size[0], size[1] / 2, 0])[:, order]
        solid.body(places, size[1] / 2, half, sheet.power, Y[order])
    for spot in product(range(nx), range(ny)):
        middle, deep = bars + hole / 2 + np.array(spot) * pitch, sheet.thick + hole.max()
        places = np.array([[*middle, -deep], [*middle, deep]])[:, order]
        solid.void(places, *(hole / 2), sheet.corner, X[order])
    solid.openings += list(hole)
    wide = bars + (WIDER_BESIDE * hole if sheet.corner < ROUNDISH else 0)
    xs, ys = (bars[k] / 2 + np.arange(count + 1) * pitch[k] for k, count in enumerate((nx, ny)))
    nodes = []
    for i, x in enumerate(xs):
        places = np.array([[x, y, 0] for y in ys])[:, order]
        column = first if first and i == 0 else [sheet.node(solid, place, min(wide) / 2) for place in places]
        nodes.append(list(column))
    for i, j in product(range(nx + 1), range(ny + 1)):
        for k, end in enumerate(((i + 1, j), (i, j + 1))):
            if end[0] > nx or end[1] > ny or (k == 1 and i == 0 and first):
                continue
            ends = nodes[i][j], nodes[end[0]][end[1]]
            sheet.path(solid, solid.nodes[list(ends)], wide[1 - k] / 2, *ends)
    return nodes
