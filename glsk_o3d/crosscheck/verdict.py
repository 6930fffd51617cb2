"""Whether a cloud is dense and clean enough for its rings: the same computed on a mesh of it, with libigl."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidCloudError, InvalidParameterError, SkeletonWarning
from ..interop.clouds import cloud_points
from ..io.meshes import mesh_arrays
from ..numerics.mesh_rings import clean_faces, umbrellas
from ..numerics.morton import morton_order
from ..pipeline import Pipeline
from ..preparation.frame import MIN_POINTS
from ..recipes.catalogue import named_pipeline
from ..report import REFUSED, Report
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from .agreement import MeshFit, RowAgreement, SkeletonAgreement, compare_rows, compare_skeletons, mesh_fit
from .mesh_contraction import mesh_skeleton
from .reconstruction import ball_pivoting, poisson, without_bare

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"

SURFACES = {"ball_pivoting": ball_pivoting, "poisson": poisson}
COVERED = 0.7  # share of the closed rings that ball pivoting must close, or Poisson steps in
SAME = 1e-6  # of the diagonal: nearer vertices are points of the cloud, whichever file has fewer digits

# What separates clean, dense samples of known shapes from sparse and noisy ones; see docs/crosscheck.md.
TURNED = 30.0  # degrees
NEAR, FAR = 0.2, 0.5  # local radii
ASTRAY = 1.0  # local radii
UNLIKE = 0.05  # share of the cloud far from the mesh, or of the mesh torn off or on borders that the cloud has not
WHOLE = 0.99  # share of rings that close where the cloud has no gaps


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
    fit: MeshFit
    rows: RowAgreement
    skeletons: SkeletonAgreement
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
        return ~(self.angle <= TURNED)

    def to_dict(self) -> dict[str, Any]:
        """The verdict and all numbers but those of single points, as JSON holds them."""
        return {
            "verdict": self.verdict,
            "reasons": list(self.reasons),
            "surface": self.surface,
            "points": {
                "given": self.n_input,
                "used": len(self.points),
                "turned": int((self.angle > TURNED).sum()),
                "not_compared": int(np.isnan(self.angle).sum()),
            },
            "mesh": {"vertices": len(self.vertices), "faces": len(self.faces), **asdict(self.fit)},
            "rows": asdict(self.rows),
            "skeletons": {**asdict(self.skeletons), "topology": self.skeletons.topology},
            "warnings": list(self.skeleton.report.warnings),
            "stop_reasons": [self.skeleton.report.stop_reason, self.mesh_skeleton.report.stop_reason],
            "thresholds": {
                "angle": TURNED,
                "distance_in_radii": [NEAR, FAR],
                "hausdorff95_in_radii": ASTRAY,
                "covered": COVERED,
                "far_or_open": UNLIKE,
                "torn": UNLIKE,
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
    pipeline.check()
    if max_points is not None and not (isinstance(max_points, int | np.integer) and max_points >= MIN_POINTS):
        raise InvalidParameterError(
            f"max_points = {max_points!r}: must be None or a whole number of at least {MIN_POINTS}"
        )
    points = cloud_points(cloud)
    n_input = len(points)
    points = _thinned(points, max_points)
    state = replace(pipeline.stages[0], thin_to="all")(points)
    skeleton = Pipeline(*pipeline.stages[1:])(state)
    if not isinstance(skeleton, Skeleton):
        raise InvalidParameterError(f"{pipeline!r} does not lead to a skeleton")

    surface, vertices, faces = _surface(state, mesh)
    angle, length, share, rows = compare_rows(state, vertices, faces)
    if rows.compared == 0 and surface == "given":
        raise InvalidCloudError("no point of the cloud lies on the mesh: both must be in the same units and place")
    other = mesh_skeleton(state, vertices, faces, pipeline)
    diagonal = state.frame.diagonal * state.frame.scale
    skeletons = compare_skeletons(skeleton, other, diagonal)
    fit = mesh_fit(state, vertices, faces)
    verdict, reasons = judge(rows, skeletons, skeleton.report.warnings, other.report, fit)
    of_point = state.row_of_point
    angle, length, share = (np.where(state.witness, values[of_point], np.nan) for values in (angle, length, share))
    return CrossCheck(
        verdict=verdict,
        reasons=reasons,
        surface=surface,
        n_input=n_input,
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
    warnings.warn(
        f"{most} of {len(good)} points are checked: raise max_points to use more, and wait longer",
        SkeletonWarning,
        stacklevel=3,
    )
    kept = np.linspace(0, len(good) - 1, most).round().astype(int)
    finite[good] = False
    finite[good[morton_order(points[good])[kept]]] = True
    return points[finite | ~np.isfinite(points).all(axis=1)]


def _surface(state, mesh):
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
        if closes.sum() >= COVERED * state.rings.closed.sum() > 0:
            break
    if found is None:
        raise InvalidCloudError(
            f"no surface can be reconstructed from {len(state.cloud)} points by {' or '.join(names)}"
        )
    return found


def _given(state, vertices, faces):
    """A user's mesh in the frame, on the cloud's own points if these are its vertices."""
    good = state.witness
    distance, nearest = cKDTree(state.frame.into(state.points[good])).query(state.frame.into(vertices))
    if distance.max() < SAME * state.frame.diagonal:
        row = state.row_of_point[good][nearest]
        return state.cloud, clean_faces(state.cloud, row[faces])
    vertices = state.frame.into(vertices)
    return without_bare(vertices, clean_faces(vertices, faces))


def judge(
    rows: RowAgreement,
    skeletons: SkeletonAgreement,
    warned: Sequence[str] = (),
    mesh_report: Report | None = None,
    fit: MeshFit | None = None,
) -> tuple[str, tuple[str, ...]]:
    """The verdict on a cloud, and what speaks against a better one.

    Parameters
    ----------
    rows : RowAgreement
    skeletons : SkeletonAgreement
    warned : sequence of str
        What the cloud's own run warns of.
    mesh_report : Report, optional
        Of the mesh's run.
    fit : MeshFit, optional

    Returns
    -------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "do not trust" where the skeletons differ in components or loops, or lie more than half a radius apart on
        average; "cannot tell" instead where the mesh does not describe the cloud (a twentieth of it lies off, a
        twentieth of the mesh has borders that the cloud has not, a twentieth is torn off, smaller pieces of it are all
        that differs, or it closes around less than 70 % of the points whose rings close), where its contraction failed,
        and where no Laplacian coordinates could be compared. "agrees" where they lie within a fifth of a radius on
        average and a radius in 95 % of their length, the mesh closes around 70 % of the points whose rings close, three
        quarters of the Laplacian coordinates lie within 30 degrees, neither run warned of anything, and the contraction
        of the mesh did not fail.
    reasons : tuple of str
    """
    failed, grave, slight = [], [], []
    if mesh_report is not None and REFUSED in mesh_report.stop_reason:
        failed.append(f"the mesh's own contraction failed: {mesh_report.stop_reason}")  # it explains the others
    for name in ("components", "loops"):
        ours, theirs = getattr(skeletons, name)
        if ours != theirs:
            grave.append(f"{name}: {ours} in the skeleton of the cloud, {theirs} in that of the mesh")
    apart = skeletons.distance_in_radii
    if apart > NEAR:
        (grave if apart > FAR else slight).append(f"the skeletons lie {apart:.2f} local radii apart on average")
    if skeletons.hausdorff95_in_radii > ASTRAY:
        slight.append(
            f"5 % of a skeleton are more than {skeletons.hausdorff95_in_radii:.1f} local radii from the other"
        )
    turned = rows.angle and rows.angle["p75"] > TURNED
    if slight or apart > FAR:
        agree = rows.one_to_one and rows.covered >= COVERED and not turned
        if agree and rows.closed >= WHOLE * rows.rows and skeletons.topology and not failed:
            slight.append("the rings agree: it is the shape, not the sampling; in a blob a curve may run anywhere")
    if not rows.compared:
        failed.append("no Laplacian coordinates could be compared")
    elif rows.covered < COVERED:
        (failed if grave else slight).append(
            f"the mesh closes around {rows.covered:.0%} of the points whose rings close"
        )
    if turned:
        slight.append(f"a quarter of the Laplacian coordinates are turned by more than {rows.angle['p75']:.0f} degrees")
    slight += [f"the run itself warns: {message}" for message in warned]
    if mesh_report is not None:
        slight += [f"the mesh's run warns: {message}" for message in mesh_report.warnings if message not in warned]
    if grave and fit is not None:
        failed += _faults(fit)
        ours, theirs = skeletons.components
        if len(grave) == 1 and 0 < theirs - ours <= fit.pieces - fit.parts:  # crumbs explain this, and nothing else
            failed.append(f"the mesh does not describe the cloud: {fit.pieces} pieces of it, {fit.parts} of the cloud")
    if failed and (grave or not rows.compared):
        return UNTOLD, (*failed, *grave, *slight)
    return (DISTRUST if grave else IN_PART if failed or slight else AGREES), (*failed, *grave, *slight)


def _faults(fit):
    """Why a mesh does not describe the cloud."""
    if fit.far > UNLIKE:
        yield f"the mesh does not describe the cloud: {fit.far:.0%} of the points lie more than a point spacing off it"
    if fit.open > UNLIKE:
        yield f"the mesh does not describe the cloud: {fit.open:.0%} of it are at holes that the cloud has not"
    if fit.torn > UNLIKE:
        yield f"the mesh does not describe the cloud: {fit.torn:.0%} of it are torn off where the cloud holds together"
