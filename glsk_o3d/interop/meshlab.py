"""Skeletons for MeshLab."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .open3d import require

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def to_pymeshlab(skeleton: Skeleton) -> Any:
    """A skeleton as a mesh of vertices and edges, to be added to a ``pymeshlab.MeshSet``.

    MeshLab's own PLY writer drops edges; its OBJ writer keeps them. `Skeleton.save` writes both.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    pymeshlab.Mesh
        ``vertex_matrix()`` (M, 3), ``edge_matrix()`` (E, 2), and the radii as ``vertex_scalar_array()`` (M,), in the
        units and the order of the skeleton.

    Raises
    ------
    MissingPackageError
        pymeshlab (GPL-3, hence an extra: ``glsk-o3d[meshlab]``) or a library that it needs is not installed.
    """
    pymeshlab = require("pymeshlab", "glsk-o3d[meshlab]")
    return pymeshlab.Mesh(
        vertex_matrix=np.ascontiguousarray(skeleton.vertices),
        edge_matrix=np.ascontiguousarray(skeleton.edges, np.int32),
        v_scalar_array=np.ascontiguousarray(skeleton.radii),
    )
