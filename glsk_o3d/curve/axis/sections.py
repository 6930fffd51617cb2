"""The points around every vertex, and the section of the part there: how wide and how thick it is."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...data.graph import Graph
from ...geometry.groups import Members, group_median, group_sum
from ...geometry.vectors import COLUMNS, FULL, ROWS, Floats, Ints, dot, norm, unit


@dataclass(frozen=True, eq=False)
class VertexPoints:
    """The points that support a curve: those that have a vertex and a normal."""

    graph: Graph

    @cached_property
    def rows(self) -> Ints:
        """Which input points they are, (n,) int array."""
        return self.graph.supporting_points

    @cached_property
    def points(self) -> np.ndarray:
        """Where they are, (n, 3) float array."""
        return self.graph.points.take(self.rows, axis=0)

    @cached_property
    def normals(self) -> np.ndarray:
        """The normal of each, (n, 3) float array."""
        return self.graph.normals.take(self.rows, axis=0)

    @cached_property
    def vertex(self) -> np.ndarray:
        """The vertex of each, (n,) int array."""
        return self.graph.vertex_of_point[self.rows]

    @cached_property
    def offset(self) -> np.ndarray:
        """From its vertex to each, (n, 3) float array."""
        return self.points - self.graph.vertices.take(self.vertex, axis=0)

    @cached_property
    def count(self) -> Ints:
        """Points of every vertex, (M,) int array."""
        return np.bincount(self.vertex, minlength=len(self.graph.vertices))

    @property
    def mass(self) -> np.ndarray:
        """The same, at least 1, as float array."""
        return np.maximum(self.count, 1).astype(float)

    @cached_property
    def distance(self) -> np.ndarray:
        """Median distance from every vertex to its points, (M,) float array."""
        return group_median(norm(self.offset), self.vertex, len(self.graph.vertices))

    @cached_property
    def members(self) -> Members:
        """The points of every vertex, as positions among these."""
        return Members(self.vertex, len(self.graph.vertices))


LEAST_SHARE = 1e-5  # precision: of the squared normals, above which they tell a direction: 1/300 of a radian


class Sections(NamedTuple):
    """The section of the part at every vertex, in the cloud's units."""

    half_width: Floats  # (M,) the larger half axis
    half_thickness: Floats  # (M,) the smaller one
    across: np.ndarray  # (M, 3) unit vectors in the direction of the width, up to their sign

    @property
    def radius(self) -> np.ndarray:
        """Radius of the circle with the area of an ellipse with these half axes, (M,) float array."""
        return np.sqrt(self.half_width * self.half_thickness)


def measure_sections(graph: Graph, cloud: VertexPoints) -> Sections:
    r"""Measure the sections by the tangent planes of the points around every vertex.

    With the points p of a vertex and of those beside it, their unit normals n, and the vertex x that each belongs to,

    .. math:: N = \sum n n^T, \quad M = \sum |n \cdot (p - x)|\, n n^T, \quad h(e) = \frac{e^T M e}{e^T N e}.

    h(e) is the mean distance of the tangent planes, each with the weight that its normal has in the direction e. The
    half axes are the largest and the least h(e) across the limb, that is in the plane of the two eigenvectors of N with
    the largest eigenvalues: along the limb normals have the least share. Around a circle, or any part of it, h is the
    radius, and around a rectangle, or two sides of it, they are its half axes, however the points are spread. Vertices
    without points have the curve's radius for both half axes; where only one side was seen, others have it in the
    direction that nobody knows.
    """
    m, (a, b) = len(graph.vertices), graph.edges.T
    sums = group_sum(normal_moments(cloud.normals, cloud.offset), cloud.vertex, m)
    sums = sums + group_sum(sums[np.concatenate([b, a])], np.concatenate([a, b]), m)
    halves = half_axes(sums, graph.radii)
    wide, thick = (np.where(cloud.count == 0, graph.radii, half) for half in halves[:2])
    return Sections(wide, thick, halves.across)


def normal_moments(normals: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """What every point adds to N and M of its section, the six different entries of either, (n, 12) float array.

    The offsets (n, 3) lead from each point to its place on the curve, or from there.
    """
    squares = normals[:, ROWS] * normals[:, COLUMNS]
    return np.concatenate([squares, np.abs(dot(normals, offset))[:, None] * squares], axis=1)


def half_axes(moments: np.ndarray, otherwise: np.ndarray) -> Sections:
    """The half axes of sections, see `measure_sections`, from sums of `normal_moments`, (m, 12).

    In a direction that nobody saw the half axis is `otherwise` (m,).
    """
    share, axes = np.linalg.eigh(moments[:, :6][:, FULL])
    known = share[:, 1:] > LEAST_SHARE * share.sum(axis=1, keepdims=True)
    # in units in which N is 1 the extremes of h are eigenvalues
    plane = axes[:, :, 1:] / np.sqrt(np.where(known, share[:, 1:], 1))[:, None]
    reach = plane.transpose(0, 2, 1) @ moments[:, 6:][:, FULL] @ plane
    unseen = np.where(np.isnan(otherwise), 0, otherwise)
    first, second = (np.where(seen, reach[:, i, i], unseen) for i, seen in enumerate(known.T))
    mean, lean, both = (first + second) / 2, (first - second) / 2, np.where(known.all(axis=1), reach[:, 0, 1], 0)
    difference, turn = np.hypot(lean, both), np.arctan2(both, lean)[:, None] / 2
    across = unit(np.cos(turn) * plane[:, :, 0] + np.sin(turn) * plane[:, :, 1])
    # rounding may leave less than nothing
    return Sections(np.maximum(mean + difference, 0), np.maximum(mean - difference, 0), across)
