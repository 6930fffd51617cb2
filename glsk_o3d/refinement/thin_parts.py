"""Tell where a cloud shows no surface: where its parts are thinner than its points are far apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix

from ..numerics.components import component_labels
from ..numerics.eigen import largest_eigenvalue
from ..numerics.near_links import link_growth
from ..numerics.neighbourhoods import nearest_neighbours
from ..numerics.vectors import COLUMNS, ROWS, TINY
from ..skeleton import Skeleton

SURFACE_GROWTH = 25 / 9  # derived: growth of links on a surface; noise that fills space has more
CURVE_GROWTH = 20 / 9  # derived: half way to that along a curve
# All fitted.
SHY = 0.3  # confidence below which the normals around a vertex do not say where the axis is
SHEET = 0.9  # share of one direction among the normals of a sheet
REGION_POINTS = 1200  # around a vertex, of which a share must show a surface
REGION_VERTICES = 400  # in which these are looked for
FIRM = 0.6  # confidence of a stretch that is a surface, whatever is around it
FIRM_LENGTH = 4.0  # and its length over its radius


def without_surface(
    skeleton: Skeleton, vertex: np.ndarray, normals: np.ndarray, links: Callable[[], csr_matrix], least: float
) -> np.ndarray:
    """Vertices around which the cloud shows no surface, (M,) bool array.

    There the normals do not agree on an axis. Nor do they where noise has tilted them; but it fills space, and from
    link to link there are more points than on a surface. Nor do they on a sheet; but there they agree with each other,
    and there are more points than along a curve. That is not sure of one vertex alone, and holds at every junction; but
    where it holds for a share of the points of a region, it is so.

    Parameters
    ----------
    skeleton : Skeleton
        With the confidence of `fit_axis`; where it is unknown there is a surface.
    vertex : (n,) int array
        Of every point.
    normals : (n, 3) float array
        NaN where there is none.
    links : callable
        Gives the links between near points; only called if the normals leave a doubt.
    least : float
        Share of the points in the region around a vertex that must show a surface.
    """
    m = len(skeleton.vertices)
    count, thin = np.bincount(vertex, minlength=m), skeleton.confidence < SHY
    if not (_share_around(skeleton.vertices, count, thin) > 1 - least).any():
        return np.zeros(m, bool)
    facts = link_growth(links()), one_direction(normals, links())
    growth, flat = (np.bincount(vertex, fact, m) / np.maximum(count, 1) for fact in facts)
    thin &= growth < np.where(flat < SHEET, SURFACE_GROWTH, CURVE_GROWTH)
    return (_share_around(skeleton.vertices, count, thin) > 1 - least) & ~_firm(skeleton)


def one_direction(normals: np.ndarray, links: csr_matrix) -> np.ndarray:
    """Share of one direction among the normals within two links of every point, (n,) float array.

    0.5 around a tube, and half a tube too, 1 on a plane; 0 without normals.
    """
    normals = np.nan_to_num(normals)
    along = normals[:, ROWS] * normals[:, COLUMNS]
    for _ in range(2):
        along = along + links.astype(bool) @ along
    total = along[:, ROWS == COLUMNS].sum(axis=1)
    return largest_eigenvalue(along.T) / np.maximum(total, TINY)


def _share_around(vertices: np.ndarray, count: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Share that some vertices have in the points of the region around every vertex."""
    _, near = nearest_neighbours(vertices, min(REGION_VERTICES, len(vertices)))
    points = count[near]
    points[np.cumsum(points, axis=1) - points >= REGION_POINTS] = 0
    return (points * some[near]).sum(axis=1) / np.maximum(points.sum(axis=1), 1)


def _firm(skeleton: Skeleton) -> np.ndarray:
    """Vertices in stretches that surely have a surface, and are long for their radius."""
    m, ends, sure = len(skeleton.vertices), skeleton.edges, skeleton.confidence > FIRM
    inside = sure[ends].all(axis=1)
    stretch = component_labels(m, ends[inside])
    length = np.bincount(stretch[ends[inside, 0]], skeleton.edge_lengths[inside], m)
    radius = np.bincount(stretch, skeleton.radii, m) / np.maximum(np.bincount(stretch, minlength=m), 1)
    return sure & (length > FIRM_LENGTH * radius)[stretch]
