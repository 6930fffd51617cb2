"""The check of a cloud against a mesh of it, with libigl: what is computed, what it found, and a picture of it."""

import os
import warnings
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..contractor import Contractor
from ..errors import InvalidCloudError, InvalidParameterError, SkeletonWarning
from ..interop.atomic import check_ending
from ..interop.clouds import cloud_points
from ..interop.packages import require
from ..numerics.frame import MIN_POINTS
from ..numerics.morton import morton_order
from ..pipeline import Pipeline
from ..recipes.catalogue import named_pipeline
from ..ring_builder import RingBuilder
from ..skeleton import Skeleton
from ..thinner import Thinner
from ..viewing import figures
from . import agreement
from .mesh import COVERED_SHARE, SURFACES, mesh_skeleton, surface_of

_OURS, _THEIRS, _UNKNOWN = "#111111", "#0a6fc2", "#c9c9c9"

# All fitted to the eye.
_MOST_REASONS = 3  # lines of text
_MOST_DEGREES = 60.0  # at which the colours end
_HEAD_ROOM, _FOOT_ROOM = 0.95, 0.57  # inches above and below the three views


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The result of the check of a cloud against a mesh.

    Attributes
    ----------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "cannot tell" if the skeletons differ because the mesh is bad.
    reasons : tuple of str
        The reasons against a better verdict.
    surface : {"ball_pivoting", "poisson", "given"}
    n_input : int
        Number of input points; `points` has fewer if the cloud was thinned.
    fit, rows, skeletons : MeshFit, RowAgreement, SkeletonAgreement
        The numbers that `to_dict` lists.
    points : (N, 3) float64 array
        The used points, in the user's order and units, as all below.
    angle : (N,) float64 array
        Between our Laplacian coordinates and the mesh's, in degrees; NaN if not comparable, 0 where both are flat.
    length_ratio : (N,) float64 array
        Ours over the mesh's; NaN as in `angle`.
    ring_share : (N,) float64 array
        Triangles common to ring and mesh over those in either; NaN if rows are not one to one.
    skeleton, mesh_skeleton : Skeleton
    vertices : (V, 3) float64 array
        The mesh. If it has the cloud's own points, they are denoised.
    faces : (F, 3) int64 array

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> cross_check(torus(1000).points).doubtful.shape
    (1000,)
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
    cloud: Any, mesh: Any = "auto", *, pipeline: Pipeline | str = "default", max_points: int | None = 16384
) -> CrossCheck:
    """Check a cloud's Laplacian and skeleton against those of a mesh, computed with libigl (Au et al. 2008).

    A SkeletonWarning says that the cloud was thinned; others come from the pipeline.

    Parameters
    ----------
    cloud : cloud
        Anything `glsk_o3d.skeletonize` takes.
    mesh : {"auto", "ball_pivoting", "poisson"} or a triangle mesh
        The reconstruction, or a mesh of the cloud's surface in its units: an Open3D TriangleMesh of either kind, or a
        pair of arrays (V, 3) and (F, 3). "auto" is ball pivoting, or Poisson if that closes less than 70 % of the
        rings.
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
        The points cannot be skeletonised, no surface can be reconstructed, or the mesh is elsewhere.
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
    if isinstance(mesh, str) and mesh not in ("auto", *SURFACES):
        raise InvalidParameterError(f"mesh = {mesh!r}: must be 'auto', {', '.join(map(repr, SURFACES))}, or a mesh")
    if max_points is not None and not (isinstance(max_points, int | np.integer) and max_points >= MIN_POINTS):
        words = f"must be None or a whole number of at least {MIN_POINTS}"
        raise InvalidParameterError(f"max_points = {max_points!r}: {words}")
    pipeline.check()
    pipeline.check_complete()
    require("igl")  # before the work that it is for
    given = cloud_points(cloud)
    points = _thinned(given, max_points)
    rings = kinds.index(RingBuilder) + 1
    state = Pipeline(*(stage for stage in pipeline.stages[:rings] if not isinstance(stage, Thinner)))(points)
    skeleton = Pipeline(*pipeline.stages[rings:])(state)
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


def save_crosscheck_picture(
    check: CrossCheck, path: str | os.PathLike, *, size: tuple[int, int] = (1800, 860), title: str | None = None
) -> None:
    """Draw a cross-check from three sides into a PNG file.

    Points are pale yellow where the Laplacian coordinates of cloud and mesh have the same direction, up to dark red at
    60 degrees and more. Grey points could not be compared. The worst points are on top. The cloud's skeleton is black,
    that of the mesh blue.

    Parameters
    ----------
    check : CrossCheck
    path : path-like
        PNG; it appears complete or not at all.
    size : (width, height)
        In pixels.
    title : str, optional
        Before the verdict.

    Raises
    ------
    FileFormatError
        The ending is not ``.png``.
    MissingPackageError
        matplotlib is not installed.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_crosscheck_picture(cross_check(torus(1000).points), f"{folder}/where.png")
    """
    check_ending(path, "picture is a PNG", ".png")
    figures.save_figure(_drawn(check, size, title), path)


def _drawn(check, size, title):
    figure = figures.new_figure(np.divide(size, figures.DPI))
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize, to_rgba

    shown = figures.thinned(check.points, figures.MOST_DRAWN_POINTS)
    shown = shown[np.argsort(np.nan_to_num(check.angle[shown], nan=-1), kind="stable")]  # the worst lie on top
    points, angle = check.points[shown], check.angle[shown]
    both = [points, check.skeleton.vertices, check.mesh_skeleton.vertices]  # they may differ widely
    centre, extent = figures.room(np.concatenate(both))
    scale = ScalarMappable(Normalize(0, _MOST_DEGREES, clip=True), colormaps["YlOrRd"])
    colours = np.where(np.isnan(angle)[:, None], to_rgba(_UNKNOWN), scale.to_rgba(np.nan_to_num(angle)))
    dot = float(np.clip(16000 / max(len(points), 1), 2, 6))
    for a, b, axes in figures.three_views(figure, extent, head=_HEAD_ROOM, foot=_FOOT_ROOM):
        axes.scatter(*(points - centre)[:, [a, b]].T, s=dot, c=colours, linewidths=0, clip_on=False)
        for skeleton, colour, line in ((check.mesh_skeleton, _THEIRS, 2.6), (check.skeleton, _OURS, 1.2)):
            places = (skeleton.vertices - centre)[:, [a, b]]
            for paint, wider in (("white", 1.4), (colour, 0)):  # a white edge lifts it off the cloud
                style = dict(colors=paint, linewidths=line + wider, capstyle="round", clip_on=False)
                axes.add_collection(LineCollection(places[skeleton.edges], **style))
            alone = skeleton.degree == 0
            axes.scatter(*places[alone].T, s=16, c=colour, linewidths=0, zorder=3, clip_on=False)
    height = figure.get_figheight()
    _write(figure, check, title, height)
    box = [0.42, 0.3 / height, 0.16, 0.09 / height]
    bar = figure.colorbar(scale, cax=figure.add_axes(box), orientation="horizontal")
    bar.set_ticks([0, 30, 60], labels=["0", "30", "60\N{DEGREE SIGN} and more"])
    bar.outline.set_visible(False)
    bar.ax.tick_params(length=0, pad=2, labelsize=7, labelcolor=figures.INK)
    return figure


def _write(figure, check, title, height):
    """The verdict and its reasons above the views, and below them what the colours are."""
    reasons = [*check.reasons[:_MOST_REASONS]]
    if len(check.reasons) > _MOST_REASONS:
        reasons[-1] += f"; and {len(check.reasons) - _MOST_REASONS} more"
    style = dict(ha="center", color=figures.INK, parse_math=False)
    head = f"{figures.printable(title)}: {check.verdict}" if title else check.verdict
    figure.text(0.5, 1 - 0.33 / height, head, fontsize=12, **style)
    for row, reason in enumerate(reasons):
        figure.text(0.5, 1 - (0.55 + 0.16 * row) / height, reason, fontsize=7.5, **style)
    style = dict(y=0.34 / height, va="center_baseline", fontsize=8)
    figure.text(0.41, s="angle between the Laplacian coordinates", ha="right", color=figures.INK, **style)
    if np.isnan(check.angle).any():
        figure.text(0.625, s="not compared", color="#999999", **style)
    figure.text(0.70, s="skeleton of the cloud", color=_OURS, **style)
    figure.text(0.81, s="of the mesh", color=_THEIRS, **style)
