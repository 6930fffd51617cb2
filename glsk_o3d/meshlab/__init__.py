"""MeshLab: its filters and ours, one after the other, in Python and in filter scripts.

``script`` reads and writes .mlx, ``verbs`` are our filters under MeshLab's kind of names, ``builtin`` knows MeshLab's
own, ``steps`` brings them together, and ``meshset`` is ``pymeshlab.MeshSet`` with all of it. Only the last, and scripts
with MeshLab's own filters, need pymeshlab.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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
        pymeshlab (GPL-3, hence the extra ``meshlab``) or a library that it needs is not installed.
    """
    from .layers import Layer

    return Layer.of(skeleton).to_pymeshlab()
