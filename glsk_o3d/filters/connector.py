"""Connector: contracted cloud -> graph (Cao et al. 2010, section 5)."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.spatial import cKDTree

from ..curve.medial import OrientedSurface
from ..data.contraction import Contraction
from ..data.skeleton import Skeleton
from ..errors import InvalidCloudError
from ..geometry.farthest_point import farthest_point_sampling
from ..geometry.groups import group_median, group_sum
from ..geometry.neighbourhoods import nearest_neighbours, row_medians
from ..geometry.numbers import fitted, measured
from ..geometry.radii import plane_distance_radii
from ..geometry.vectors import norm
from ..parameters import documented, parameter, resolve_length
from ..pipeline import Filter, RunContext


@dataclass(frozen=True)
class ConnectorNumbers:
    """Numbers of the Connector."""

    radius: float = fitted(1.0, "radius of a ball around a vertex, in percent of the diagonal")
    ring_width: float = fitted(2, "mean edges of a ring across it: nearer vertices would share points")
    smoothing: int = measured(16, "survivors over which the contraction distance is smoothed")


CONNECTOR = ConnectorNumbers()


@documented
@dataclass(frozen=True, kw_only=True)
class Connector(Filter[Contraction, Skeleton]):
    """Sample the contracted points and join samples whose points are ring neighbours.

    Farthest-point sampling leaves a ball around every vertex, as wide as `radius` or a share of the local thickness.
    Each contracted point belongs to its nearest vertex, in units of the vertex's ball, and the vertex moves to the mean
    of its points.

    Notes
    -----
    The published codes use one radius of 2 % of the bounding box's diagonal, and join a point's vertex to that of the
    first foreign neighbour in its ring. That depends on where the ring starts, so ``links="nearest"`` takes the
    nearest.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> raw = (RingBuilder() | Contractor() | Connector(radius="2%"))(torus(1000).points)
    >>> raw.n_components, len(raw.edges) >= len(raw.vertices)
    (1, True)
    """

    radius: float | str = parameter(
        "auto",
        "Least distance between vertices: smaller details are lost, and parts closer than this fuse. 'auto' is 1 % of "
        "the diagonal or, where points are so dense that it is less, the width of a ring.",
        type="length",
        unit="cloud's units, or % of the diagonal",
        low=0,
        open_low=True,
        choices=("auto",),
    )
    thickness: float = parameter(
        0.6, "Distance between vertices over the local thickness, where that is more; 0 for `radius` alone.", low=0
    )
    links: Literal["all", "nearest"] = parameter(
        "all",
        "Join a point's vertex with those of all its foreign ring neighbours, or of the nearest.",
        choices=("all", "nearest"),
    )
    shut: float = parameter(
        0.01,
        "Least share of a closed surface that faces the place to which it was contracted, as walls of narrow holes do "
        "when these are shut, for the graph to be the curve on the medial axis of the solid instead, if that has "
        "loops. 0 takes it of any closed surface, 1 never.",
        low=0,
        high=1,
    )

    def run(self, state: Contraction, context: RunContext) -> Skeleton:
        auto, diagonal = self.radius == "auto", state.frame.diagonal * state.frame.scale
        radius: Any = resolve_length(f"{CONNECTOR.radius}%" if auto else self.radius, diagonal) / state.frame.scale
        if auto:
            radius = np.minimum(radius, CONNECTOR.ring_width * state.rings.mean_lengths(state.cloud[state.survivors]))
        balls = np.maximum(radius, self.thickness * contraction_distance(state))
        samples, vertex_of_survivor = farthest_point_sampling(state.positions, balls)
        mass = group_sum(state.mass, vertex_of_survivor, len(samples))[:, None]
        vertices = group_sum(state.mass[:, None] * state.positions, vertex_of_survivor, len(samples)) / mass
        vertex_of_row = vertex_of_survivor[state.map.survivor_of_row]
        graph = raw_graph(state, vertices, self._edges(state, vertex_of_survivor), vertex_of_row)
        return graph if self.shut == 1 else self._with_holes(state, graph, np.median(radius))

    def _with_holes(self, state: Contraction, contracted: Skeleton, radius: float) -> Skeleton:
        """The graph on the medial axis of the solid, if there is one and contraction has shut enough of its holes."""
        surface = OrientedSurface.of(state)
        if not surface.has_shut(self.shut):
            return contracted
        try:
            curve = surface.medial_graph()
        except InvalidCloudError:  # a piece has too few points
            return contracted
        if not surface.confirms(curve):
            return contracted
        balls = np.maximum(radius, self.thickness * curve.radii)
        part, edges = curve.merged(farthest_point_sampling(curve.places, balls)[1])
        mean = group_sum(np.column_stack([curve.places, curve.radii]), part, part.max() + 1)
        mean /= np.bincount(part)[:, None]
        vertex_of_row = part[cKDTree(curve.places).query(state.cloud)[1]]
        graph = raw_graph(state, mean[:, :3], edges, vertex_of_row, mean[:, 3], on_medial_axis=curve.is_sound)
        return graph if graph.n_loops or not self.shut else contracted

    def _edges(self, state: Contraction, vertex_of_survivor: np.ndarray) -> np.ndarray:
        rings = state.rings
        a, b = vertex_of_survivor[rings.centres], vertex_of_survivor[rings.indices]
        link = a != b
        if self.links == "nearest":
            length = np.where(link, rings.edge_lengths(state.positions), np.inf)
            link &= length == np.repeat(np.minimum.reduceat(length, rings.indptr[:-1]), rings.sizes)
        a, b = a[link], b[link]
        m = vertex_of_survivor.max() + 1
        return np.column_stack(np.divmod(np.unique(np.minimum(a, b) * m + np.maximum(a, b)), m))


def contraction_distance(state: Contraction) -> np.ndarray:
    """Median distance in the frame of each survivor's points to where they were contracted, smoothed, (n,)."""
    survivor = state.map.survivor_of_row
    distance = group_median(norm(state.cloud - state.positions[survivor]), survivor, len(state))
    _, neighbours = nearest_neighbours(state.positions, min(CONNECTOR.smoothing, len(state)))
    return row_medians(distance.take(neighbours))


def raw_graph(
    state: Contraction,
    vertices: np.ndarray,
    edges: np.ndarray,
    vertex_of_row: np.ndarray,
    radii: np.ndarray | float = 0.0,
    on_medial_axis: bool = False,
) -> Skeleton:
    """The skeleton with vertices (M, 3) in the working frame, to which the rows of the cloud belong.

    Vertices to which none belongs have the `radii` (M,), in the same frame.
    """
    vertices, vertex_of_point = state.frame.out_of(vertices), state.map.to_points(vertex_of_row)
    # copies, and what a sample stands for, count with one point
    once = np.where(state.map.sampled, vertex_of_point, -1)
    normals = np.full_like(state.points, np.nan)
    normals[state.has_normal] = state.normals[state.map.row_of_point[state.has_normal]]
    return Skeleton(
        vertices=vertices,
        edges=edges,
        radii=plane_distance_radii(vertices, once, state.points, normals, radii * state.frame.scale),
        vertex_of_point=vertex_of_point,
        points=state.points,
        normals=normals,
        report=replace(state.report, on_medial_axis=on_medial_axis),
        representative_of_point=state.surface_representatives,
    )
