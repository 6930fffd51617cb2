"""MeshLab: its filters and ours, one after the other, in Python and in filter scripts.

``script`` reads and writes .mlx, ``verbs`` and ``edits`` are our filters under MeshLab's kind of names, ``builtin``
knows MeshLab's own, ``steps`` brings them together, and ``meshset`` is ``pymeshlab.MeshSet`` with all of it. Only the
last, and scripts with MeshLab's own filters, need pymeshlab.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..skeleton import Skeleton


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
    from .layers import Layer

    return Layer.of(skeleton).to_pymeshlab()
