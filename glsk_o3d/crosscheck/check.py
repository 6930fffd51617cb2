"""The check of a cloud against a mesh of it, with libigl: what is computed, and what it found."""

import warnings
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..contractor import Contractor
from ..errors import InvalidParameterError, SkeletonWarning
from ..interop.clouds import cloud_points
from ..interop.packages import require
from ..numerics.frame import MIN_POINTS
from ..numerics.morton import morton_order
from ..parameters import check_number
from ..pipeline import Pipeline
from ..recipes.catalogue import named_pipeline
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from ..thinner import Thinner
from . import agreement
from .mesh import SURFACES, mesh_skeleton, surface_of


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The result of the check of a cloud against a mesh.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "cannot tell" if the skeletons differ because the mesh is bad.
    reasons : tuple of str
        The reasons against a better verdict.
    surface : {"ball_pivoting", "poisson"}
    n_input : int
        Number of input points; `points` has fewer if the cloud was thinned.
    fit, rows, skeletons : MeshFit, RowAgreement, SkeletonAgreement
        The numbers that `to_dict` lists.
    points : (N, 3) float64 array
        The used points, in the user's order and units, as all below.
    angle : (N,) float64 array
        Between our Laplacian coordinates and the mesh's, in degrees; NaN if not comparable, 0 where both are flat.
    skeleton, mesh_skeleton : Skeleton
    vertices : (V, 3) float64 array
        The mesh. If it has the cloud's own points, they are denoised.
    faces : (F, 3) int64 array
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
    skeleton: Skeleton = field(repr=False)
    mesh_skeleton: Skeleton = field(repr=False)
    vertices: np.ndarray = field(repr=False)
    faces: np.ndarray = field(repr=False)

    @property
    def doubtful(self) -> np.ndarray:
        """Points where the Laplacian coordinates differ by more than 30 degrees, or could not be compared."""
        return ~(self.angle <= agreement.TURNED_ANGLE)

    def to_dict(self) -> dict[str, Any]:
        """The verdict and all numbers except those of single points, as for JSON."""
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
            "skeletons": asdict(self.skeletons),
        }


def cross_check(
    cloud: Any, method: str = "auto", *, pipeline: Pipeline | str = "default", max_points: int | None = 16384
) -> CrossCheck:
    """Check a cloud's Laplacian and skeleton against those of a mesh, computed with libigl (Au et al. 2008).

    A SkeletonWarning says that the cloud was thinned; others come from the pipeline.

    Parameters
    ----------
    cloud : cloud
        Anything `glsk_o3d.skeletonize` takes.
    method : {"auto", "ball_pivoting", "poisson"}
        How the mesh is made. "auto" is ball pivoting, or Poisson if that closes less than 70 % of the rings.
    pipeline : Pipeline or str
        ... | RingBuilder | Contractor | ... | Refiner. The mesh's skeleton is made with the same parameters but without
        reduction.
    max_points : int or None
        Larger clouds are thinned to this number, evenly along their Morton curve. None for no limit.

    Returns
    -------
    CrossCheck

    Raises
    ------
    InvalidCloudError
        The points cannot be skeletonised, or no surface can be reconstructed.
    InvalidParameterError
        An argument is wrong.
    MissingPackageError
        libigl or Open3D is not installed.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> check = cross_check(torus(2048).points)
    >>> check.verdict, check.skeletons.loops
    ('agrees', (1, 1))
    """
    pipeline = named_pipeline(pipeline) if isinstance(pipeline, str) else pipeline
    kinds = [type(stage) for stage in pipeline.stages] if isinstance(pipeline, Pipeline) else []
    if RingBuilder not in kinds or Contractor not in kinds:
        raise InvalidParameterError(f"pipeline = {pipeline!r}: must have a RingBuilder and a Contractor")
    if method not in ("auto", *SURFACES):
        raise InvalidParameterError(f"method = {method!r}: must be 'auto' or {' or '.join(map(repr, SURFACES))}")
    check_number("max_points", max_points, "int?", low=MIN_POINTS)
    pipeline.check()
    pipeline.check_complete()
    require("igl")  # before the work that it is for
    given = cloud_points(cloud)
    points = _thinned(given, max_points)
    rings = kinds.index(RingBuilder) + 1
    state = Pipeline(*(stage for stage in pipeline.stages[:rings] if not isinstance(stage, Thinner)))(points)
    skeleton = Pipeline(*pipeline.stages[rings:])(state)
    surface, vertices, faces = surface_of(state, method)
    angle, rows = agreement.compare_rows(state, vertices, faces)
    other = mesh_skeleton(state, vertices, faces, pipeline)
    step = agreement.COMPARISON_STEP * state.frame.diagonal * state.frame.scale
    skeletons = agreement.compare_skeletons(skeleton, other, step)
    fit = agreement.mesh_fit(state, vertices, faces)
    verdict, reasons = agreement.judge(rows, skeletons, fit, skeleton.report.warnings, other.report)
    return CrossCheck(
        verdict=verdict,
        reasons=reasons,
        surface=surface,
        n_input=len(given),
        fit=fit,
        rows=rows,
        skeletons=skeletons,
        points=points,
        angle=np.where(state.sampled, angle[state.representative_of_point], np.nan),
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
