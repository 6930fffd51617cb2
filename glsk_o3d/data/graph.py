"""A graph in space with the points around it: what a finished skeleton and the working curve have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..geometry.groups import component_labels
from ..geometry.polylines import maximal_paths
from ..geometry.radii import supporting_points
from ..geometry.vectors import norm
from .derived import derived
from .report import Report, Reported

AnyGraph = TypeVar("AnyGraph", bound="Graph")

OF_VERTICES = ("radii", "confidence", "half_width", "half_thickness", "support")
"""What is known of every vertex but its place."""


@dataclass(frozen=True, eq=False)
class Graph(Reported):
    """Vertices, edges, what is known of the vertices, and which points belong to each: see `Skeleton`."""

    vertices: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    vertex_of_point: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    report: Report
    confidence: np.ndarray
    half_width: np.ndarray
    half_thickness: np.ndarray
    support: np.ndarray
    representative_of_point: np.ndarray

    @derived("edges")
    def degree(self) -> np.ndarray:
        """Edges at every vertex, (M,) int array."""
        return np.bincount(self.edges.ravel(), minlength=len(self.vertices))

    @derived("vertex_of_point", "normals")
    def supporting_points(self) -> np.ndarray:
        """Input points with a vertex and a normal, which determine the skeleton, int array."""
        return supporting_points(self.vertex_of_point, self.normals)

    @property
    def surface_points(self) -> np.ndarray:
        """Supporting points by which a Refiner knows the surface, int array.

        Those that represent themselves; of a skeleton without representatives all.
        """
        points = self.supporting_points
        own = points[self.representative_of_point[points] == points]
        return own if len(own) else points

    @property
    def leaves(self) -> np.ndarray:
        """Vertices with one edge, int array."""
        return np.flatnonzero(self.degree == 1)

    @property
    def junctions(self) -> np.ndarray:
        """Vertices with more than two edges, int array."""
        return np.flatnonzero(self.degree > 2)

    @derived("edges")
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

    @derived("vertices", "edges")
    def edge_lengths(self) -> np.ndarray:
        """Length of every edge, (E,) float array."""
        ends = self.vertices[self.edges]
        return norm(ends[:, 1] - ends[:, 0])

    @derived("edges")
    def branches(self) -> tuple[np.ndarray, ...]:
        """Maximal paths between leaves and junctions, as vertex indices in order.

        A loop without a junction starts and ends at the same vertex. A vertex without edges is no branch.
        """
        return tuple(np.array(vertices) for vertices, _ in maximal_paths(len(self.vertices), self.edges))


def all_of_vertices(graph: Graph, rows: Any = slice(None)) -> dict[str, Any]:
    """The place of some vertices and all that is known of them, by field, for `Graph.changed`."""
    return {name: getattr(graph, name)[rows] for name in ("vertices", *OF_VERTICES)}


def in_order_of_ends(edges: np.ndarray, m: int) -> np.ndarray:
    """Edges (E, 2) between m vertices as pairs i < j, in ascending order."""
    first, second = edges.T
    if (first > second).any() or (np.diff(first * m + second) <= 0).any():
        edges = np.sort(edges, axis=1)
        edges = edges[np.lexsort(edges.T[::-1])]
    return edges
