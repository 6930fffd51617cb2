"""The check of a cloud against a mesh of it, with libigl: what is computed, and what it found."""

from __future__ import annotations

import warnings
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import InvalidCloudError, InvalidParameterError, SkeletonWarning
from ..interop.clouds import cloud_points
from ..numerics.morton import morton_order
from ..pipeline import Pipeline
from ..preparation.frame import MIN_POINTS
from ..recipes.catalogue import named_pipeline
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from . import agreement
from .mesh import COVERED_SHARE, SURFACES, mesh_skeleton, surface_of


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """What the check of a cloud against a mesh found.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        The last where the skeletons differ and the mesh is no good, so that this says nothing about the cloud.
    reasons : tuple of str
        What speaks against a better verdict.
    surface : {"ball_pivoting", "poisson", "given"}
        The mesh.
    n_input : int
        Points that were given; fewer are in `points` if the cloud was thinned.
    fit : MeshFit
    rows : RowAgreement
    skeletons : SkeletonAgreement
    points : (N, 3) float64 array
        The points that were used, in the user's order and units, as all below.
    angle : (N,) float64 array
        Between our Laplacian coordinates and the mesh's, in degrees; NaN where they could not be compared, 0 where both
        are flat.
    length_ratio : (N,) float64 array
        Ours over the mesh's; NaN alike.
    ring_share : (N,) float64 array
        Triangles of the ring in the mesh, over those in either; NaN where rows are not one to one.
    skeleton, mesh_skeleton : Skeleton
    vertices : (V, 3) float64 array
        The mesh, if it has the cloud's own points, these as they are after denoising.
    faces : (F, 3) int64 array

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> check = cross_check(torus(2000).points)
    >>> check.verdict, check.skeletons.loops
    ('agrees', (1, 1))
    """

    verdict: str
    reasons: tuple[str, ...]
    surface: str
    n_input: int
    fit: agreement.MeshFit
    rows: agreement.RowAgreement
    skeletons: agreement.SkeletonAgreement
    points: np.ndarray = field(repr=False)
    angle: np.ndarray = field(repr=False)
    length_ratio: np.ndarray = field(repr=False)
    ring_share: np.ndarray = field(repr=False)
    skeleton: Skeleton = field(repr=False)
    mesh_skeleton: Skeleton = field(repr=False)
    vertices: np.ndarray = field(repr=False)
    faces: np.ndarray = field(repr=False)

    @property
    def doubtful(self) -> np.ndarray:
        """Points where the Laplacian coordinates differ by more than 30 degrees, or could not be compared."""
        return ~(self.angle <= agreement.TURNED_ANGLE)

    def to_dict(self) -> dict[str, Any]:
        """The verdict and all numbers but those of single points, as JSON holds them."""
        return {
            "verdict": self.verdict,
            "reasons": list(self.reasons),
            "surface": self.surface,
            "points": {
                "given": self.n_input,
                "used": len(self.points),
                "turned": int((self.angle > agreement.TURNED_ANGLE).sum()),
                "not_compared": int(np.isnan(self.angle).sum()),
            },
            "mesh": {"vertices": len(self.vertices), "faces": len(self.faces), **asdict(self.fit)},
            "rows": asdict(self.rows),
            "skeletons": {**asdict(self.skeletons), "topology": self.skeletons.topology},
            "warnings": list(self.skeleton.report.warnings),
            "stop_reasons": [self.skeleton.report.stop_reason, self.mesh_skeleton.report.stop_reason],
            "thresholds": {
                "angle": agreement.TURNED_ANGLE,
                "distance_in_radii": [agreement.NEAR_RADII, agreement.FAR_RADII],
                "hausdorff95_in_radii": agreement.HAUSDORFF_RADII,
                "covered": COVERED_SHARE,
                "far_or_open": agreement.FAULTY_SHARE,
                "torn": agreement.FAULTY_SHARE,
            },
            "convention": "L = 2 igl.cotmatrix: rows sum to 0, off-diagonals are positive, L P points inward",
        }


def cross_check(
    cloud: Any,
    mesh: Any = "auto",
    *,
    pipeline: Pipeline | str = "default",
    max_points: int | None = 16384,
) -> CrossCheck:
    """Check a cloud's Laplacian and skeleton against those of a mesh, computed with libigl.

    Parameters
    ----------
    cloud : cloud
        Anything `glsk_o3d.skeletonize` takes.
    mesh : {"auto", "ball_pivoting", "poisson"} or a triangle mesh
        How to reconstruct one, or a mesh of the cloud's surface in its units: an Open3D TriangleMesh of either kind, or
        a pair of arrays (V, 3) and (F, 3). "auto" is ball pivoting, or Poisson where that closes less than 70 % of the
        rings.
    pipeline : Pipeline or str
        RingBuilder | Contractor | ... | Refiner. The mesh's skeleton is made with the same parameters but without
        reduction.
    max_points : int or None
        Larger clouds are thinned to so many points, evenly along their Morton curve, with a warning. None for no limit.

    Returns
    -------
    CrossCheck

    Raises
    ------
    InvalidCloudError
        The points cannot be skeletonised, no surface be reconstructed from them, or the mesh lies elsewhere.
    InvalidParameterError
        An argument is wrong.
    MissingPackageError
        libigl or Open3D is not installed.

    Warns
    -----
    SkeletonWarning
        The cloud was thinned; and whatever the pipeline warns of.

    References
    ----------
    Au et al. 2008, "Skeleton extraction by mesh contraction"; Meyer et al. 2003, "Discrete differential-geometry
    operators for triangulated 2-manifolds".

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> check = cross_check(torus(2048).points)
    >>> check.verdict, check.skeletons.loops
    ('agrees', (1, 1))
    """
    pipeline = named_pipeline(pipeline) if isinstance(pipeline, str) else pipeline
    if not isinstance(pipeline, Pipeline) or not isinstance(pipeline.stages[0], RingBuilder):
        raise InvalidParameterError(f"pipeline = {pipeline!r}: must be one that starts with a RingBuilder")
    if isinstance(mesh, str) and mesh not in ("auto", *SURFACES):
        raise InvalidParameterError(f"mesh = {mesh!r}: must be 'auto', {', '.join(map(repr, SURFACES))}, or a mesh")
    if max_points is not None and not (isinstance(max_points, int | np.integer) and max_points >= MIN_POINTS):
        words = f"must be None or a whole number of at least {MIN_POINTS}"
        raise InvalidParameterError(f"max_points = {max_points!r}: {words}")
    pipeline.check()
    pipeline.check_complete()
    given = cloud_points(cloud)
    points = _thinned(given, max_points)
    state = replace(pipeline.stages[0], thin_to="all")(points)
    skeleton = Pipeline(*pipeline.stages[1:])(state)
    surface, vertices, faces = surface_of(state, mesh)
    numbers, rows = agreement.compare_rows(state, vertices, faces)
    if rows.compared == 0 and surface == "given":
        raise InvalidCloudError("no point of the cloud lies on the mesh: both must be in the same units and place")
    other = mesh_skeleton(state, vertices, faces, pipeline)
    skeletons = agreement.compare_skeletons(skeleton, other, state.frame.diagonal * state.frame.scale)
    fit = agreement.mesh_fit(state, vertices, faces)
    verdict, reasons = agreement.judge(rows, skeletons, fit, skeleton.report.warnings, other.report)
    angle, length, share = np.where(state.sampled, numbers[:, state.representative_of_point], np.nan)
    return CrossCheck(
        verdict=verdict,
        reasons=reasons,
        surface=surface,
        n_input=len(given),
        fit=fit,
        rows=rows,
        skeletons=skeletons,
        points=points,
        angle=angle,
        length_ratio=length,
        ring_share=share,
        skeleton=skeleton,
        mesh_skeleton=other,
        vertices=state.frame.out_of(vertices),
        faces=faces,
    )


def _thinned(points, most):
    """At most so many points, evenly along the Morton curve; and all that are not finite, for others to judge."""
    finite = np.isfinite(points).all(axis=1)
    good = np.flatnonzero(finite)
    if most is None or len(good) <= most:
        return points
    told = f"{most} of {len(good)} points are checked: raise max_points to use more, and wait longer"
    warnings.warn(told, SkeletonWarning, stacklevel=3)
    kept = np.linspace(0, len(good) - 1, most).round().astype(int)
    return points[np.sort(np.append(good[morton_order(points[good])[kept]], np.flatnonzero(~finite)))]
