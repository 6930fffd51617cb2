"""A run in a few numbers, as the commands and the ledger of a batch tell it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def summary(skeleton: Skeleton, seconds: float) -> dict[str, Any]:
    """A run in a few numbers."""
    report = skeleton.report
    return {
        "points": report.n_input,
        "dropped": report.n_dropped,
        "sampled": report.n_sampled,
        "outliers": report.n_outliers,
        "distinct": report.n_distinct,
        "contracted": report.n_contracted,
        **structure(skeleton),
        "loops_closed": report.n_loops_closed,
        "cuts": report.n_cuts,
        "bridges": report.n_bridges,
        "traced": report.n_traced,
        "joined": len(report.joined),
        "uncertain": len(report.uncertain),
        "iterations": len(report.iterations),
        "converged": report.converged,
        "stop_reason": report.stop_reason,
        "seconds": seconds,
    }


def structure(skeleton: Skeleton) -> dict[str, Any]:
    """The counts of a skeleton's graph, and its length."""
    return {
        "vertices": len(skeleton.vertices),
        "edges": len(skeleton.edges),
        "components": skeleton.n_components,
        "loops": skeleton.n_loops,
        "leaves": len(skeleton.leaves),
        "junctions": len(skeleton.junctions),
        "length": skeleton.length,
    }
