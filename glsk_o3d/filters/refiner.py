"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from ..curve.axis.fit import fit_axis, pull_back_detached
from ..curve.axis.subdivision import subdivide_edges
from ..curve.curve import Curve
from ..curve.diagnostics import measured
from ..curve.merging import collapse_triangles
from ..curve.sampling import along_a_morton_curve, on_points, surface_sample
from ..curve.shape.ends import regrow_ends
from ..curve.shape.junctions import move_junctions
from ..curve.shape.wide_ends import level_wide_ends
from ..curve.surface import Surface
from ..curve.thin.deferred import Deferred
from ..curve.thin.detect import THIN, without_detached_clumps
from ..curve.topology.false_branches import FalseBranches
from ..curve.topology.gaps import Gaps
from ..curve.topology.loops import Loops
from ..curve.topology.question import Question, ask
from ..curve.topology.spurs import Limbs
from ..data.decisions import WORDS, Decision
from ..data.skeleton import Skeleton
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext

QUESTIONS: tuple[type[Question], ...] = (Loops, Limbs, FalseBranches, Limbs, Gaps, Loops, Limbs)
"""In this order: cuts and bridges may make spurs, and bridges loops, so these are asked about again."""


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter[Skeleton, Skeleton]):
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
        not determine the axis; it names the region. For close calls about loops, air or gaps; it names the closest. For
        a tree that is made of what has loops.

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

    def run(self, skeleton: Skeleton, context: RunContext) -> Skeleton:
        curve = Curve.of(skeleton)
        if skeleton.report.on_medial_axis and self.handle < 1:  # the solid has answered
            return replace(self, handle=0, air=0, bridge=0, limb=0)._run(curve)
        return self._run(curve)

    def _run(self, curve: Curve) -> Skeleton:
        if not self.recentre:  # every point keeps its vertex
            return self._in_order(curve).to_skeleton()
        refined = on_points(self._in_order, curve, surface_sample(curve))
        return (without_detached_clumps(refined) if self.air and self.bridge else refined).to_skeleton()

    def _in_order(self, curve: Curve) -> Curve:
        has_copies = curve.report.n_distinct < curve.report.n_sampled
        return on_points(self._refined, curve, along_a_morton_curve(curve, distinct=has_copies))

    def _refined(self, curve: Curve) -> Curve:
        curve, surface = self.fitted(curve)
        deferred = None
        asks = self.recentre or any(self._least(question.about) for question in QUESTIONS)
        if asks and _may_be_asked(curve):
            curve, surface, deferred = self._decided(curve, surface.oriented(curve))
        if self.recentre and len(curve.vertices):
            on_axis = curve.report.on_medial_axis  # where lines of limbs could draw a junction across a hole
            if on_axis:  # it is measured where it is
                curve = fit_axis(curve, 0)
            else:
                curve = fit_axis(level_wide_ends(curve, surface), self.recentre + 1, surface, settle=True)
            size = curve.binary_size  # fourth powers of lengths must not overflow
            curve = curve.scaled(1 / size)
            curve = regrow_ends(curve if on_axis else move_junctions(curve), self.ends == "surface").scaled(size)
            if _may_be_asked(curve):
                n_facing, facing = surface.facing(curve)
                curve = curve.with_facts(n_facing=n_facing, facing=facing)
        return measured(deferred.put_back(curve) if deferred else curve)

    def fitted(self, curve: Curve) -> tuple[Curve, Surface]:
        """A raw curve made one-dimensional and fitted to the axis of the surface around it, and that surface."""
        curve = collapse_triangles(curve, by_degree=self.collapse == "degree")
        surface = Surface.of(curve)
        if self.recentre:
            curve = pull_back_detached(curve)
        return self._centred(curve, surface), surface

    def after(self, question: Question, curve: Curve, surface: Surface) -> tuple[Curve, list[Decision]]:
        """A curve after a question was answered for all its parts, fitted anew if it was changed; and the decisions."""
        changed, decisions = ask(question, curve, surface, self._least(question.about))
        return (curve if changed is curve else self._centred(changed, surface)), decisions

    def _decided(self, curve: Curve, surface: Surface) -> tuple[Curve, Surface, Deferred | None]:
        """Answer one question after the other; not again where the graph is the same, or has no more loops."""
        curve, surface, deferred = self._without_deferred(curve, surface)
        decisions: dict[str, list[Decision]] = {question.about: [] for question in QUESTIONS}
        answered: dict[str, Curve] = {}  # what each question was last asked about
        n_handles = 0
        for question in QUESTIONS:
            n_handles = min(n_handles, curve.n_loops)  # cuts may have opened some
            about = question.about
            if not self._least(about) or answered.get(about) is curve or not _may_be_asked(curve):
                continue
            if question is Loops and curve.n_loops <= n_handles:
                continue
            curve, answers = self.after(question(), curve, surface)
            decisions[about] = [*_changes(decisions[about]), *answers]
            answered[about] = curve
            if question is Loops:
                n_handles = curve.n_loops
                if deferred is None:  # loops may have hidden that a part has no surface
                    curve, surface, deferred = self._without_deferred(curve, surface)
        counts = {about: len(_changes(given)) for about, given in decisions.items()}
        curve = curve.with_facts(
            decisions=tuple(decision for about in decisions.values() for decision in about),
            n_loops_closed=counts["loop"],
            n_cuts=counts["air"],
            n_bridges=counts["gap"],
        )
        return curve, surface, deferred

    def _least(self, about: str) -> float:
        """The probability that decides a question."""
        probability: float = getattr(self, WORDS[about].option)
        return probability

    def _without_deferred(self, curve: Curve, surface: Surface) -> tuple[Curve, Surface, Deferred | None]:
        """The curve without parts that are left to a Tracer, and the surface around it."""
        deferred = Deferred.of(curve, THIN.least_surface) if self.set_aside and self.handle else None
        if not deferred:
            return curve, surface, None
        curve = deferred.rest()
        surface = Surface.of(curve)
        return curve, surface.oriented(curve) if _may_be_asked(curve) else surface, deferred

    def _centred(self, curve: Curve, surface: Surface) -> Curve:
        if self.spacing:
            curve = subdivide_edges(curve, self.spacing)
        return curve if curve.report.on_medial_axis else fit_axis(curve, self.recentre, surface)


def _may_be_asked(curve: Curve) -> bool:
    return len(curve.edges) > 0 and len(curve.supporting_points) > 0


def _changes(decisions: Iterable[Decision]) -> list[Decision]:
    return [decision for decision in decisions if decision.changed]
