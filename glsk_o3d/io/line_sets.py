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


def to_line_set(skeleton: Skeleton, color: ColorChoice = (0.85, 0.1, 0.1)) -> Any:
    """A skeleton as a legacy line set, points and lines in its order, with colours of the edges as from `shades`."""
    o3d = import_open3d()
    lines = o3d.geometry.LineSet()
    lines.points = o3d.utility.Vector3dVector(_rows(skeleton.vertices, float, 3))
    lines.lines = o3d.utility.Vector2iVector(_rows(skeleton.edges, np.int32, 2))
    lines.colors = o3d.utility.Vector3dVector(_edge_colors(skeleton, color))
    return lines


def to_tensor_line_set(skeleton: Skeleton, color: ColorChoice | None = None) -> Any:
    """A skeleton as a tensor line set on the CPU.

    It has ``point.positions`` (M, 3), ``point.radius``, ``point.confidence``, ``point.half_width``,
    ``point.half_thickness`` and ``point.support`` (M, 1) float64, ``line.indices`` (E, 2) int64, ``line.branch`` (E, 1)
    int32 and, with a color, ``line.colors`` (E, 3) float64.
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
