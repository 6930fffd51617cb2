"""From a cloud to a skeleton: how far a run is, and what came of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from .console import print_json, print_rows, print_table
from .outputs import tell_files

if TYPE_CHECKING:
    from ..judgements import Judgement
    from ..report import IterationRecord, Report
    from ..skeleton import Skeleton

_ITERATIONS = {  # head of a column, field of IterationRecord, format
    "solve": ("iteration", "d"),
    "points": ("n_points", "d"),
    "merged": ("n_merged", "d"),
    "e": ("explained", ".4f"),
    "De": ("explained_change", ".4f"),
    "rings": ("ring_ratio", ".4f"),
    "w_L": ("contraction_weight", ".4g"),
    "error": ("solve_error", ".1e"),
    "seconds": ("seconds", ".3f"),
}


def run(pipeline: Callable[..., Skeleton], cloud: Any, update, on_state=None) -> tuple[Skeleton, float]:
    """Run a pipeline and show how far it is; gives the skeleton, and the seconds it took."""
    start = time.perf_counter()
    doing, most = "", None

    def on_stage(stage):
        nonlocal doing, most
        doing, most = type(stage).__name__, getattr(stage, "max_iterations", None)
        update(doing)

    def on_iteration(record):
        left = record.n_points - record.n_merged
        update(f"{doing}: solve {record.iteration} of at most {most}, {left} points", record.iteration, most)

    skeleton = pipeline(cloud, on_iteration=on_iteration, on_state=on_state, on_stage=on_stage)
    return skeleton, time.perf_counter() - start


def print_iterations(records: Sequence[IterationRecord], *, err: bool = False) -> None:
    """Print a contraction's iterations as a table."""
    rows = [[format(getattr(record, name), form) for name, form in _ITERATIONS.values()] for record in records]
    if rows:
        print_table(rows, list(_ITERATIONS), err=err)


def print_results(
    skeleton: Skeleton,
    seconds: float,
    written: Sequence[Path],
    problems: Sequence[str],
    more: Mapping[str, Any] = MappingProxyType({}),
    *,
    quiet: bool,
    verbose: bool,
    as_json: bool = False,
) -> None:
    """Print the summary, with `more` facts, and the files written; then raise OSError if there were problems."""
    from ..analysis.summary import summary

    report = skeleton.report
    if verbose:
        print_iterations(report.iterations, err=True)
    facts = {**summary(skeleton, seconds), **more}
    if as_json:
        supported = {"unsupported": list(map(asdict, report.unsupported))} if report.n_draws else {}
        files = [str(path) for path in written]
        print_json({**facts, **supported, "warnings": list(report.warnings), "files": files})
    elif not quiet:
        print_rows(_shown(facts, report))
    tell_files(written, problems, quiet=quiet or as_json)


def _shown(facts: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """The facts that say something of this run, in words."""
    from ..analysis.summary import ENDING_FACTS, ending

    hidden = {*ENDING_FACTS, "seconds", "agreeing"}
    hidden.add("loops_closed")  # most clouds have some, true ones are hardly ever among them
    noted = ("dropped", "outliers", "cuts", "bridges", "traced", "joined")
    hidden.update(name for name in noted if not facts[name])
    if not report.is_sampled:
        hidden.add("sampled")
    if facts["contracted"] == facts["distinct"]:
        hidden.add("contracted")
    shown = {name: value for name, value in facts.items() if name not in hidden}
    shown |= {name: "yes" if value else "no" for name, value in shown.items() if isinstance(value, bool)}
    shown["uncertain"] = "\n".join(map(_close_call, report.uncertain)) or None
    if report.n_draws:
        agreeing = f"{report.n_agreeing} of {report.n_draws} have the same graph"
        shown["samples"] = "\n".join([agreeing, *map(str, report.unsupported)])
    return {**shown, "contraction": ending(facts), "seconds": f"{facts['seconds']:.2f}"}


def _close_call(call: Judgement) -> str:
    """A close call, and what to do where the answer is wrong."""
    return f"{call}; if that is wrong: --set {call.otherwise}"
