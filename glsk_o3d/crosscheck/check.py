"""The check of a cloud against a mesh of it, with libigl: what is computed, and what it found."""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..contractor import Contractor
from ..driver import as_pipeline
from ..errors import InvalidParameterError
from ..interop.packages import require
from ..numerics.morton import morton_order
from ..pipeline import Pipeline
from ..points import surface_points
from ..report import warn
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from ..state import Contraction
from ..thinner import Thinner
from . import agreement
from .mesh import ball_pivoting, mesh_skeleton

MOST_POINTS = 16384  # measured: they take about three seconds


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The result of the check of a cloud against a mesh.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "cannot tell" if the skeletons differ because the mesh is bad.
    reasons : tuple of str
        The reasons against a better verdict.
    n_input : int
        Number of input points; `points` has fewer if the cloud was thinned.
    rows, skeletons : RowAgreement, SkeletonAgreement
        The numbers that `to_dict` lists.
    points : (N, 3) float64 array
        The used points, in the user's order and units, as all below.
    angle : (N,) float64 array
        Between our Laplacian coordinates and the mesh's, in degrees; NaN if not comparable, 0 where both are flat.
    skeleton, mesh_skeleton : Skeleton
    vertices : (V, 3) float64 array
        The mesh: the distinct points, denoised.
    faces : (F, 3) int64 array
    """

    verdict: str
    reasons: tuple[str, ...]
    n_input: int
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
            "points": {
                "given": self.n_input,
                "used": len(self.points),
                "turned": int((self.angle > agreement.TURNED_ANGLE).sum()),
                "not_compared": int(np.isnan(self.angle).sum()),
            },
            "mesh": {"vertices": len(self.vertices), "faces": len(self.faces)},
            "rows": asdict(self.rows),
            "skeletons": asdict(self.skeletons),
        }


def cross_check(cloud: Any, *, pipeline: Pipeline[Any] | str = "default") -> CrossCheck:
    """Check a cloud's Laplacian and skeleton against those of a mesh, computed with libigl (Au et al. 2008).

    A cloud of more than 16384 points is thinned to so many, evenly along its Morton curve, with a SkeletonWarning;
    others come from the pipeline.

    Parameters
    ----------
    cloud : cloud
        Anything `glsk_o3d.skeletonize` takes.
    pipeline : Pipeline or str
        ... | RingBuilder | Contractor | ... | Refiner. The mesh's skeleton is made with the same parameters but without
        reduction.

    Returns
    -------
    CrossCheck

    Raises
    ------
    InvalidCloudError
        The points cannot be skeletonised, or no surface can be reconstructed.
    InvalidParameterError
        The pipeline is wrong.
    MissingPackageError
        libigl or Open3D is not installed.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> check = cross_check(torus(2048).points)
    >>> check.verdict, check.skeletons.loops
    ('agrees', (1, 1))
    """
    pipeline = as_pipeline(pipeline)
    kinds = [type(stage) for stage in pipeline.stages]
    if RingBuilder not in kinds or Contractor not in kinds:
        raise InvalidParameterError(f"pipeline = {pipeline!r}: must have a RingBuilder and a Contractor")
    require("igl")  # before the work that it is for
    given = surface_points(cloud)
    points = _thinned(given)
    rings = kinds.index(RingBuilder) + 1
    state: Contraction = Pipeline(*(each for each in pipeline.stages[:rings] if not isinstance(each, Thinner)))(points)
    skeleton: Skeleton = Pipeline(*pipeline.stages[rings:])(state)
    faces = ball_pivoting(state)
    angle, rows = agreement.compare_rows(state, faces)
    other = mesh_skeleton(state, faces, pipeline)
    step = agreement.COMPARISON_STEP * state.frame.diagonal * state.frame.scale
    skeletons = agreement.compare_skeletons(skeleton, other, step)
    verdict, reasons = agreement.judge(rows, skeletons, skeleton.report.warnings, other.report)
    return CrossCheck(
        verdict=verdict,
        reasons=reasons,
        n_input=len(given),
        rows=rows,
        skeletons=skeletons,
        points=points,
        angle=np.where(state.has_normal, angle[state.representative_of_point], np.nan),
        skeleton=skeleton,
        mesh_skeleton=other,
        vertices=state.frame.out_of(state.cloud),
        faces=faces,
    )


def _thinned(points: np.ndarray) -> np.ndarray:
    """At most so many points, evenly along the Morton curve; and all that are not finite, for others to judge."""
    finite = np.isfinite(points).all(axis=1)
    good = np.flatnonzero(finite)
    if len(good) <= MOST_POINTS:
        return points
    warn([f"{MOST_POINTS} of {len(good)} points are checked, spread evenly over the cloud"])
    kept = np.linspace(0, len(good) - 1, MOST_POINTS).round().astype(int)
    return points[np.sort(np.append(good[morton_order(points[good])[kept]], np.flatnonzero(~finite)))]
