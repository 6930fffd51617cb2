"""What the refiner asks about a cloud with a known axis, and what is so."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from _common.clouds import Case
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching
from scipy.spatial.distance import cdist

from glsk_o3d import Pipeline
from glsk_o3d.analysis import Truth
from glsk_o3d.analysis.comparison import TIP_REACH
from glsk_o3d.numerics.cycles import minimum_cycle_basis
from glsk_o3d.refinement.air import branch_facts, cut_air
from glsk_o3d.refinement.bridging import gap_facts
from glsk_o3d.refinement.evidence import Evidence, in_order
from glsk_o3d.refinement.loops import close_loops, loop_facts
from glsk_o3d.refinement.spurs import limb_facts, prune_spurs
from glsk_o3d.skeleton import Skeleton

from .labels import Placed

DIGITS = 4  # of a fact


def questions(case: Case, pipeline: Pipeline) -> dict:
    """Every question about a cloud: what it is `about`, the `facts`, and whether it `is_so`."""
    points, truth = case.load()
    found = [
        dict(about=about, facts={name: round(value, DIGITS) for name, value in facts.items()}, is_so=is_so)
        for about, facts, is_so in asked(points, truth, pipeline)
    ]
    return dict(questions=found)


def asked(points: np.ndarray, truth: Truth, pipeline: Pipeline) -> Iterator[tuple[str, dict[str, float], bool]]:
    """The questions in the order in which a pipeline's refiner asks them, each of the skeleton that it has then."""
    *stages, refiner = pipeline.stages
    skeleton, surface = refiner._fit(in_order(Pipeline(*stages)(points))[0])
    if not len(skeleton.edges):
        return
    evidence = Evidence.of(skeleton, surface)
    yield from _loops(skeleton, evidence, truth)
    skeleton, _ = refiner._asked(close_loops, skeleton, evidence, refiner.handle)
    yield from _limbs(skeleton, evidence, truth)
    skeleton, _ = refiner._asked(prune_spurs, skeleton, evidence, refiner.limb)
    yield from _branches(skeleton, evidence, truth)
    skeleton, _ = cut_air(skeleton, evidence, skeleton.report.noise, refiner.air)
    skeleton, _ = refiner._asked(prune_spurs, skeleton, evidence, refiner.limb)
    yield from _gaps(skeleton, evidence, truth)


def _loops(skeleton: Skeleton, evidence: Evidence, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
    if cycles:
        placed = Placed(truth, skeleton.vertices)
        for cycle, loop in zip(cycles, loop_facts(skeleton, cycles, evidence), strict=True):
            if (is_so := placed.is_handle(cycle)) is not None:  # also without an inside: of false ones there are few
                yield "loop", loop.facts, is_so


def _branches(skeleton: Skeleton, evidence: Evidence, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    placed = Placed(truth, skeleton.vertices)
    for branch, k, facts in branch_facts(skeleton, evidence, skeleton.report.noise):
        yield "air", facts, placed.crosses_air(branch, k)


def _gaps(skeleton: Skeleton, evidence: Evidence, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    placed = Placed(truth, skeleton.vertices)
    for (leaf, other), facts in gap_facts(skeleton, evidence):
        yield "gap", facts, bool(placed.joined(leaf, other))


def _limbs(skeleton: Skeleton, evidence: Evidence, truth: Truth) -> Iterator[tuple[str, dict[str, float], bool]]:
    """A branch is a limb if a true tip is lost without it: of two prongs in one end either may go, and is none."""
    leaves = np.flatnonzero(skeleton.degree == 1)
    tips = np.flatnonzero(np.bincount(truth.edges.ravel(), minlength=len(truth.nodes)) == 1)
    near = cdist(skeleton.vertices[leaves], truth.nodes[tips]) <= TIP_REACH * truth.radii[tips]
    served = _served(near)
    for leaf, facts in limb_facts(skeleton, evidence):
        yield "limb", facts, _served(near[leaves != leaf]) < served


def _served(near: np.ndarray) -> int:
    """Most true tips that can have a leaf of their own near them."""
    return int((maximum_bipartite_matching(csr_array(near.astype(np.int8)), perm_type="column") >= 0).sum())
