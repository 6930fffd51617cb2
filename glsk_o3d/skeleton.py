"""The result: a curve skeleton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from .errors import InvalidParameterError
from .interop.packages import import_open3d, require
from .numerics.groups import component_labels
from .numerics.radii import supporting_points
from .numerics.vectors import norm
from .report import Report

if TYPE_CHECKING:
    import networkx
    import open3d

OF_VERTICES = ("radii", "confidence", "half_width", "half_thickness", "support")
"""What is known of every vertex but its place."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A curve skeleton: a graph embedded in space, in the units of the cloud it was made from.

    Attributes
    ----------
    vertices : (M, 3) float64 array
    edges : (E, 2) int64 array
        Pairs i < j, sorted, each once.
    radii : (M,) float64 array
        Local radius: the median distance from the vertex to the tangent planes of the points it owns, or, where
        noise has tilted these, from the fitted curve to the points; on the axis of a tube the tube's radius. Where
        there is no surface, how far the points scatter around the curve.
    vertex_of_point : (N,) int64 array
        For every input point the vertex it belongs to; -1 only for points that were dropped as not finite.
    points : (N, 3) float64 array
        The input points, in the order they came in.
    normals : (N, 3) float64 array
        Unit normals estimated from the neighbourhoods, up to their sign; NaN for points that have no say, because they
        were dropped as not finite, set aside as outliers, or left out of the sample of a large cloud, and where there
        is no surface.
    report : Report
        What the run did.
    confidence : (M,) float64 array
        How well its points support each vertex, from 0 to 1: the share of what they say about where the axis is that
        they agree on, less where they are few; 0 where there is no surface. NaN where nobody has measured it.
    half_width, half_thickness : (M,) float64 array
        Half axes of the part's section at every vertex, the longer and the shorter one: of a bar half its width and
        half its thickness. The radius where nobody has measured them.
    support : (M,) float64 array
        Share of samples of the cloud whose skeletons show the curve there, see `glsk_o3d.support`; NaN where nobody has
        measured it.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> ring.n_components, ring.n_loops, len(ring.leaves)
    (1, 1, 0)
    >>> abs(ring.length - 2 * np.pi * 0.4) < 0.1  # the axis is a circle of radius 0.4
    True
    >>> ring.vertex_of_point.shape
    (1000,)
    """

    vertices: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    vertex_of_point: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    report: Report = field(default_factory=Report)
    confidence: np.ndarray = None  # type: ignore[assignment]
    half_width: np.ndarray = None  # type: ignore[assignment]
    half_thickness: np.ndarray = None  # type: ignore[assignment]
    support: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        # steps that merge or add vertices pass on what was measured before them: it means nothing any more
        unknown = np.full(len(self.vertices), np.nan)
        otherwise = dict(confidence=unknown, half_width=self.radii, half_thickness=self.radii, support=unknown)
        for name, value in otherwise.items():
            if np.shape(getattr(self, name))[:1] != unknown.shape:
                object.__setattr__(self, name, value)
        shapes = dict(vertices=(-1, 3), edges=(-1, 2), points=(-1, 3), normals=(-1, 3))
        for name in (*shapes, "vertex_of_point", *OF_VERTICES):
            dtype = np.int64 if name in ("edges", "vertex_of_point") else float
            array = np.asarray(getattr(self, name), dtype).reshape(shapes.get(name, -1))
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        return (
            f"Skeleton({len(self.vertices)} vertices, {len(self.edges)} edges, {self.n_components} components, "
            f"{self.n_loops} loops, {len(self.leaves)} leaves, {len(self.junctions)} junctions)"
        )

    @cached_property
    def degree(self) -> np.ndarray:
        """Edges at every vertex, (M,) int array."""
        return np.bincount(self.edges.ravel(), minlength=len(self.vertices))

    @property
    def supporting_points(self) -> np.ndarray:
        """Input points that have a vertex and a normal, int array: those that say where the skeleton is."""
        return supporting_points(self.vertex_of_point, self.normals)

    @property
    def leaves(self) -> np.ndarray:
        """Vertices with one edge, int array."""
        return np.flatnonzero(self.degree == 1)

    @property
    def junctions(self) -> np.ndarray:
        """Vertices with more than two edges, int array."""
        return np.flatnonzero(self.degree > 2)

    @cached_property
    def component_of_vertex(self) -> np.ndarray:
        """Connected component of every vertex, (M,) int array."""
        return component_labels(len(self.vertices), self.edges)

    @property
    def n_components(self) -> int:
        """Connected components."""
        return int(self.component_of_vertex.max(initial=-1)) + 1

    @property
    def n_loops(self) -> int:
        """Cycle rank: independent loops of the graph."""
        return len(self.edges) - len(self.vertices) + self.n_components

    @property
    def length(self) -> float:
        """Total length of the edges, in the cloud's units."""
        return float(self.edge_lengths.sum())

    @property
    def edge_lengths(self) -> np.ndarray:
        """Length of every edge, (E,) float array."""
        ends = self.vertices[self.edges]
        return norm(ends[:, 1] - ends[:, 0])

    @cached_property
    def branches(self) -> tuple[np.ndarray, ...]:
        """Maximal paths between leaves and junctions, as vertex indices in order.

        A loop without a junction starts and ends at the same vertex. A vertex without edges is no branch.
        """
        neighbours: list[list[int]] = [[] for _ in self.vertices]
        for a, b in self.edges.tolist():
            neighbours[a].append(b)
            neighbours[b].append(a)
        left, paths = set(map(tuple, self.edges.tolist())), []
        ends = np.flatnonzero((self.degree > 0) & (self.degree != 2)).tolist()
        for start in ends + np.flatnonzero(self.degree == 2).tolist():
            for step in neighbours[start]:
                if (min(start, step), max(start, step)) not in left:
                    continue
                path = [start, step]
                while path[-1] != start and len(neighbours[path[-1]]) == 2:
                    before, (one, other) = path[-2], neighbours[path[-1]]
                    path.append(other if one == before else one)
                left.difference_update((min(edge), max(edge)) for edge in pairwise(path))
                paths.append(np.array(path))
        return tuple(paths)

    def to_networkx(self) -> networkx.Graph:
        """The graph, with what is known of every vertex.

        Returns
        -------
        networkx.Graph
            Nodes have ``position`` (3-tuple), ``radius``, ``confidence``, ``half_width``, ``half_thickness`` and
            ``support``; edges ``length``.

        Raises
        ------
        MissingPackageError
        """
        graph = require("networkx").Graph()
        columns = [map(tuple, self.vertices.tolist()), *(getattr(self, name).tolist() for name in OF_VERTICES)]
        for i, facts in enumerate(zip(*columns, strict=True)):
            graph.add_node(i, **dict(zip(("position", "radius", *OF_VERTICES[1:]), facts, strict=True)))
        for (a, b), length in zip(self.edges.tolist(), self.edge_lengths.tolist(), strict=True):
            graph.add_edge(a, b, length=length)
        return graph

    def to_line_set(self, color: Sequence[float] = (0.85, 0.1, 0.1)) -> open3d.geometry.LineSet:
        """The skeleton as an ``open3d.geometry.LineSet`` of one colour. See `glsk_o3d.to_line_set` for others.

        Parameters
        ----------
        color : three floats in [0, 1]

        Raises
        ------
        InvalidParameterError, MissingPackageError
        """
        try:
            paint = np.asarray(color, float)
        except (TypeError, ValueError):
            paint = np.empty(0)
        if paint.shape != (3,) or not ((paint >= 0) & (paint <= 1)).all():
            words = "must be three numbers from 0 to 1; glsk_o3d.to_line_set takes words, too"
            raise InvalidParameterError(f"color = {color!r}: {words}")
        o3d = import_open3d()
        lines = o3d.geometry.LineSet()
        lines.points = o3d.utility.Vector3dVector(np.ascontiguousarray(self.vertices))
        lines.lines = o3d.utility.Vector2iVector(np.ascontiguousarray(self.edges, np.int32))
        lines.paint_uniform_color(paint)
        return lines
