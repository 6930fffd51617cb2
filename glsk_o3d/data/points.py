"""Points: a cloud in its working frame, and which of its points represent which."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from ..errors import StageError
from ..geometry.area_sampling import SurfaceSample, sample_by_area, vertices_mislead
from ..geometry.frame import Frame, not_finite, to_working_frame
from ..geometry.grid_sampling import sample_cloud
from ..geometry.neighbourhoods import principal, reach_next_rows, row_medians
from ..geometry.numbers import fitted, speed
from ..geometry.vectors import TINY, Ints, finite_rows
from ..interop.clouds import cloud_counts, surface_mesh, to_point_cloud
from .point_map import PointMap
from .report import Report, Reported

Working = TypeVar("Working", bound="WorkingCloud")


@dataclass(frozen=True)
class PointNumbers:
    """Numbers of the preparation of points that several filters share."""

    clean: float = fitted(0.2, "median sphericity of clean neighbourhoods at most")
    noisy: float = fitted(0.35, "median sphericity of neighbourhoods of nothing but noise")
    ridge_neighbours: int = fitted(32, "neighbours among which a ridge is sought; a noisy shell is thick")
    enough: int = fitted(2400, "points on a body without thin parts; fewer are not thinned")
    most: int = speed(25000, "points of most clouds that are contracted")


POINTS = PointNumbers()


def default_k(n: int) -> int:
    """Neighbours per point, itself included: 16 from 4096 points on, fewer by the cube root below, at least 8.

    In a sparse cloud 16 neighbours would reach across thin parts.
    """
    return min(int(np.clip(np.floor(16 * np.cbrt(n / 4096) + 0.5), 8, 16)), n)


def default_size(n: int) -> int:
    """Points to contract: at most 25000, but 64 times the square root of their number from 152588 points on.

    More points make the axis hardly more exact, since neither noise nor the thickness of parts shrinks with their
    spacing; they only cost time.
    """
    size: int = max(POINTS.most, round(64 * np.sqrt(n)))
    return min(n, size)


@dataclass(frozen=True, eq=False)
class WorkingCloud(Reported):
    """What `Points` and `Contraction` have in common: a cloud in its working frame, and who represents whom.

    Arrays over the N input points are in the user's order and units. Everything else lives in the working frame: m
    distinct points in Morton order, of which n survive.
    """

    points: np.ndarray
    map: PointMap
    frame: Frame
    cloud: np.ndarray
    weight: np.ndarray
    merged: np.ndarray
    noise: np.ndarray
    normals: np.ndarray
    report: Report

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} of {len(self.points)} points left)"

    def __len__(self) -> int:
        return len(self.survivors)

    @property
    def survivors(self) -> Ints:
        """Remaining rows of `cloud`, (n,) int array."""
        return self.map.survivors

    @property
    def outlier(self) -> np.ndarray:
        """Outliers, (N,) bool array."""
        return self.map.outlier

    @property
    def survivor_of_point(self) -> np.ndarray:
        """The survivor that represents every input point, (N,) int array; -1 for dropped points."""
        return self.map.survivor_of_point

    @property
    def has_normal(self) -> np.ndarray:
        """Input points with a normal, (N,) bool array: those that determine the surface, and their copies."""
        if self.report.is_sampled or self.report.n_by_area:
            return self.map.sampled
        return (self.map.row_of_point >= 0) & ~self.outlier

    def merged_into(self: Working, into: np.ndarray, **changes: Any) -> Working:
        """The same with survivors merged `into` others (n,); one that stays is its own.

        `changes` are the fields over the survivors that remain.
        """
        return replace(self, map=self.map.merge(into), **changes)


@dataclass(frozen=True, eq=False, repr=False)
class Points(WorkingCloud):
    """A cloud on its way to its rings.

    Filters that prepare a cloud merge copies, noisy points and near points, and set outliers aside. A remaining point
    represents the points merged into it, and the outliers nearest to it.

    Attributes
    ----------
    points : (N, 3) float64 array
        The input; of a mesh that is sampled its vertices, and the sample after them.
    map : PointMap
        From the input points to the rows of `cloud` and to those that remain, the survivors.
    frame : Frame
    cloud : (m, 3) float64 array
        Distinct input points; noisy ones denoised, and where there are many, means of several.
    weight, merged : (m,) float64 array
        Number of input points that each represents, without copies, and of distinct points that it is the mean of.
    noise : (m,) float64 array
        Share of noise in the neighbourhood of each, from 0 to 1.
    normals : (m, 3) float64 array
        Unit normals of the tangent planes before points were moved to ridges, up to their sign.
    neighbours : (n, k) int array
        The nearest survivors of each, nearest first after the point itself; as many as reach into the next rows where
        points lie in rows, such as scan lines.
    spread : (n, 3) float64 array
        Sums of squares along the principal axes of these neighbourhoods, ascending.
    ring_normals : (n, 3) float64 array
        Unit normals of the planes of these neighbourhoods, in which the rings lie.
    report : Report

    Examples
    --------
    >>> from glsk_o3d import OutlierRemover, Sampler
    >>> from glsk_o3d.samples import torus
    >>> points = (Sampler() | OutlierRemover())(torus(500).points)
    >>> len(points), points.neighbours.shape, int(points.outlier.sum())
    (500, (500, 8), 0)
    """

    neighbours: np.ndarray
    spread: np.ndarray
    ring_normals: np.ndarray

    @property
    def coordinates(self) -> np.ndarray:
        """Positions of the survivors in the user's units, (n, 3) float64 array."""
        return self.frame.out_of(self.cloud[self.survivors])

    def to_point_cloud(self) -> Any:
        """The survivors as an ``open3d.geometry.PointCloud``."""
        return to_point_cloud(self.coordinates)

    @classmethod
    def of(
        cls, cloud: Any, size: Callable[[int], int] = int, by: str = "spread", drop: bool = False, sample: Any = "auto"
    ) -> Points:
        """The points of a cloud, or about `size(n)` of n from the cells of a grid if n is more than twice as large.

        Of a mesh they are those `on_surface`, if there are some, and each vertex follows the nearest.
        InvalidCloudError as of `RingBuilder`.
        """
        points, _ = mesh = surface_mesh(cloud)
        finite = finite_rows(points)
        if not (drop or finite.all()):
            raise not_finite(int((~finite).sum()), len(points), int(finite.argmin()))
        counts, n, dropped = cloud_counts(cloud, finite)
        finite_points = points if finite.all() else points[finite]
        surface = on_surface(mesh, sample)[0]
        if len(surface):
            kept, position, counts = sample_cloud(surface, size(len(surface)))
            kept, position = (
                kept + len(finite_points),
                np.append(position[cKDTree(surface).query(finite_points)[1]], position),
            )
            points, finite = np.append(points, surface, axis=0), np.append(finite, np.ones(len(surface), bool))
        else:
            kept, position, counts = sample_cloud(finite_points, size(n), counts)
        kept, place = np.flatnonzero(finite)[kept], np.full(len(points), -1)
        place[finite] = position
        report = Report(n_input=n + dropped, n_dropped=dropped, n_by_area=len(surface), n_sampled=len(kept))
        return cls._of_rows(points, kept, place, counts, by, report)

    @classmethod
    def _of_rows(
        cls,
        points: np.ndarray,
        kept: np.ndarray,
        place: np.ndarray,
        counts: np.ndarray,
        by: str,
        report: Report,
        neighbours: np.ndarray | None = None,
    ) -> Points:
        """Those of the rows `kept` (s,) of a cloud, each of which stands for `counts` (s,) points.

        `place` (N,) is the position in `kept` of what stands for each input point, -1 for none. `neighbours` (s, k), if
        they are known, are positions in `kept` that are all distinct.
        """
        frame, cloud, first, row, weight, neighbours = to_working_frame(points[kept], counts, by, default_k, neighbours)
        sampled = np.zeros(len(points), bool)
        sampled[kept[first]] = True
        return cls(
            points=points,
            map=PointMap.of_rows(np.append(row, -1)[place], sampled, len(cloud)),
            frame=frame,
            weight=weight,
            merged=np.ones(len(cloud)),
            report=report,
            **_measured(cloud, neighbours),
        )

    def without(self, gone: np.ndarray, neighbours: np.ndarray) -> Points:
        """These without the outliers in the (m,) bool array, in the frame of the rest.

        `neighbours` are those of the remaining rows, as positions among these.
        """
        first, aside = self.map.point_of_survivor, self.map.to_points(gone) > 0
        kept, position = np.flatnonzero(self.map.sampled & ~aside), np.full(len(self.points), -1)
        position[kept] = np.arange(len(kept))
        of_row = position[first]
        place = np.where(aside, -1, self.map.to_points(of_row))
        place[kept] = np.arange(len(kept))
        by = "box" if self.frame.mean is None else "spread"
        rows, known, weight = of_row[~gone], np.empty_like(neighbours), np.empty(len(kept))
        known[rows], weight[rows] = rows[neighbours], self.weight[~gone]
        points = self._of_rows(self.points, kept, place, weight, by, self.report, known)
        nearest = np.full(len(gone), -1)
        nearest[gone] = cKDTree(points.cloud).query(points.frame.into(self.points[first[gone]]))[1]
        row_of_point = np.where(aside, self.map.to_points(nearest), points.map.row_of_point)
        return replace(points, map=replace(points.map, row_of_point=row_of_point, outlier=self.outlier | aside))

    def check_not_thinned(self, filter: Any) -> None:
        """Raise StageError if points were merged: the filter needs all of them."""
        if len(self) < len(self.cloud):
            raise StageError(f"{type(filter).__name__} comes before Thinner, which has merged points already")

    def check_not_moved(self, filter: Any) -> None:
        """Raise StageError if points were moved: the filter measures anew where they were."""
        if len(self.cloud) and not (self.frame.into(self.points[self.map.point_of_row]) == self.cloud).all():
            raise StageError(f"{type(filter).__name__} comes before Denoiser, which has moved points already")

    def with_rows(self, row: np.ndarray, cloud: np.ndarray, neighbours: np.ndarray, **changes: Any) -> Points:
        """These with new rows: `row` (m,) is the new row of each old one. Neighbourhoods are measured anew.

        `changes` are other fields over the new rows.
        """
        return replace(self, map=self.map.moved(row, len(cloud)), **_measured(cloud, neighbours) | changes)


def _measured(cloud: np.ndarray, neighbours: np.ndarray) -> dict[str, Any]:
    """Rows that all survive, with what their neighbourhoods are like, as fields of `Points`."""
    neighbours = reach_next_rows(cloud, neighbours)
    spread, normals = principal(cloud, neighbours)
    return dict(
        cloud=cloud,
        noise=noise_share(spread, neighbours),
        normals=normals,
        neighbours=neighbours,
        spread=spread,
        ring_normals=normals,
    )


def on_surface(mesh: tuple[np.ndarray, np.ndarray], sample: Any = "auto") -> SurfaceSample:
    """The points that stand for a mesh, by the option `sample` of the Sampler: none where its vertices do."""
    if sample == "auto" and vertices_mislead(mesh, default_k, POINTS.enough):
        sample = POINTS.most
    return sample_by_area(*mesh, 0 if isinstance(sample, str) else int(sample))


def surface_points(cloud: Any) -> np.ndarray:
    """The points of a cloud, or those that stand for a mesh by default, (N, 3) float64 array."""
    mesh = surface_mesh(cloud)
    places = on_surface(mesh)[0]
    return places if len(places) else mesh.vertices


def noise_share(spread: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """How far the neighbourhoods of a cloud are noise, from 0 to 1, (n,) float array.

    That is how much they fill space: the sphericity, the least over the largest principal spread, smoothed by the
    median, is near 0 on a surface and along a curve, however dense, and 1 in a ball of noise (Demantke et al. 2011,
    "Dimensionality based scale selection in 3D lidar point clouds"); from 0.2 to 0.35 it is mapped to 0 to 1.
    """
    sphericity = row_medians((spread[:, 0] / np.maximum(spread[:, 2], TINY)).take(neighbours))
    rise = (sphericity - POINTS.clean) / (POINTS.noisy - POINTS.clean)
    return np.clip(rise, 0, 1)
