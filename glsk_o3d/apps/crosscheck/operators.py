"""Two Laplacians, of rings and of a mesh, compared by what does not need the same vertices."""

import numpy as np
from scipy.sparse.linalg import eigs, eigsh

from ...analysis.agreement import OperatorAgreement
from ...geometry.cotangent import Operator, eigenvalues, mapped
from ...geometry.rings import Rings
from ...geometry.vectors import TINY, box, dot, norm
from ...interop.packages import require
from .solid import Solid

DIFFUSION = 2.0  # measured: ring edges over which both operators are averaged: fewer compare noise
WITHIN = 1.5  # fitted: ring edges from the mesh, farther than which a point is not compared
FLAT = 0.1  # fitted: ring edges that diffusion moves a point by, less than which has no direction
QUANTILES = {"p10": 10, "median": 50, "p90": 90}


def mesh_operator(solid: Solid) -> Operator:
    """libigl's cotangent Laplacian and Voronoi areas of a mesh (Meyer et al. 2003)."""
    igl, mesh = require("igl"), (solid.vertices, solid.faces)
    return Operator(solid.vertices, igl.cotmatrix(*mesh), np.maximum(igl.massmatrix(*mesh).diagonal(), TINY))


def compare_operators(
    ours: Operator, rings: Rings, ring_normals: np.ndarray, theirs: Operator, solid: Solid
) -> tuple[np.ndarray, OperatorAgreement]:
    """The angle between the mean curvature vectors of cloud and mesh at every point, in degrees, and how they agree.

    The (n,) float array is 0 where both are flat and NaN where the mesh is too far away.
    """
    igl, (low, high) = require("igl"), box(theirs.places)
    edge = float(rings.mean_lengths(ours.places).mean())
    length = DIFFUSION * edge
    phases = (np.pi * (operator.places - low) / np.maximum(high - low, TINY) for operator in (ours, theirs))
    waves = [np.cos(np.column_stack([phase, 2 * phase])) for phase in phases]  # half a wave and a whole one across
    own = mapped(ours, np.column_stack([ours.places, waves[0]]), length)
    other = mapped(theirs, np.column_stack([theirs.places, waves[1]]), length)
    squared, face, foot = igl.point_mesh_squared_distance(ours.places, solid.vertices, solid.faces)
    corners = solid.faces[face]
    share = igl.barycentric_coordinates(foot, *(solid.vertices[corner] for corner in corners.T))
    other = np.einsum("nk,nkc->nc", share, other[corners])

    near, a, b = squared < (WITHIN * edge) ** 2, norm(own[:, :3]), norm(other[:, :3])
    flat = near & (np.maximum(a, b) * length**2 < FLAT * edge)
    bent = near & ~flat
    cosine = dot(own[:, :3], other[:, :3]) / np.maximum(a * b, TINY)
    angle = np.where(flat, 0, np.where(near, np.degrees(np.arccos(np.clip(cosine, -1, 1))), np.nan))
    difference, size = (ours.area[near] @ vectors[near, 3:] ** 2 for vectors in (own - other, other))
    both = np.array([*zip(eigenvalues(ours, eigs), eigenvalues(theirs, eigsh), strict=False)])
    positive = both[both[:, 1] * theirs.area.sum() > 1]
    agreement = OperatorAgreement(
        points=len(a),
        compared=int(near.sum()),
        flat=int(flat.sum()),
        angle=_quantiles(angle[bent]),
        ratio=_quantiles(a[bent] / np.maximum(b[bent], TINY)),
        functions=float(np.median(np.sqrt(difference / np.maximum(size, TINY)))),
        eigenvalues=both,
        eigenvalue_ratio=float(np.median(positive[:, 0] / positive[:, 1])),
        folded=int(rings.folded(ours.places, ring_normals).sum()),
    )
    return angle, agreement


def _quantiles(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.percentile(values, at)) for name, at in QUANTILES.items()} if len(values) else {}
