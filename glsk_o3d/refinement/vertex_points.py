"""The points that belong to the vertices of a skeleton, and how they lie around them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.groups import Members, group_median
from ..numerics.vectors import norm
from ..skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class VertexPoints:
    """The points that support a skeleton: those that have a vertex and a normal."""

    skeleton: Skeleton

    @cached_property
    def rows(self) -> np.ndarray:
        """Which input points they are, (n,) int array."""
        return self.skeleton.supporting_points

    @cached_property
    def points(self) -> np.ndarray:
        """Where they are, (n, 3) float array."""
        return self.skeleton.points.take(self.rows, axis=0)

    @cached_property
    def normals(self) -> np.ndarray:
        """The normal of each, (n, 3) float array."""
        return self.skeleton.normals.take(self.rows, axis=0)

    @cached_property
    def vertex(self) -> np.ndarray:
        """The vertex of each, (n,) int array."""
        return self.skeleton.vertex_of_point[self.rows]

    @cached_property
    def offset(self) -> np.ndarray:
        """From its vertex to each, (n, 3) float array."""
        return self.points - self.skeleton.vertices.take(self.vertex, axis=0)

    @cached_property
    def count(self) -> np.ndarray:
        """Points of every vertex, (M,) int array."""
        return np.bincount(self.vertex, minlength=len(self.skeleton.vertices))

    @property
    def mass(self) -> np.ndarray:
        """The same, at least 1, as float array."""
        return np.maximum(self.count, 1).astype(float)

    @property
    def distance(self) -> np.ndarray:
        """Median distance from every vertex to its points, (M,) float array."""
        return group_median(norm(self.offset), self.vertex, len(self.skeleton.vertices))

    @cached_property
    def members(self) -> Members:
        """The points of every vertex, as positions among these."""
        return Members(self.vertex, len(self.skeleton.vertices))
