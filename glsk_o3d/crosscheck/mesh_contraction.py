"""Contraction of a mesh by libigl's Laplacian (Au et al. 2008), with this package's weights, solver and graph."""

from __future__ import annotations

import warnings
from dataclasses import fields, replace
from itertools import dropwhile

import numpy as np
from scipy.sparse import diags_array
from scipy.spatial import cKDTree

from ..contractor import Contractor
from ..errors import InvalidParameterError, SkeletonWarning
from ..interop.packages import require
from ..lpr_reducer import LPRReducer
from ..numerics.cotangent import WEIGHT_CAP
from ..numerics.mesh_rings import mesh_rings
from ..refiner import Refiner
from ..report import Report
from ..state import at_rest


def mesh_laplacian(vertices, faces, cap=WEIGHT_CAP):
    """libigl's cotangent Laplacian in the convention of `cotangent_laplacian`: twice ``igl.cotmatrix``, and capped.

    Parameters
    ----------
    vertices : (n, 3) float array
    faces : (f, 3) int array
    cap : float
        A row whose weights sum to more than this, in absolute value, is scaled down to it.

    Returns
    -------
    (n, n) csr_matrix
        Rows of vertices without a triangle are empty.
    """
    igl = require("igl", "libigl")
    faces = faces[igl.doublearea(vertices, faces) > 0]  # igl would divide by them
    laplacian = 2 * igl.cotmatrix(vertices, faces)
    return (diags_array(cap / np.maximum(np.abs(laplacian.diagonal()), cap)) @ laplacian).tocsr()


def mesh_areas(vertices, faces):
    """Area of every vertex, (n,) float array: the mixed Voronoi areas of ``igl.massmatrix`` (Meyer et al. 2003)."""
    igl = require("igl", "libigl")
    areas = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    return np.pad(areas, (0, len(vertices) - len(areas)))  # igl leaves out bare vertices at the end


def ring_areas(points, rings):
    """The same of every ring, (n,) float array: of each fan triangle what `mesh_areas` gives to the point itself."""
    triangles = rings.triangles
    own = points[triangles].reshape(-1, 3)
    areas = mesh_areas(own, np.arange(len(own)).reshape(-1, 3))[::3]
    return np.bincount(triangles[:, 0], areas, len(points))


def curvature_normals(laplacian, areas, points):
    """Mean curvature normals, (n, 3) float array: -2 n / r on a sphere, -n / r on a cylinder, n pointing outward.

    NaN where there is no area. The Laplacian is twice the cotangent matrix, as here and in `cotangent_laplacian`.
    """
    with np.errstate(invalid="ignore"):
        return (laplacian @ points) / np.where(areas > 0, 2 * areas, np.nan)[:, None]


class MeshContractor(Contractor):
    """The contractor with the Laplacian of a mesh in the place of that of the rings; it keeps all points.

    Parameters
    ----------
    faces : (f, 3) int array
        Of the state's positions.
    like : Contractor
        Whose parameters to take.
    """

    faces: np.ndarray  # no field of the dataclass: the report shows these

    def __init__(self, faces, like):
        super().__init__(**{field.name: getattr(like, field.name) for field in fields(like)} | {"reducer": None})
        object.__setattr__(self, "faces", faces)

    def _laplacian(self, state):
        return mesh_laplacian(state.positions, self.faces)


def mesh_state(state, vertices, faces):
    """A mesh as a contraction about to start.

    Parameters
    ----------
    state : Contraction
        Of the cloud; its frame is kept.
    vertices : (m, 3) float array
        In the frame. If it is `state.cloud` itself, points without a triangle go to the nearest with one.
    faces : (f, 3) int array

    Returns
    -------
    state : Contraction
    faces : (f, 3) int array
        Of its positions.
    """
    if vertices is not state.cloud:
        igl = require("igl", "libigl")
        m = len(vertices)
        state = replace(
            state,
            points=state.frame.out_of(vertices),
            representative_of_point=np.arange(m),
            outlier=np.zeros(m, bool),
            sampled=np.ones(m, bool),
            cloud=vertices,
            noise=np.zeros(m),
            normals=igl.per_vertex_normals(vertices, faces),
        )
    survivors, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    positions = vertices[survivors]
    n = len(positions)
    rings = mesh_rings(n, faces)
    begun = replace(
        state,
        survivors=survivors,
        representative=cKDTree(positions).query(vertices)[1],
        mass=np.ones(n),
        **at_rest(positions, rings),
        report=Report(n_input=len(state.points), n_distinct=n, n_contracted=n),
    )
    return begun, faces


def mesh_skeleton(state, vertices, faces, pipeline):
    """Skeleton of a mesh: its contraction by libigl's Laplacian, and the rest of a pipeline.

    Parameters
    ----------
    state, vertices, faces
        As of `mesh_state`.
    pipeline : Pipeline
        Its Contractor lends the parameters; reductions are left out, and gaps of the mesh stay gaps; what follows is as
        it is.

    Returns
    -------
    Skeleton
        Its warnings are in its report alone.

    Raises
    ------
    InvalidParameterError
        The pipeline has no Contractor.
    """
    stages = list(dropwhile(lambda stage: not isinstance(stage, Contractor), pipeline.stages))
    if not stages:
        raise InvalidParameterError(f"{pipeline!r} has no Contractor: there is nothing to compare with a mesh")
    flow, faces = mesh_state(state, vertices, faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)
        flow = MeshContractor(faces, stages[0])(flow)
        for stage in stages[1:]:
            if isinstance(stage, Refiner):
                stage = replace(stage, bridge=0)
            if not isinstance(stage, LPRReducer):
                flow = stage(flow)
    return flow
