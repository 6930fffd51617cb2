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

    Farthest-point sampling leaves a ball around every vertex, as wide as `radius` or a share of the local thickness.
    Each contracted point belongs to its nearest vertex, in units of the vertex's ball, and the vertex moves to the mean
    of its points. Vertices are joined where ring neighbours belong to different ones.

    Notes
    -----
    The published codes use one radius of 2 % of the diagonal, and join a point's vertex to that of its first foreign
    neighbour in the ring, so that their loops depend on where a ring happens to start. ``links="nearest"`` takes the
    nearest foreign neighbour instead, which depends on nothing but the points; ``links="all"`` takes all of them, so
    that what is connected by rings stays connected.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.
    """

    consumes: ClassVar[str] = "Contraction"
    produces: ClassVar[str] = "Skeleton"

    radius: float | str = parameter(
        "1%",
        "Least distance between vertices: smaller details are lost, and parts closer than this fuse.",
        type="length",
        unit="cloud's units, or % of the diagonal",
        low=0,
        open_low=True,
    )
    thickness: float = parameter(
        0.6,
        "Distance between vertices over the local thickness, where that is more; 0 for `radius` alone.",
        type="float",
        low=0,
    )
    links: str = parameter(
        "all",
        "Join a point's vertex with those of all its foreign ring neighbours, or of the nearest one only.",
        type="choice",
        choices=("all", "nearest"),
    )

    def _run(self, state, on_iteration):
        radius = resolve_length(self.radius, state.frame.diagonal * state.frame.scale) / state.frame.scale
        radii = np.maximum(radius, self.thickness * local_thickness(state))
        samples, owner = farthest_point_sampling(state.positions, radii)
        mass = group_sum(state.mass, owner, len(samples))[:, None]
        vertices = group_sum(state.mass[:, None] * state.positions, owner, len(samples)) / mass
        survivor = state.survivor_of_point
        vertex_of_point = np.where(survivor >= 0, owner[survivor], -1)
        known = (state.row_of_point >= 0) & ~state.outlier
        normals = np.where(known[:, None], state.normals[state.row_of_point], np.nan)
        vertices = state.frame.out_of(vertices)
        return Skeleton(
            vertices=vertices,
            edges=self._edges(state, owner),
            radii=plane_distance_radii(vertices, vertex_of_point, state.points, normals),
            vertex_of_point=vertex_of_point,
            points=state.points,
            normals=normals,
            report=state.report,
        )

    def _edges(self, state, owner):
        rings = state.rings
        a, b = owner[rings.owners], owner[rings.indices]
        link = a != b
        if self.links == "nearest":
            length = np.where(link, rings.edge_lengths(state.positions), np.inf)
            link &= length == np.repeat(np.minimum.reduceat(length, rings.indptr[:-1]), rings.sizes)
        return np.unique(np.sort(np.column_stack([a[link], b[link]]), axis=1), axis=0)


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
