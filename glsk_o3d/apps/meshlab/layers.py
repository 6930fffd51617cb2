"""Layers, as MeshLab calls the meshes it holds: what goes into a filter and what comes out."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.summary import summary
from ...data.skeleton import Skeleton
from ...errors import InvalidCloudError, InvalidParameterError
from ...interop.atomic import check_ending, write_atomically
from ...interop.clouds import SurfaceMesh, surface_mesh
from ...interop.packages import require
from ...io.formats import ply
from ...io.formats.graphs import graph_skeleton
from ...io.scans import read_scan
from ...io.skeletons import FORMATS, save_skeleton

LAYER_ENDINGS = {"skeleton": tuple(FORMATS), "points": (".ply", ".xyz"), "mesh": (".ply",)}
"""What layers are written as."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Vertices with what hangs on them, (N, ...) arrays: MeshLab calls the scalars quality.

    Scalars are the radii of a skeleton, or the branches of a segmented cloud. Colours are red, green, blue and alpha
    from 0 to 1. `skeleton` is what the vertices and edges show, `source` the layer that it was made from, and
    `results` what the filter returns.
    """

    vertices: np.ndarray
    faces: np.ndarray | None = None
    edges: np.ndarray | None = None
    normals: np.ndarray | None = None
    scalars: np.ndarray | None = None
    colors: np.ndarray | None = None
    label: str = "cloud"
    skeleton: Skeleton | None = None
    source: Layer | None = None
    results: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, data: Any, label: str = "cloud", source: Layer | None = None) -> Layer:
        """The layer that shows a skeleton or a cloud."""
        if isinstance(data, Skeleton):
            facts: dict[str, Any] = dict(edges=data.edges, scalars=data.radii, skeleton=data)
            return cls(data.vertices, label=label, source=source, **facts)
        vertices, faces = surface_mesh(data)
        return cls(vertices, faces=faces if len(faces) else None, label=label, source=source)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Layer:
        """A scan that `read_cloud` reads, with the faces of a mesh and the quality of points."""
        scan = read_scan(path)
        colors = scan.colors
        return cls(
            scan.positions,
            faces=scan.triangles if len(scan.triangles) else None,
            normals=scan.normals,
            scalars=scan.attributes["quality"].astype(float) if "quality" in scan.attributes else None,
            colors=None if colors is None else np.column_stack([colors, np.ones(len(colors))]),
            label=Path(path).name,
        )

    @classmethod
    def of_mesh(cls, mesh: Any) -> Layer:
        """A ``pymeshlab.Mesh`` as its matrix shows it; what nobody has set, zeros or white, is left out."""
        normals, scalars, colors = mesh.vertex_normal_matrix(), mesh.vertex_scalar_array(), mesh.vertex_color_matrix()
        turned = normals @ np.linalg.pinv(mesh.transform_matrix()[:3, :3])  # stay normal if it is no rotation
        return cls(
            mesh.transformed_vertex_matrix(),
            faces=mesh.face_matrix() if mesh.face_number() else None,
            edges=mesh.edge_matrix().reshape(-1, 2) if mesh.edge_number() else None,
            normals=turned if normals.any() else None,
            scalars=scalars if scalars.any() else None,
            colors=None if (colors == 1).all() else colors,
            label=mesh.label(),
        )

    @property
    def is_skeleton(self) -> bool:
        """Whether it has vertices and edges alone, or is a skeleton of ours, of a single vertex perhaps."""
        return self.skeleton is not None or (self.edges is not None and self.faces is None)

    @property
    def diagonal(self) -> float:
        """That of the axis-aligned bounding box of the finite vertices, 0 if there are none."""
        finite = self.vertices[np.isfinite(self.vertices).all(axis=1)]
        return math.hypot(*np.ptp(finite, axis=0)) if len(finite) else 0.0

    def shows(self, other: Layer) -> bool:
        """Whether both have the same vertices and edges, so that the one's skeleton is still the other's."""
        none = np.empty((0, 2), int)
        own_edges, other_edges = (none if layer.edges is None else layer.edges for layer in (self, other))
        return np.array_equal(self.vertices, other.vertices) and np.array_equal(own_edges, other_edges)

    def cloud(self) -> SurfaceMesh:
        """The vertices and faces of a layer that is a scan; InvalidCloudError for a skeleton."""
        if self.is_skeleton:
            what = "is a skeleton or another line drawing: make the scan the current layer"
            raise InvalidCloudError(f"the current layer ({self.label}) {what}")
        return SurfaceMesh(self.vertices, () if self.faces is None else self.faces)  # type: ignore[arg-type]

    def facts(self) -> dict[str, Any]:
        """The layer in a few numbers, as MeshLab's filters return them."""
        facts: dict[str, Any] = {"vertices": len(self.vertices), **self.results}
        skeleton = self.skeleton
        if skeleton is not None:
            run, report = summary(skeleton, 0.0), skeleton.report
            names = ("edges", "components", "loops", "length", "iterations", "converged", "stop_reason")
            facts |= {name: run[name] for name in names} | {"warnings": list(report.warnings)}
        elif self.colors is not None and self.scalars is not None:
            facts["branches"] = int(self.scalars.max(initial=-1)) + 1
        return facts

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
        if not len(self.vertices):
            raise InvalidParameterError(f"the {self.label} is empty: pymeshlab has no meshes without vertices")
        return pymeshlab.Mesh(**{key: array for key, array in arrays.items() if len(array)})

    def to_skeleton(self) -> Skeleton:
        """The skeleton that the layer shows: that of our filters, or else its vertices and edges with what is known."""
        if self.skeleton is not None:
            return self.skeleton
        return graph_skeleton(self.vertices, np.empty((0, 2)) if self.edges is None else self.edges, self.scalars)

    def save(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Write the layer, complete or not at all: a skeleton by `save_skeleton`, which has the options.

        Others as ``.ply`` with everything, the scalars as ``quality`` as MeshLab has it, or their vertices as ``.xyz``.
        """
        path = Path(path)
        if self.is_skeleton:
            save_skeleton(self.to_skeleton(), path, **options)
            return
        what = "points" if self.faces is None else "points or a mesh"
        check_ending(path, f"layer is {what}", *layer_endings(what))
        if path.suffix.lower() == ".xyz":
            write_atomically(path, lambda file: np.savetxt(file, self.vertices, "%.17g"))
            return
        colors = None if self.colors is None else self.colors[:, :3]
        known = {"positions": self.vertices, "normals": self.normals, "colors": colors, "quality": self.scalars}
        held = {name: np.asarray(values, float) for name, values in known.items() if values is not None}
        ply.save(path, held, self.faces if self.faces is not None and len(self.faces) else None)


def layer_endings(what: str) -> tuple[str, ...]:
    """Endings of files for such a layer: "a skeleton", "points", "points or a mesh", "a skeleton, points or a mesh"."""
    known = (ending for kind, endings in LAYER_ENDINGS.items() if kind in what for ending in endings)
    return tuple(dict.fromkeys(known))


def to_pymeshlab(skeleton: Skeleton) -> Any:
    """A skeleton as a ``pymeshlab.Mesh`` of vertices and edges, with the radii as vertex scalars.

    MeshLab's own PLY writer drops edges, its OBJ writer keeps them; `glsk_o3d.save_skeleton` writes both.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    pymeshlab.Mesh

    Raises
    ------
    MissingPackageError
        Without the extra ``meshlab``.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> to_pymeshlab(ring).edge_number() == len(ring.edges)
    True
    """
    return Layer.of(skeleton).to_pymeshlab()
