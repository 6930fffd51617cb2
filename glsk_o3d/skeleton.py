"""The result: a curve skeleton."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .numerics.groups import group_median
from .report import Report

if TYPE_CHECKING:
    from os import PathLike

    import networkx


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A curve skeleton: a graph embedded in space, in the units of the cloud it was made from.

    Attributes
    ----------
    vertices : (M, 3) float64 array
    edges : (E, 2) int64 array
        Pairs i < j, sorted, each once.
    radii : (M,) float64 array
        Local thickness: the median distance from the vertex to the tangent planes of the points it owns; on the axis of
        a tube the tube's radius.
    vertex_of_point : (N,) int64 array
        For every input point the vertex it belongs to; -1 only for points that were dropped as not finite.
    points : (N, 3) float64 array
        The input points, in the order they came in.
    normals : (N, 3) float64 array
        Unit normals estimated from the neighbourhoods, up to their sign; NaN for points that have no say, because they
        were dropped as not finite or set aside as outliers.
    report : Report
        What the run did.
    confidence : (M,) float64 array
        How well its points support each vertex, from 0 to 1: the share of what they say about where the axis is that
        they agree on, less where they are few. NaN where nobody has measured it.
    """

    vertices: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    vertex_of_point: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    report: Report = field(default_factory=Report)
    confidence: np.ndarray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self):
        # steps that merge or add vertices pass on what was measured before them: it means nothing any more
        if len(self.confidence) != len(self.vertices):
            object.__setattr__(self, "confidence", np.full(len(self.vertices), np.nan))
        for name, dtype, columns in (
            ("vertices", float, 3),
            ("edges", np.int64, 2),
            ("radii", float, None),
            ("confidence", float, None),
            ("vertex_of_point", np.int64, None),
            ("points", float, 3),
            ("normals", float, 3),
        ):
            array = np.asarray(getattr(self, name), dtype)
            array = array.reshape(-1, columns) if columns else array.reshape(-1)
            object.__setattr__(self, name, array)

    def __repr__(self):
        return (
            f"Skeleton({len(self.vertices)} vertices, {len(self.edges)} edges, {self.n_components} components, "
            f"{self.n_loops} loops, {len(self.leaves)} leaves, {len(self.junctions)} junctions)"
        )

    @cached_property
    def degree(self) -> np.ndarray:
        """Edges at every vertex, (M,) int array."""
        return np.bincount(self.edges.ravel(), minlength=len(self.vertices))

    @property
    def witnesses(self) -> np.ndarray:
        """Input points that have a vertex and a normal, int array: those that say where the skeleton is."""
        return np.flatnonzero((self.vertex_of_point >= 0) & np.isfinite(self.normals).all(axis=1))

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
        from .numerics.components import component_labels

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
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    @cached_property
    def branches(self) -> tuple[np.ndarray, ...]:
        """Maximal paths between leaves and junctions, as vertex indices in order.

        A loop without a junction starts and ends at the same vertex. A vertex without edges is no branch.
        """
        neighbours: list[list[int]] = [[] for _ in self.vertices]
        for a, b in self.edges.tolist():
            neighbours[a].append(b)
            neighbours[b].append(a)
        left = {(a, b) for a, b in self.edges.tolist()}
        paths = []
        ends = np.flatnonzero((self.degree > 0) & (self.degree != 2)).tolist()
        for start in ends + np.flatnonzero(self.degree == 2).tolist():
            for step in neighbours[start]:
                path, here = [start], step
                if (min(start, here), max(start, here)) not in left:
                    continue
                left.discard((min(start, here), max(start, here)))
                path.append(here)
                while here != start and len(neighbours[here]) == 2:
                    onward = neighbours[here][0] if neighbours[here][1] == path[-2] else neighbours[here][1]
                    left.discard((min(here, onward), max(here, onward)))
                    path.append(onward)
                    here = onward
                paths.append(np.array(path))
        return tuple(paths)

    def to_networkx(self) -> networkx.Graph:
        """Graph; nodes have ``position`` (3-tuple), ``radius`` and ``confidence``, edges ``length``.

        Returns
        -------
        networkx.Graph
        """
        import networkx

        graph = networkx.Graph()
        facts = zip(self.vertices.tolist(), self.radii.tolist(), self.confidence.tolist(), strict=True)
        for i, (position, radius, confidence) in enumerate(facts):
            graph.add_node(i, position=tuple(position), radius=radius, confidence=confidence)
        for (a, b), length in zip(self.edges.tolist(), self.edge_lengths.tolist(), strict=True):
            graph.add_edge(a, b, length=length)
        return graph

    def to_line_set(self):
        """The skeleton as an ``open3d.geometry.LineSet``."""
        from .interop.open3d import to_line_set

        return to_line_set(self)

    def to_tensor_line_set(self):
        """The skeleton as an ``open3d.t.geometry.LineSet`` with the point attributes ``radii`` and ``confidence``."""
        from .interop.open3d import to_tensor_line_set

        return to_tensor_line_set(self)

    def to_pymeshlab(self):
        """The skeleton as a ``pymeshlab.Mesh`` of vertices and edges (extra ``meshlab``)."""
        from .interop.meshlab import to_pymeshlab

        return to_pymeshlab(self)

    def save(self, path: str | PathLike, **options) -> None:
        """Write the skeleton to a file; the ending chooses the format. See `glsk_o3d.save_skeleton`."""
        from .interop.files import save_skeleton

        save_skeleton(self, path, **options)


def plane_distance_radii(vertices, vertex_of_point, points, normals, otherwise=0.0):
    """Local thickness: median distance from each vertex to the tangent planes of the points it owns.

    On the axis of a tube this is the tube's radius, however far along the axis a point lies from its vertex.

    Parameters
    ----------
    vertices : (M, 3) float array
    vertex_of_point : (N,) int array
        -1 for points that belong to no vertex.
    points, normals : (N, 3) float array
        Points without a normal (NaN) do not count.
    otherwise : (M,) float array or float
        Radius of the vertices without points.

    Returns
    -------
    (M,) float array
    """
    owned = np.flatnonzero((vertex_of_point >= 0) & np.isfinite(normals).all(axis=1))
    owner = vertex_of_point[owned]
    offset = points[owned] - vertices[owner]
    distance = np.abs(np.einsum("ij,ij->i", offset, normals[owned]))
    radii = group_median(distance, owner, len(vertices))
    return np.where(np.bincount(owner, minlength=len(vertices)) > 0, radii, otherwise)
