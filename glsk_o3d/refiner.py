"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from .judgements import Judgement
from .numerics.vectors import AXES
from .parameters import documented, parameter
from .pipeline import Filter, Watch
from .refinement.air import cut_air
from .refinement.axis_fit import fit_axis, pull_back_detached
from .refinement.bridging import bridge_gaps
from .refinement.diagnostics import diagnose
from .refinement.ends import regrow_ends
from .refinement.evidence import Evidence, SurfaceGraph, in_order
from .refinement.junctions import move_junctions
from .refinement.loops import close_loops, collapse_narrow_loops
from .refinement.merging import binary_size, scaled
from .refinement.sections import measure_sections
from .refinement.spurs import prune_spurs
from .refinement.subdivision import subdivide_edges
from .refinement.tracing import trace
from .refinement.triangles import collapse_triangles
from .skeleton import Skeleton


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter[Skeleton]):
    """Make the graph one-dimensional, close false loops, prune spurs, and centre it in the surface around it.

    1. Edges that lie on a triangle are collapsed, the shortest first, until there is none. This step is published, and
       with all options 0 the only one.
    2. Loops narrower than their tube are collapsed, detached vertices brought back, and edges subdivided.
    3. The curve and its radii are fitted to the axis of the surface: to the normals of the points around, even if only
       one side was scanned, and to the points themselves where noise has spoilt the normals.
    4. The topology is judged by the surface around the curve: false loops are closed, spurs pruned, branches that cross
       air cut, and gaps bridged across which the object goes on.
    5. Junctions move to where limbs meet, and ends grow along their limbs to where these stop.
    6. Where the cloud shows no surface, the curve is replaced by shortest paths through the points. With a `root` all
       is made one tree: vertex 0 is the root, and every edge leads from parent to child.

    Warns
    -----
    SkeletonWarning
        Where no curve skeleton is meaningful, sphere-like or sheet-like clouds, and where many points do not say where
        the axis is; it names the region. Where questions about loops, air or gaps were close calls; it names the
        closest.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.

    Examples
    --------
    >>> from glsk_o3d import Connector, Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> raw = (RingBuilder() | Contractor() | Connector())(torus(1000).points)
    >>> refined = Refiner(limb=0.6)(raw)
    >>> refined.n_loops, len(refined.leaves)
    (1, 0)
    """

    consumes: ClassVar[type] = Skeleton
    produces: ClassVar[type] = Skeleton

    collapse: Literal["length", "degree"] = parameter(
        "length",
        "Which edge of a triangle collapses first: the shortest, or that with the least mean degree of its ends.",
        choices=("length", "degree"),
    )
    handle: float = parameter(
        0.5, "Least probability that a loop is a handle of the object; others are closed. 0 keeps all.", low=0, high=1
    )
    air: float = parameter(
        0.5, "Probability that a branch crosses air from which on it is cut there. 0 cuts none.", low=0, high=1
    )
    bridge: float = parameter(
        0.5, "Probability that the object crosses a gap from which on it is bridged. 0 bridges none.", low=0, high=1
    )
    limb: float = parameter(
        0.25, "Least probability that a branch is a limb; others, spurs, are pruned. 0 keeps all.", low=0, high=1
    )
    spacing: float = parameter(0.5, "Longest edge over the local radius, by subdivision; 0 leaves the edges.", low=0)
    recentre: int = parameter(
        3, "Passes that fit the curve to the axis of the surface; 0 leaves it.", unit="passes", low=0
    )
    surface: float = parameter(
        0.65, "Share of points with a surface below which a region is traced as paths. 0 traces none.", low=0, high=1
    )
    root: str | Any = parameter(
        None,
        "Where one tree grows from: the lowest place along an axis, the thickest end, or the place nearest to a point. "
        "None keeps parts and loops.",
        type="point?",
        choices=(*AXES, "thickest"),
    )

    def __post_init__(self) -> None:
        # as plain text it can be compared, printed and written to files
        if not isinstance(self.root, str | None):
            with suppress(TypeError, ValueError):  # what is no point is found when the filter is checked
                point = np.asarray(self.root, float)
                if point.shape == (3,):
                    object.__setattr__(self, "root", ",".join(map(repr, point.tolist())))

    def _run(self, given: Skeleton, watch: Watch | None) -> Skeleton:
        ordered, back = in_order(given)
        skeleton = self._refined(ordered)
        vertex, normals = skeleton.vertex_of_point[back], skeleton.normals.take(back, axis=0)
        return replace(skeleton, points=given.points, normals=normals, vertex_of_point=vertex)

    def _refined(self, skeleton: Skeleton) -> Skeleton:
        skeleton, surface = self._fit(skeleton)
        asks = self.handle or self.limb or self.air or self.bridge
        if len(skeleton.edges) and len(skeleton.supporting_points) and (asks or self.recentre):
            skeleton = self._judge(skeleton, surface)
        if self.recentre:
            size = binary_size(skeleton)  # fourth powers of lengths must not overflow
            skeleton = scaled(regrow_ends(move_junctions(scaled(skeleton, 1 / size))), size)
        if self.surface or self.root is not None:
            skeleton = trace(skeleton, self.surface, self.root)
        report, sections = skeleton.report, measure_sections(skeleton)
        for message in diagnose(skeleton):
            report = report.with_warning(message)
        return replace(skeleton, report=report, half_width=sections.half_width, half_thickness=sections.half_thickness)

    def _fit(self, skeleton: Skeleton) -> tuple[Skeleton, SurfaceGraph]:
        """Make the graph one-dimensional and centre it in the surface around it."""
        skeleton = collapse_triangles(skeleton, by_degree=self.collapse == "degree")
        surface = SurfaceGraph.of(skeleton)
        if self.handle:
            skeleton = collapse_narrow_loops(skeleton, surface)
        if self.recentre:
            skeleton = pull_back_detached(skeleton)
        return self._centred(skeleton, surface), surface

    def _judge(self, skeleton: Skeleton, surface: SurfaceGraph) -> Skeleton:
        """Close false loops, prune spurs, cut what crosses air, bridge gaps; then ask for loops and limbs anew."""
        evidence = Evidence.of(skeleton, surface)
        skeleton, loops = self._asked(close_loops, skeleton, evidence, self.handle)
        skeleton, limbs = self._asked(prune_spurs, skeleton, evidence, self.limb)
        cuts, gaps = [], []
        if self.air:
            skeleton, cuts = cut_air(skeleton, evidence, skeleton.report.noise, self.air)
        if _changed(cuts):
            skeleton, more = self._asked(prune_spurs, skeleton, evidence, self.limb)
            limbs = _changed(limbs) + more
        if self.bridge:
            skeleton, gaps = bridge_gaps(skeleton, evidence, self.bridge)
        if _changed([*cuts, *gaps]):
            skeleton, again = self._asked(close_loops, self._centred(skeleton, evidence), evidence, self.handle)
            skeleton, more = self._asked(prune_spurs, skeleton, evidence, self.limb)
            loops, limbs = _changed(loops) + again, _changed(limbs) + more
        report = replace(
            skeleton.report,
            judgements=(*loops, *cuts, *gaps, *limbs),
            n_loops_closed=len(_changed(loops)),
            n_cuts=len(_changed(cuts)),
            n_bridges=len(_changed(gaps)),
        )
        return replace(skeleton, report=report)

    def _asked(
        self, answer: Callable[..., Any], skeleton: Skeleton, evidence: Evidence, limit: float
    ) -> tuple[Skeleton, list[Judgement]]:
        """A skeleton after a question was answered for its parts, with curves fitted anew where it was changed."""
        if not limit:
            return skeleton, []
        skeleton, judgements = answer(skeleton, evidence, limit)
        return (self._centred(skeleton, evidence) if _changed(judgements) else skeleton), judgements

    def _centred(self, skeleton: Skeleton, surface: SurfaceGraph) -> Skeleton:
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, self.recentre, surface)


def _changed(judgements: list[Judgement]) -> list[Judgement]:
    return [each for each in judgements if each.changed]
