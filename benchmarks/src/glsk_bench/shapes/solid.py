"""Components, loops and cavities of a union of balls."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.ndimage import label

CELLS_PER_RADIUS = 3  # fitted: of the grid, along the least radius: what touches there is told from what does not
LEAST_CELL = 0.0035  # fitted: of the grid, as a share of the diagonal: at most some ten million cells


def topology(centres: np.ndarray, radii: np.ndarray) -> tuple[int, int, int]:
    """Components, loops and cavities of a union of balls, as its cells on a grid have them.

    Components are cells that share a corner at least, cavities empty cells that share a face with no outer one. The
    Euler characteristic is components less loops plus cavities.

    Parameters
    ----------
    centres : (n, 3) float array
    radii : (n,) float array

    Returns
    -------
    components, loops, cavities : int
    """
    cells = _cells(centres, radii)
    components = label(cells, np.ones((3, 3, 3)))[1]
    cavities = label(~cells)[1] - 1
    return components, components + cavities - _euler(cells), cavities


def _cells(centres, radii):
    """Which cells of a grid have their middle in a ball; two layers around are empty."""
    cell = max(radii.min() / CELLS_PER_RADIUS, LEAST_CELL)
    low = (centres - radii[:, None]).min(axis=0) - 2 * cell
    high = (centres + radii[:, None]).max(axis=0)
    cells = np.zeros(np.ceil((high - low) / cell).astype(int) + 2, bool)
    for centre, radius in zip((centres - low) / cell, radii / cell, strict=True):
        first, beyond = np.floor(centre - radius).astype(int), np.ceil(centre + radius).astype(int) + 1
        x, y, z = (np.arange(a, b) + 0.5 - c for a, b, c in zip(first, beyond, centre, strict=True))
        ball = (x**2)[:, None, None] + (y**2)[:, None] + z**2 < radius * radius
        cells[tuple(map(slice, first, beyond))] |= ball
    return cells


def _euler(cells):
    """Corners less edges plus faces less cubes of the cells, each counted once."""
    total = 0
    for flat in product((False, True), repeat=3):  # along which axes a face, an edge or a corner has no extent
        grown = cells
        for axis in np.flatnonzero(flat):
            grown = grown | np.roll(grown, 1, axis)
        total += (-1) ** (3 - sum(flat)) * int(np.count_nonzero(grown))
    return total
