"""The branches of a skeleton, measured one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidParameterError
from ..numerics.polylines import place_at
from ..refinement.rooted import root_among
from .branch_rows import BranchTable
from .curvature import curvature_torsion
from .growth import axes, grow
from .segmentation import branch_of_point

if TYPE_CHECKING:
    from ..skeleton import Skeleton

# fitted: radii from a junction between which a branch has its direction; nearer, parts blend
HEADING_SPAN = (1.0, 3.0)


@np.errstate(all="ignore")  # a file may hold coordinates whose squares no float64 holds
def branch_table(skeleton: Skeleton, root: Any = None) -> BranchTable:
    """Measure every branch of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    root : str, int or (x, y, z), optional
        As of `editing.reroot`: ``"x"`` to ``"-z"`` for the vertex that is lowest along this axis, ``"thickest"`` for
        the thickest end, a vertex, or a point whose nearest vertex it is. Its branch, or all that meet there, are those
        of level 0 in its component. By default that is where the tree was made to grow from, if it was. In other
        components, and else, it is the branch with the most volume (the longest one, where radii are unknown), with its
        free or thicker end for a start.

    Returns
    -------
    BranchTable

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or there is no such root.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> table = branch_table(skeletonize(y_junction(2000).points))
    >>> sorted(table.level.tolist())
    [0, 1, 1]
    """
    m = len(skeleton.vertices)
    if m == 0:
        raise InvalidParameterError("the skeleton is empty: it has no branches to measure")
    root = skeleton.report.root or None if root is None else root
    chosen = None if root is None else root_among(skeleton.vertices, skeleton, root)
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    steps = [np.linalg.norm(np.diff(skeleton.vertices[path], axis=0), axis=1) for path in paths]
    length = np.array([step.sum() for step in steps])
    weights = [np.r_[step, 0] + np.r_[0, step] if step.any() else np.ones(len(step) + 1) for step in steps]

    def mean(values):
        return np.array([_mean(values[path], weight) for path, weight in zip(paths, weights, strict=True)])

    section = mean((skeleton.radii / np.nanmax(skeleton.radii, initial=np.finfo(float).tiny)) ** 2)
    parent, level, backwards = grow(skeleton, paths, length, np.where(np.isnan(section), 1, section), chosen)
    outward = [path[::-1] if turn else path for path, turn in zip(paths, backwards, strict=True)]
    start, end = (np.array([path[i] for path in outward]) for i in (0, -1))
    first, last = skeleton.vertices[start], skeleton.vertices[end]
    with np.errstate(divide="ignore", invalid="ignore"):
        tortuosity = length / np.linalg.norm(last - first, axis=1)
    curvature, torsion = curvature_torsion(skeleton)
    label = branch_of_point(skeleton, skeleton.points, skeleton.vertex_of_point)
    angle = np.array([_angle(skeleton, outward, i, parent[i]) for i in range(len(paths))])
    mean_radius = mean(skeleton.radii)
    axis, order = axes(parent, level, start, angle, mean_radius, length)
    return BranchTable(
        kind=_kinds(skeleton, paths),
        component=skeleton.component_of_vertex[start],
        parent=parent,
        level=level,
        start=start,
        end=end,
        start_point=first,
        end_point=last,
        length=length,
        tortuosity=tortuosity,
        mean_radius=mean_radius,
        start_radius=skeleton.radii[start],
        end_radius=skeleton.radii[end],
        angle=angle,
        mean_curvature=mean(curvature),
        mean_torsion=mean(torsion),
        points=np.bincount(label[label >= 0], minlength=len(paths)),
        confidence=mean(skeleton.confidence),
        support=np.array([skeleton.support[path].min() for path in paths]),
        axis=axis,
        order=order,
    )


def _mean(values, weights):
    known = np.isfinite(values) & (weights > 0)
    return np.average(values[known], weights=weights[known]) if known.any() else np.nan


def _kinds(skeleton, paths):
    import networkx

    graph = networkx.Graph(skeleton.edges.tolist())
    bridges = {frozenset(edge) for edge in networkx.bridges(graph)} if len(graph) else set()

    def kind(path):
        if len(path) == 1:
            return "isolated"
        if frozenset(path[:2].tolist()) not in bridges:
            return "loop"
        return "tip" if (skeleton.degree[path[[0, -1]]] == 1).any() else "inner"

    return np.array([kind(path) for path in paths])


def _angle(skeleton, paths, row, parent):
    path, before = paths[row], paths[parent]
    if parent < 0 or path[0] == path[-1] or before[0] == before[-1]:
        return np.nan
    radius = skeleton.radii[path[0]]
    leaves = _heading(skeleton.vertices[path], radius)
    arrives = -_heading(skeleton.vertices[before[::-1] if before[-1] == path[0] else before], radius)
    if not (leaves.any() and arrives.any()):
        return np.nan
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(leaves, arrives)), leaves @ arrives))


def _heading(curve, radius):
    """RootPlace a curve goes from its first point: from one to three radii, or the first quarter."""
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    reach = along[-1]
    near, far = np.minimum(np.multiply(HEADING_SPAN, radius), [reach / 2, reach]) if radius > 0 else (0, reach / 4)
    return place_at(curve, along, far) - place_at(curve, along, near)
