"""A skeleton as Open3D's line sets, as a mesh of tubes, and as voxels."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..data.skeleton import Skeleton, check_skeleton
from ..errors import InvalidParameterError
from ..geometry.polylines import twist_free_frames
from ..geometry.vectors import box
from ..interop.packages import import_open3d
from ..parameters import check_number
from .colors import ColorChoice, shades

MOST_VOXELS = 10**7  # speed: in the box around a skeleton, a minute's


def to_line_set(skeleton: Skeleton, color: ColorChoice = "branch") -> Any:
    """A skeleton as a legacy line set, coloured by an attribute.

    Parameters
    ----------
    skeleton : Skeleton
    color : {"branch", "order", "radius", "confidence", "support"} or three floats in [0, 1]
        What the colours of the edges show, or the one colour of all.

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
    check_skeleton(skeleton)
    lines = skeleton.to_line_set()
    colors = shades(skeleton, color, skeleton.branch_of_edge, skeleton.edges)
    lines.colors = import_open3d().utility.Vector3dVector(np.ascontiguousarray(colors).reshape(-1, 3))
    return lines


def to_tubes(skeleton: Skeleton, color: ColorChoice = "branch", *, radius: float | None = None, sides: int = 16) -> Any:
    """A skeleton as a mesh of tubes, one for every branch, closed by half balls.

    Their sections are circles with the radii of the vertices. They are linear between vertices, do not twist, and
    overlap at junctions.

    Parameters
    ----------
    skeleton : Skeleton
        A vertex without edges becomes a ball.
    color : {"branch", "order", "radius", "confidence", "support"} or three floats in [0, 1]
        What the colours of the branches or vertices show, or the one colour of all.
    radius : float, optional
        One radius for all, in the cloud's units, instead of the radii of the vertices.
    sides : int
        Corners of a cross-section, at least 3.

    Returns
    -------
    open3d.geometry.TriangleMesh
        With vertex colours and normals; triangles face outwards.

    Raises
    ------
    InvalidParameterError
        A radius is unknown or not positive, `sides` is below 3, or the colour is unknown.
    MissingPackageError

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> to_tubes(skeletonize(torus(1000).points)).has_vertex_normals()
    True
    """
    check_skeleton(skeleton)
    check_number("sides", sides, "int", low=3)
    check_number("radius", radius, "float?", low=0, open_low=True)
    radii = skeleton.radii if radius is None else np.full(len(skeleton.vertices), float(radius))
    unknown = ~(np.isfinite(radii) & (radii >= 0))
    if unknown.any():
        raise InvalidParameterError(f"{unknown.sum()} of {len(radii)} vertices have no radius: give one, radius=...")
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    vertices, triangles, row = sweep(skeleton.vertices, radii, paths, sides)
    flat, branch = np.concatenate([*paths, np.empty(0, int)]), np.repeat(np.arange(len(paths)), list(map(len, paths)))
    o3d = import_open3d()
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles))
    mesh.vertex_colors = o3d.utility.Vector3dVector(shades(skeleton, color, branch, flat)[row])
    mesh.compute_vertex_normals()
    return mesh


def to_voxels(skeleton: Skeleton, size: float) -> Any:
    """The space inside the tubes of a skeleton as voxels.

    Parameters
    ----------
    skeleton : Skeleton
    size : float
        Of a voxel, in the cloud's units.

    Returns
    -------
    open3d.geometry.VoxelGrid
        Of the voxels whose centre is no farther from the curve than the radius there. Its origin is the lowest corner
        of the box around all balls.

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, a radius is unknown, or the size is not positive or so small that there would be too
        many voxels.
    MissingPackageError

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> grid = to_voxels(skeletonize(torus(1000).points), 0.02)
    >>> abs(len(grid.get_voxels()) * 0.02**3 / (2 * np.pi**2 * 0.4 * 0.1**2) - 1) < 0.1
    True
    """
    check_skeleton(skeleton)
    check_number("size", size, low=0, open_low=True)
    if not len(skeleton.vertices) or not np.isfinite(skeleton.radii).all():
        raise InvalidParameterError("voxels are inside the radii of a skeleton, and this one is empty or lacks some")
    radii = skeleton.radii[:, None]
    low, high = box(np.concatenate([skeleton.vertices - radii, skeleton.vertices + radii]))
    counts = np.ceil((high - low) / size)
    if counts.prod() > MOST_VOXELS:
        raise InvalidParameterError(f"size = {size:g}: there would be {counts.prod():.3g} voxels: take larger ones")
    places = low + size * (np.argwhere(np.ones(counts.astype(int), bool)) + 0.5)
    geometry, vectors = import_open3d().geometry, import_open3d().utility.Vector3dVector
    inside = geometry.PointCloud(vectors(places[skeleton.nearest(places).clearance <= 0]))
    return geometry.VoxelGrid.create_from_point_cloud_within_bounds(inside, size, low, low + size * counts)


def sweep(
    vertices: np.ndarray, radii: np.ndarray, paths: Sequence[np.ndarray], sides: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Closed surfaces around curves, each a path of vertices: circles swept along them, and half balls at the ends.

    Gives points, (P, 3), triangles, (T, 3), and the row, in the paths one after the other, that each point belongs to.
    """
    if len(paths) == 0:
        return np.empty((0, 3)), np.empty((0, 3), int), np.empty(0, int)
    flat, size = np.concatenate(paths), np.array(list(map(len, paths)))
    path = np.repeat(np.arange(len(paths)), size)
    stop = np.cumsum(size)
    first, last = np.zeros(len(flat), bool), np.zeros(len(flat), bool)
    first[stop - size], last[stop - 1] = True, True
    centre, radius = vertices[flat], radii[flat]
    frames = twist_free_frames(centre, np.flatnonzero(first))
    tangent, axes = frames[:, :, 0], frames[:, :, 1:]

    caps = max(2, sides // 4)  # circles from a half ball's equator to its pole
    before, after = (caps - 1) * first, (caps - 1) * last
    count = before + 1 + after
    row = np.repeat(np.arange(len(flat)), count)
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count + before, count)
    latitude = step * np.pi / 2 / caps
    angle = np.arange(sides) * 2 * np.pi / sides
    across = np.einsum("rij,js->rsi", axes[row], np.stack([np.cos(angle), np.sin(angle)]))
    middle = centre[row] + (radius[row] * np.sin(latitude))[:, None] * tangent[row]
    circles = middle[:, None] + (radius[row] * np.cos(latitude))[:, None, None] * across
    poles = [centre[end] + sign * radius[end, None] * tangent[end] for end, sign in ((first, -1), (last, 1))]
    points = np.concatenate([circles.reshape(-1, 3), *poles])

    corner = np.arange(len(row) * sides).reshape(-1, sides)
    onward = np.roll(corner, -1, axis=1)
    joined = np.flatnonzero(path[row[:-1]] == path[row[1:]])
    a, b, c, d = corner[joined], onward[joined], corner[joined + 1], onward[joined + 1]
    opened = np.flatnonzero(np.r_[True, path[row[1:]] != path[row[:-1]]])
    closed = np.r_[opened[1:], len(row)] - 1
    south, north = len(row) * sides + np.arange(2 * len(paths)).reshape(2, -1, 1)
    faces = [(a, b, d), (a, d, c), (onward[opened], corner[opened], south), (corner[closed], onward[closed], north)]
    triangles = np.concatenate([np.stack(np.broadcast_arrays(*face), axis=-1).reshape(-1, 3) for face in faces])
    return points, triangles, np.concatenate([np.repeat(row, sides), np.flatnonzero(first), np.flatnonzero(last)])
