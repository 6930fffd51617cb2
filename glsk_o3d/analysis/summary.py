"""A run in a few numbers, for the commands and the ledger of a batch."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..data.report import NOT_CONTRACTED, IterationRecord
from ..data.skeleton import Skeleton

ITERATION_COLUMNS = {
    "solve": ("iteration", "d"),
    "points": ("n_points", ",d"),
    "merged": ("n_merged", ",d"),
    "held": ("n_held", ",d"),
    "e": ("explained", ".4f"),
    "De": ("explained_change", ".4f"),
    "ring ratio": ("ring_ratio", ".4f"),
    "w_L": ("contraction_weight", ".4g"),
    "solver error": ("solve_error", ".1e"),
    "seconds": ("seconds", ".3f"),
}
"""What people read of a contraction: the field of an IterationRecord by the heading, and its format."""
ENDING_FACTS = ("iterations", "converged", "stop_reason")
"""The entries of `summary` that `ending` needs."""


def summary(skeleton: Skeleton, seconds: float) -> dict[str, Any]:
    """A run in a few numbers."""
    report = skeleton.report

    def counted(*names: str) -> dict[str, int]:
        return {name: getattr(report, f"n_{name}") for name in names}

    return {
        "points": report.n_input,
        **counted("dropped", "by_area", "sampled", "outliers", "mixed", "distinct", "contracted"),
        **structure(skeleton),
        **counted("loops_closed", "cuts", "bridges", "traced"),
        "joined": len(report.joined),
        "uncertain": len(report.uncertain),
        **({"samples": report.n_draws, "agreeing": report.n_agreeing} if report.n_draws else {}),
        "verdict": skeleton.verdict.value,
        "score": None if np.isnan(skeleton.score) else round(skeleton.score, 3),
        "reasons": list(map(str, skeleton.reasons)),
        "iterations": len(report.iterations),
        "converged": report.converged,
        "stop_reason": report.stop_reason,
        "seconds": seconds,
    }


def iteration_rows(records: Iterable[IterationRecord]) -> list[list[str]]:
    """The iterations of a contraction as the rows of a table with `ITERATION_COLUMNS`."""
    return [[f"{getattr(record, name):{form}}" for name, form in ITERATION_COLUMNS.values()] for record in records]


def ending(facts: Mapping[str, Any]) -> str | None:
    """How a contraction ended, in a line, from its `summary`; None for a run without one.

    >>> ending({"iterations": 4, "converged": True, "stop_reason": "explained score settled: De = 0.01 < 0.03"})
    'converged after 4 solves'
    >>> ending({"iterations": 1, "converged": False, "stop_reason": "reached max_iterations = 1"})
    'not converged after 1 solve: reached max_iterations = 1'
    """
    n, reason = facts["iterations"], facts["stop_reason"]
    if n == 0 and reason == NOT_CONTRACTED:
        return None
    words = f"converged after {n} solve{'s' * (n != 1)}"
    return words if facts["converged"] else f"not {words}: {reason}"


def point_count(skeleton: Skeleton) -> int:
    """Number of points of the whole cloud, also if the skeleton holds a sample of them or none; 0 if it is unknown."""
    return skeleton.report.n_input or len(skeleton.points)


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
