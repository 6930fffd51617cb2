"""The points that support a skeleton, and how they hang together as a surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.diffusion import Diffusion
from ..numerics.morton import morton_order
from ..numerics.neighbourhoods import nearest_neighbours
from ..numerics.winding import AREA_NEIGHBOURS
from ..skeleton import Skeleton

ENOUGH_POINTS = 4096  # measured: points of one object beyond which a surface hangs together in the same way
VERTEX_POINTS = 32  # derived: points to a vertex of a tube with 20 around it, whose vertices are half a radius apart


@dataclass(frozen=True, eq=False)
class SurfaceGraph:
    """Some of the points that support a skeleton, each linked with those nearest to it.

    Of many points it takes every so-manieth, 4096 or more, and 32 for every vertex: an object of many parts takes more.
    Of points in one place it takes the first.

    Attributes
    ----------
    supporting : (n,) int array
        Which input points.
    points : (n, 3) float array
    neighbours : (n, k) int array
        Nearest points, itself first.
    """

    supporting: np.ndarray
    points: np.ndarray
    neighbours: np.ndarray

    @classmethod
    def of(cls, skeleton: Skeleton) -> SurfaceGraph:
        """The surface that supports a skeleton."""
        supporting = skeleton.supporting_points
        enough = max(ENOUGH_POINTS, VERTEX_POINTS * len(skeleton.vertices))
        step = max(len(supporting) // enough, 1)
        if step > 1:  # which they are must not depend on points that have no say
            supporting = np.sort(supporting[morton_order(skeleton.points[supporting])[::step]])
        supporting = supporting[_first_in_their_place(skeleton.points[supporting])]
        points = skeleton.points[supporting]
        if not len(points):
            return cls(supporting, points, np.empty((0, 1), int))
        return cls(supporting, points, nearest_neighbours(points, min(AREA_NEIGHBOURS + 1, len(points)))[1])

    @cached_property
    def diffusion(self) -> Diffusion:
        """Over the links."""
        return Diffusion(self.points, self.neighbours)


def _first_in_their_place(points: np.ndarray) -> np.ndarray:
    """The first of all points with the same coordinates, bool array: which of them is linked would be chance."""
    order = np.lexsort(points.T)
    again = (np.diff(points[order], axis=0) == 0).all(axis=1)
    first = np.ones(len(points), bool)
    first[order[1:][again]] = False
    return first
