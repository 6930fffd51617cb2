"""The vertex and the branch of every point of a cloud."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..data.skeleton import Skeleton, check_skeleton
from ..errors import InvalidCloudError, InvalidParameterError
from ..geometry.groups import Members
from ..geometry.polylines import nearest_on_edges
from ..geometry.vectors import finite_rows
from ..interop.clouds import cloud_points
from .curves import along, pieces

PIECES_PER_CURVE = 4000  # fitted: that a curve is cut into, to find the one nearest to a point


def segment(skeleton: Skeleton, cloud: Any = None) -> np.ndarray:
    """Label every point with the branch that it belongs to.

    A point belongs to the branch of its vertex; around a junction, to the branch whose curve is nearest.

    Parameters
    ----------
    skeleton : Skeleton
    cloud : cloud, optional
        By default that of the skeleton. Points of another cloud have the branch of its nearest point, or of the nearest
        place on the curve if the skeleton's file held no cloud.

    Returns
    -------
    (N,) int64 array
        Rows of `glsk_o3d.analysis.branch_table`. -1 only for points with coordinates that are not finite.

    Raises
    ------
    InvalidCloudError, InvalidParameterError
        There is no cloud, or it has no points; or the skeleton is empty.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> label = segment(skeletonize(y_junction(2000).points))
    >>> label.shape, np.unique(label).tolist()
    ((2000,), [0, 1, 2])
    """
    points, vertex = vertex_of_cloud(skeleton, cloud)
    return branch_of_point(skeleton, points, vertex)


def vertex_of_cloud(skeleton: Skeleton, cloud: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """The points of a cloud, by default that of the skeleton, and the vertex of each; -1 for those that are not finite.

    (N, 3) float64 and (N,) int64 array.
    """
    check_skeleton(skeleton)
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: there is nothing to label points with")
    if cloud is None:
        if len(skeleton.points) == 0:
            raise InvalidCloudError("this skeleton came without its cloud: give the cloud, too")
        return skeleton.points, skeleton.vertex_of_point
    points, known = cloud_points(cloud), np.flatnonzero(skeleton.vertex_of_point >= 0)
    if len(known) and np.array_equal(skeleton.points, points, equal_nan=True):
        return points, skeleton.vertex_of_point
    vertex, finite = np.full(len(points), -1), finite_rows(points)
    if len(known):
        nearest = known[cKDTree(skeleton.points[known]).query(points[finite])[1]]
        vertex[finite] = skeleton.vertex_of_point[nearest]
    else:
        vertex[finite] = _nearest_vertex(skeleton, points[finite])
    return points, vertex


def _nearest_vertex(skeleton: Skeleton, points: np.ndarray) -> Any:
    """The nearer end of the edge that is nearest to each point; vertices without edges count, too."""
    length = skeleton.edge_lengths.sum()
    detached = np.flatnonzero(skeleton.degree == 0)
    if length == 0:
        return cKDTree(skeleton.vertices).query(points)[1]
    row, part = pieces(skeleton.vertices, skeleton.edges, length / PIECES_PER_CURVE)
    places = np.concatenate([along(skeleton.edges, row, part, skeleton.vertices), skeleton.vertices[detached]])
    ends = np.where(part < 0.5, *skeleton.edges[row].T)
    return np.concatenate([ends, detached])[cKDTree(places).query(points)[1]]


def branch_of_vertex(skeleton: Skeleton) -> np.ndarray:
    """The row of the branch table of every vertex, (M,) int array; -1 for junctions."""
    branch = np.full(len(skeleton.vertices), -1)
    branch[skeleton.edges] = skeleton.branch_of_edge[:, None]
    branch[skeleton.junctions] = -1
    detached = skeleton.degree == 0
    branch[detached] = len(skeleton.branches) + np.arange(detached.sum())
    return branch


@np.errstate(all="ignore")
def branch_of_point(skeleton: Skeleton, points: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """`segment` for points, (N, 3) float array, whose vertices are known, (N,) int array: (N,) int64 array."""
    label: np.ndarray = np.append(branch_of_vertex(skeleton), -1)[vertex]
    edge_branch, members = skeleton.branch_of_edge, Members(vertex, len(skeleton.vertices))
    for junction in np.intersect1d(skeleton.junctions, vertex):
        rows = members.of(np.array([junction]))
        around = (skeleton.edges == junction).any(axis=1)
        edges = np.flatnonzero(np.isin(edge_branch, edge_branch[around]))
        candidates = np.broadcast_to(edges, (len(rows), len(edges)))
        edge, _ = nearest_on_edges(skeleton.vertices, skeleton.edges, candidates, points[rows])
        label[rows] = edge_branch[edge]
    return label
