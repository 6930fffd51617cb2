"""From a cloud to a skeleton: how far a run is, and what came of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..analysis.summary import ENDING_FACTS, ending, summary
from ..judgements import Judgement
from ..report import Report
from ..skeleton import Skeleton
from .console import echo, print_iterations, print_json, print_rows

_DOING = {
    "RingBuilder": "building rings",
    "Contractor": "contracting",
    "LPRReducer": "merging points",
    "Connector": "connecting",
    "Refiner": "refining",
}


def run(pipeline: Callable[..., Skeleton], cloud: Any, update, on_state=None) -> tuple[Skeleton, float]:
    """Run a pipeline and show how far it is; gives the skeleton, and the seconds it took."""
    start = time.perf_counter()
    on_stage, on_iteration = _watch(update)
    skeleton = pipeline(cloud, on_iteration=on_iteration, on_state=on_state, on_stage=on_stage)
    return skeleton, time.perf_counter() - start


def _watch(update):
    doing, most = "", None

    def on_stage(stage):
        nonlocal doing, most
        doing, most = _DOING.get(type(stage).__name__, type(stage).__name__), getattr(stage, "max_iterations", None)
        update(doing)

    def on_iteration(record):
        left = record.n_points - record.n_merged
        update(f"{doing}: solve {record.iteration} of at most {most}, {left} points", record.iteration, most)

    return on_stage, on_iteration


def print_results(
    skeleton: Skeleton,
    seconds: float,
    written: Sequence[Path],
    problems: Sequence[str],
    more: Mapping[str, Any] = MappingProxyType({}),
    *,
    quiet,
    verbose,
    as_json=False,
) -> None:
    """Print the summary, with `more` facts, and the files written; then raise OSError if there were problems."""
    if verbose:
        print_iterations(skeleton.report.iterations, stderr=True)
    facts = {**summary(skeleton, seconds), **more}
    if as_json:
        warnings = list(skeleton.report.warnings)
        unsupported = list(map(asdict, skeleton.report.unsupported))
        supported = {"unsupported": unsupported} if skeleton.report.n_draws else {}
        print_json({**facts, **supported, "warnings": warnings, "files": [str(path) for path in written]})
    elif not quiet:
        told = {name: value for name, value in facts.items() if name not in (*ENDING_FACTS, "seconds")}
        hidden = {"dropped": facts["dropped"] or None}
        if not skeleton.report.is_sampled:
            hidden["sampled"] = None
        hidden["loops_closed"] = None  # most clouds have some, true ones are hardly ever among them
        hidden |= {name: None for name in ("outliers", "cuts", "bridges", "traced", "joined") if not facts[name]}
        hidden["uncertain"] = "\n".join(map(_close_call, skeleton.report.uncertain)) or None
        if skeleton.report.n_draws:
            hidden["samples"], hidden["agreeing"] = _supported(skeleton.report), None
        if facts["contracted"] == facts["distinct"]:
            hidden["contracted"] = None
        words = {name: "yes" if value else "no" for name, value in told.items() if isinstance(value, bool)}
        print_rows({**told, **words, **hidden, "contraction": ending(facts), "seconds": f"{seconds:.2f}"})
    tell_files(written, problems, quiet=quiet or as_json)


def _supported(report: Report) -> str:
    """How many samples agree with a skeleton, and what most of them do not show."""
    return "\n".join([f"{report.n_agreeing} of {report.n_draws} have the same graph", *map(str, report.unsupported)])


def _close_call(call: Judgement) -> str:
    """A close call, and what to do where the answer is wrong."""
    from ..refinement.diagnostics import otherwise

    return f"{call}; if that is wrong: --set {otherwise(call)}"


def tell_files(written: Sequence[Path], problems: Sequence[str] = (), *, quiet: bool) -> None:
    """Print which files were written; then raise OSError if some were not."""
    if not quiet:
        for path in written:
            echo(f"wrote {path}")
    if problems:
        raise OSError("; ".join(problems))
