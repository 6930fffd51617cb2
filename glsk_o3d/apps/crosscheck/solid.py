"""The solid whose surface a cloud is: a mesh of its own, and what it is like."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...errors import InvalidCloudError
from ...geometry.frame import MIN_POINTS, Frame
from ...geometry.neighbourhoods import spacing
from ...interop.clouds import SurfaceMesh, to_point_cloud
from ...interop.packages import import_open3d, require
from ...interop.poisson import CELL, poisson_mesh

SLIVER = 1e-12  # precision: of the mean area of triangles
LEAST_CELLS = 4  # derived: across a surface: the octree is at least two deep
REACH = 2.5  # fitted: cells from the nearest point: what is farther away is no surface
LEAST_PART = 0.02  # fitted: of the area of the largest: smaller ones are bubbles
BALL_RADII = (1.0, 2.0, 4.0)  # fitted: of the rolling balls, in spacings
LONGEST_EDGE = 3.0  # fitted: of a given mesh, in spacings, for its Laplacian to be that of the surface
TRIANGLES, MOST_TIMES = 10, 3  # speed: of a given mesh, in a square of a spacing, and that many times as many
MOST_VERTICES = 50_000  # speed: of a given mesh whose edges were halved


class Part(NamedTuple):
    """A connected part of a mesh."""

    area: float
    volume: float | None  # None if it has borders
    genus: int
    borders: int

    @property
    def is_cavity(self) -> bool:
        """Whether it is the wall of a cavity: its normals point inward."""
        return self.volume is not None and self.volume < 0


@dataclass(frozen=True, eq=False)
class Solid:
    """A mesh that a cloud is checked against."""

    vertices: np.ndarray  # (V, 3) float64
    faces: np.ndarray  # (F, 3) int64, anticlockwise from outside; a manifold
    made_by: str  # "poisson", "ball_pivoting" or "given"

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The connected parts, the largest area first."""
        igl, parts = require("igl"), []
        n_parts, part_of_face = igl.facet_components(self.faces)
        for part in range(n_parts):
            vertices, faces, *_ = igl.remove_unreferenced(self.vertices, self.faces[part_of_face == part])
            area, borders = float(igl.doublearea(vertices, faces).sum() / 2), len(igl.boundary_loop_all(faces))
            corners = vertices[faces] - vertices.mean(axis=0)
            volume = None if borders else float(np.linalg.det(corners).sum() / 6)
            parts.append(Part(area, volume, (2 - borders - int(igl.euler_characteristic(faces))) // 2, borders))
        return tuple(sorted(parts, key=lambda part: -part.area))

    @property
    def is_watertight(self) -> bool:
        """Whether no part has a border."""
        return not any(part.borders for part in self.parts)

    @property
    def n_solids(self) -> int:
        """Parts that are not walls of cavities."""
        return sum(not part.is_cavity for part in self.parts)

    @property
    def genus(self) -> int:
        """Handles of the solids: the loops that a skeleton has."""
        return sum(part.genus for part in self.parts if not part.is_cavity)

    @classmethod
    def of(cls, mesh: Any, made_by: str, *, orient: bool = False, least_part: float = 0.0) -> Solid:
        """That of an Open3D mesh, split where it is no manifold; InvalidCloudError if there is hardly any surface."""
        igl = require("igl")
        mesh.remove_duplicated_vertices()
        mesh.remove_duplicated_triangles()
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles, np.int64)
        area = igl.doublearea(vertices, faces) if len(faces) else np.empty(0)
        faces = faces[area > SLIVER * area.mean()] if len(faces) else faces
        if len(faces) < MIN_POINTS:
            raise InvalidCloudError(f"only {len(faces)} triangles have an area: there is no surface to compare with")
        vertices, faces, *_ = igl.split_nonmanifold(vertices, igl.bfs_orient(faces)[0] if orient else faces)
        part = igl.facet_components(faces)[1]
        area = np.bincount(part, igl.doublearea(vertices, faces))
        vertices, faces, *_ = igl.remove_unreferenced(vertices, faces[(area >= least_part * area.max())[part]])
        inside_out = next((part.is_cavity for part in cls(vertices, faces, made_by).parts if not part.borders), False)
        return cls(vertices, faces[:, ::-1].copy() if inside_out else faces, made_by)


def poisson(points: np.ndarray, outward: np.ndarray, edge: float) -> Solid:
    """A mesh through points (n, 3) with outward normals, with vertices of its own (Kazhdan and Hoppe 2013).

    `edge` is the spacing that its cells go by. What is far from all points is left out, and so are small parts.
    """
    cell = CELL * edge
    if cell > np.ptp(points, axis=0).max() / LEAST_CELLS:
        raise InvalidCloudError(f"{len(points)} points are too few for a surface to be reconstructed")
    mesh = poisson_mesh(points, outward, edge)
    mesh.remove_vertices_by_mask(cKDTree(points).query(np.asarray(mesh.vertices))[0] > REACH * cell)
    return Solid.of(mesh, "poisson", least_part=LEAST_PART)


def ball_pivoting(points: np.ndarray, outward: np.ndarray) -> Solid:
    """A mesh with the points (n, 3) as vertices (Bernardini et al. 1999)."""
    o3d, cloud = import_open3d(), to_point_cloud(points)
    cloud.normals = o3d.utility.Vector3dVector(outward)
    radii = o3d.utility.DoubleVector(spacing(points) * np.array(BALL_RADII))
    return Solid.of(o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii), "ball_pivoting")


def given(surface: SurfaceMesh, frame: Frame, edge: float) -> Solid | None:
    """A mesh of the user's in the working frame, simplified if much finer than the points, its edges halved if coarser.

    None if that makes too many, or if it has no triangles; InvalidCloudError if it is not finite or has no area.
    """
    if len(surface.triangles) == 0:
        return None
    if not np.isfinite(surface.vertices).all():
        raise InvalidCloudError("the mesh has coordinates that are not finite")
    o3d, igl = import_open3d(), require("igl")
    vertices = o3d.utility.Vector3dVector(frame.into(surface.vertices))
    mesh = o3d.geometry.TriangleMesh(vertices, o3d.utility.Vector3iVector(surface.triangles))
    enough = int(TRIANGLES * mesh.get_surface_area() / edge**2)
    if len(surface.triangles) > MOST_TIMES * enough:
        return Solid.of(mesh.simplify_quadric_decimation(enough), "given", orient=True)
    solid = Solid.of(mesh, "given", orient=True)
    while igl.edge_lengths(solid.vertices, solid.faces).max() > LONGEST_EDGE * edge:
        if len(solid.vertices) > MOST_VERTICES / 4:
            return None
        vertices, faces = igl.upsample(solid.vertices, solid.faces, 1)
        solid = Solid(vertices, faces, "given")
    return solid
