"""Meshes of clouds, by Open3D."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..interop.clouds import to_point_cloud
from ..interop.packages import import_open3d
from ..numerics.mesh_rings import clean_faces
from ..numerics.neighbourhoods import nearest_neighbours
from ..numerics.orientation import orient_normals

BALL_RADII = (1.0, 2.0, 4.0)  # fitted: of the rolling balls, in spacings
# measured: of Poisson's octree; below 5 Open3D makes the same mesh, and complains
POISSON_DEPTHS = (5, 9)
INVENTED_DISTANCE = 3.0  # fitted: spacings from the cloud beyond which Poisson's surface is an invention


def spacing(points):
    """Mean distance of the points to their six nearest neighbours, as many as a regular triangulation gives each."""
    return float(nearest_neighbours(points, min(7, len(points)))[0][:, 1:].mean())


def ball_pivoting(points, normals, rings):
    """Triangulate a cloud by rolling balls over it (Bernardini et al. 1999): its points are the vertices.

    The normals are good up to their sign; the rings say which points are neighbours. The faces, (f, 3) int array, are
    not always manifold, nor of all vertices; there are none where no ball finds three points.
    """
    o3d = import_open3d()
    radii = o3d.utility.DoubleVector(spacing(points) * np.array(BALL_RADII))
    cloud = _with_normals(points, normals, rings)
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)
    return points, clean_faces(points, np.asarray(mesh.triangles))


def poisson(points, normals, rings):
    """Screened Poisson reconstruction (Kazhdan and Hoppe 2013), cut where there is no cloud; takes what `ball_pivoting`
    does.

    There are about as many vertices as points, but not these; the faces are of all of them.
    """
    o3d = import_open3d()
    step = spacing(points)
    depth = int(np.clip(np.log2(1.1 * np.ptp(points, axis=0).max() / step), *POISSON_DEPTHS))
    cloud = _with_normals(points, normals, rings)
    # with several threads the last digits change from run to run
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth, n_threads=1)
    vertices = np.array(mesh.vertices)
    near = cKDTree(points).query(vertices, distance_upper_bound=INVENTED_DISTANCE * step)[0] < np.inf
    faces = np.asarray(mesh.triangles)
    return without_bare(vertices, clean_faces(vertices, faces[near[faces].all(axis=1)]))


def without_bare(vertices, faces):
    """The mesh without vertices that have no triangle, and the faces renumbered."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def _with_normals(points, normals, rings):
    o3d = import_open3d()
    cloud = to_point_cloud(points)
    edges = np.column_stack([rings.centres, rings.indices])
    cloud.normals = o3d.utility.Vector3dVector(orient_normals(points, normals, edges))
    return cloud
