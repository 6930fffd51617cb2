"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from ..curve.axis.fit import fit_axis, pull_back_detached
from ..curve.axis.subdivision import subdivide_edges
from ..curve.diagnostics import measured
from ..curve.shape.ends import regrow_ends
from ..curve.shape.junctions import move_junctions
from ..curve.shape.wide_ends import level_wide_ends
from ..curve.thin.deferred import Aside
from ..curve.thin.detect import without_strays
from ..curve.topology.air import cut_air
from ..curve.topology.collapse import binary_size, collapse_triangles, scaled, with_fields
from ..curve.topology.evidence import Evidence, SurfaceGraph, in_order, on_sample
from ..curve.topology.gaps import bridge_gaps
from ..curve.topology.loops import close_loops
from ..curve.topology.spurs import prune_spurs
from ..data.decisions import QUESTIONS, Decision
from ..data.skeleton import Skeleton
from ..parameters import documented, parameter
from ..pipeline import Filter, Watch
from .tracer import Tracer

ANSWERS = {"loop": close_loops, "limb": prune_spurs, "air": cut_air, "gap": bridge_gaps}
ORDER_OF_QUESTIONS = ("surface", "loop", "surface", "limb", "air", "limb", "gap", "loop", "limb")
"""Parts without a surface are set aside at the start, or when their loops are closed.

Spurs are asked about again after cuts and bridges, which may make them, and loops if bridges made more of them."""


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter[Skeleton]):
    """Make the graph one-dimensional, close false loops, prune spurs, and centre it in the surface around it.

    1. Edges on triangles are collapsed, the shortest first, until there is no triangle. This step is published; with
       all options 0 it is the only one.
    2. Detached vertices are brought back, and edges subdivided.
    3. The curve and its radii are fitted to the axis of the surface, to the normals of the points around, even if only
       one side was scanned; again after every change of the graph.
    4. The topology is judged by the surface around the curve: false loops are closed, spurs pruned, branches that cross
       air cut, and gaps bridged across which the object continues. If most of a large skeleton has no surface, as a
       crown, that part is set aside before, or once its loops are closed: a Tracer replaces it.
    5. The curve is led straight through wide ends, as of a pan. It settles: it is fitted twice more, also to the points
       themselves where noise has spoilt the normals, and where they hardly differ, as of a leaf of which one side was
       scanned.
    6. Junctions move to where limbs meet, and ends grow along their limbs to where these stop.
    7. The sections are measured, and warnings are collected.

    Warns
    -----
    SkeletonWarning
        For sphere-like and sheet-like clouds, which have no meaningful curve skeleton. For regions where many points do
        not determine the axis; it names the region. For close calls about loops, air or gaps; it names the closest.

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
        "Edge of a triangle to collapse first: the shortest, or that with the least mean degree of its ends.",
        choices=("length", "degree"),
    )
    handle: float = parameter(
        0.5, "Least probability that a loop is a handle of the object; others are closed. 0 keeps all.", low=0, high=1
    )
    air: float = parameter(0.5, "Least probability that a branch crosses air for a cut. 0 cuts none.", low=0, high=1)
    bridge: float = parameter(
        0.5, "Least probability that the object continues across a gap for a bridge. 0 bridges none.", low=0, high=1
    )
    limb: float = parameter(
        0.5, "Least probability that a branch is a limb; others, spurs, are pruned. 0 keeps all.", low=0, high=1
    )
    set_aside: bool = parameter(
        True,
        "Leave parts without a surface to a Tracer if they have most points of a large skeleton. False judges them, "
        "too, as does handle = 0.",
    )
    spacing: float = parameter(0.5, "Longest edge over the local radius, by subdivision; 0 leaves the edges.", low=0)
    recentre: int = parameter(
        1,
        "Passes of a fit of the curve to the axis of the surface; the last fit has one more. 0 leaves it.",
        unit="passes",
        low=0,
    )

    ends: Literal["medial", "surface"] = parameter(
        "medial",
        "Where ends stop: half a radius inside a face, and at the centre of a round cap; or on the surface.",
        choices=("medial", "surface"),
    )

    def _run(self, given: Skeleton, watch: Watch | None) -> Skeleton:
        if not self.recentre:
            return in_order(self._refined, given)  # every point keeps its vertex
        refined = on_sample(lambda skeleton: in_order(self._refined, skeleton), given)
        return without_strays(refined) if self.air and self.bridge else refined

    def _refined(self, skeleton: Skeleton) -> Skeleton:
        skeleton, surface = self._fit(skeleton)
        asks = self.handle or self.limb or self.air or self.bridge
        aside = None
        if _may_be_asked(skeleton) and (asks or self.recentre):
            skeleton, surface, aside = self._decide(skeleton, surface)
        if self.recentre and len(skeleton.vertices):
            skeleton = fit_axis(level_wide_ends(skeleton, surface), self.recentre + 1, surface, settle=True)
            size = binary_size(skeleton)  # fourth powers of lengths must not overflow
            grown = regrow_ends(move_junctions(scaled(skeleton, 1 / size)), self.ends == "surface")
            skeleton = scaled(grown, size)
        return measured(aside.put_back(skeleton) if aside else skeleton)

    def _fit(self, skeleton: Skeleton) -> tuple[Skeleton, SurfaceGraph]:
        """Make the graph one-dimensional and centre it in the surface around it."""
        skeleton = collapse_triangles(skeleton, by_degree=self.collapse == "degree")
        surface = SurfaceGraph.of(skeleton)
        if self.recentre:
            skeleton = pull_back_detached(skeleton)
        return self._centred(skeleton, surface), surface

    def _decide(self, skeleton: Skeleton, surface: SurfaceGraph) -> tuple[Skeleton, SurfaceGraph, Aside | None]:
        """Answer one question after the other; not again where the graph is the same, or has no more loops."""
        evidence, aside = Evidence.of(skeleton, surface), None
        decisions: dict[str, list[Decision]] = {about: [] for about in ANSWERS}
        settled: dict[str, Skeleton] = {}  # what each question was last asked about
        n_handles = 0
        for about in ORDER_OF_QUESTIONS:
            n_handles = min(n_handles, skeleton.n_loops)  # cuts may have opened some
            if settled.get(about) is skeleton or not _may_be_asked(skeleton):
                continue
            if about == "surface":
                settled[about] = skeleton
                if self.set_aside and self.handle and not aside and (aside := Aside.of(skeleton, Tracer().surface)):
                    skeleton = aside.rest()
                    surface = SurfaceGraph.of(skeleton)
                    evidence = Evidence.of(skeleton, surface) if _may_be_asked(skeleton) else evidence
                continue
            if about == "loop" and skeleton.n_loops <= n_handles:
                continue
            skeleton, found = self._asked(about, skeleton, evidence)
            decisions[about] = _changed(decisions[about]) + found
            settled[about] = skeleton
            if about == "loop":
                n_handles = skeleton.n_loops
        report = replace(
            skeleton.report,
            decisions=tuple(each for found in decisions.values() for each in found),
            n_loops_closed=len(_changed(decisions["loop"])),
            n_cuts=len(_changed(decisions["air"])),
            n_bridges=len(_changed(decisions["gap"])),
        )
        return with_fields(skeleton, report=report), surface, aside

    def _asked(self, about: str, skeleton: Skeleton, evidence: Evidence) -> tuple[Skeleton, list[Decision]]:
        """A skeleton after a question was answered for its parts, with the curve fitted anew if it was changed."""
        limit = getattr(self, QUESTIONS[about].option)
        if not limit:
            return skeleton, []
        answered, found = ANSWERS[about](skeleton, evidence, limit)
        return (self._centred(answered, evidence) if _changed(found) else skeleton), found

    def _centred(self, skeleton: Skeleton, surface: SurfaceGraph) -> Skeleton:
        if self.spacing:
            skeleton = subdivide_edges(skeleton, self.spacing)
        return fit_axis(skeleton, self.recentre, surface)


def _may_be_asked(skeleton: Skeleton) -> bool:
    return len(skeleton.edges) > 0 and len(skeleton.supporting_points) > 0


def _changed(decisions: list[Decision]) -> list[Decision]:
    return [each for each in decisions if each.changed]
