"""Open3D's surfaces through oriented points, and what is inside of them."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .clouds import to_point_cloud
from .packages import import_open3d

CELL = 1.25  # measured: side of the octree's cells, in spacings: smaller ones follow noise, larger ones close holes
FULL_DEPTH = 4  # speed: of the octree, down to which it is a full grid
RAYS = 3  # measured: from each place, of which most decide: one may meet an edge


def poisson_mesh(points: np.ndarray, outward: np.ndarray, spacing: float) -> Any:
    """A closed mesh near points (n, 3) with outward normals, as an Open3D mesh (Kazhdan and Hoppe 2013)."""
    o3d, cloud = import_open3d(), to_point_cloud(points)
    cloud.normals = o3d.utility.Vector3dVector(outward)
    octree = dict(depth=0, width=CELL * spacing, full_depth=FULL_DEPTH, linear_fit=True, n_threads=1)
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, **octree)
    return mesh


def inside_of(mesh: Any) -> Callable[[np.ndarray], np.ndarray]:
    """Which of places (m, 3) are inside of a closed Open3D mesh, as a function that gives an (m,) bool array."""
    o3d = import_open3d()
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))

    def is_inside(places: np.ndarray) -> np.ndarray:
        queries = o3d.core.Tensor(places.astype(np.float32))
        return scene.compute_occupancy(queries, nthreads=1, nsamples=RAYS).numpy() > 0

    return is_inside
