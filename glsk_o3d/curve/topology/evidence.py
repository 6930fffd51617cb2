"""The surface around a curve: how it hangs together, which side is out, and what is inside."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from ..curve import Curve
from ...geometry.cycles import inscribed_circle
from ...geometry.diffusion import Diffusion
from ...geometry.groups import first_in_their_place, group_rank, quantile
from ...geometry.morton import morton_order
from ...geometry.neighbourhoods import nearest_neighbours, uprightness
from ...geometry.polylines import incident_edges, nearest_on_edges, places_on_edges
from ...geometry.vectors import TINY, dot
from ...geometry.winding import AREA_NEIGHBOURS, orient_from_axis, point_areas, winding_number
from ..axis.sections import VertexPoints
from .collapse import with_fields

# fitted: winding number below which an axis is in little; .5 on that of a tube seen from one side, .2 in sparse crowns
LEAST_INSIDE = 0.4

REFINED_POINTS = 16384  # measured: points without noise that a graph is refined by: of 65536 it takes half of the time
# measured: points of one object beyond which a surface hangs together in the same way, and noisy ones down to about
ENOUGH_POINTS = 4096  # which they are averaged
VERTEX_POINTS = 32  # derived: points to a vertex of a tube with 20 around it, whose vertices are half a radius apart


Asked = TypeVar("Asked")
Answer = TypeVar("Answer")


def ask_once(
    known: dict[bytes, Answer],
    names: Sequence[bytes],
    asked: Iterable[Asked],
    ask: Callable[[list[Asked]], Iterable[Answer]],
) -> list[Answer]:
    """The answer for each of some things, of which those with new `names` are asked for together, and then `known`.

    A name is all that the answer hangs on, so that it is the same when other parts of the curve have changed.
    """
    fresh = {name: each for name, each in zip(names, asked, strict=True) if name not in known}
    if fresh:
        known.update(zip(fresh, ask([*fresh.values()]), strict=True))
    return [known[name] for name in names]


@dataclass(frozen=True, eq=False)
class SurfaceGraph:
    """Some of the points that support a curve, each linked with those nearest to it.

    Of many points it takes a regular sample, 4096 or more, and 32 for every vertex: an object of many parts takes more.
    Of points in one place it takes the first.
    """

    supporting: np.ndarray  # (n,) which input points
    points: np.ndarray  # (n, 3)
    neighbours: np.ndarray  # (n, k) nearest points, itself first

    @classmethod
    def of(cls, curve: Curve) -> SurfaceGraph:
        """The surface that supports a curve."""
        supporting = curve.supporting_points
        enough = max(ENOUGH_POINTS, VERTEX_POINTS * len(curve.vertices))
        step = max(len(supporting) // enough, 1)
        if step > 1:  # which they are must not depend on points that have no say
            supporting = np.sort(supporting[morton_order(curve.points[supporting])[::step]])
        supporting = supporting[first_in_their_place(curve.points[supporting])]
        points = curve.points[supporting]
        if not len(points):
            return cls(supporting, points, np.empty((0, 1), int))
        return cls(supporting, points, nearest_neighbours(points, min(AREA_NEIGHBOURS + 1, len(points)))[1])

    @cached_property
    def diffusion(self) -> Diffusion:
        """Over the links."""
        return Diffusion(self.points, self.neighbours)

    @cached_property
    def areas(self) -> np.ndarray:
        """What every point stands for, (n,)."""
        return point_areas(self.points, self.neighbours)

    @cached_property
    def spacing(self) -> float:
        """Distance of the points: the root of the median of what they stand for."""
        return float(np.sqrt(np.median(self.areas)))


@dataclass(frozen=True, eq=False)
class Evidence(SurfaceGraph):
    """The points that support a curve, as an oriented surface; it holds while the graph is changed."""

    normals: np.ndarray  # (n, 3) unit vectors that point outward
    _said: dict[str, tuple[Curve, Any]] = field(default_factory=dict, repr=False)
    _wound: dict[bytes, float] = field(default_factory=dict, repr=False)
    _circles: dict[bytes, tuple[np.ndarray, float]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, curve: Curve, surface: SurfaceGraph | None = None) -> Evidence:
        """The evidence for a curve that has edges and was fitted to its points, or to their `surface`."""
        surface = surface or SurfaceGraph.of(curve)
        supporting, points, neighbours = surface.supporting, surface.points, surface.neighbours
        edge, t = _nearest_edges(curve, supporting)
        axis = np.where(edge[:, None] >= 0, places_on_edges(curve.vertices, curve.edges, edge, t), points)
        normals = orient_from_axis(points, curve.normals[supporting], axis, neighbours)
        made = cls(supporting, points, neighbours, normals)
        vars(made).update(diffusion=surface.diffusion, areas=surface.areas)  # over the same links
        return made

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def near(self, place: np.ndarray, reach: float) -> np.ndarray:
        """The points that are not farther from a place, ascending int array."""
        return np.array(self._tree.query_ball_point(place, reach, return_sorted=True), int)

    def winding(self, queries: np.ndarray) -> np.ndarray:
        """Winding number of the surface around each place, (m,) float array from (m, 3): near 1 inside, 0 outside."""
        return winding_number(self.points, self.normals, self.areas, queries)

    def winding_at(self, vertices: np.ndarray) -> np.ndarray:
        """The same of vertices, which stay where they are while others are merged: of each it is asked once."""
        names = [place.tobytes() for place in vertices]
        return np.array(ask_once(self._wound, names, vertices, lambda fresh: self.winding(np.array(fresh)).tolist()))

    def winding_along(self, curve: Curve) -> np.ndarray:
        """That at the middle of every edge, (E,) float array."""
        return self._once("winding", curve, lambda: self.winding(curve.vertices[curve.edges].mean(axis=1)))

    def surface_around(self, curve: Curve) -> np.ndarray:
        """Area of the surface along every edge, (E,) float array.

        Points belong to the nearest of the edges at their vertex, and count by how upright their normals stand on it,
        sin^2: all of a tube of which it is the axis, and nothing of a sheet across it.
        """
        edge, _ = _nearest_edges(curve, self.supporting)
        some = np.flatnonzero(edge >= 0)
        edge, ends = edge[some], curve.vertices[curve.edges]
        way = (ends[:, 1] - ends[:, 0]) / np.maximum(curve.edge_lengths, TINY)[:, None]
        upright = 1 - dot(self.normals[some], way[edge]) ** 2
        return np.bincount(edge, self.areas[some] * upright, len(curve.edges))

    def bonds(self, curve: Curve) -> tuple[np.ndarray, np.ndarray]:
        """How far the surface goes on from vertex to vertex: pairs i < j, (B, 2) int array, and weights, (B,).

        Every two near points of different vertices count by how far their normals agree and stand upright on the line
        between them, cos^2 times sin^2 times sin^2: not where surfaces of two parts face each other.
        """
        return self._once("bonds", curve, lambda: self._bonds(curve))

    def tubes(self, curve: Curve, cycles: list[np.ndarray]) -> list[float]:
        """Median distance of the surface along each of some loops of the curve."""
        surface = self._once("surface", curve, lambda: curve.cloud.distance)
        return [max(quantile(surface[cycle]), TINY) for cycle in cycles]

    def circle(self, loop: np.ndarray) -> tuple[np.ndarray, float]:
        """The `inscribed_circle` of a loop, (n, 3): of each it is asked once."""
        return ask_once(self._circles, [loop.tobytes()], [loop], lambda fresh: map(inscribed_circle, fresh))[0]

    def _once(self, what: str, curve: Curve, ask: Callable[[], Any]) -> Any:
        """What was said of the same curve before, or is now."""
        of, answer = self._said.get(what, (None, None))
        if of is not curve:
            answer = ask()
            self._said[what] = curve, answer
        return answer

    def _bonds(self, curve: Curve) -> tuple[np.ndarray, np.ndarray]:
        vertex, m = curve.vertex_of_point[self.supporting], len(curve.vertices)
        p, q = np.repeat(np.arange(len(vertex)), self.neighbours.shape[1] - 1), self.neighbours[:, 1:].ravel()
        a, b = vertex[p], vertex[q]
        foreign = np.flatnonzero(a != b)
        p, q, a, b = (each.take(foreign) for each in (p, q, a, b))
        agree = dot(self.normals.take(p, axis=0), self.normals.take(q, axis=0)) ** 2
        weight = agree * uprightness(self.points, self.normals, p, q)
        keys = np.minimum(a, b) * m + np.maximum(a, b)
        keys, which = np.unique(keys, return_inverse=True)
        return np.column_stack(np.divmod(keys, m)), np.bincount(which, weight, len(keys))


def on_sample(step: Callable[[Curve], Curve], curve: Curve) -> Curve:
    """What a step makes of a curve with its surface points alone and, where there are many, fewer of them.

    Of every vertex there is a regular sample, so that thin parts keep all. The more of the cloud is noise, the more
    points are taken, since their mean is what is known of the surface.
    """
    rows, m = curve.surface_points, len(curve.vertices)
    if not len(rows):
        return step(curve)
    clean = 1 - curve.report.noise
    if len(rows) * clean > REFINED_POINTS:
        rows = rows[morton_order(curve.points[rows])]
        vertex = curve.vertex_of_point[rows]
        count = np.bincount(vertex, minlength=m)
        most = max(REFINED_POINTS / clean / np.count_nonzero(count), 2 * VERTEX_POINTS)
        every = np.ceil(count / most).astype(int)
        rows = rows[group_rank(vertex, m) % every[vertex] == 0]
    return on_rows(step, curve, rows)


def on_rows(step: Callable[[Curve], Curve], curve: Curve, rows: np.ndarray) -> Curve:
    """What a step makes of a curve with some of its input points alone, `rows` (n,), in their order.

    In the result a point that had a vertex has that of its stand-in, and one that is its own that of the nearest of
    these points.
    """
    others = curve.vertex_of_point >= 0
    others[rows] = False
    others = np.flatnonzero(others)
    points, vertex = curve.points[rows], curve.vertex_of_point[rows]
    made = step(curve.changed(points=points, normals=curve.normals[rows], vertex_of_point=vertex))
    owner, normals = np.full(len(curve.points), -1), curve.normals.copy()
    owner[rows], normals[rows] = made.vertex_of_point, made.normals
    stand_ins = curve.stand_ins[others]
    alone = others[stand_ins == others]
    if len(alone):
        alone = alone[morton_order(curve.points[alone])]  # the tree is quicker with what is near in turn
        owner[alone] = made.vertex_of_point[cKDTree(points).query(curve.points[alone])[1]]
    owner[others] = owner[stand_ins]
    normals[others[np.isnan(normals[stand_ins, 0])]] = np.nan
    return with_fields(made, points=curve.points, normals=normals, vertex_of_point=owner)


def in_order(step: Callable[[Curve], Curve], curve: Curve, distinct: bool = False) -> Curve:
    """What a step makes of a curve whose points are along a Morton curve, whatever order they came in.

    That would show in the last digit of sums, and where one thing is as good as another, as on grids, it decides. In
    the result the points are as they came. The step may have one point alone of every `distinct` place.
    """
    rows = np.flatnonzero(curve.vertex_of_point >= 0)
    rows = rows[first_in_their_place(curve.points[rows])] if distinct else rows
    return on_rows(step, curve, rows[morton_order(curve.points[rows])] if len(rows) else rows)


def _nearest_edges(curve: Curve, supporting: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the edges at a point's vertex the nearest, or -1 if it has none, and where on it."""
    vertex = curve.vertex_of_point[supporting]
    around = incident_edges(curve.edges, len(curve.vertices))[vertex]
    edge, t = nearest_on_edges(curve.vertices, curve.edges, around, curve.points[supporting])
    return np.where(curve.degree[vertex] > 0, edge, -1), t
