"""Frames: bars between corners, flat and in space, with one to eight loops."""

from __future__ import annotations

import numpy as np

from ..randomness import any_rotation
from .axis import Axis, UnfitDraw
from .curves import across
from .frame_graphs import frame_graph

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
