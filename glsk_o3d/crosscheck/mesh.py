"""A mesh of a cloud, reconstructed by Open3D; its one-rings; its Laplacian by libigl; the skeleton it contracts to."""

import time
import warnings
from dataclasses import replace
from itertools import dropwhile
from typing import Any

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..contractor import Contractor
from ..errors import InvalidCloudError, SkeletonWarning
from ..interop.clouds import to_point_cloud
from ..interop.packages import import_open3d, require
from ..lpr_reducer import LPRReducer
from ..numerics.cotangent import WEIGHT_CAP
from ..numerics.frame import MIN_POINTS
from ..numerics.groups import component_labels
from ..numerics.neighbourhoods import nearest_neighbours
from ..numerics.rings import Rings
from ..numerics.vectors import dot
from ..pipeline import Pipeline, with_stage
from ..refiner import Refiner
from ..report import Report
from ..skeleton import Skeleton
from ..state import Contraction, at_rest

BALL_RADII = (1.0, 2.0, 4.0)  # fitted: of the rolling balls, in spacings


def ball_pivoting(state: Contraction) -> np.ndarray:
    """Roll balls over the cloud of a state (Bernardini et al. 1999).

    Gives faces over its points, (f, 3) int64 array, which may be no manifold; InvalidCloudError if there are hardly
    any.
    """
    o3d = import_open3d()
    edges = np.column_stack([state.rings.centres, state.rings.indices])
    cloud = to_point_cloud(state.cloud)
    cloud.normals = o3d.utility.Vector3dVector(orient_normals(state.cloud, state.normals, edges))
    # the mean distance to six neighbours, as many as a regular triangulation gives each point
    spacing = nearest_neighbours(state.cloud, min(7, len(state.cloud)))[0][:, 1:].mean()
    radii = o3d.utility.DoubleVector(spacing * np.array(BALL_RADII))
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)
    faces = clean_faces(state.cloud, np.asarray(mesh.triangles))
    if len(np.unique(faces)) < MIN_POINTS:
        raise InvalidCloudError(f"no surface can be reconstructed from {len(state.cloud)} points")
    return faces


def mesh_laplacian(vertices: np.ndarray, faces: np.ndarray, cap: float = WEIGHT_CAP) -> Any:
    """Twice ``igl.cotmatrix``, capped as `cotangent_laplacian` is, (n, n) csr_matrix; bare vertices have empty rows."""
    igl = require("igl")
    faces = faces[igl.doublearea(vertices, faces) > 0]  # igl would divide by them
    laplacian = 2 * igl.cotmatrix(vertices, faces)
    return (diags_array(cap / np.maximum(np.abs(laplacian.diagonal()), cap)) @ laplacian).tocsr()


def mesh_state(state: Contraction, faces: np.ndarray) -> tuple[Contraction, np.ndarray]:
    """A mesh of the points of a state as a contraction about to start, and the faces over its positions.

    Points without a triangle go to the nearest with one.
    """
    survivors, faces = np.unique(faces, return_inverse=True)
    positions, faces, n = state.cloud[survivors], faces.reshape(-1, 3), len(survivors)
    begun = replace(
        state,
        survivors=survivors,
        representative=cKDTree(positions).query(state.cloud)[1],
        mass=np.ones(n),
        **at_rest(positions, mesh_rings(n, faces)),
        report=Report(n_input=len(state.points), n_distinct=n, n_contracted=n),
    )
    return begun, faces


def mesh_skeleton(state: Contraction, faces: np.ndarray, pipeline: Pipeline[Any]) -> Skeleton:
    """Skeleton of a mesh of the points of a state: its contraction by libigl's Laplacian (Au et al. 2008), then the
    rest of a pipeline.

    The pipeline's Contractor lends the parameters; reductions are left out, and gaps of the mesh stay gaps. Warnings
    are in the report alone.
    """
    stages: list[Any] = list(dropwhile(lambda stage: not isinstance(stage, Contractor), pipeline.stages))
    begun, faces = mesh_state(state, faces)
    contractor = replace(stages[0], reducer=None)
    rest = [stage for stage in stages[1:] if not isinstance(stage, LPRReducer)]
    rest = [replace(stage, bridge=0) if isinstance(stage, Refiner) else stage for stage in rest]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)
        start = time.perf_counter()
        flow = contractor.contract(begun, lambda state: mesh_laplacian(state.positions, faces))
        flow = replace(flow, report=with_stage(flow.report, contractor, time.perf_counter() - start))
        return Pipeline(*rest)(flow)


# derived: cost of an edge between equal normals; a sparse graph would take 0 for no edge
EQUAL_NORMALS_COST = 1e-6


def orient_normals(points: np.ndarray, normals: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Turn normals so that neighbours agree (Hoppe et al. 1992): along the tree over which they turn least.

    `edges` (e, 2) say which points are neighbours. In every connected part the point farthest from the centroid of all
    points says which side is out. Open3D's function makes a Delaunay tetrahedralisation first, which breaks down on
    points of a sphere.
    """
    n = len(points)
    a, b = np.unique(np.sort(edges, axis=1), axis=0).T
    cost = 1 - np.abs(dot(normals[a], normals[b])) + EQUAL_NORMALS_COST
    tree = minimum_spanning_tree(coo_array((cost, (a, b)), shape=(n, n)).tocsr()).tocoo()
    part = connected_components(tree, directed=False)[1]
    outward = points - points.mean(axis=0)
    roots = np.empty(part.max() + 1, int)
    order = np.argsort(dot(outward, outward), kind="stable")
    roots[part[order]] = order  # the last one written, the farthest, stays
    tree.data = np.where(dot(normals[tree.row], normals[tree.col]) < 0, 1.0, 2.0)  # so ways over odd turns are odd
    steps, _, root = dijkstra(tree, directed=False, indices=roots, min_only=True, return_predecessors=True)
    turned = (steps % 2 == 1) ^ (dot(normals, outward) < 0)[root]
    return np.where(turned[:, None], -normals, normals)


def clean_faces(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Triangles with an area, each once, (g, 3) int64 array, in the order and with the orientation of their first copy.

    Vertices without a triangle stay, so that rows keep their meaning.
    """
    faces = np.asarray(faces, np.int64).reshape(-1, 3)
    first = np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])
    a, b, c = points[faces[first]].transpose(1, 0, 2)
    return faces[first[np.cross(b - a, c - a).any(axis=1)]]


def umbrellas(n: int, faces: np.ndarray) -> np.ndarray:
    """Vertices whose triangles make one closed umbrella, (n,) bool array: neither border nor fan of fans nor bare.

    The faces, (f, 3) int array, are as from `clean_faces`.
    """
    corner = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])  # each triangle from all its corners
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [0, 2]]])
    spoke, row, count = np.unique(ends @ [n, 1], return_inverse=True, return_counts=True)
    fan = component_labels(len(spoke), row.reshape(2, -1).T)  # spokes that triangles lead between are in one
    odd = np.bincount(spoke // n, count != 2, n) > 0
    vertex_of_fan = np.unique(np.column_stack([spoke // n, fan]), axis=0)[:, 0]
    return ~odd & (np.bincount(vertex_of_fan, minlength=n) == 1)


def mesh_rings(n: int, faces: np.ndarray) -> Rings:
    """The neighbours of every vertex of a mesh of `clean_faces` as Rings; every vertex needs a face.

    They are ascending, not in rotational order, since there may be none: `triangles` mean nothing.
    """
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)  # the sides of every triangle
    centre, neighbour = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0).T
    return Rings(np.searchsorted(centre, np.arange(n + 1)), neighbour, umbrellas(n, faces))
