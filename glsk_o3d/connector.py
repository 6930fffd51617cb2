"""Connector: contracted cloud -> graph (Cao et al. 2010, section 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .filter import Filter, documented, parameter, resolve_length
from .numerics.groups import group_median, group_sum
from .numerics.neighbourhoods import nearest_neighbours
from .numerics.sampling import farthest_point_sampling
from .skeleton import Skeleton, plane_distance_radii


@documented
@dataclass(frozen=True, kw_only=True)
class Connector(Filter):
    """Sample the contracted points and join samples whose points are ring neighbours.

    Farthest-point sampling leaves a ball of `radius` around every vertex; each contracted point belongs to its nearest
    vertex, which moves to the mean of its points. Two vertices are joined where a point of one has its nearest foreign
    ring neighbour in the other. The published codes take the first foreign neighbour in the ring, so that their loops
    depend on where a ring happens to start; the nearest one depends on nothing but the points.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.
    """

    consumes: ClassVar[str] = "Contraction"
    produces: ClassVar[str] = "Skeleton"

    radius: float | str = parameter(
        "2%",
        "Distance between neighbouring vertices: details smaller than this are lost, parts closer than this fuse.",
        type="length",
        unit="cloud's units, or % of the diagonal",
        low=0,
        open_low=True,
    )

    thickness: float = parameter(
        0.0, "Ball radius as a share of the local thickness, where that is more than `radius`.", type="float", low=0
    )

    def _run(self, state, on_iteration):
        radius = resolve_length(self.radius, state.frame.diagonal * state.frame.scale) / state.frame.scale
        radii = np.maximum(radius, self.thickness * local_thickness(state))
        samples, owner = farthest_point_sampling(state.positions, radii)
        mass = group_sum(state.mass, owner, len(samples))[:, None]
        vertices = group_sum(state.mass[:, None] * state.positions, owner, len(samples)) / mass
        survivor = state.survivor_of_point
        vertex_of_point = np.where(survivor >= 0, owner[survivor], -1)
        normals = np.where(state.row_of_point[:, None] >= 0, state.normals[state.row_of_point], np.nan)
        vertices = state.frame.out_of(vertices)
        return Skeleton(
            vertices=vertices,
            edges=_links(state, owner),
            radii=plane_distance_radii(vertices, vertex_of_point, state.points, normals),
            vertex_of_point=vertex_of_point,
            points=state.points,
            normals=normals,
            report=state.report,
        )


def local_thickness(state):
    """Median distance of the input points that each survivor speaks for to where it was contracted, smoothed over 16.

    Parameters
    ----------
    state : Contraction

    Returns
    -------
    (n,) float array
        In the working frame.
    """
    distance = np.linalg.norm(state.cloud - state.positions[state.owner], axis=1)
    thickness = group_median(distance, state.owner, len(state))
    _, neighbours = nearest_neighbours(state.positions, min(16, len(state)))
    return np.median(thickness[neighbours], axis=1)


def _links(state, owner):
    """Edges between samples: from every point's sample to that of its nearest foreign ring neighbour."""
    rings = state.rings
    a, b = owner[rings.owners], owner[rings.indices]
    length = np.where(a == b, np.inf, rings.edge_lengths(state.positions))
    nearest = np.minimum.reduceat(length, rings.indptr[:-1])
    link = np.flatnonzero((length == np.repeat(nearest, rings.sizes)) & (a != b))
    return np.unique(np.sort(np.column_stack([a[link], b[link]]), axis=1), axis=0)
