"""Points on the surface of a mesh, evenly by area, and whether its vertices would do as well."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .groups import first_in_their_place
from .morton import morton_order
from .vectors import cross, finite_rows, norm, unit

PLASTIC = 1.32471795724474602596  # derived: the root of x^3 = x + 1, whose powers step evenly through a square
ASKED_PLACES = 4096  # precision: places on a mesh that say to a percent how much of its area is in long triangles
HAIR = 1 + 1e-9  # derived: on grids edges are as long as neighbourhoods are wide


class SurfaceSample(NamedTuple):
    places: np.ndarray  # (n, 3)
    corners: np.ndarray  # (n, 3) vertices of the triangle of each
    normals: np.ndarray  # (n, 3) of the triangle of each
    area: float  # of the whole mesh


@np.errstate(all="ignore")  # of clouds that will be refused for their size
def sample_by_area(vertices: np.ndarray, triangles: np.ndarray, n: int) -> SurfaceSample:
    """n places on the finite triangles (t, 3) of a mesh, none of them random, or no places if these have no area.

    Every n-th of the area, along a Morton curve through the triangles, has one place, and those in one triangle follow
    the R2 sequence (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
    """
    triangles = triangles[finite_rows(vertices)[triangles].all(axis=1)] if n else triangles[:0]
    triangles = triangles[morton_order(vertices[triangles].mean(axis=1))] if len(triangles) else triangles
    side = float(np.abs(vertices[triangles]).max(initial=0)) or 1.0  # squares of unit numbers do not overflow
    a, b, c = (vertices[corner] / side for corner in triangles.T)
    doubled = np.append(0.0, norm(cross(b - a, c - a))).cumsum()
    step = np.arange(n if doubled[-1] > 0 else 0)
    row = np.searchsorted(doubled[1:], (step + 0.5) / max(n, 1) * doubled[-1], side="right")
    u, v = (0.5 + step[:, None] / PLASTIC ** np.array([1, 2])).T[..., None] % 1
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))  # the other half of the square
    a, b, c = (vertices[corner] for corner in triangles[row].T)
    normals = unit(cross((b - a) / side, (c - a) / side))
    return SurfaceSample(a + u * (b - a) + v * (c - a), triangles[row], normals, float(doubled[-1] / 2 * side**2))


def vertices_mislead(mesh: tuple[np.ndarray, np.ndarray], neighbours: Callable[[int], int], enough: int) -> bool:
    """Whether the vertices of a mesh, taken for a cloud, leave most of the area of its triangles unseen.

    Unseen is a triangle with an edge longer than the neighbourhoods of its corners, of as many `neighbours` as a cloud
    of that many points has, or than those of `enough` points spread evenly. A mesh is a cloud where most vertices are
    in no triangle, or hardly two triangles have a corner in common.
    """
    vertices, triangles = mesh
    step = len(triangles) // (16 * ASKED_PLACES) + 1
    sample = sample_by_area(vertices, triangles[::step], ASKED_PLACES)
    used = vertices[np.flatnonzero(np.bincount(triangles.ravel()))]
    if not len(sample.corners) or 2 * len(used) <= len(vertices):
        return False
    used, ends = used[finite_rows(used)], vertices[sample.corners]
    distinct = used[first_in_their_place(used)]
    if len(distinct) > 2 * len(triangles):
        return False
    longest = np.max([norm(ends[:, i] - ends[:, i - 1]) for i in range(3)], axis=0)
    reach = cKDTree(distinct, balanced_tree=False).query(ends, [neighbours(len(distinct))])[0].max(axis=(1, 2))
    widest = np.sqrt(neighbours(enough) / enough * step * sample.area / np.pi)
    return bool(np.mean(longest > HAIR * np.minimum(reach, widest)) > 0.5)
