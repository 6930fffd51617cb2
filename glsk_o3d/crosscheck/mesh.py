"""Meshes of clouds, reconstructed by Open3D; their Laplacian by libigl; the skeleton they contract to."""

import time
import warnings
from dataclasses import replace
from itertools import dropwhile

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
from ..numerics.neighbourhoods import nearest_neighbours
from ..numerics.vectors import dot
from ..pipeline import Pipeline, with_stage
from ..refiner import Refiner
from ..report import Report
from ..state import at_rest
from .mesh_rings import clean_faces, mesh_rings, umbrellas

BALL_RADII = (1.0, 2.0, 4.0)  # fitted: of the rolling balls, in spacings
POISSON_DEPTHS = (5, 9)  # measured: of the octree; below 5 Open3D makes the same mesh, and complains
INVENTED_DISTANCE = 3.0  # fitted: spacings from the cloud beyond which Poisson's surface is an invention
COVERED_SHARE = 0.7  # fitted: of the closed rings that a mesh closes too; below it, Poisson follows on ball pivoting


def spacing(points):
    """Mean distance of the points to their six nearest neighbours, as many as a regular triangulation gives each."""
    return float(nearest_neighbours(points, min(7, len(points)))[0][:, 1:].mean())


def ball_pivoting(state):
    """Roll balls over the cloud of a state (Bernardini et al. 1999): its points, and faces that may be no manifold."""
    o3d = import_open3d()
    radii = o3d.utility.DoubleVector(spacing(state.cloud) * np.array(BALL_RADII))
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(_oriented(state), radii)
    return state.cloud, clean_faces(state.cloud, np.asarray(mesh.triangles))


def poisson(state):
    """Screened Poisson surface (Kazhdan and Hoppe 2013) cut where there is no cloud: vertices of its own, and faces."""
    o3d = import_open3d()
    points, step = state.cloud, spacing(state.cloud)
    depth = int(np.clip(np.log2(1.1 * np.ptp(points, axis=0).max() / step), *POISSON_DEPTHS))
    # with several threads the last digits change from run to run
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(_oriented(state), depth=depth, n_threads=1)
    vertices, faces = np.array(mesh.vertices), np.asarray(mesh.triangles)
    near = cKDTree(points).query(vertices, distance_upper_bound=INVENTED_DISTANCE * step)[0] < np.inf
    used, faces = np.unique(clean_faces(vertices, faces[near[faces].all(axis=1)]), return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


SURFACES = {"ball_pivoting": ball_pivoting, "poisson": poisson}


def _oriented(state):
    """The cloud of a state with normals that agree along its rings."""
    edges = np.column_stack([state.rings.centres, state.rings.indices])
    cloud = to_point_cloud(state.cloud)
    cloud.normals = import_open3d().utility.Vector3dVector(orient_normals(state.cloud, state.normals, edges))
    return cloud


def surface_of(state, method):
    """The name of a surface, its vertices in the frame (`state.cloud` itself if these are its points), its faces.

    "auto" is the first surface that closes around enough of the rings that close, or else the last.
    """
    found, closed = None, state.rings.closed
    for name in SURFACES if method == "auto" else (method,):
        vertices, faces = SURFACES[name](state)
        if len(np.unique(faces)) < MIN_POINTS:
            continue
        found = name, vertices, faces
        both = closed & umbrellas(len(vertices), faces) if vertices is state.cloud else closed
        if both.sum() >= COVERED_SHARE * closed.sum() > 0:
            break
    if found is None:
        raise InvalidCloudError(f"no surface can be reconstructed from {len(state.cloud)} points: {method}")
    return found


def mesh_laplacian(vertices, faces, cap=WEIGHT_CAP):
    """Twice ``igl.cotmatrix``, capped as `cotangent_laplacian` is, (n, n) csr_matrix; bare vertices have empty rows."""
    igl = require("igl")
    faces = faces[igl.doublearea(vertices, faces) > 0]  # igl would divide by them
    laplacian = 2 * igl.cotmatrix(vertices, faces)
    return (diags_array(cap / np.maximum(np.abs(laplacian.diagonal()), cap)) @ laplacian).tocsr()


def mesh_areas(vertices, faces):
    """Area of every vertex, (n,) float array: the mixed Voronoi areas of ``igl.massmatrix`` (Meyer et al. 2003)."""
    igl = require("igl")
    areas = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    return np.pad(areas, (0, len(vertices) - len(areas)))  # igl leaves out bare vertices at the end


def ring_areas(points, rings):
    """The same of every ring, (n,) float array: of each fan triangle what `mesh_areas` gives to the point itself."""
    triangles = rings.triangles
    own = points[triangles].reshape(-1, 3)
    areas = mesh_areas(own, np.arange(len(own)).reshape(-1, 3))[::3]
    return np.bincount(triangles[:, 0], areas, len(points))


def curvature_normals(laplacian, areas, points):
    """Mean curvature normals, (n, 3) float array: -2 n / r on a sphere, n pointing outward; NaN where there is no area.

    The Laplacian is twice the cotangent matrix.
    """
    with np.errstate(invalid="ignore"):
        return (laplacian @ points) / np.where(areas > 0, 2 * areas, np.nan)[:, None]


def mesh_state(state, vertices, faces):
    """A mesh as a contraction about to start, in the frame of the cloud's, and the faces over its positions.

    If the vertices are `state.cloud` itself, points without a triangle go to the nearest with one.
    """
    if vertices is not state.cloud:
        m = len(vertices)
        state = replace(
            state,
            points=state.frame.out_of(vertices),
            representative_of_point=np.arange(m),
            outlier=np.zeros(m, bool),
            sampled=np.ones(m, bool),
            cloud=vertices,
            noise=np.zeros(m),
            normals=require("igl").per_vertex_normals(vertices, faces),
        )
    survivors, faces = np.unique(faces, return_inverse=True)
    positions, faces, n = vertices[survivors], faces.reshape(-1, 3), len(survivors)
    begun = replace(
        state,
        survivors=survivors,
        representative=cKDTree(positions).query(vertices)[1],
        mass=np.ones(n),
        **at_rest(positions, mesh_rings(n, faces)),
        report=Report(n_input=len(state.points), n_distinct=n, n_contracted=n),
    )
    return begun, faces


def mesh_skeleton(state, vertices, faces, pipeline):
    """Skeleton of a mesh: its contraction by libigl's Laplacian (Au et al. 2008), then the rest of a pipeline.

    The mesh is as for `mesh_state`. The pipeline's Contractor lends the parameters; reductions are left out, and gaps
    of the mesh stay gaps. Warnings are in the report alone.
    """
    stages = list(dropwhile(lambda stage: not isinstance(stage, Contractor), pipeline.stages))
    begun, faces = mesh_state(state, vertices, faces)
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
