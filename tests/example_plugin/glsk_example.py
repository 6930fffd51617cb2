"""An example of a plugin: a filter of clouds, one of skeletons, a stopping rule, and a pipeline of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glsk_o3d import Cloud, Connector, Contractor, Filter, LPRReducer, Pipeline, Refiner, RingBuilder, Skeleton
from glsk_o3d.interop.clouds import cloud_points
from glsk_o3d.parameters import Parameters, documented, parameter, resolve_length


@documented
@dataclass(frozen=True, kw_only=True)
class Voxel(Filter[Cloud, Cloud]):
    """Replace the points in every cell of a grid by their mean."""

    size: float | str = parameter(
        "2%", "Side of a cell.", type="length", unit="cloud's units, or % of the diagonal", low=0, open_low=True
    )

    def run(self, cloud, context):
        points = cloud_points(cloud)
        low, high = points.min(axis=0), points.max(axis=0)
        size = resolve_length(self.size, float(np.linalg.norm(high - low)))
        _, cell = np.unique(np.floor((points - low) / size), axis=0, return_inverse=True)
        cell = cell.reshape(-1)
        return np.column_stack([np.bincount(cell, axis) for axis in points.T]) / np.bincount(cell)[:, None]


@documented
@dataclass(frozen=True, kw_only=True)
class RadiusFloor(Filter[Skeleton, Skeleton]):
    """Let no radius be less than a share of the median radius."""

    share: float = parameter(0.5, "Least radius over the median radius.", type="float", low=0)

    def run(self, skeleton, context):
        return replace(skeleton, radii=np.maximum(skeleton.radii, self.share * np.median(skeleton.radii)))


@documented
@dataclass(frozen=True)
class SolveCount(Parameters):
    """Stop after so many solves."""

    count: int = parameter(4, "Solves.", type="int", unit="solves", low=1)

    def __call__(self, iterations):
        return f"{self.count} solves are done" if len(iterations) >= self.count else None


def coarse() -> Pipeline:
    """The default pipeline on a thinned cloud, with four solves."""
    contractor = Contractor(reducer=LPRReducer(), stop=SolveCount())
    return Voxel() | RingBuilder() | contractor | Connector() | Refiner() | RadiusFloor()
