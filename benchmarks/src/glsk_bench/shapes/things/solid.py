"""A thing while it is drawn: a union of sweeps less voids, and its true axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from ..axis import Draft
from ..curves import UP, across
from .lines import at_lengths, lengths_along
from .section import section_radius
from .sweep import Sweep

# A limb keeps its own section if what it starts or ends in has another radius, in its own; it has it from there on, as
# a share of its first step.
ALIKE_RADII = (0.83, 1.2)  # fitted
PART_STARTS = 0.03  # fitted
FLAT_INSET = 0.5  # fitted: how far inside a flat face the axis ends, in the radius there: a convention
NODES_OFF_TIP = 0.2  # fitted: nodes nearer to a tip at a flat face are left out, in the radius
BEVEL_ROOM = 0.3  # fitted: places nearer to the inner edge of a bevel are left out, in its size
USUAL_GAP = 0.25  # fitted: in the least radius
Ends = Sequence[str]
FLAT_ENDS, ROUND_ENDS = ("flat", "flat"), ("round", "round")
"""Both ends of a sweep."""


@dataclass(eq=False)
class Solid(Draft):
    """A union, hard or smooth, of sweeps, less voids that are sweeps, too; and its true axis.

    The axis is the curve of the sections' centroids. Where limbs meet, that of the thinner runs on to that of the
    thicker.

    Attributes
    ----------
    blend : float
        How far parts flow into one another, in the least radius; 0 for edges.
    sweeps, voids : list of Sweep
    owners : list of int or None
        For each sweep the path of the axis that is inside of it, if there is just one.
    paths : list of list of int
        Nodes along the paths of the axis.
    half_axes : list of tuple
        Of the section at each node, the longer one first.
    flat : list of int
        Tips at flat faces.
    unjudged : set of int
        Edges of which the axis is a matter of taste.
    openings : list of float
        How wide the holes are.
    mirror : (2, 3) float array or None
        A point of the plane of symmetry, and its normal.
    hollow : bool
        Whether the void is that of a vessel.
    gap : float
        By what the solid must not change its topology where it is thickened, in the least radius.
    edge : float
        Blended parts have the normal of a flat face so far around its edges. With 0, as in versions before v3, it is a
        matter of roundings there, to which points of a blended surface are moved.
    """

    blend: float = 0.0
    sweeps: list[Sweep] = field(default_factory=list)
    voids: list[Sweep] = field(default_factory=list)
    owners: list[int | None] = field(default_factory=list)
    paths: list[list[int]] = field(default_factory=list)
    half_axes: list[tuple[float, float]] = field(default_factory=list)
    flat: list[int] = field(default_factory=list)
    unjudged: set[int] = field(default_factory=set)
    openings: list[float] = field(default_factory=list)
    mirror: np.ndarray | None = None
    hollow: bool = False
    gap: float = USUAL_GAP
    edge: float = 0.0

    # ---- the axis

    def node(self, place, radius, a=None, b=None) -> int:
        """Add a node of the axis, where the section has these half axes, or is a circle; gives its number."""
        a, b = radius if a is None else a, radius if b is None else b
        self.half_axes.append((max(a, b), min(a, b)))
        return self.ball(place, radius)

    def path(self, places, a, b=None, power=2.0, start=None, end=None, judged=True, closed=False) -> list[int]:
        """Add a path of the axis, without a body; gives its nodes, of a closed one the first once more at the end.

        The nodes `start` and `end`, where they are given, take the place of its first and its last. Where these are
        much thicker or thinner, the path has its own section just beside them.
        """
        places, first = np.asarray(places, float), len(self.links)
        a, b = _along(a, len(places)), _along(a if b is None else b, len(places))
        radii = section_radius(a, b, power)
        known = {0: start, len(places) - 1: end}
        nodes = []
        for k, place in enumerate(places):
            old = known.get(k)
            nodes.append(self.node(place, radii[k], a[k], b[k]) if old is None else old)
        for old, k, beside in ((start, 0, 1), (end, -1, -2)):
            if old is not None and not ALIKE_RADII[0] < self.sizes[old] / radii[k] < ALIKE_RADII[1]:
                here = self.places[old]
                new = self.node(here + PART_STARTS * (places[beside] - here), radii[k], a[k], b[k])
                nodes.insert(1 if k == 0 else len(nodes) - 1, new)
        nodes += nodes[:1] if closed else []
        self.links += pairwise(nodes)
        self.paths.append(nodes)
        if not judged:
            self.unjudged |= set(range(first, len(self.links)))
        return nodes

    def nearest(self, nodes: Sequence[int], place: Sequence[float] | np.ndarray) -> int:
        """The one of some nodes that is nearest to a place."""
        return nodes[int(np.linalg.norm(self.nodes[list(nodes)] - place, axis=1).argmin())]

    # ---- bodies

    def body(
        self, places, a, b=None, power=2.0, side=None, ends: Ends = FLAT_ENDS, closed=False, bevel=0.0, owner=None
    ) -> None:
        """Add a sweep without an axis.

        The edges of flat ends are cut off by a share `bevel` of their smaller half axis.
        """
        self.sweeps.append(_sweep(places, a, b, power, side, ends, closed, bevel))
        self.owners.append(owner)

    def void(self, places, a, b, power, side) -> None:
        """Take a sweep with flat ends away."""
        self.voids.append(_sweep(places, a, b, power, side, FLAT_ENDS))

    def limb(
        self, places, a, b=None, power=2.0, side=None, ends: Ends = FLAT_ENDS, start=None, end=None, bevel=0.0,
        begin=0.0, beyond=0.0, faces=(True, True),
    ) -> list[int]:  # fmt: skip
        """Add a sweep and the path of the axis inside of it; gives the nodes.

        The path begins at the node `start`, if there is one, and ends at `end`; the body begins at the length `begin`
        of it, which may be before the path, and ends so far `beyond`. Other ends that are flat are faces, unless
        `faces` says no: there the path stops half a radius short of them.
        """
        places = np.asarray(places, float)
        a, b = _along(a, len(places)), _along(a if b is None else b, len(places))
        along = lengths_along(places)

        def cut(lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            return at_lengths(places, lengths), np.interp(lengths, along, a), np.interp(lengths, along, b)

        low, high = begin, along[-1] + beyond
        inner = along[(along > low + 1e-9) & (along < high - 1e-9)]
        self.body(*cut(np.r_[low, inner, high]), power, side, ends, bevel=bevel, owner=len(self.paths))
        radii = section_radius(a, b, power)
        tips = [
            shape == "flat" and node is None and is_face
            for shape, node, is_face in zip(ends, (start, end), faces, strict=True)
        ]
        low, high = FLAT_INSET * radii[0] * tips[0], along[-1] - FLAT_INSET * radii[-1] * tips[1]
        first, last = low + NODES_OFF_TIP * radii[0] * tips[0], high - NODES_OFF_TIP * radii[-1] * tips[1]
        inner = along[(along > first) & (along < last)]
        nodes = self.path(*cut(np.unique(np.r_[low, inner, high])), power, start, end)
        self.flat += [node for node, is_tip in zip((nodes[0], nodes[-1]), tips, strict=True) if is_tip]
        return nodes

    def ring(self, places, a, b=None, power=2.0, side=UP) -> list[int]:
        """Add a closed sweep and the path of the axis inside of it; gives the nodes."""
        self.body(places, a, b, power, side, closed=True, owner=len(self.paths))
        return self.path(places, a, b, power, closed=True)

    # ---- the whole

    @property
    def thinnest(self) -> float:
        """The least half axis of all sweeps."""
        return min(sweep.thinnest for sweep in self.sweeps)

    @property
    def smoothing(self) -> float:
        """How far parts flow into one another."""
        return self.blend * self.radii.min()

    def rotated(self, rotation: Rotation) -> Solid:
        """The solid turned about the origin."""
        mirror = None if self.mirror is None else np.array([rotation.apply(each) for each in self.mirror])
        sweeps, voids = ([each.rotated(rotation) for each in group] for group in (self.sweeps, self.voids))
        return replace(self, places=list(rotation.apply(self.nodes)), sweeps=sweeps, voids=voids, mirror=mirror)

    def scaled(self, scale: float, shift: np.ndarray) -> Solid:
        """The solid made larger, and then moved."""
        mirror = None if self.mirror is None else np.array([self.mirror[0] * scale + shift, self.mirror[1]])
        sweeps, voids = ([each.scaled(scale, shift) for each in group] for group in (self.sweeps, self.voids))
        return replace(
            self,
            places=list(self.nodes * scale + shift),
            sizes=list(self.radii * scale),
            half_axes=[(a * scale, b * scale) for a, b in self.half_axes],
            openings=[each * scale for each in self.openings],
            sweeps=sweeps,
            voids=voids,
            mirror=mirror,
        )

    def normalised(self) -> Solid:
        """The solid whose bounding box has its middle about in the origin and a diagonal of about 1.

        It is that of corners of meshes, of the sweeps each.
        """
        corners = np.vstack([sweep.mesh().reshape(-1, 3)[::7] for sweep in self.sweeps])
        return self.boxed(corners)[0]

    def boxed(self, points: np.ndarray) -> tuple[Solid, float, np.ndarray]:
        """The solid where the box of some points has its middle in the origin and a diagonal of 1; scale and points."""
        low, high = points.min(axis=0), points.max(axis=0)
        scale = 1 / np.linalg.norm(high - low)
        return self.scaled(scale, -(low + high) / 2 * scale), scale, (points - (low + high) / 2) * scale


def _along(half, count):
    """A half axis for each of so many places, of one for all or one each."""
    return np.broadcast_to(np.asarray(half, float), count)


def _sweep(places, a, b, power, side, ends, closed=False, bevel=0.0):
    """A sweep with a direction across it, and with its edges cut off."""
    places = np.asarray(places, float)
    a, b = _along(a, len(places)).copy(), _along(a if b is None else b, len(places)).copy()
    if side is None:
        side = across(places[len(places) // 4 if closed else -1] - places[0])[0]
    for k in (0, -1):
        if bevel and not closed and ends[k] == "flat":
            places, a, b = _bevelled(places, a, b, bevel, k)
    return Sweep(places, a, b, float(power), np.asarray(side, float), (str(ends[0]), str(ends[1])), closed)


def _bevelled(places, a, b, bevel, k):
    """Places and half axes with narrower ones at the first or the last place, and a place more where that begins."""
    size, along = bevel * min(a[k], b[k]), lengths_along(places)
    edge = size if k == 0 else along[-1] - size
    inner = at_lengths(places, np.array([edge])), np.interp(edge, along, a), np.interp(edge, along, b)
    near = along < edge + BEVEL_ROOM * size if k == 0 else along > edge - BEVEL_ROOM * size
    near[[0, -1]] = False
    at = 1 if k == 0 else np.count_nonzero(~near) - 1
    places, a, b = (np.insert(each[~near], at, new, axis=0) for each, new in zip((places, a, b), inner, strict=True))
    a[k], b[k] = a[k] - size, b[k] - size
    return places, a, b
