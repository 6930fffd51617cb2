"""Set parts without a surface aside while a curve is refined by the surface around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...data.graph import all_of_vertices
from ...geometry.near_links import spanning
from ...geometry.vectors import norm
from ..curve import Curve
from ..numbers import CURVE
from ..topology.false_branches import CROSSING_HOPS
from .detect import THIN, SpacedPoints, mostly_on_loops, without_surface


class Deferred(NamedTuple):
    """What of a curve is left to a Tracer."""

    whole: Curve
    gone: np.ndarray  # (M,) bool, its vertices without a surface
    rows: np.ndarray  # input points of the others

    @classmethod
    def of(cls, curve: Curve, least: float) -> Deferred | None:
        """The parts that a Tracer will trace, if they have most points of a large curve, such as a tree's crown.

        No surface around them says anything, and there are thousands of them to be asked about. `least` is as in
        `without_surface`.
        """
        cloud, unsure = SpacedPoints(curve), curve.confidence < CURVE.unsure
        if len(unsure) <= THIN.region_vertices or not _most(cloud, unsure) or mostly_on_loops(curve, unsure):
            return None
        gone = without_surface(cloud, least)
        if not _most(cloud, gone) or mostly_on_loops(curve, gone):
            return None
        for _ in range(CROSSING_HOPS):  # what grows where a part was severed is near, and will be traced, too
            gone[curve.edges[~gone[curve.edges].all(axis=1)]] = False
        owner = curve.vertex_of_point
        return cls(curve, gone, np.flatnonzero((owner >= 0) & ~gone[owner]))

    def rest(self) -> Curve:
        """What is left, with its points alone."""
        whole, stays, rows = self.whole, ~self.gone, self.rows
        number = np.cumsum(stays) - 1
        return whole.changed(
            **all_of_vertices(whole, stays),
            edges=number[whole.edges[stays[whole.edges].all(axis=1)]],
            vertex_of_point=number[whole.vertex_of_point[rows]],
            points=whole.points[rows],
            normals=whole.normals[rows],
        )

    def put_back(self, curve: Curve) -> Curve:
        """The refined rest, and behind its vertices those set aside, as trees tied to where it is nearest."""
        whole, gone, m = self.whole, self.gone, len(curve.vertices)
        number = m - 1 + np.cumsum(gone)
        ends = whole.edges[gone[whole.edges].any(axis=1)]
        ties, stays = number[ends], ~gone[ends]
        if stays.any():
            ties[stays] = cKDTree(curve.vertices).query(whole.vertices[ends[stays]])[1]
        piece = np.append(curve.component_of_vertex, curve.n_components + np.arange(gone.sum()))
        if len(ties):
            ties = ties[spanning(piece, ties, norm(whole.vertices[ends[:, 1]] - whole.vertices[ends[:, 0]]))]
        owner = np.where(whole.vertex_of_point >= 0, number[whole.vertex_of_point], -1)
        owner[self.rows] = curve.vertex_of_point
        inside, outside = all_of_vertices(curve), all_of_vertices(whole, gone)
        return curve.rewired(
            np.concatenate([curve.edges, ties]),
            **{name: np.concatenate([inside[name], outside[name]]) for name in inside},
            vertex_of_point=owner,
            points=whole.points,
            normals=whole.normals,
        )


def _most(cloud: SpacedPoints, rows: np.ndarray) -> bool:
    return bool(cloud.count[rows].sum() > CURVE.majority * cloud.count.sum())
