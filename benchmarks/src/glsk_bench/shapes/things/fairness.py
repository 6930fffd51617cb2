"""What makes the draw of a thing fair: its axis is no matter of taste, and a cloud of 4096 points can show it."""

from __future__ import annotations

import numpy as np

from glsk_o3d.geometry.groups import component_labels

from ..fairness import STUB, THINNEST_SPACINGS, grid_topology
from .field import grid
from .solid import Solid

# Fitted, as all of this page: on draws that people would not agree about.
NARROWEST_SPACINGS = 2.5  # least width of a hole of a plate, in the mean distance of 4096 points
STUB_REACH = 0.8  # how far around a tip others are looked for, in its radius
GAP_SPACINGS = 0.5  # by what the solid is thickened at least, in that distance
PART_OF_GAP = 3  # the solid is also thickened by this part of it
CELLS, CELLS_OF_BLEND, CELLS_OF_HOLE = 0.45, 0.6, 0.4  # of the grid, in the least half axis, and in the narrowest hole
LEAST_GRID_CELL = 0.005  # a share of the diagonal
VESSEL_OPENED = 2.5  # how much farther the void of a vessel opens, in what the solid is thickened by


def fault_of(solid: Solid, spacing: float) -> str | None:
    """The first thing that is wrong with a thing, in a word; `spacing` is the mean distance of 4096 points on it.

    ``thin``: a limb or a sheet is thinner than `THINNEST_SPACINGS` spacings; ``narrow``: a hole of a plate is narrower
    than `NARROWEST_SPACINGS`; ``stub``: a tip hardly stands out of the rest; ``holes``: the solid has other loops or
    components than the axis, or cavities; ``gap``: it has when it is thicker.
    """
    radii, edges, n = solid.radii, solid.edges, len(solid.places)
    if min(radii.min(), 2 * solid.thinnest) < THINNEST_SPACINGS * spacing:
        return "thin"
    narrowest = min(solid.openings, default=1.0)
    if narrowest < NARROWEST_SPACINGS * spacing:
        return "narrow"
    if any(_is_stub(solid, tip) for tip in np.flatnonzero(np.bincount(edges.ravel(), minlength=n) == 1)):
        return "stub"
    components = int(component_labels(n, edges).max()) + 1
    expected = components, len(edges) - n + components, 0
    thicker = max(solid.gap * radii.min(), GAP_SPACINGS * spacing)
    cells = (CELLS_OF_BLEND if solid.smoothing else CELLS) * solid.thinnest
    cell = max(min(cells, CELLS_OF_HOLE * narrowest), LEAST_GRID_CELL)
    values, _ = grid(solid, cell, thicker)
    if grid_topology(values < 0) != expected:
        return "holes"
    if solid.hollow:  # a vessel is not to be closed by what is beyond its opening
        values, _ = grid(solid, cell, thicker, VESSEL_OPENED * thicker)
    elif grid_topology(values < thicker / PART_OF_GAP) != expected:
        return "gap"
    return None if grid_topology(values < thicker) == expected else "gap"


def _is_stub(solid, tip):
    """Whether a tip stands less than `STUB` radii out of some limb that it does not belong to."""
    mine = {k for k, path in enumerate(solid.paths) if tip in path}
    place, radius = solid.places[tip][None], solid.sizes[tip]
    for sweep, owner in zip(solid.sweeps, solid.owners, strict=True):
        if owner is not None and owner not in mine:
            off = sweep.distance(place, STUB_REACH * radius).values
            if len(off) and off[0] < STUB * radius:
                return True
    return False
