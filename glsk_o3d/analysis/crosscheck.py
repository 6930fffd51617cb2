"""Whether a cloud is dense and clean enough for its rings: the same computed on a mesh of it, with libigl."""

from __future__ import annotations

import warnings
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidCloudError, InvalidParameterError, SkeletonWarning
from ..interop.meshes import mesh_arrays
from ..interop.open3d import cloud_points, require
from ..numerics.cotangent import cotangent_laplacian
from ..numerics.meshes import clean_faces, common_share, umbrellas
from ..numerics.ordering import morton_order
from ..pipeline import Pipeline
from ..pipelines import named_pipeline
from ..ring_builder import MIN_POINTS, RingBuilder
from ..skeleton import Skeleton
from .curves import distances
from .mesh_contraction import curvature_normals, mesh_areas, mesh_laplacian, mesh_skeleton, ring_areas
from .reconstruction import REACH, ball_pivoting, poisson, spacing, without_bare

AGREES, IN_PART, DISTRUST = VERDICTS = "agrees", "agrees in part", "do not trust"

SURFACES = {"ball_pivoting": ball_pivoting, "poisson": poisson}
COVERED = 0.7  # share of the closed rings that ball pivoting must close, or Poisson steps in
SAME = 1e-9  # of the diagonal: nearer vertices are points of the cloud
FLAT = 1e-3  # of the ring's size: smaller Laplacian coordinates have no direction
STEP = 0.002  # of the diagonal: spacing of the places where skeletons are compared

# What separates clean, dense samples of known shapes from sparse and noisy ones; see docs/crosscheck.md.
TURNED = 10.0  # degrees
NEAR, FAR = 0.2, 0.5  # local radii
ASTRAY = 1.0  # local radii


@dataclass(frozen=True)
class RowAgreement:
    """How the Laplacian coordinates of a cloud's rings agree with those of a mesh.

    Attributes
    ----------
    rows, closed : int
        Distinct points of the cloud, and those of them whose ring closes.
    compared : int
        Closed rings at which the mesh has a closed umbrella as well.
    covered : float
        The share `compared` of `closed`.
    one_to_one : bool
        Whether vertices of the mesh are points of the cloud, so that rows of the two matrices were compared. Otherwise
        mean curvature normals were: ours, and the mesh's interpolated at the nearest place on it.
    same_rings : float or None
        Share of the compared rings that are the mesh's one-rings: the same neighbours in the same cyclic order. None
        without `one_to_one`, as the next.
    common_triangles : float or None
        Mean over the compared rings of the triangles in both over those in either.
    flat : float
        Share of the compared rows that are flat in both, and so have no direction.
    angle : dict of str to float
        Quantiles over the compared rows of the angle between the two, in degrees; 0 is best.
    length : dict of str to float
        Quantiles of our length over the mesh's; 1 is best.
    """

    rows: int
    closed: int
    compared: int
    covered: float
    one_to_one: bool
    same_rings: float | None
    common_triangles: float | None
    flat: float
    angle: dict[str, float]
    length: dict[str, float]


@dataclass(frozen=True)
class SkeletonAgreement:
    """How the skeleton of a cloud and that of a mesh agree.

    Attributes
    ----------
    distance, distance_in_radii : float
        Mean distance from one to the nearest place on the other, the mean of both directions: as a share of the cloud's
        diagonal, and in local radii (the mean of the two skeletons' at these places).
    hausdorff95, hausdorff95_in_radii : float
        The 95 % quantile of these distances, of the worse direction.
    components, loops, leaves : (int, int)
        Of the cloud's and of the mesh's.
    """

    distance: float
    distance_in_radii: float
    hausdorff95: float
    hausdorff95_in_radii: float
    components: tuple[int, int]
    loops: tuple[int, int]
    leaves: tuple[int, int]

    @property
    def topology(self) -> bool:
        """Whether components and loops agree."""
        return self.components[0] == self.components[1] and self.loops[0] == self.loops[1]


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """What the check of a cloud against a mesh found.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust"}
    reasons : tuple of str
        What speaks against a better verdict.
    surface : {"ball_pivoting", "poisson", "given"}
        The mesh.
    n_input : int
        Points that were given; fewer are in `points` if the cloud was thinned.
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
    """

    verdict: str
    reasons: tuple[str, ...]
    surface: str
    n_input: int
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
        """Points where cloud and mesh differ by more than a right angle over three, or could not be compared."""
        return ~(self.angle <= 30)

    def to_dict(self) -> dict[str, Any]:
        """The verdict and all numbers but those of single points, as JSON holds them."""
        return {
            "verdict": self.verdict,
            "reasons": list(self.reasons),
            "surface": self.surface,
            "points": {"given": self.n_input, "used": len(self.points), "doubtful": int(self.doubtful.sum())},
            "mesh": {"vertices": len(self.vertices), "faces": len(self.faces)},
            "rows": asdict(self.rows),
            "skeletons": {**asdict(self.skeletons), "topology": self.skeletons.topology},
            "warnings": list(self.skeleton.report.warnings),
            "stop_reasons": [self.skeleton.report.stop_reason, self.mesh_skeleton.report.stop_reason],
            "thresholds": {
                "turned": TURNED, "near": NEAR, "far": FAR, "astray": ASTRAY, "covered": COVERED
            },
            "convention": "L = 2 igl.cotmatrix: rows sum to 0, off-diagonals are positive, L P points inward",
        }  # fmt: skip


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
        How to reconstruct one, or a mesh of the cloud's surface in its units: an Open3D TriangleMesh of either kind, or a
        pair of arrays (V, 3) and (F, 3). "auto" is ball pivoting, or Poisson where that closes less than 70 % of the
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
        The points cannot be skeletonised, or no surface be reconstructed from them.
    InvalidParameterError
        An argument is wrong, or the mesh lies elsewhere than the cloud.
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
    points = cloud_points(cloud)
    n_input = len(points)
    points = _thinned(points, max_points)
    state = pipeline.stages[0](points)
    skeleton = Pipeline(*pipeline.stages[1:])(state)
    if not isinstance(skeleton, Skeleton):
        raise InvalidParameterError(f"{pipeline!r} does not lead to a skeleton")

    surface, vertices, faces = _surface(state, mesh)
    angle, length, share, rows = _compare_rows(state, vertices, faces)
    if rows.compared == 0 and surface == "given":
        raise InvalidParameterError("no point of the cloud lies on the mesh: both must be in the same units and place")
    other = mesh_skeleton(state, vertices, faces, pipeline)
    diagonal = state.frame.diagonal * state.frame.scale
    skeletons = _compare_skeletons(skeleton, other, diagonal)
    verdict, reasons = judge(rows, skeletons)
    of_point = state.row_of_point
    angle, length, share = (
        np.where((of_point >= 0) & ~state.outlier, values[of_point], np.nan) for values in (angle, length, share)
    )
    return CrossCheck(
        verdict=verdict,
        reasons=reasons,
        surface=surface,
        n_input=n_input,
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
    if most is None or len(points) <= most:
        return points
    warnings.warn(
        f"the check is of {most} of {len(points)} points: raise max_points to use more, and wait longer",
        SkeletonWarning,
        stacklevel=3,
    )
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        return points  # the ring builder knows what to do, or to say
    kept = np.linspace(0, len(points) - 1, most).round().astype(int)
    return points[np.sort(morton_order(points)[kept])]


def _surface(state, mesh):
    """The name of a surface, its vertices in the frame (`state.cloud` itself if these are its points), its faces."""
    if not isinstance(mesh, str):
        return "given", *_given(state, *mesh_arrays(mesh))
    for name in ("ball_pivoting", "poisson") if mesh == "auto" else (mesh,):
        vertices, faces = SURFACES[name](state.cloud, state.normals, state.rings)
        closes = state.rings.closed & umbrellas(len(vertices), faces) if vertices is state.cloud else state.rings.closed
        if mesh == name or closes.sum() >= COVERED * state.rings.closed.sum() > 0:
            break
    if len(np.unique(faces)) < MIN_POINTS:
        raise InvalidCloudError(f"no surface can be reconstructed from {len(state.cloud)} points by {name}")
    return name, vertices, faces


def _given(state, vertices, faces):
    """A user's mesh in the frame, on the cloud's own points if these are its vertices."""
    good = (state.row_of_point >= 0) & ~state.outlier
    distance, nearest = cKDTree(state.frame.into(state.points[good])).query(state.frame.into(vertices))
    if distance.max() < SAME * state.frame.diagonal:
        row = state.row_of_point[good][nearest]
        return state.cloud, clean_faces(state.cloud, row[faces])
    vertices = state.frame.into(vertices)
    return without_bare(vertices, clean_faces(vertices, faces))


def _compare_rows(state, vertices, faces):
    """Angle, ratio of lengths, and share of common triangles of every distinct point; and all in numbers."""
    points, rings = state.cloud, state.rings
    matrix, other = cotangent_laplacian(points, rings), mesh_laplacian(vertices, faces)
    size = -matrix.diagonal() * rings.mean_lengths(points)  # of Laplacian coordinates as long as the ring is wide
    one_to_one = vertices is points
    if one_to_one:
        ours, theirs = matrix @ points, other @ points
        there = umbrellas(len(points), faces)
        share = common_share(rings, faces)
    else:
        areas = ring_areas(points, rings)
        ours = curvature_normals(matrix, areas, points)
        normals = curvature_normals(other, mesh_areas(vertices, faces), vertices)
        normals[~umbrellas(len(vertices), faces)] = np.nan
        theirs, distance = _on_mesh(points, vertices, faces, normals)
        there = np.isfinite(theirs).all(axis=1) & (distance < REACH * spacing(points))
        share = np.full(len(points), np.nan)
        size = size / np.where(areas > 0, 2 * areas, np.inf)
    compared = rings.closed & there & np.isfinite(ours).all(axis=1)
    a, b = np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1)
    flat = compared & (np.maximum(a, b) <= FLAT * np.abs(size))
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", ours, theirs) / (a * b)
        angle, length = np.degrees(np.arccos(np.clip(cosine, -1, 1))), a / b
    angle[flat], length[flat] = 0, 1
    angle[~compared] = length[~compared] = np.nan
    n = int(compared.sum())
    rows = RowAgreement(
        rows=len(points),
        closed=int(rings.closed.sum()),
        compared=n,
        covered=n / max(int(rings.closed.sum()), 1),
        one_to_one=one_to_one,
        same_rings=float((share[compared] == 1).mean()) if one_to_one and n else None,
        common_triangles=float(share[compared].mean()) if one_to_one and n else None,
        flat=float(flat.sum() / max(n, 1)),
        angle=_quantiles(angle[compared & ~flat], {"median": 50, "p75": 75, "p90": 90}),
        length=_quantiles(length[compared & ~flat], {"p10": 10, "median": 50, "p90": 90}),
    )
    return angle, length, share, rows


def _on_mesh(points, vertices, faces, values):
    """Values at the vertices of a mesh, interpolated at the places on it nearest to the points; and how far these are."""
    squared, face, place = require("igl", "libigl").point_mesh_squared_distance(points, vertices, faces)
    corner = vertices[faces[face]]
    weight = np.stack(
        [
            np.linalg.norm(np.cross(corner[:, i - 2] - place, corner[:, i - 1] - place), axis=1)
            for i in range(3)  # the area opposite to each corner
        ],
        axis=1,
    )
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("ni,nij->nj", weight, values[faces[face]]), np.sqrt(squared)


def _quantiles(values, which):
    values = values[np.isfinite(values)]
    return {name: float(np.percentile(values, at)) for name, at in which.items()} if len(values) else {}


def _compare_skeletons(ours, theirs, diagonal):
    step = STEP * diagonal
    both = [distances(ours, theirs, step), distances(theirs, ours, step)]
    return SkeletonAgreement(
        distance=float(np.mean([distance.mean() for distance, _ in both]) / diagonal),
        distance_in_radii=float(np.mean([(distance / radius).mean() for distance, radius in both])),
        hausdorff95=float(max(np.percentile(distance, 95) for distance, _ in both) / diagonal),
        hausdorff95_in_radii=float(max(np.percentile(distance / radius, 95) for distance, radius in both)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
        leaves=(len(ours.leaves), len(theirs.leaves)),
    )


def judge(rows: RowAgreement, skeletons: SkeletonAgreement) -> tuple[str, tuple[str, ...]]:
    """The verdict on a cloud, and what speaks against a better one.

    Parameters
    ----------
    rows : RowAgreement
    skeletons : SkeletonAgreement

    Returns
    -------
    verdict : {"agrees", "agrees in part", "do not trust"}
        "do not trust" where the skeletons differ in components or loops, or lie more than half a radius apart on
        average. "agrees" where they lie within a fifth of a radius on average and a radius in 95 % of their length, and
        the Laplacian coordinates within 10 degrees in the median.
    reasons : tuple of str
    """
    grave, slight = [], []
    for name in ("components", "loops"):
        ours, theirs = getattr(skeletons, name)
        if ours != theirs:
            grave.append(f"{name}: {ours} in the skeleton of the cloud, {theirs} in that of the mesh")
    apart = skeletons.distance_in_radii
    if apart > NEAR:
        (grave if apart > FAR else slight).append(f"the skeletons lie {apart:.2f} local radii apart on average")
    if skeletons.hausdorff95_in_radii > ASTRAY:
        slight.append(f"5 % of a skeleton are more than {skeletons.hausdorff95_in_radii:.1f} local radii from the other")
    if not rows.compared:
        slight.append("no Laplacian coordinates could be compared")
    elif rows.covered < COVERED:
        slight.append(f"the mesh closes around {rows.covered:.0%} of the points whose rings close")
    if rows.angle and rows.angle["median"] > TURNED:
        slight.append(f"the Laplacian coordinates are turned by {rows.angle['median']:.0f} degrees in the median")
    return (DISTRUST if grave else IN_PART if slight else AGREES), (*grave, *slight)
