"""The check of a cloud against a mesh, with libigl: what is computed, and what it found."""

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ...analysis.agreement import OperatorAgreement, SkeletonAgreement, compare_skeletons
from ...api import as_pipeline
from ...data.contraction import Contraction
from ...data.points import Points
from ...data.skeleton import Skeleton
from ...errors import InvalidCloudError, InvalidParameterError
from ...filters.contractor import Contractor
from ...filters.ring_builder import RingBuilder
from ...filters.thinner import Thinner
from ...geometry.cotangent import Operator, ring_operator
from ...geometry.inscribed_balls import outward_normals
from ...geometry.neighbourhoods import spacing
from ...geometry.vectors import box
from ...interop.clouds import SurfaceMesh, surface_mesh
from ...interop.packages import require
from ...pipeline import Pipeline
from . import agreement, operators
from .mesh import mesh_skeleton
from .solid import Solid, ball_pivoting, given, poisson

MESH_KINDS = ("auto", "poisson", "ball_pivoting")
COMPARISON_STEP = 0.002  # precision: of the diagonal: spacing of the places where skeletons are compared
LEAST_SURFACE = 1e-9  # precision: of a surface in the working frame
DOUBTFUL_ANGLE = 30.0  # measured: degrees by which the mean curvature vectors differ where points are doubtful


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The result of the check of a cloud against a mesh.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "cannot tell" if cloud and mesh differ because the mesh is bad.
    probability : float
        That the skeleton has the right components, loops and limbs, as measured on shapes with known axes.
    reasons : tuple of str
        What speaks against it, with the places.
    rows, skeletons, mesh : OperatorAgreement, SkeletonAgreement, MeshFacts
    points : (N, 3) float64 array
        The input points, in the user's order and units, as are the skeletons and the solid.
    angle : (N,) float64 array
        Between the mean curvature vectors of cloud and mesh, in degrees; NaN where the mesh is too far away, 0 where
        both are flat.
    skeleton, mesh_skeleton, solid : Skeleton, Skeleton, Solid
    ours, theirs : Operator
        The Laplacians of the contracted points and of the mesh, in the working frame.
    """

    verdict: str
    probability: float
    reasons: tuple[str, ...]
    rows: OperatorAgreement
    skeletons: SkeletonAgreement
    mesh: agreement.MeshFacts
    points: np.ndarray = field(repr=False)
    angle: np.ndarray = field(repr=False)
    skeleton: Skeleton = field(repr=False)
    mesh_skeleton: Skeleton = field(repr=False)
    solid: Solid = field(repr=False)
    ours: Operator = field(repr=False)
    theirs: Operator = field(repr=False)

    @property
    def doubtful(self) -> np.ndarray:
        """Points where the mean curvature vectors differ by more than 30 degrees, or could not be compared."""
        return ~(self.angle <= DOUBTFUL_ANGLE)

    def to_dict(self) -> dict[str, Any]:
        """The verdict and all numbers except those of single points, as for JSON."""
        solid, rows = self.solid, asdict(self.rows)
        counts = dict(vertices=len(solid.vertices), faces=len(solid.faces), solids=solid.n_solids, genus=solid.genus)
        parts = dict(watertight=solid.is_watertight, parts=[part._asdict() for part in solid.parts])
        return {
            "verdict": self.verdict,
            "probability": self.probability,
            "reasons": list(self.reasons),
            "points": {"given": len(self.points), "doubtful": int(self.doubtful.sum())},
            "mesh": {"made_by": solid.made_by, **counts, **parts, **asdict(self.mesh)},
            "rows": rows | {"eigenvalues": rows["eigenvalues"].tolist()},
            "skeletons": asdict(self.skeletons),
        }


def cross_check(cloud: Any, *, pipeline: Pipeline[Any, Any] | str = "default", mesh: Any = "auto") -> CrossCheck:
    """Check a cloud's Laplacian and skeleton against those of a mesh, computed with libigl (Au et al. 2008).

    Parameters
    ----------
    cloud : cloud
    pipeline : Pipeline or str
        ... | RingBuilder | Contractor | ... | Refiner; the mesh's has the same parameters but no reduction.
    mesh : {"auto", "poisson", "ball_pivoting"}, TriangleMesh, or (vertices, faces)
        "poisson" reconstructs a mesh with vertices of its own, "ball_pivoting" one with the cloud's points as vertices;
        "auto" takes the triangles of `cloud` if it has some that are not too coarse, else "poisson". One of the user's
        is in the cloud's units.

    Returns
    -------
    CrossCheck

    Raises
    ------
    InvalidCloudError
        The points cannot be skeletonised, or have no surface.
    InvalidParameterError
        The pipeline or the mesh is wrong, or the mesh is too coarse.
    MissingPackageError

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> check = cross_check(torus(2048).points)
    >>> check.verdict, check.skeletons.loops, check.solid.genus
    ('agrees', (1, 1), 1)
    """
    pipeline = as_pipeline(pipeline)
    kinds = [type(stage) for stage in pipeline.stages]
    if RingBuilder not in kinds or Contractor not in kinds:
        raise InvalidParameterError(f"pipeline = {pipeline!r}: must have a RingBuilder and a Contractor")
    if isinstance(mesh, str) and mesh not in MESH_KINDS:
        raise InvalidParameterError(f"mesh = {mesh!r}: must be one of {MESH_KINDS}, a mesh, or (vertices, faces)")
    require("igl")  # before the work that it is for
    rings = kinds.index(RingBuilder)
    builder: Any = pipeline.stages[rings]
    thinner = kinds.index(Thinner) if Thinner in kinds[:rings] else rings
    dense = Pipeline(*pipeline.stages[:thinner])(cloud) if thinner else cloud
    dense = dense if isinstance(dense, Points) else Points.of(dense)
    points: Points = Pipeline(*pipeline.stages[thinner:rings])(dense) if thinner < rings else dense
    state: Contraction = builder(points)
    skeleton: Skeleton = Pipeline(*pipeline.stages[rings + 1 :])(state)

    ours, frame = ring_operator(state.positions, state.rings), state.frame
    if not ours.area.sum() > LEAST_SURFACE:
        raise InvalidCloudError("the points lie on a line: there is no surface to compare with")
    surface = state if points is dense else builder(dense)
    solid = _solid(cloud, mesh, surface, spacing(state.positions))
    theirs = operators.mesh_operator(solid)
    ring_normals = builder.neighbourhoods(points, ours.places)[1]
    angle, rows = operators.compare_operators(ours, state.rings, ring_normals, theirs, solid)
    in_units = replace(solid, vertices=frame.out_of(solid.vertices))
    other = mesh_skeleton(in_units, pipeline)
    at_surface = surface.positions, surface.normals[surface.survivors]
    facts = agreement.mesh_facts(solid, *at_surface, skeleton.n_components, other.report.stop_reason)
    skeletons = compare_skeletons(skeleton, other, COMPARISON_STEP * frame.diagonal * frame.scale)
    judgement = agreement.judge(rows, skeletons, solid, facts)
    angle = np.append(angle, np.nan)[state.survivor_of_point]
    return CrossCheck(*judgement, rows, skeletons, facts, state.points, angle, skeleton, other, in_units, ours, theirs)


def _solid(cloud: Any, mesh: Any, surface: Contraction, edge: float) -> Solid:
    """The mesh that is asked for, in the working frame; contracted points are one `edge` apart."""
    if not isinstance(mesh, str):
        return _users_solid(mesh, surface, edge)
    own = surface_mesh(cloud) if mesh == "auto" else None
    solid = given(own, surface.frame, edge) if own and np.isfinite(own.vertices).all() else None
    if solid is not None:
        return solid
    through = surface.positions, outward_normals(surface.positions, surface.normals[surface.survivors], surface.rings)
    return ball_pivoting(*through) if mesh == "ball_pivoting" else poisson(*through, edge)


def _users_solid(mesh: Any, surface: Contraction, edge: float) -> Solid:
    """The mesh that is given, refused where it is of something else or too coarse."""
    if isinstance(mesh, tuple) and (len(mesh) != 2 or np.shape(mesh[1])[1:] != (3,)):
        raise InvalidParameterError("mesh: must be vertices (V, 3) and faces (F, 3), or a triangle mesh")
    mesh, frame = surface_mesh(SurfaceMesh(*mesh) if isinstance(mesh, tuple) else mesh), surface.frame
    (low, high), (least, most) = box(surface.positions), box(frame.into(mesh.vertices))
    size, excess = (high - low).max(), np.maximum(low - least, most - high).max()
    if len(mesh.triangles) and not (excess < size and (most - least).max() > size / 2):
        raise InvalidParameterError("mesh: is larger or smaller than the cloud, or elsewhere: same units and place?")
    solid = given(mesh, frame, edge)
    if solid is None:
        why = f"it has no triangles, or edges too long for points {edge * frame.scale:.3g} apart"
        raise InvalidParameterError(f"mesh: {why}: remesh it, as by MeshLab's 'Isotropic Explicit Remeshing'")
    return solid
