"""The surface that a cloud is checked against: reconstructed from its points, or given."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidCloudError
from ..io.meshes import mesh_arrays
from ..numerics.mesh_rings import clean_faces, umbrellas
from ..preparation.frame import MIN_POINTS
from .reconstruction import ball_pivoting, poisson, without_bare

SURFACES = {"ball_pivoting": ball_pivoting, "poisson": poisson}

COVERED_SHARE = 0.7  # fitted: of the closed rings that a mesh closes too; below it, Poisson follows on ball pivoting
# derived: of the diagonal; nearer vertices are points of the cloud, the digits of a float32 in whichever file
SAME_VERTEX = 1e-6


def surface_of(state, mesh):
    """The name of a surface, its vertices in the frame (`state.cloud` itself if these are its points), its faces."""
    if not isinstance(mesh, str):
        return "given", *_given(state, *mesh_arrays(mesh))
    names = ("ball_pivoting", "poisson") if mesh == "auto" else (mesh,)
    found = None
    for name in names:
        vertices, faces = SURFACES[name](state.cloud, state.normals, state.rings)
        if len(np.unique(faces)) < MIN_POINTS:
            continue
        found = name, vertices, faces
        closes = state.rings.closed & umbrellas(len(vertices), faces) if vertices is state.cloud else state.rings.closed
        if closes.sum() >= COVERED_SHARE * state.rings.closed.sum() > 0:
            break
    if found is None:
        raise InvalidCloudError(
            f"no surface can be reconstructed from {len(state.cloud)} points by {' or '.join(names)}"
        )
    return found


def _given(state, vertices, faces):
    """A user's mesh in the frame, on the cloud's own points if these are its vertices."""
    good = state.sampled
    distance, nearest = cKDTree(state.frame.into(state.points[good])).query(state.frame.into(vertices))
    if distance.max() < SAME_VERTEX * state.frame.diagonal:
        row = state.representative_of_point[good][nearest]
        return state.cloud, clean_faces(state.cloud, row[faces])
    vertices = state.frame.into(vertices)
    return without_bare(vertices, clean_faces(vertices, faces))
