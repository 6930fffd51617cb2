"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from __future__ import annotations

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

    1. Edges that lie on a triangle are collapsed, the shortest first, until there is no triangle.
    2. Loops that open less than their tube is thick, two strands in one part, are collapsed.
    3. Vertices that left their points are brought back, and edges are subdivided, so that chords do not cut
       corners.
    4. The curve is fitted to the axis of the surface: to the normals of the input points around it, even if only one
       side was scanned, and to the points themselves where noise has spoilt the normals. So are the radii.
    5. The topology is judged by what the surface around the curve says: loops that are probably no handles are closed;
       branches that are probably no limbs are pruned; branches that probably cross air are cut, and gaps across which
       the object probably goes on are bridged.
    6. Junctions move to where limbs meet, and those within one radius become one. Ends, which flat faces have pulled
       into their edges, grow anew along their limbs to where these stop: half a radius inside a flat face, or the
       centre of a round cap.
    7. Where the cloud shows no surface, parts thinner than its points are far apart, what the steps before made of them
       is replaced by shortest paths through the points.
    8. With a `root`, all is made one tree that grows from there: gaps are joined where they are narrowest, and loops
       are cut. Vertex 0 is the root, and every edge leads from parent to child.

    The first step is published; with all options 0 it is the only one.

    Warns
    -----
    SkeletonWarning
        Where no curve skeleton is meaningful, sphere-like or sheet-like clouds, and where many points do not say where
        the axis is; it names the region. Where questions about loops, air or gaps were close calls; it names the
        closest.

    Notes
    -----
    The published code also merges nearly straight runs; an indexing slip makes that step idle in most clouds. It is
    left out here.

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
        "Which edge of a triangle collapses first: the shortest, or, as published, that with the least mean degree of "
        "its ends, which changes with every sample of the points.",
        type="choice",
        choices=("length", "degree"),
    )
    handle: float = parameter(
        0.5,
        "Least probability that a loop is a handle of the object; others are closed. 0 keeps all.",
        type="float",
        low=0,
        high=1,
    )
    air: float = parameter(
        0.5,
        "Probability that a branch crosses air from which on it is cut there. 0 cuts none.",
        type="float",
        low=0,
        high=1,
    )
    bridge: float = parameter(
        0.5,
        "Probability that the object goes on across a gap from which on it is bridged. 0 bridges none.",
        type="float",
        low=0,
        high=1,
    )
    limb: float = parameter(
        0.25,
        "Least probability that a branch is a limb of the object; others, spurs, are pruned. 0 keeps all.",
        type="float",
        low=0,
        high=1,
    )
    spacing: float = parameter(
        0.5,
        "Longest edge over the local radius, by subdivision; 0 leaves the edges. Long ones cut corners.",
        type="float",
        low=0,
    )
    recentre: int = parameter(
        3, "Passes that fit the curve to the axis of the surface; 0 leaves it.", type="int", unit="passes", low=0
    )

    surface: float = parameter(
        0.65,
        "Least share of the points of a region that must show a surface; where fewer do, parts are traced along "
        "shortest paths through the points. 0 traces none.",
        type="float",
        low=0,
        high=1,
    )
    root: str | Any = parameter(
        None,
        "Where a tree grows from: the lowest place along an axis, the end that is thickest, or the place nearest to a "
        "point; the skeleton is then one tree, whatever the gaps. None keeps parts and loops.",
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
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, self.recentre, surface), surface

    def _judge(self, skeleton: Skeleton, surface: SurfaceGraph) -> Skeleton:
        """Close false loops, prune spurs, cut what crosses air, bridge gaps; then ask for loops and limbs anew."""
        evidence = Evidence.of(skeleton, surface)
        skeleton, loops = self._close(skeleton, evidence)
        skeleton, limbs = self._prune(skeleton, evidence)
        skeleton, cuts = self._cut(skeleton, evidence)
        if _changed(cuts):
            limbs, (skeleton, more) = _of_changes(limbs), self._prune(skeleton, evidence)
            limbs += more
        skeleton, gaps = self._bridge(skeleton, evidence)
        if _changed([*cuts, *gaps]):
            loops, (skeleton, again) = _of_changes(loops), self._close(self._refit(skeleton, evidence), evidence)
            limbs, (skeleton, more) = _of_changes(limbs), self._prune(skeleton, evidence)
            loops, limbs = loops + again, limbs + more
        closed, cut, bridged = (len(_of_changes(found)) for found in (loops, cuts, gaps))
        report = replace(
            skeleton.report,
            judgements=(*loops, *cuts, *gaps, *limbs),
            n_loops_closed=closed,
            n_cuts=cut,
            n_bridges=bridged,
        )
        return replace(skeleton, report=report)

    def _close(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        if not self.handle:
            return skeleton, []
        skeleton, loops = close_loops(skeleton, evidence, self.handle)
        return (self._refit(skeleton, evidence) if _changed(loops) else skeleton), loops

    def _prune(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        if not self.limb:
            return skeleton, []
        skeleton, limbs = prune_spurs(skeleton, evidence, self.limb)
        return (self._refit(skeleton, evidence) if _changed(limbs) else skeleton), limbs

    def _cut(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        return cut_air(skeleton, evidence, skeleton.report.noise, self.air) if self.air else (skeleton, [])

    def _bridge(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        return bridge_gaps(skeleton, evidence, self.bridge) if self.bridge else (skeleton, [])

    def _refit(self, skeleton: Skeleton, evidence: Evidence) -> Skeleton:
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, self.recentre, evidence)


def _of_changes(judgements: list[Judgement]) -> list[Judgement]:
    return [it for it in judgements if it.changed]


def _changed(judgements: list[Judgement]) -> bool:
    return bool(_of_changes(judgements))
