"""Layers, as MeshLab calls the meshes it holds: what goes into a filter and what comes out."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError
from ..interop.atomic import write_atomically
from ..interop.clouds import cloud_points
from ..interop.packages import import_open3d, require
from ..io.formats import ply
from ..io.formats.graphs import graph_skeleton
from ..io.formats.ply import ply_elements
from ..io.paths import existing_file
from ..io.scan import COLOR_CHANNELS
from ..io.scans import read_scan
from ..io.skeletons import read_skeleton, save_skeleton, skeleton_ending
from ..skeleton import Skeleton
from ..state import Contraction

LAYER_ENDINGS = {"points": (".ply", ".pcd", ".xyz"), "mesh": (".ply", ".obj", ".off", ".stl")}
"""What layers without edges are written as."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Vertices with what hangs on them, (N, ...) arrays: MeshLab calls the scalars quality.

    Scalars are the radii of a skeleton, the multiplicities of a contracted cloud, the branches of a segmented one.
    Colours are red, green, blue and alpha from 0 to 1. `flow` is what our filters pass on, of which the vertices are
    the visible part, and `source` the layer that it was made from; `told` is what else there is to say of how.
    """

    vertices: np.ndarray
    faces: np.ndarray | None = None
    edges: np.ndarray | None = None
    normals: np.ndarray | None = None
    scalars: np.ndarray | None = None
    colors: np.ndarray | None = None
    label: str = "cloud"
    flow: Contraction | Skeleton | None = None
    source: Layer | None = None
    told: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, data: Any, label: str = "cloud", source: Layer | None = None) -> Layer:
        """The layer that shows a skeleton, a contraction or a cloud."""
        common: dict[str, Any] = dict(label=label, source=source)
        if isinstance(data, Skeleton):
            return cls(data.vertices, edges=data.edges, scalars=data.radii, flow=data, **common)
        if isinstance(data, Contraction):
            return cls(data.contracted, scalars=data.mass, flow=data, **common)
        return cls(cloud_points(data), **common)

    @classmethod
    def read(cls, path: str | os.PathLike) -> Layer:
        """A scan from a file that `read_cloud` reads, with the faces of a mesh and the quality of a PLY file.

        Of a PLY or OBJ file of lines the edges are kept. What STL repeats for every triangle becomes one vertex.
        """
        path = existing_file(path)
        held = _elements(path)
        if "edge" in held and "face" not in held:
            drawing = read_skeleton(path)
            edges = drawing.edges if len(drawing.edges) else None
            radii = None if np.isnan(drawing.radii).all() else drawing.radii
            return cls(drawing.vertices, edges=edges, scalars=radii, label=path.name)
        scan = read_scan(path)  # knows best what may be wrong with the file
        points, normals, faces, colors = scan.positions, scan.normals, scan.triangles, scan.colors
        if path.suffix.lower() == ".stl":
            o3d = import_open3d()
            mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(points), o3d.utility.Vector3iVector(faces))
            if normals is not None:
                mesh.vertex_normals = o3d.utility.Vector3dVector(normals)
            mesh.remove_duplicated_vertices()
            points, normals, faces = map(np.array, (mesh.vertices, mesh.vertex_normals, mesh.triangles))
        return cls(
            points,
            faces=faces if len(faces) else None,
            normals=normals,
            scalars=scan.attributes["quality"].astype(float) if "quality" in held.get("vertex", ()) else None,
            colors=None if colors is None else np.column_stack([colors, np.ones(len(colors))]),
            label=path.name,
        )

    @classmethod
    def of_mesh(cls, mesh: Any) -> Layer:
        """A ``pymeshlab.Mesh`` as its matrix shows it; what nobody has set, zeros or white, is left out."""
        normals, scalars, colors = mesh.vertex_normal_matrix(), mesh.vertex_scalar_array(), mesh.vertex_color_matrix()
        return cls(
            mesh.transformed_vertex_matrix(),
            faces=mesh.face_matrix() if mesh.face_number() else None,
            edges=mesh.edge_matrix().reshape(-1, 2) if mesh.edge_number() else None,
            normals=_turned(normals, mesh.transform_matrix()) if normals.any() else None,
            scalars=scalars if scalars.any() else None,
            colors=None if (colors == 1).all() else colors,
            label=mesh.label(),
        )

    def shows(self, other: Layer) -> bool:
        """Whether both have the same vertices and edges, so that the one's flow is still the other's."""
        none = np.empty((0, 2), int)
        mine, its = (none if layer.edges is None else layer.edges for layer in (self, other))
        return np.array_equal(self.vertices, other.vertices) and np.array_equal(mine, its)

    @property
    def is_skeleton(self) -> bool:
        """Whether it has vertices and edges alone, or is a skeleton of ours, of a single vertex perhaps."""
        return isinstance(self.flow, Skeleton) or (self.edges is not None and self.faces is None)

    @property
    def diagonal(self) -> float:
        """That of the axis-aligned bounding box of the finite vertices, 0 if there are none."""
        finite = self.vertices[np.isfinite(self.vertices).all(axis=1)]
        return math.hypot(*np.ptp(finite, axis=0)) if len(finite) else 0.0

    def summary(self) -> dict[str, Any]:
        """The layer in a few numbers, as MeshLab's filters return them."""
        found: dict[str, Any] = {"vertices": len(self.vertices)}
        flow = self.flow
        if isinstance(flow, Skeleton):
            found |= {"edges": len(flow.edges), "components": flow.n_components, "loops": flow.n_loops}
            found |= {"length": flow.length}
        elif self.colors is not None and self.scalars is not None:
            found["branches"] = int(self.scalars.max(initial=-1)) + 1
        found |= self.told
        if flow is not None and flow.report.stages:  # else it is from a file
            report = flow.report
            found |= {"iterations": len(report.iterations), "converged": report.converged}
            found |= {"stop_reason": report.stop_reason, "warnings": list(report.warnings)}
        return found

    def to_pymeshlab(self) -> Any:
        """The layer as a ``pymeshlab.Mesh``; MissingPackageError without pymeshlab."""
        pymeshlab = require("pymeshlab")
        given = dict(
            vertex_matrix=(self.vertices, float),
            face_matrix=(self.faces, np.int32),
            edge_matrix=(self.edges, np.int32),
            v_normals_matrix=(self.normals, float),
            v_scalar_array=(self.scalars, float),
            v_color_matrix=(self.colors, float),
        )
        arrays = {key: np.ascontiguousarray(array, kind) for key, (array, kind) in given.items() if array is not None}
        return pymeshlab.Mesh(**{key: array for key, array in arrays.items() if len(array)})

    def to_skeleton(self) -> Skeleton:
        """The skeleton that the layer shows: that of our filters, or else its vertices and edges with what is known."""
        if isinstance(self.flow, Skeleton):
            return self.flow
        return graph_skeleton(self.vertices, np.empty((0, 2)) if self.edges is None else self.edges, self.scalars)

    def save(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the layer, complete or not at all: a skeleton by `save_skeleton`, which has the options.

        Others by their endings: ``.ply`` with everything, the scalars as ``quality`` as MeshLab has it, ``.pcd`` in
        float32 with normals and colours, or ``.xyz``; a mesh also as ``.obj``, ``.off`` or ``.stl``.
        """
        path = Path(path)
        if self.is_skeleton:
            save_skeleton(self.to_skeleton(), path, **options)
            return
        check_ending(path, "points" if self.faces is None else "points or mesh")
        writers = {".ply": self._write_ply, ".xyz": self._write_xyz}
        write_atomically(path, writers.get(path.suffix.lower(), self._write_open3d))

    def _write_ply(self, path: Path) -> None:
        columns = dict(zip("xyz", self.vertices.T.astype(float), strict=True))
        if self.normals is not None:
            columns |= dict(zip(("nx", "ny", "nz"), self.normals.T.astype(float), strict=True))
        if self.colors is not None:
            shades = np.round(255 * self.colors[:, :3]).astype(np.uint8)
            columns |= dict(zip(COLOR_CHANNELS, shades.T, strict=True))
        if self.scalars is not None:
            columns["quality"] = np.asarray(self.scalars, float)
        vertices, said = ply.rows_of(columns), ""
        faces = np.empty(0 if self.faces is None else len(self.faces), [("n", "u1"), ("corners", "<i4", 3)])
        if len(faces):
            faces["n"], faces["corners"] = 3, self.faces
            said = f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
        header = ply.header_of(vertices.dtype, len(vertices), more=said)
        path.write_bytes(header + vertices.tobytes() + faces.tobytes())

    def _write_open3d(self, path: Path) -> None:
        o3d = import_open3d()
        points, normals, colors = (
            o3d.utility.Vector3dVector(np.empty((0, 3)) if array is None else np.ascontiguousarray(array[:, :3], float))
            for array in (self.vertices, self.normals, self.colors)
        )
        if path.suffix.lower() in LAYER_ENDINGS["points"]:
            cloud = o3d.geometry.PointCloud(points)
            cloud.normals, cloud.colors = normals, colors
            done = o3d.io.write_point_cloud(str(path), cloud)
        else:
            faces = o3d.utility.Vector3iVector(np.ascontiguousarray(self.faces, np.int32))
            mesh = o3d.geometry.TriangleMesh(points, faces)
            mesh.vertex_normals, mesh.vertex_colors = normals, colors
            if path.suffix.lower() == ".stl":
                mesh.compute_triangle_normals()
            done = o3d.io.write_triangle_mesh(str(path), mesh)
        if not done:
            raise FileFormatError(f"{path}: Open3D cannot write it")

    def _write_xyz(self, path: Path) -> None:
        np.savetxt(path, self.vertices, fmt="%.17g")


def _turned(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Normals as a layer's matrix shows them: they keep their lengths and stay normal where it is no rotation."""
    turned = normals @ np.linalg.pinv(matrix[:3, :3])
    before, after = (np.linalg.norm(vectors, axis=1, keepdims=True) for vectors in (normals, turned))
    return turned * np.divide(before, after, out=np.ones_like(after), where=after > 0)


def _elements(path: Path) -> dict[str, list[str]]:
    """What a PLY or OBJ file holds, with the properties of PLY."""
    if path.suffix.lower() == ".obj":  # without faces Open3D finds nothing in it
        with path.open("rb") as stream:
            return {"face" if any(line.split()[:1] == [b"f"] for line in stream) else "edge": []}
    return ply_elements(path) if path.suffix.lower() == ".ply" else {}


def check_ending(path: Path, what: str) -> None:
    """Raise FileFormatError unless the ending is that of a format for such a layer.

    `what` it may be is "skeleton", "points", "points or mesh", or "skeleton, points or mesh".
    """
    known = [ending for kind, endings in LAYER_ENDINGS.items() if kind in what for ending in endings]
    if path.suffix.lower() in known:
        return
    if "skeleton" in what:
        skeleton_ending(path)
    else:
        raise FileFormatError(f"{path}: unknown ending for {what}; known are {', '.join(dict.fromkeys(known))}")
