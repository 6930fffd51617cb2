"""The skeleton that a mesh contracts to, by libigl's Laplacian."""

import warnings
from dataclasses import replace
from itertools import dropwhile
from typing import Any

import numpy as np
from scipy.sparse import diags_array
from scipy.spatial import cKDTree

from ...data.contraction import Contraction, at_rest
from ...data.skeleton import Skeleton
from ...errors import SkeletonWarning
from ...filters.connector import Connector
from ...filters.contractor import Contractor
from ...filters.lpr_reducer import LPRReducer
from ...filters.refiner import Refiner
from ...filters.ring_builder import RingBuilder
from ...filters.sampler import Sampler
from ...geometry.cotangent import WEIGHT_CAP
from ...geometry.inscribed_balls import inscribed_balls, mean_places
from ...geometry.rings import Rings
from ...interop.packages import require
from ...pipeline import Pipeline
from .solid import Solid

LEAST_MASS = 0.05  # fitted: of the mean, that a vertex of slivers has


def mesh_skeleton(solid: Solid, pipeline: Pipeline[Any, Any]) -> Skeleton:
    """Skeleton of a mesh, contracted from its medial places by libigl's Laplacian (Au et al. 2008; Tagliasacchi 2012).

    The pipeline's Contractor and later filters lend their parameters, but there are no reductions, bridges or warnings.
    """
    stages: list[Any] = list(dropwhile(lambda stage: not isinstance(stage, Contractor), pipeline.stages))
    contractor = replace(stages[0], reducer=None)
    rest = [stage for stage in stages[1:] if not isinstance(stage, LPRReducer)]
    rest = [replace(stage, bridge=0) if isinstance(stage, Refiner) else stage for stage in rest]
    rest = [replace(stage, shut=1) if isinstance(stage, Connector) else stage for stage in rest]  # its own opinion
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)
        state, faces = mesh_state(solid)
        return Pipeline(*rest)(contractor.contract(state, lambda current: mesh_laplacian(current.positions, faces)))


def mesh_state(solid: Solid) -> tuple[Contraction, np.ndarray]:
    """A mesh as a contraction about to start from its medial places, and the faces over its positions."""
    igl = require("igl")
    state: Contraction = (Sampler(size="all", frame="spread") | RingBuilder())(solid.vertices)
    corners = state.map.row_of_point[solid.faces]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]  # near vertices may have become one
    survivors, faces = np.unique(corners, return_inverse=True)
    positions, faces = state.cloud[survivors], faces.reshape(-1, 3)
    rings, area = Rings.of_faces(len(positions), faces), igl.massmatrix(positions, faces).diagonal()
    normals = igl.per_vertex_normals(positions, faces)
    places, trust = mean_places(positions, normals, rings, *inscribed_balls(positions, normals))
    state = replace(
        state,
        map=replace(state.map, survivors=survivors, survivor_of_row=cKDTree(positions).query(state.cloud)[1]),
        mass=np.maximum(area / area.mean(), LEAST_MASS),
        **at_rest(positions, rings),
    )
    return replace(state, positions=positions + trust[:, None] * (places - positions)), faces


def mesh_laplacian(vertices: np.ndarray, faces: np.ndarray, cap: float = WEIGHT_CAP) -> Any:
    """Twice ``igl.cotmatrix``, capped as `cotangent_laplacian` is, (n, n) csr_matrix."""
    igl = require("igl")
    laplacian = 2 * igl.cotmatrix(vertices, faces[igl.doublearea(vertices, faces) > 0])  # it would divide by the others
    return (diags_array(cap / np.maximum(np.abs(laplacian.diagonal()), cap)) @ laplacian).tocsr()
