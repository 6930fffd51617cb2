"""Skeletons of tiles joined into one: nothing lost at a seam, nothing twice.

Every tile saw more than its box, so what crosses a face of it was seen whole by the tiles on both sides, and their
skeletons nearly coincide there. The tiles are taken in the order of their numbers. Each brings the connected pieces of
its skeleton that come into its box, up to a little beyond it, less what lies on what others brought; where that ends,
their cut ends are at hand, and the two are made one.

So a curve that crosses from tile to tile is cut once, at a plane, and one that runs along a face, even in it, comes
from one tile whole. If tiles were cut at the faces themselves, such a curve would be cut to shreds, or lost by both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..analysis.curves import along, pieces
from ..numerics.vectors import dot, norm
from ..skeleton import Skeleton
from .grid import CUT_REACH, Grid, Tile
from .loose_ends import Seams, finished
from .strands import BORDER, INNER, Strands, inside

SAMPLE_STEP = 0.25  # fitted: of the scale of a curve, between the places at which others are compared with it
MOST_SAMPLES = 1000  # derived: places on an edge, where the part has no thickness: a thousandth of it is near enough
CLAIM_SHARE = 0.5  # fitted: of how far beyond its box a tile counts, up to where a piece must come to be its own


class Samples(NamedTuple):
    """Places along curves that are there."""

    places: np.ndarray  # (m, 3)
    scale: np.ndarray  # (m,)
    vertex: np.ndarray  # (m,) number of the nearer end of the edge
    outward: np.ndarray  # (m, 3) where the curve would go on, at cut ends; 0 elsewhere


@dataclass
class Joint:
    """What has been brought so far. Vertices are numbered through.

    Attributes
    ----------
    strands : list of Strands
    first : list of int
        The number of the first vertex of each, and then of the next.
    merged : list of (int, int)
        A cut end, and the earlier one that is the same place.
    touching : list of (int, int)
        A cut end that found none, and the earlier vertex that is nearest.
    open : list of int
        Cut ends that nobody has gone on from.
    met : list of (k, 8) array
        Ends of the object that lie on what others brought: there a cut end has nothing to meet.
    short : list of (k,) array
        Radii at ends that are so near to where the points of a tile were cut off that they may be no ends.
    """

    strands: list[Strands] = field(default_factory=list)
    first: list[int] = field(default_factory=lambda: [0])
    merged: list[tuple[int, int]] = field(default_factory=list)
    touching: list[tuple[int, int]] = field(default_factory=list)
    open: list[int] = field(default_factory=list)
    met: list[np.ndarray] = field(default_factory=list)
    short: list[np.ndarray] = field(default_factory=list)

    def values(self, vertices: Sequence[int] | np.ndarray) -> np.ndarray:
        """The values of numbered vertices, (k, 8) float array."""
        parts = np.searchsorted(self.first, vertices, side="right") - 1
        rows = [
            self.strands[part].values[at - self.first[part]] for part, at in zip(parts.tolist(), vertices, strict=True)
        ]
        return np.array(rows).reshape(-1, 8)

    def bring(self, strands: Strands) -> tuple[Samples, np.ndarray]:
        """Add strands; gives them as samples, and the numbers of their inner cut ends."""
        first = self.first[-1]
        self.strands.append(strands)
        self.first.append(first + len(strands.values))
        border, inner = strands.marks[:, BORDER], strands.marks[:, INNER]
        self.open += (first + np.flatnonzero(border & ~inner)).tolist()
        return _sampled(strands, first), first + np.flatnonzero(inner)

    def meet(self, ends: np.ndarray, theirs: Samples) -> None:
        """Match cut ends with open ones, the nearest first, one to one; others touch what is nearest."""
        known = set(theirs.vertex.tolist())
        waiting = [at for at in self.open if at in known]
        mine, others = self.values(ends), self.values(waiting)
        distance = cdist(mine[:, :3], others[:, :3])
        near = distance <= mine[:, None, 5] + others[:, 5]
        rows, columns = np.nonzero(near)
        left, free = set(ends.tolist()), set(waiting)
        for pair in np.argsort(distance[near], kind="stable"):
            one, other = int(ends[rows[pair]]), waiting[columns[pair]]
            if one in left and other in free:
                self.merged.append((one, other))
                left.remove(one)
                free.remove(other)
        gone = set(waiting) - free
        self.open = [at for at in self.open if at not in gone]
        loose = sorted(left)
        nearest = cKDTree(theirs.places).query(self.values(loose)[:, :3])[1] if loose else []
        self.touching += zip(loose, theirs.vertex[nearest].tolist(), strict=True)


def join_tiles(skeletons: Mapping[Tile, Skeleton], grid: Grid) -> tuple[Skeleton, Seams]:
    """Join the skeletons of overlapping tiles.

    Parameters
    ----------
    skeletons : mapping of (int, int, int) to Skeleton
        Of the points in each tile and its overlap; a tile without points may be left out.
    grid : Grid

    Returns
    -------
    Skeleton
        Vertices, edges, and what is known of the vertices; it has no points. It does not depend on the order of the
        mapping.
    Seams
        How the cut ends met.

    Notes
    -----
    The axes of two parts are farther apart than either is thick. So what lies nearer to another tile's skeleton than
    the radius is the same part, and cut ends are the same place if they are no farther apart than both radii.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> points = torus(8000, radius=0.05).points
    >>> grid = Grid.over(points.min(axis=0), points.max(axis=0), size=0.6, overlap=0.15)
    >>> ring, seams = join_tiles({tile: skeletonize(points[rows]) for tile, rows in grid.parted(points)}, grid)
    >>> ring.n_components, ring.n_loops, seams.joined, seams.unmatched
    (1, 1, 4, 0)
    """
    joint = Joint()
    brought: dict[Tile, Samples] = {}
    for tile in sorted(skeletons):
        near = [each for each in brought if max(abs(a - b) for a, b in zip(each, tile, strict=True)) <= 1]
        strands = Strands.of(skeletons[tile]).within(*grid.box(tile, grid.trust))
        joint.short.append(_fell_short(strands, grid, tile))
        strands = strands.with_pieces(strands.touching(*grid.box(tile, CLAIM_SHARE * grid.trust)))
        theirs = _all([brought[each] for each in near])
        if len(theirs.places):
            strands, met = _not_there(strands, theirs, grid, tile, near)
            joint.met.append(met)
        brought[tile], ends = joint.bring(strands)
        if len(ends):
            joint.meet(ends, theirs)
    return finished(joint, grid)


def _not_there(
    strands: Strands, theirs: Samples, grid: Grid, tile: Tile, near: Sequence[Tile]
) -> tuple[Strands, np.ndarray]:
    """What others have not brought, and the ends of the object that they have."""
    for axis, value in grid.seams(tile):
        strands = strands.split(axis, value)
    there = _covered(strands.middles, theirs)
    ends = (strands.degree == 1) & ~strands.marks[:, BORDER]
    ends[strands.edges[~there]] = False
    left = strands.keep(~there, ~_covered(strands.values, theirs), INNER)
    # a stretch of a curve that others saw, too, and elsewhere, is theirs; unless they have nothing there at all
    middles = left.middles
    seen = np.any([inside(middles, *grid.box(each, grid.trust), middles[:, 5]) for each in near], axis=0)
    leaves = np.zeros(len(left.values), bool)
    leaves[left.edges[~seen]] = True
    pieces = left.pieces
    leaves |= ~np.isin(pieces, pieces[left.marks[:, INNER]])
    return left.with_pieces(leaves).mended(), strands.values[ends]


def _fell_short(strands: Strands, grid: Grid, tile: Tile) -> np.ndarray:
    """Radii at ends within reach of a cut through the points: it is not known whether the part goes on."""
    ends = strands.values[(strands.degree <= 1) & ~strands.marks[:, BORDER]]
    return ends[~inside(ends, *grid.box(tile, grid.overlap), CUT_REACH * ends[:, 3]), 3]


def _sampled(strands: Strands, first: int) -> Samples:
    places, edges = strands.values[:, :3], strands.edges
    scale = np.fmax(np.fmin(*strands.values[edges, 5].T), np.finfo(float).tiny)
    step = np.fmax(SAMPLE_STEP * scale, norm(places[edges[:, 1]] - places[edges[:, 0]]) / MOST_SAMPLES)
    row, part = pieces(places, edges, step) if len(edges) else (np.empty(0, int), np.empty(0))
    between = along(edges, row, part, strands.values) if len(edges) else np.empty((0, 8))
    values = np.concatenate([strands.values, between])
    vertex = np.concatenate([np.arange(len(places)), edges[row, (part > 0.5).astype(int)]])
    outward = np.concatenate([strands.outward(), np.zeros((len(row), 3))])
    return Samples(values[:, :3], values[:, 5], first + vertex, outward)


def _all(samples: Sequence[Samples]) -> Samples:
    if not samples:
        return Samples(np.empty((0, 3)), np.empty(0), np.empty(0, int), np.empty((0, 3)))
    return Samples(*(np.concatenate(each) for each in zip(*samples, strict=True)))


def _covered(values: np.ndarray, theirs: Samples) -> np.ndarray:
    """Which places are on curves that are there: no farther from them than either is thick, and not past a cut end."""
    distance, nearest = cKDTree(theirs.places).query(values[:, :3])
    past = dot(values[:, :3] - theirs.places[nearest], theirs.outward[nearest]) > 0
    return (distance <= np.fmax(values[:, 5], theirs.scale[nearest])) & ~past
