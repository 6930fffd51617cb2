"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from .parameters import documented, parameter
from .pipeline import Filter, Watch
from .refinement.air import cut_air
from .refinement.axis_fit import fit_axis
from .refinement.bridging import bridge_gaps
from .refinement.clamp import clamp_to_points
from .refinement.diagnostics import diagnose
from .refinement.evidence import Evidence
from .refinement.junctions import level_tips, move_junctions
from .refinement.loops import close_loops, zip_narrow_loops
from .refinement.reattachment import reattach_limbs
from .refinement.spurs import prune_spurs
from .refinement.subdivision import subdivide_edges
from .refinement.triangles import collapse_triangles
from .report import Judgement
from .skeleton import Skeleton

CUTTING_ROUNDS = 3  # measured: after two nothing is left to cut


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter[Skeleton]):
    """Make the graph one-dimensional, close false loops, prune spurs, and centre it in the surface around it.

    1. Edges that lie on a triangle are collapsed, those with the least mean degree of their ends first, and among these
       the shortest, until there is no triangle.
    2. Loops that open less than their tube is thick are zipped up.
    3. Vertices that ran away from their points are brought back, and edges are subdivided, so that chords do not cut
       corners.
    4. The curve is fitted to the axis of the surface: to the normals of the input points around it, even if only one
       side was scanned, and to the points themselves where noise has spoilt the normals. So are the radii.
    5. The topology is judged by what the surface around the curve says: loops that are probably no handles are closed,
       branches that probably cross air are cut, and gaps across which the object probably goes on are bridged.
    6. Limbs that run beside another one inside its tube begin where they leave it. Spurs, branches whose points hardly
       leave the limbs around them, where these go on to meet, are pruned, and junctions move to where limbs meet.

    The first step is published; with all options 0 it is the only one.

    Warns
    -----
    SkeletonWarning
        Where no curve skeleton is meaningful, sphere-like or sheet-like clouds, and where many points do not say where
        the axis is; it names the region. Where questions about the topology were close calls; it names the closest.

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
    >>> refined = Refiner(spur=2)(raw)
    >>> refined.n_loops, len(refined.leaves)
    (1, 0)
    """

    consumes: ClassVar[type] = Skeleton
    produces: ClassVar[type] = Skeleton

    handle: float = parameter(
        0.5,
        "Least probability that a loop is a handle of the object; others are zipped up. 0 keeps all.",
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
    spur: float = parameter(
        1.5,
        "Least reach of a branch's points from the limbs that meet there over the distance of the surface; others "
        "are cut. 0 keeps all.",
        type="float",
        low=0,
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

    def _run(self, skeleton: Skeleton, watch: Watch | None) -> Skeleton:
        skeleton = self._fit(skeleton)
        if len(skeleton.edges) and len(skeleton.supporting_points) and (self.handle or self.air or self.bridge):
            skeleton = self._judge(skeleton)
        skeleton, limbs = self._settle(skeleton)
        if self.recentre:
            skeleton = level_tips(move_junctions(skeleton))
        report = replace(skeleton.report, judgements=(*skeleton.report.judgements, *limbs))
        for message in diagnose(replace(skeleton, report=report)):
            report = report.with_warning(message)
        return replace(skeleton, report=report)

    def _fit(self, skeleton: Skeleton) -> Skeleton:
        """Make the graph one-dimensional and centre it."""
        skeleton = collapse_triangles(skeleton)
        if self.handle:
            skeleton = zip_narrow_loops(skeleton)
        if self.recentre:
            skeleton = clamp_to_points(skeleton)
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, self.recentre)

    def _settle(self, skeleton: Skeleton) -> tuple[Skeleton, list[Judgement]]:
        """Let limbs begin where they leave others, and prune what is none."""
        if self.recentre:
            skeleton = reattach_limbs(skeleton)
        return prune_spurs(skeleton, self.spur) if self.spur else (skeleton, [])

    def _judge(self, skeleton: Skeleton) -> Skeleton:
        """Close false loops, cut what crosses air, and bridge gaps; the axis is fitted anew where that changed."""
        evidence, found = Evidence.of(skeleton), []
        for step in (self._close, self._cut, self._bridge):
            skeleton, judgements = step(skeleton, evidence)
            found += judgements
        if _changed(found):
            skeleton = self._refit(skeleton, 2)
        counts = {about: sum(it.about == about and it.changed for it in found) for about in ("loop", "air", "gap")}
        report = replace(
            skeleton.report,
            judgements=tuple(found),
            n_loops_closed=counts["loop"],
            n_cuts=counts["air"],
            n_bridges=counts["gap"],
        )
        return replace(skeleton, report=report)

    def _close(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        if not self.handle:
            return self._prune(skeleton), []
        skeleton, loops = close_loops(skeleton, evidence, self.handle)
        if _changed(loops):
            skeleton = self._refit(skeleton, 1)
        return self._prune(skeleton), loops

    def _cut(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        found: list[Judgement] = []
        for _ in range(CUTTING_ROUNDS if self.air else 0):
            skeleton, cuts = cut_air(skeleton, evidence, skeleton.report.noise, self.air)
            found = [*(it for it in found if it.changed), *cuts]
            if not _changed(cuts):
                break
            skeleton = self._prune(skeleton)
        return skeleton, found

    def _bridge(self, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Judgement]]:
        if not self.bridge:
            return skeleton, []
        skeleton, found = bridge_gaps(skeleton, evidence, self.bridge)
        if _changed(found):
            skeleton = self._refit(skeleton, 1)
            if self.handle:
                skeleton, loops = close_loops(skeleton, evidence, self.handle)
                found += [it for it in loops if it.changed]
        return skeleton, found

    def _prune(self, skeleton: Skeleton) -> Skeleton:
        return prune_spurs(skeleton, self.spur)[0] if self.spur else skeleton

    def _refit(self, skeleton: Skeleton, passes: int) -> Skeleton:
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, min(passes, self.recentre))


def _changed(judgements: list[Judgement]) -> bool:
    return any(it.changed for it in judgements)
