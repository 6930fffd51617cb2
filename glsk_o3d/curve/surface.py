"""The surface around a curve: how it hangs together, which side is out, and what it says of the curve."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from ..data.derived import Changeable, derived
from ..geometry.cycles import inscribed_circle
from ..geometry.diffusion import Diffusion
from ..geometry.groups import component_labels, first_in_their_place, quantile
from ..geometry.morton import morton_order
from ..geometry.neighbourhoods import nearest_neighbours, uprightness
from ..geometry.polylines import incident_edges, nearest_on_edges, places_on_edges
from ..geometry.vectors import TINY, Floats, dot
from ..geometry.winding import AREA_NEIGHBOURS, orient_from_axis, point_areas, winding_number
from .curve import Curve
from .numbers import CURVE

Thing = TypeVar("Thing")
Answer = TypeVar("Answer")


class Memo(dict[bytes, Answer]):
    """Answers by all that each depends on, so that they hold when other parts of a curve have changed."""

    def of(
        self, keys: Sequence[bytes], things: Iterable[Thing], answers: Callable[[list[Thing]], Iterable[Answer]]
    ) -> list[Answer]:
        """The answer for each of some things; `answers` is called once, with those whose keys are new."""
        fresh = {key: thing for key, thing in zip(keys, things, strict=True) if key not in self}
        if fresh:
            self.update(zip(fresh, answers([*fresh.values()]), strict=True))
        return [self[key] for key in keys]


@dataclass(frozen=True, eq=False)
class Surface(Changeable):
    """Some of the points that support a curve, each linked with those nearest to it; it holds while the curve changes.

    Of many points it takes a regular sample, 4096 or more, and 32 for every vertex: an object of many parts takes more.
    Of points in one place it takes the first.
    """

    supporting: np.ndarray  # (n,) which input points
    points: np.ndarray  # (n, 3)
    neighbours: np.ndarray  # (n, k) nearest points, itself first
    normals: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # (n, 3) outward unit normals, of `oriented`
    _windings: Memo[float] = field(default_factory=Memo, repr=False)
    _circles: Memo[tuple[np.ndarray, float]] = field(default_factory=Memo, repr=False)

    @classmethod
    def of(cls, curve: Curve) -> Surface:
        """The surface that supports a curve."""
        supporting = curve.supporting_points
        enough = max(CURVE.enough_points, CURVE.vertex_points * len(curve.vertices))
        step = max(len(supporting) // enough, 1)
        if step > 1:  # which they are must not depend on points that have no say
            supporting = np.sort(supporting[morton_order(curve.points[supporting])[::step]])
        supporting = supporting[first_in_their_place(curve.points[supporting])]
        points = curve.points[supporting]
        if not len(points):
            return cls(supporting, points, np.empty((0, 1), int))
        return cls(supporting, points, nearest_neighbours(points, min(AREA_NEIGHBOURS + 1, len(points)))[1])

    def oriented(self, curve: Curve) -> Surface:
        """The same with normals that point away from a curve that has edges and was fitted to these points."""
        normals = self._outwards(curve, self._axis(curve))
        return self.changed(normals=normals, _windings=Memo(), _circles=Memo())

    def _axis(self, curve: Curve) -> np.ndarray:
        edge, t = _nearest_edges(curve, self.supporting)
        return np.where(edge[:, None] >= 0, places_on_edges(curve.vertices, curve.edges, edge, t), self.points)

    def _outwards(self, curve: Curve, axis: np.ndarray) -> np.ndarray:
        return orient_from_axis(self.points, curve.normals[self.supporting], axis, self.neighbours)

    def facing(self, curve: Curve) -> tuple[int, float]:
        """Points of the largest patch that faces a curve with edges, and the share of all that do.

        Outside of an axis the surface faces away from it. Walls of a hole that was closed, and flanks of a limb that
        was lost, face the curve beside them in patches, and noise here and there.
        """
        axis = self._axis(curve)
        faces = dot(self._outwards(curve, axis), self.points - axis) < 0
        links = np.column_stack([np.repeat(np.arange(len(faces)), self.neighbours.shape[1]), self.neighbours.ravel()])
        label = component_labels(len(faces), links[faces[links].all(axis=1)])
        return int(np.bincount(label[faces]).max(initial=0)), float(faces.mean())

    @derived("points", "neighbours")
    def diffusion(self) -> Diffusion:
        """Over the links."""
        return Diffusion(self.points, self.neighbours)

    @derived("points", "neighbours")
    def areas(self) -> np.ndarray:
        """What every point stands for, (n,)."""
        return point_areas(self.points, self.neighbours)

    @derived("points", "neighbours")
    def spacing(self) -> float:
        """Distance of the points: the root of the median of what they stand for."""
        return float(np.sqrt(np.median(self.areas)))

    @derived("points")
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def near(self, place: np.ndarray, reach: float) -> np.ndarray:
        """The points that are not farther from a place, ascending int array."""
        return np.array(self._tree.query_ball_point(place, reach, return_sorted=True), int)

    def winding(self, places: np.ndarray) -> np.ndarray:
        """Generalised winding number of the oriented surface around places (m, 3), (m,): near 1 inside, 0 outside."""
        return winding_number(self.points, self.normals, self.areas, places)

    def winding_at(self, vertices: np.ndarray) -> np.ndarray:
        """The same of vertices, which stay where they are while others are merged: it is computed once for each."""
        keys = [place.tobytes() for place in vertices]
        return np.array(self._windings.of(keys, vertices, lambda fresh: self.winding(np.array(fresh)).tolist()))

    def circle(self, loop: np.ndarray) -> tuple[np.ndarray, float]:
        """The `inscribed_circle` of a loop, (n, 3): it is computed once for each."""
        return self._circles.of([loop.tobytes()], [loop], lambda fresh: map(inscribed_circle, fresh))[0]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What an oriented surface says about a curve."""

    curve: Curve
    surface: Surface

    @cached_property
    def winding(self) -> Floats:
        """Winding number at the middle of every edge, (E,) float array."""
        return self.surface.winding(self.curve.vertices[self.curve.edges].mean(axis=1))

    @cached_property
    def area(self) -> np.ndarray:
        """Area of the surface along every edge, (E,) float array.

        Points belong to the nearest of the edges at their vertex, and count by how upright their normals stand on it,
        sin^2: all of a tube of which it is the axis, and nothing of a sheet across it.
        """
        curve, surface = self.curve, self.surface
        edge, _ = _nearest_edges(curve, surface.supporting)
        rows = np.flatnonzero(edge >= 0)
        edge, ends = edge[rows], curve.vertices[curve.edges]
        tangent = (ends[:, 1] - ends[:, 0]) / np.maximum(curve.edge_lengths, TINY)[:, None]
        upright = 1 - dot(surface.normals[rows], tangent[edge]) ** 2
        area: np.ndarray = np.bincount(edge, surface.areas[rows] * upright, len(curve.edges))
        return area

    @cached_property
    def bonds(self) -> tuple[np.ndarray, np.ndarray]:
        """How far the surface goes on from vertex to vertex: pairs i < j, (B, 2) int array, and weights, (B,).

        Every two near points of different vertices count by how far their normals agree and stand upright on the line
        between them, cos^2 times sin^2 times sin^2: not where surfaces of two parts face each other.
        """
        surface, m = self.surface, len(self.curve.vertices)
        vertex, neighbours = self.curve.vertex_of_point[surface.supporting], surface.neighbours[:, 1:]
        p, q = np.repeat(np.arange(len(vertex)), neighbours.shape[1]), neighbours.ravel()
        a, b = vertex[p], vertex[q]
        foreign = np.flatnonzero(a != b)
        p, q, a, b = (values.take(foreign) for values in (p, q, a, b))
        agree = dot(surface.normals.take(p, axis=0), surface.normals.take(q, axis=0)) ** 2
        weight = agree * uprightness(surface.points, surface.normals, p, q)
        keys = np.minimum(a, b) * m + np.maximum(a, b)
        keys, which = np.unique(keys, return_inverse=True)
        return np.column_stack(np.divmod(keys, m)), np.bincount(which, weight, len(keys))

    def thickness(self, cycles: list[np.ndarray]) -> list[float]:
        """Median distance of the surface along each of some loops of the curve."""
        return [max(quantile(self.curve.cloud.distance[cycle]), TINY) for cycle in cycles]


def _nearest_edges(curve: Curve, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the edges at a point's vertex the nearest, or -1 if it has none, and where on it."""
    vertex = curve.vertex_of_point[points]
    around = incident_edges(curve.edges, len(curve.vertices))[vertex]
    edge, t = nearest_on_edges(curve.vertices, curve.edges, around, curve.points[points])
    return np.where(curve.degree[vertex] > 0, edge, -1), t
