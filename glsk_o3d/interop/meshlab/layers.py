"""Layers, as MeshLab calls the meshes it holds: what goes into a filter and what comes out."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileFormatError
from ...skeleton import Skeleton
from ...state import Contraction
from ..files import graph_skeleton, save_skeleton, skeleton_ending, write_atomically
from ..open3d import cloud_points, import_open3d, require

CLOUD_ENDINGS = (".ply", ".pcd", ".xyz")
MESH_ENDINGS = (".ply", ".obj", ".off", ".stl")


@dataclass(frozen=True, eq=False)
class Layer:
    """Vertices with what hangs on them.

    Attributes
    ----------
    vertices : (N, 3) float64 array
    faces : (F, 3) int array or None
    edges : (E, 2) int array or None
    normals : (N, 3) float array or None
    scalars : (N,) float array or None
        One number per vertex, which MeshLab calls quality: radii of a skeleton, multiplicities of a contracted cloud,
        branches of a segmented one.
    colors : (N, 4) float array or None
        Red, green, blue and alpha from 0 to 1.
    label : str
    flow : Contraction or Skeleton or None
        What our filters pass on, of which the vertices are the visible part.
    source : Layer or None
        The layer from which the flow was made.
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

    @classmethod
    def of(cls, data: Any, label: str = "cloud", source: Layer | None = None) -> Layer:
        """The layer that shows a skeleton, a contraction or a cloud.

        Parameters
        ----------
        data : Skeleton, Contraction or cloud
        label : str
        source : Layer, optional

        Returns
        -------
        Layer
        """
        common: dict[str, Any] = dict(label=label, source=source)
        if isinstance(data, Skeleton):
            return cls(data.vertices, edges=data.edges, scalars=data.radii, flow=data, **common)
        if isinstance(data, Contraction):
            return cls(data.contracted, scalars=data.mass, flow=data, **common)
        return cls(cloud_points(data), **common)

    def shows(self, other: Layer) -> bool:
        """Whether both have the same vertices and edges, so that the one's flow is still the other's."""
        none = np.empty((0, 2), int)
        mine, its = (none if layer.edges is None else layer.edges for layer in (self, other))
        return np.array_equal(self.vertices, other.vertices) and np.array_equal(mine, its)

    def to_pymeshlab(self) -> Any:
        """The layer as a ``pymeshlab.Mesh``.

        Raises
        ------
        MissingPackageError
        """
        pymeshlab = require("pymeshlab", "glsk-o3d[meshlab]")
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
        """Write the layer: one with edges as `save_skeleton` does, points with scalars and colours as a cloud.

        Parameters
        ----------
        path : path-like
            The ending of a skeleton's format; for points ``.ply`` (with the scalars as the property ``quality``, as
            MeshLab has it), ``.pcd`` (float32, with colours) or ``.xyz``.
        **options
            As in `save_skeleton`.

        Raises
        ------
        FileFormatError
            The ending is that of no format, or of none for such a layer.
        OSError
            The file cannot be written.
        """
        path = Path(path)
        if self.edges is not None:
            save_skeleton(self.to_skeleton(), path, **options)
            return
        check_ending(path)
        writers = {".ply": self._write_ply, ".pcd": self._write_pcd, ".xyz": self._write_xyz}
        write_atomically(path, writers[path.suffix.lower()])

    def _write_ply(self, path: Path) -> None:
        o3d = import_open3d()
        columns = {
            "normals": (self.normals, float),
            "colors": (None if self.colors is None else np.round(255 * self.colors[:, :3]), np.uint8),
            "quality": (None if self.scalars is None else self.scalars[:, None], float),
        }
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(self.vertices, float)))
        for name, (array, kind) in columns.items():
            if array is not None:
                cloud.point[name] = o3d.core.Tensor(np.ascontiguousarray(array, kind))
        if not o3d.t.io.write_point_cloud(str(path), cloud):
            raise FileFormatError(f"{path}: Open3D cannot write it")

    def _write_pcd(self, path: Path) -> None:
        o3d = import_open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.ascontiguousarray(self.vertices, float)))
        if self.colors is not None:
            cloud.colors = o3d.utility.Vector3dVector(np.ascontiguousarray(self.colors[:, :3], float))
        if not o3d.io.write_point_cloud(str(path), cloud):
            raise FileFormatError(f"{path}: Open3D cannot write it")

    def _write_xyz(self, path: Path) -> None:
        np.savetxt(path, self.vertices, fmt="%.17g")


def check_ending(path: Path, edges: bool | None = False) -> None:
    """Raise FileFormatError unless the ending is that of a format for such a layer.

    Parameters
    ----------
    path : Path
    edges : bool or None
        Whether the layer has edges; None where that is not known yet, and it may also have faces.
    """
    if edges or (edges is None and path.suffix.lower() not in CLOUD_ENDINGS + MESH_ENDINGS):
        skeleton_ending(path)
    elif edges is False and path.suffix.lower() not in CLOUD_ENDINGS:
        raise FileFormatError(f"{path}: unknown ending for points; known are {', '.join(CLOUD_ENDINGS)}")
