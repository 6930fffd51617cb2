"""The result: a curve skeleton."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidParameterError, brief
from ..geometry.vectors import FARTHEST_PLACE
from ..interop.packages import import_open3d, require
from ..parameters import shown
from .derived import derived, forget
from .graph import OF_VERTICES, in_order_of_ends
from .report import Report
from .space_curve import SpaceCurve
from .verdict import Reason, Verdict, graph_score, reasons_of_score, verdict_of

if TYPE_CHECKING:
    import networkx
    import open3d

ARRAYS: dict[str, tuple[tuple[int, ...], type]] = {
    "vertices": ((3,), float),
    "edges": ((2,), int),
    "radii": ((), float),
    "confidence": ((), float),
    "vertex_of_point": ((), int),
    "points": ((3,), float),
    "normals": ((3,), float),
    "half_width": ((), float),
    "half_thickness": ((), float),
    "support": ((), float),
    "representative_of_point": ((), int),
}
"""The arrays of a skeleton: the shape of a row and the type of each. The one field more is ``report``."""
UNIT = 1.001  # derived: a unit vector that was written in three digits is one


@dataclass(frozen=True, eq=False)
class Skeleton(SpaceCurve):
    """A curve skeleton: a graph embedded in space, in the units of the cloud it was made from.

    All fields are checked. Arrays without rows mean unknown values and are filled with NaN, or -1 for
    `vertex_of_point`. Edges in another order are sorted.

    Attributes
    ----------
    vertices : (M, 3) float64 array
        Finite, and at most 1e150.
    edges : (E, 2) int64 array
        Sorted pairs i < j without repetitions.
    radii : (M,) float64 array
        Local radius: that of a circle with the area of the section, or of the tube on the axis of a tube. In noise it
        moves towards the median distance from the curve to the points. Without a surface it is the scatter of the
        points around the curve. NaN if unknown.
    vertex_of_point : (N,) int64 array
        The vertex of every input point; -1 for points that are not finite, or whose vertex was left out.
    points : (N, 3) float64 array
        The input points in their order.
    normals : (N, 3) float64 array
        Unit normals estimated from the neighbourhoods, up to their sign; NaN for points that are not finite, outliers,
        outside the sample of a large cloud, or without a surface.
    report : Report
        The record of the run.
    confidence : (M,) float64 array
        How well the points of each vertex agree on the axis, from 0 to 1: less with few points, and 0 without a
        surface. NaN if not measured.
    half_width, half_thickness : (M,) float64 array
        Half axes of the part's section at every vertex, such as half the width and half the thickness of a bar. The
        radius if not measured.
    support : (M,) float64 array
        Share of samples of the cloud whose skeletons show the curve there, see `glsk_o3d.support`; NaN if not measured.
    representative_of_point : (N,) int64 array
        Of a skeleton that is to be refined the point by which a Refiner knows the surface at each input point: itself,
        or another one; -1 for the nearest of these, or if unknown.

    Raises
    ------
    InvalidParameterError
        An array has a wrong shape or type, or an impossible number: the message names the first such row.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> ring.n_components, ring.n_loops, len(ring.leaves)
    (1, 1, 0)
    >>> abs(ring.length - 2 * np.pi * 0.4) < 0.1  # the axis is a circle of radius 0.4
    True
    >>> ring.vertex_of_point.shape
    (1000,)
    """

    report: Report = field(default_factory=Report)
    confidence: np.ndarray = None  # type: ignore[assignment]
    half_width: np.ndarray = None  # type: ignore[assignment]
    half_thickness: np.ndarray = None  # type: ignore[assignment]
    support: np.ndarray = None  # type: ignore[assignment]
    representative_of_point: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        _complete(self)
        with np.errstate(all="ignore"):  # numbers that are refused may overflow
            _check_values(self)
        object.__setattr__(self, "edges", in_order_of_ends(self.edges, len(self.vertices)))
        _refuse(self, "edges", ~np.diff(self.edges, axis=0).any(axis=1), "is there twice")

    def with_report(self, report: Report) -> Skeleton:
        """The same with another record of the run."""
        other = copy(self)  # what was checked need not be checked again
        object.__setattr__(other, "report", report)
        forget(other, "report")
        if self.whole is not self:
            vars(other)["_whole"] = self.whole.with_report(report)
        return other

    def __repr__(self) -> str:
        return (
            f"Skeleton({len(self.vertices)} vertices, {len(self.edges)} edges, {self.n_components} components, "
            f"{self.n_loops} loops, {len(self.leaves)} leaves, {len(self.junctions)} junctions)"
        )

    @derived("report", "confidence")
    def score(self) -> float:
        """Probability that the graph is right, 0 to 1: components, loops and all ends. NaN if unknown.

        By how certain the decisions about the topology are, by the confidence of the vertices, and by how much of the
        surface faces its own curve, as where narrow holes or stout limbs are lost before anything is asked. Of random
        shapes with a score about s, a share of about s is right.
        """
        report = self.report
        return graph_score(report.decisions, self.confidence, report.n_facing, report.facing)

    @derived("report", "confidence", "vertices", "edges")
    def branch_scores(self) -> np.ndarray:
        """The same of every branch, (B,) float array: by the decisions at places on it, and by its own confidence.

        Not calibrated by itself: it says which branches the doubt is about.
        """
        decisions = self.report.decisions if len(self.branches) else ()
        places = np.array([decision.place for decision in decisions]).reshape(-1, 3)
        branch = self.nearest(places).branch if len(places) else np.empty(0, int)
        scores = [
            graph_score([decisions[row] for row in np.flatnonzero(branch == number)], self.confidence[path])
            for number, path in enumerate(self.branches)
        ]
        return np.array(scores)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Why not to rely on it: those of the report, and a low or unknown score."""
        report = self.report
        of_score = reasons_of_score(self.score, report.decisions, report.n_facing, report.facing)
        return (*report.reasons, *of_score)

    @property
    def verdict(self) -> Verdict:
        """Whether to rely on it: the worst verdict that one of the reasons demands."""
        return verdict_of(self.reasons)

    @property
    def whole(self) -> Skeleton:
        """This with the points by area of a sampled mesh behind its vertices, as a pipeline or a file gave it."""
        return vars(self).get("_whole", self)

    @property
    def lacks_sample(self) -> bool:
        """Whether its mesh was sampled, and it was changed and has the vertices alone: they do not show the object."""
        return 0 < self.report.n_by_area > len(self.whole.points) - self.report.n_input

    def to_networkx(self) -> networkx.Graph:
        """The graph with the attributes of every vertex.

        Returns
        -------
        networkx.Graph
            Nodes have ``position`` (3-tuple), ``radius``, ``confidence``, ``half_width``, ``half_thickness`` and
            ``support``; edges ``length``.

        Raises
        ------
        MissingPackageError
        """
        graph = require("networkx").Graph()
        columns = [map(tuple, self.vertices.tolist()), *(getattr(self, name).tolist() for name in OF_VERTICES)]
        for i, facts in enumerate(zip(*columns, strict=True)):
            graph.add_node(i, **dict(zip(("position", "radius", *OF_VERTICES[1:]), facts, strict=True)))
        for (a, b), length in zip(self.edges.tolist(), self.edge_lengths.tolist(), strict=True):
            graph.add_edge(a, b, length=length)
        return graph

    def to_line_set(self, color: Sequence[float] = (0.85, 0.1, 0.1)) -> open3d.geometry.LineSet:
        """The skeleton as an ``open3d.geometry.LineSet`` of one colour. See `glsk_o3d.to_line_set` for others.

        Parameters
        ----------
        color : three floats in [0, 1]

        Raises
        ------
        InvalidParameterError, MissingPackageError
        """
        paint = as_color(color, "must be three numbers from 0 to 1; glsk_o3d.to_line_set takes words, too")
        o3d = import_open3d()
        lines = o3d.geometry.LineSet()
        lines.points = o3d.utility.Vector3dVector(np.ascontiguousarray(self.vertices))
        lines.lines = o3d.utility.Vector2iVector(np.ascontiguousarray(self.edges, np.int32))
        lines.paint_uniform_color(paint)
        return lines


def check_skeleton(value: Any) -> None:
    """Raise InvalidParameterError if a value is no Skeleton."""
    if not isinstance(value, Skeleton):
        raise InvalidParameterError(f"a {type(value).__name__} is no Skeleton: make one with skeletonize")


def of_input(skeleton: Skeleton) -> Skeleton:
    """A skeleton with the points that were given alone: without those by area that stood for a mesh."""
    n, report = len(skeleton.points), skeleton.report
    if not report.n_by_area or n != report.n_input + report.n_by_area:
        return skeleton
    of_given_points = skeleton.changed(
        **{name: getattr(skeleton, name)[: report.n_input] for name in ("points", "normals", "vertex_of_point")},
        representative_of_point=None,
    )
    vars(of_given_points)["_whole"] = skeleton
    return of_given_points


def as_color(color: Any, words: str) -> np.ndarray:
    """Three numbers from 0 to 1, (3,) float array; InvalidParameterError with these words for anything else."""
    try:
        paint = np.asarray(color, float)
    except (TypeError, ValueError):
        paint = np.empty(0)
    if paint.shape != (3,) or not ((paint >= 0) & (paint <= 1)).all():
        raise InvalidParameterError(f"color = {color!r}: {words}")
    return paint


def _complete(skeleton: Skeleton) -> None:
    """Make all fields arrays, and fill in those without rows; InvalidParameterError where that cannot be."""
    arrays: dict[str, np.ndarray] = {}
    for name, (columns, kind) in ARRAYS.items():
        values = getattr(skeleton, name)
        try:
            array = np.asarray(() if values is None else values)
        except (TypeError, ValueError) as error:  # rows of unequal length, and what else
            raise InvalidParameterError(f"{name}: is no array: {brief(error)}") from None
        unknown = name == "representative_of_point" and (array == -1).all()
        array = array if array.size and not unknown else np.empty((0, *columns), kind)
        if array.shape[1:] != columns or array.ndim == 0 or not np.can_cast(array.dtype, kind, "safe"):
            meant = f"{'whole ' * (kind is int)}numbers, {columns[0] if columns else 1} a row"
            raise InvalidParameterError(f"{name}: has shape {array.shape} and dtype {array.dtype}: must be {meant}")
        arrays[name] = array.astype(kind, copy=False)
    for name in (*OF_VERTICES, "vertex_of_point", "normals", "representative_of_point"):
        owner = "vertices" if name in OF_VERTICES else "points"
        values, wanted = arrays[name], len(arrays[owner])
        if len(values) not in (0, wanted):
            raise InvalidParameterError(f"{name}: has {len(values)} rows for {wanted} {owner}")
        if len(values) < wanted:
            unknown = np.full((wanted, *values.shape[1:]), np.nan if values.dtype == float else -1)
            arrays[name] = arrays["radii"] if name.startswith("half") else unknown
    for name, array in arrays.items():
        object.__setattr__(skeleton, name, array)
    if not isinstance(skeleton.report, Report):
        raise InvalidParameterError(f"report = {shown(skeleton.report)}: must be a Report")


def _check_values(skeleton: Skeleton) -> None:
    """Raise InvalidParameterError for the first number that cannot be true."""
    m, owner = len(skeleton.vertices), skeleton.vertex_of_point
    finite = f"must be finite, and at most {FARTHEST_PLACE:g}"
    vertex_range = f"names a missing vertex: there are {m}"
    _check_range(skeleton, "vertices", -FARTHEST_PLACE, FARTHEST_PLACE, finite)
    _check_range(skeleton, "edges", 0, m - 1, vertex_range)
    _refuse(skeleton, "edges", skeleton.edges[:, 0] == skeleton.edges[:, 1], "joins a vertex with itself")
    _check_range(skeleton, "vertex_of_point", -1, m - 1, vertex_range)
    representative = skeleton.representative_of_point
    _check_range(skeleton, "representative_of_point", -1, len(owner) - 1, "names a missing point")
    further = (representative >= 0) & (representative[representative] >= 0)
    passed_on = further & (representative[representative] != representative)
    _refuse(skeleton, "representative_of_point", passed_on, "names a point that another one represents")
    owned = f"{finite}, as vertex_of_point gives it a vertex"
    _check_range(skeleton, "points", -FARTHEST_PLACE, FARTHEST_PLACE, owned, lambda points: (owner < 0)[:, None])
    _check_range(skeleton, "normals", -UNIT, UNIT, "must be unit vectors, or NaN", unless=np.isnan)
    for name in OF_VERTICES:
        most = 1.0 if name in ("confidence", "support") else FARTHEST_PLACE
        _check_range(skeleton, name, 0, most, f"must lie between 0 and {most:g}, or be NaN", unless=np.isnan)
    thicker = skeleton.half_thickness > skeleton.half_width
    _refuse(skeleton, "half_thickness", thicker, "must be at most half_width")


def _check_range(
    skeleton: Skeleton, name: str, low: float, high: float, why: str, unless: Callable[[np.ndarray], Any] | None = None
) -> None:
    """Refuse the first row of an array with a number beyond limits, or that is none, `unless` it is excused."""
    values = getattr(skeleton, name)
    least, most = (np.fmin, np.fmax) if unless is np.isnan else (np.minimum, np.maximum)
    if values.size and not (low <= least.reduce(values, None) and most.reduce(values, None) <= high):
        wrong = ~((values >= low) & (values <= high))
        _refuse(skeleton, name, wrong if unless is None else wrong & ~unless(values), why)


def _refuse(skeleton: Skeleton, name: str, wrong: Any, why: str) -> None:
    """Raise InvalidParameterError for the first row of an array that is wrong, or has something wrong."""
    if wrong.any():
        row = int(wrong.argmax()) // (wrong.size // len(wrong))
        raise InvalidParameterError(f"{name}[{row}] = {shown(getattr(skeleton, name)[row].tolist())}: {why}")
