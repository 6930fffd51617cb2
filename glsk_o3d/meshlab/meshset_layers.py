"""The layers of a MeshSet as our filters see them, and their files."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ..interop.atomic import write_atomically
from ..interop.packages import require
from ..io.paths import CLOUD_ENDINGS, MESH_ENDINGS, existing_file
from ..io.skeletons import save_skeleton, skeleton_ending
from ..skeleton import Skeleton
from .layers import Layer

pymeshlab = require("pymeshlab")


class LayeredMeshSet(pymeshlab.MeshSet):  # type: ignore[name-defined]
    """``pymeshlab.MeshSet`` whose layers remember what our filters made them from."""

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._flows: dict[int, Layer] = {}

    def add_points(self, points: Any, name: str = "cloud") -> None:
        """Add a cloud as a new layer, which becomes the current one.

        Parameters
        ----------
        points : cloud
            Anything that `glsk_o3d.skeletonize` takes.
        name : str
        """
        self.add_mesh(Layer.of(points).to_pymeshlab(), name)

    def layer(self, number: int = -1) -> Layer:
        """A layer as our filters see it, with what they passed on if its vertices and edges are unchanged since.

        Parameters
        ----------
        number : int
            Its id; -1 is the current layer.

        Returns
        -------
        Layer

        Raises
        ------
        InvalidCloudError
            There is no layer at all.
        InvalidParameterError
            There is none of that id.
        """
        if not self.mesh_number():
            raise InvalidCloudError("there is no layer: load a scan first")
        number = self.current_mesh_id() if number == -1 else number
        if not self.mesh_id_exists(number):
            raise InvalidParameterError(f"layer = {number}: there is no such layer")
        mesh = self.mesh(number)
        scalars = mesh.vertex_scalar_array()
        layer = Layer(
            mesh.transformed_vertex_matrix(),
            faces=mesh.face_matrix() if mesh.face_number() else None,
            edges=mesh.edge_matrix().reshape(-1, 2) if mesh.edge_number() else None,
            normals=_unless(_turned(mesh.vertex_normal_matrix(), mesh.transform_matrix()), 0),
            scalars=_unless(scalars, 0),
            colors=_unless(mesh.vertex_color_matrix(), 1),
            label=mesh.label(),
        )
        known = self._flows.get(number)
        if known is None or not known.shows(layer):
            return layer
        flow = known.flow
        if isinstance(flow, Skeleton) and not np.array_equal(scalars, flow.radii, equal_nan=True):
            flow = replace(flow, radii=scalars, half_width=scalars, half_thickness=scalars)
        return replace(layer, edges=known.edges, flow=flow, source=known.source)

    def current_skeleton(self) -> Skeleton:
        """The skeleton in the current layer; its radii are the layer's scalars.

        It has its report and its points if nothing changed its vertices and edges since they were made.

        Raises
        ------
        InvalidCloudError
            The layer has no edges.
        """
        layer = self.layer()
        if layer.edges is None:
            raise InvalidCloudError(f"the current layer ({layer.label}) has no edges: it is no skeleton")
        return layer.to_skeleton()

    def save_current_mesh(self, file_name: str | os.PathLike, *args: Any, **kwargs: Any) -> None:
        """Write the current layer. Without options, edges and their radii survive in PLY, which MeshLab would drop.

        Parameters
        ----------
        file_name : path-like
            MeshLab's endings; for a layer of vertices and edges also those of `glsk_o3d.save_skeleton`.
        *args, **kwargs
            As pymeshlab has them; with any of them the layer is written by MeshLab.
        """
        if not args and not kwargs and self.current_mesh().edge_number() and not self.current_mesh().face_number():
            try:
                skeleton_ending(Path(file_name))
            except FileFormatError:
                pass
            else:
                save_skeleton(self.current_skeleton(), file_name)
                return
        super().save_current_mesh(os.fspath(file_name), *args, **kwargs)

    def save(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the current layer, complete or not at all: by MeshLab if it has faces, else as `Layer.save`.

        Parameters
        ----------
        path : path-like
        **options
            As in `glsk_o3d.save_skeleton`.

        Raises
        ------
        FileFormatError, OSError
        """
        layer = self.layer()
        if layer.faces is None or Path(path).suffix.lower() in (".pcd", ".xyz"):  # which hold no faces
            layer.save(path, **options)
            return
        try:
            write_atomically(path, lambda temporary: super(LayeredMeshSet, self).save_current_mesh(str(temporary)))
        except pymeshlab.PyMeshLabException as error:
            raise FileFormatError(f"{path}: MeshLab cannot write it: {' '.join(str(error).split())}") from error

    def load_scan(self, path: str | os.PathLike) -> None:
        """Add a scan as a new layer: what `Layer.read` reads as it does, all else by MeshLab.

        Parameters
        ----------
        path : path-like
            Of formats that both read, `load_new_mesh` also has colours of faces and textures.

        Raises
        ------
        FileNotFoundError, FileFormatError
        """
        path = existing_file(path)
        try:
            if path.suffix.lower() in CLOUD_ENDINGS + MESH_ENDINGS:
                self.add_mesh(Layer.read(path).to_pymeshlab(), path.name)
                return
            self.load_new_mesh(str(path))
        except pymeshlab.PyMeshLabException as error:
            raise FileFormatError(f"{path}: MeshLab cannot read it: {' '.join(str(error).split())}") from error
        if not self.current_mesh().vertex_number():
            raise FileFormatError(f"{path}: no points could be read")

    def clear(self) -> None:
        """Remove all layers."""
        super().clear()
        self._flows = {}


def _unless(array: np.ndarray, blank: float) -> np.ndarray | None:
    """What every layer has, or nothing if it was never set."""
    return None if (array == blank).all() else array


def _turned(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Normals as a layer's matrix shows them: they keep their lengths and stay normal where it is no rotation."""
    turned = normals @ np.linalg.pinv(matrix[:3, :3])
    before, after = (np.linalg.norm(vectors, axis=1, keepdims=True) for vectors in (normals, turned))
    return turned * np.divide(before, after, out=np.ones_like(after), where=after > 0)
