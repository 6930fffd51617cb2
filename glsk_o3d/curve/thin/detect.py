"""Tell where a cloud shows no surface: where its parts are thinner than its points are far apart."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from ...data.graph import Graph
from ...data.points import POINTS, noise_share
from ...geometry.cycles import edges_on_cycles
from ...geometry.eigen import largest_eigenvalue
from ...geometry.grid_sampling import SAMPLED_POINTS, sample_cloud
from ...geometry.groups import component_labels, first_in_their_place, group_sum
from ...geometry.near_links import link_growth, near_links
from ...geometry.neighbourhoods import nearest_neighbours, principal
from ...geometry.numbers import derived, fitted, measured
from ...geometry.vectors import COLUMNS, ROWS, TINY
from ...geometry.winding import AREA_NEIGHBOURS
from ..axis.sections import VertexPoints
from ..curve import Curve
from ..merging import drop_vertices
from ..numbers import CURVE


@dataclass(frozen=True)
class ThinNumbers:
    """Numbers that tell where a cloud shows no surface."""

    least_surface: float = fitted(0.65, "share of the points of a region with a surface that show one")
    same_place: float = derived(1e-6, "share of the cloud's extent below which points are not apart")
    points: int = fitted(64, "points; fewer say nothing about where there is no surface")
    sheet_growth: float = fitted(2.2, "growth of links that a sheet surely has")
    region_points: int = fitted(1200, "points around a vertex of which a share must show a surface")
    region_vertices: int = measured(400, "vertices in which these are looked for")


THIN = ThinNumbers()

SURE_CONFIDENCE = 1 - CURVE.unsure  # derived: least in a stretch that surely has a surface


class SpacedPoints(VertexPoints):
    """The distinct points that have a vertex, or a sample of very many, and how far they are apart.

    Those without a normal are among them.
    """

    @cached_property
    def rows(self) -> np.ndarray:
        """Which input points they are."""
        points, owned = self.graph.points, np.flatnonzero(self.graph.vertex_of_point >= 0)
        if len(owned):
            owned = owned[sample_cloud(points[owned], SAMPLED_POINTS)[0]]
        wide = np.ptp(points[owned], axis=0).max() if len(owned) else 0.0
        return owned[first_in_their_place(np.rint(points[owned] / max(THIN.same_place * wide, TINY)))]

    @cached_property
    def links(self) -> csr_matrix:
        """Of near points."""
        return near_links(self.points)

    @cached_property
    def away(self) -> np.ndarray:
        """Distances to the nearest points, from the point itself to the one that gives the scale."""
        return nearest_neighbours(self.points, min(AREA_NEIGHBOURS + 1, len(self.points)))[0]

    @property
    def scattered(self) -> np.ndarray:
        """Whether each of them is one of many that fill space, (n,) bool array, as noise as wide as its part does."""
        near = nearest_neighbours(self.points, min(POINTS.ridge_neighbours, len(self.points)))[1]
        inner = self.points / max(np.ptp(self.points, axis=0).max(), TINY)  # whose fourth powers do not overflow
        return noise_share(principal(inner, near)[0], near) > 0


def without_surface(cloud: SpacedPoints, least: float) -> np.ndarray:
    """Vertices around which the cloud shows no surface, (M,) bool array.

    There the normals do not agree on an axis. Nor do they in noise; but it fills space, and from link to link there are
    more points than on a surface. Nor do they on a sheet; but there they agree with each other, and there are more
    points than along a curve. One vertex alone is not sure; but where this holds for more than ``1 - least`` of the
    points of a region, it is so. Where the confidence is unknown there is a surface. If more than `least` of all these
    points fill space, they are no twigs, but a part scattered as thick as it is wide, and there are no such vertices.
    """
    curve, m = cloud.graph, len(cloud.graph.vertices)
    thin = curve.confidence < CURVE.unsure
    if not may_lack_surface(curve, least) or len(cloud.rows) < THIN.points:
        return np.zeros(m, bool)
    vertex, count = cloud.vertex, cloud.count
    _, near = nearest_neighbours(curve.vertices, min(THIN.region_vertices, m))
    if (_share_around(near, count, thin) <= 1 - least).all():
        return np.zeros(m, bool)
    facts = np.column_stack([link_growth(cloud.links), one_direction(cloud.normals, cloud.links)])
    growth, flat = (group_sum(facts, vertex, m) / np.maximum(count, 1)[:, None]).T
    thin &= growth < np.where(flat < CURVE.sheet, CURVE.surface_growth, THIN.sheet_growth)
    thin = (_share_around(near, count, thin) > 1 - least) & ~_surely_with_surface(curve)
    of_points = thin[vertex]  # of none, if only vertices without points are thin
    return thin & (not of_points.any() or bool(cloud.scattered[of_points].mean() <= least))


def without_detached_clumps(curve: Curve) -> Curve:
    """The same without vertices that nothing is joined to and that have few points: clumps of flying ones, outliers.

    They are fewer than `THIN.points`, and than half of those of the largest component. Some edge must be left.
    """
    lone, owner, report = curve.degree == 0, curve.vertex_of_point, curve.report
    if not lone.any():
        return curve
    rows = curve.supporting_points
    rows = rows[first_in_their_place(curve.points[rows])]
    count = np.bincount(owner[rows], minlength=len(lone))
    strays = lone & (count < min(THIN.points, CURVE.majority * np.bincount(curve.component_of_vertex, count).max()))
    if not strays.any() or not len(curve.edges):
        return curve
    gone = np.append(strays, False)[owner] & ~np.isnan(curve.normals[:, 0])
    distinct = len(np.unique(curve.points[gone], axis=0))
    n_outliers, n_distinct = report.n_outliers + int(gone.sum()), report.n_distinct - distinct
    report = replace(report, n_outliers=n_outliers, n_distinct=n_distinct)
    normals = np.where(gone[:, None], np.nan, curve.normals)
    return drop_vertices(curve.changed(normals=normals, report=report), strays)


def may_lack_surface(curve: Graph, least: float) -> bool:
    """Whether vertices that are not sure where the axis is have so many points that one region may lack a surface."""
    if curve.report.n_mixed:  # then a part thinner than a pixel would be nothing but mixed pixels
        return False
    owner, m = curve.vertex_of_point[curve.vertex_of_point >= 0], len(curve.vertices)
    count = np.bincount(owner, minlength=m) / max(len(owner) / SAMPLED_POINTS, 1)
    return bool(count[curve.confidence < CURVE.unsure].sum() > (1 - least) * min(THIN.region_points, count.sum()))


def mostly_on_loops(curve: Graph, thin: np.ndarray) -> bool:
    """Whether most of some vertices are on loops, as in a frame of thin bars: from its root, paths would open all."""
    edges = curve.edges
    looped = edges_on_cycles(len(thin), edges)
    return bool(2 * thin[np.unique(edges[looped])].sum() > thin.sum())


def one_direction(normals: np.ndarray, links: csr_matrix) -> np.ndarray:
    """Share of one direction among the normals within two links of every point, (n,) float array.

    0.5 around a tube, and half a tube too, 1 on a plane; 0 without normals.
    """
    normals = np.nan_to_num(normals)
    along = normals[:, ROWS] * normals[:, COLUMNS]
    for _ in range(2):
        along = along + links.astype(bool) @ along
    return largest_eigenvalue(along.T) / np.maximum(along[:, ROWS == COLUMNS].sum(axis=1), TINY)


def _share_around(near: np.ndarray, count: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Share that some vertices have in the points of the region around every vertex, by its nearest ones."""
    points = count[near]
    points[np.cumsum(points, axis=1) - points >= THIN.region_points] = 0
    return (points * rows[near]).sum(axis=1) / np.maximum(points.sum(axis=1), 1)


def _surely_with_surface(curve: Graph) -> np.ndarray:
    """Vertices in stretches that surely have a surface, and are long for their radius."""
    m, ends, sure = len(curve.vertices), curve.edges, curve.confidence > SURE_CONFIDENCE
    inside = sure[ends].all(axis=1)
    stretch = component_labels(m, ends[inside])
    length = np.bincount(stretch[ends[inside, 0]], curve.edge_lengths[inside], m)
    radius = np.bincount(stretch, curve.radii, m) / np.maximum(np.bincount(stretch, minlength=m), 1)
    return sure & (length > CURVE.stub * radius)[stretch]
