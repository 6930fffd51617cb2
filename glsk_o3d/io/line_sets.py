"""Skeletons as Open3D's line sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.segmentation import branch_of_edge
from ..interop.packages import import_open3d
from ..skeleton import OF_VERTICES
from .colors import ColorChoice, shades

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def to_line_set(skeleton: Skeleton, color: ColorChoice = "branch") -> Any:
    """A skeleton as a legacy line set, coloured by what is known of it.

    Parameters
    ----------
    skeleton : Skeleton
    color : {"branch", "order", "radius", "confidence", "support", "thickness"} or three floats in [0, 1]
        What the colours of the edges show, or the one colour of all; see `glsk_o3d.io.colors.shades`.

    Returns
    -------
    open3d.geometry.LineSet

    Raises
    ------
    InvalidParameterError, MissingPackageError

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> len(to_line_set(ring, "radius").colors) == len(ring.edges)
    True
    """
    lines = skeleton.to_line_set()
    lines.colors = import_open3d().utility.Vector3dVector(_rows(_edge_colors(skeleton, color), float, 3))
    return lines


def to_tensor_line_set(skeleton: Skeleton, color: ColorChoice | None = None) -> Any:
    """A skeleton as a tensor line set on the CPU, with all that is known of its vertices and edges.

    Parameters
    ----------
    skeleton : Skeleton
    color : as of `to_line_set`, optional

    Returns
    -------
    open3d.t.geometry.LineSet
        With ``point.positions`` (M, 3), ``point.radius``, ``point.confidence``, ``point.half_width``,
        ``point.half_thickness`` and ``point.support`` (M, 1) float64, ``line.indices`` (E, 2) int64, ``line.branch``
        (E, 1) int32 and, with a color, ``line.colors`` (E, 3) float64.

    Raises
    ------
    InvalidParameterError, MissingPackageError

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> to_tensor_line_set(ring).line.branch.shape[0] == len(ring.edges)
    True
    """
    o3d = import_open3d()
    lines = o3d.t.geometry.LineSet()
    lines.point.positions = o3d.core.Tensor(_rows(skeleton.vertices, float, 3))
    lines.point.radius = o3d.core.Tensor(_rows(skeleton.radii, float, 1))
    for name in OF_VERTICES[1:]:
        lines.point[name] = o3d.core.Tensor(_rows(getattr(skeleton, name), float, 1))
    lines.line.indices = o3d.core.Tensor(_rows(skeleton.edges, np.int64, 2))
    lines.line.branch = o3d.core.Tensor(_rows(branch_of_edge(skeleton), np.int32, 1))
    if color is not None:
        lines.line.colors = o3d.core.Tensor(_rows(_edge_colors(skeleton, color), float, 3))
    return lines


def _edge_colors(skeleton: Skeleton, color: ColorChoice) -> np.ndarray:
    return shades(skeleton, color, branch_of_edge(skeleton), skeleton.edges)


def _rows(array: np.ndarray, dtype: type, columns: int) -> np.ndarray:
    return np.ascontiguousarray(array, dtype).reshape(-1, columns)
