"""Points on the surface of a mesh, evenly by area, and whether its vertices would do as well."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from .groups import first_in_their_place
from .morton import morton_order
from .vectors import cross, finite_rows, norm, unit

PLASTIC = 1.32471795724474602596  # derived: the root of x^3 = x + 1, whose powers step evenly through a square
ASKED_PLACES = 4096  # precision: places on a mesh that say to a percent how much of its area is in long triangles
HAIR = 1 + 1e-9  # derived: on grids edges are as long as neighbourhoods are wide


SurfaceSample: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, float]
"""Places on a mesh, the corners of the triangle of each and its normal, (n, 3) arrays; and the area of the mesh."""


@np.errstate(all="ignore")  # of clouds that will be refused for their size
def sample_by_area(vertices: np.ndarray, triangles: np.ndarray, n: int) -> SurfaceSample:
    """n places on the finite triangles of a mesh, or none if these have no area.

    Nothing is random: every n-th of the area, along a Morton curve through the triangles, has one place, and those in
    one triangle follow the R2 sequence (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    """
    triangles = triangles[finite_rows(vertices)[triangles].all(axis=1)] if n else triangles[:0]
    if len(triangles):
        triangles = triangles[morton_order(vertices[triangles].mean(axis=1))]
    side = float(np.abs(vertices[triangles]).max(initial=0)) or 1.0  # squares of unit numbers do not overflow
    a, b, c = (vertices[corner] / side for corner in triangles.T)
    doubled = np.append(0.0, norm(cross(b - a, c - a))).cumsum()
    step = np.arange(n if doubled[-1] > 0 else 0)
    row = np.searchsorted(doubled[1:], (step + 0.5) / max(n, 1) * doubled[-1], side="right")
    u, v = (0.5 + step[:, None] / PLASTIC ** np.array([1, 2])).T[..., None] % 1
    u, v = (np.where(u + v > 1, 1 - each, each) for each in (u, v))  # the other half of the square
    a, b, c = (vertices[corner] for corner in triangles[row].T)
    normals = unit(cross((b - a) / side, (c - a) / side))
    return a + u * (b - a) + v * (c - a), triangles[row], normals, float(doubled[-1] / 2 * side**2)


def vertices_mislead(mesh: tuple[np.ndarray, np.ndarray], neighbours: Callable[[int], int], enough: int) -> bool:
    """Whether the vertices of a mesh, taken for a cloud, leave most of the area of its triangles unseen.

    Unseen is a triangle with an edge longer than the neighbourhoods of its corners, of so many `neighbours` as a cloud
    of so many points has, or than those of `enough` points spread evenly. A mesh is a cloud where most vertices are in
    no triangle, or hardly two triangles have a corner in common.
    """
    vertices, triangles = mesh
    step = len(triangles) // (16 * ASKED_PLACES) + 1
    _, corners, _, area = sample_by_area(vertices, triangles[::step], ASKED_PLACES)
    used = vertices[np.flatnonzero(np.bincount(triangles.ravel()))]
    if not len(corners) or 2 * len(used) <= len(vertices):
        return False
    used, ends = used[finite_rows(used)], vertices[corners]
    distinct = used[first_in_their_place(used)]
    if len(distinct) > 2 * len(triangles):
        return False
    longest = np.max([norm(ends[:, i] - ends[:, i - 1]) for i in range(3)], axis=0)
    reach = cKDTree(distinct, balanced_tree=False).query(ends, [neighbours(len(distinct))])[0].max(axis=(1, 2))
    widest = np.sqrt(neighbours(enough) / enough * step * area / np.pi)
    return bool(np.mean(longest > HAIR * np.minimum(reach, widest)) > 0.5)
