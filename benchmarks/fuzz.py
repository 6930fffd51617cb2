"""Look for what breaks: degenerate clouds through all pipelines, damaged files through all readers.

Findings are crashes, hangs, memory, errors that are not of the package, warnings, vertices that are no numbers or lie
outside of the box of the points, indices out of range, and skeletons that depend on the order of the points.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before NumPy: the same on any machine

import typer
from _common.command_line import application
from _common.tables import show
from _fuzz.workers import Outcome, one_case, run_cases

MOST_CASES = 10**7  # more than there is time for

app = application(__doc__)
Runs = Annotated[int, typer.Option("--runs", min=1, help="Cases.")]
Minutes = Annotated[float, typer.Option("--minutes", min=0, help="How long, about.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Of all that is drawn.")]
Only = Annotated[int | None, typer.Option("--case", min=0, help="Run this one alone, in this process.")]


@app.command()
def arrays(runs: Runs = 1000, seed: Seed = 0, case: Only = None) -> None:
    """Degenerate clouds through the pipelines, each in two orders."""
    _run("arrays", runs, seed, case)


@app.command()
def files(runs: Runs = 1000, seed: Seed = 0, case: Only = None) -> None:
    """Damaged files through the readers."""
    _run("files", runs, seed, case)


@app.command()
def both(minutes: Minutes = 1.0, seed: Seed = 0) -> None:
    """First files, then arrays, as long as there is time: half of it for each."""
    start, bad = time.monotonic(), False
    for part, what in enumerate(("files", "arrays"), 1):
        end = start + 60 * minutes * part / 2
        bad |= _tell(what, seed, _until(end, run_cases(what, seed, range(MOST_CASES))))
    raise typer.Exit(bad)


def _until(end: float, outcomes: Iterator[Outcome]) -> Iterator[Outcome]:
    """Those that come before it, and one."""
    for outcome in outcomes:
        yield outcome
        if time.monotonic() > end:
            return


def _run(what: str, runs: int, seed: int, case: int | None) -> None:
    if case is None:
        raise typer.Exit(_tell(what, seed, run_cases(what, seed, range(runs))))
    with TemporaryDirectory() as folder:
        outcome = one_case(what, seed, case, Path(folder))
    typer.echo(f"{outcome.kind}: {outcome.told}" + "".join(f"\n{finding}" for finding in outcome.findings))
    raise typer.Exit(bool(outcome.findings))


def _tell(what: str, seed: int, outcomes: Iterable[Outcome]) -> bool:
    """Print a table, and the findings with how to repeat them; gives whether there are any."""
    counts: Counter[tuple[str, str]] = Counter()
    findings = []
    for outcome in _until_interrupted(outcomes):
        kind = outcome.kind or "not known"
        counts[kind, outcome.told] += 1
        counts[kind, "findings"] += len(outcome.findings)
        findings += [(outcome.number, finding) for finding in outcome.findings]
    told = sorted({word for _, word in counts} - {"findings"}) + ["findings"]
    rows = [[kind, *(str(counts[kind, word]) for word in told)] for kind in sorted({kind for kind, _ in counts})]
    rows.append(["all", *(str(sum(counts[kind, word] for kind in {kind for kind, _ in counts})) for word in told)])
    show(f"{what}, seed {seed}", [what, *told], rows, markdown=False)
    for number, finding in findings:
        typer.echo(f"benchmarks/fuzz.py {what} --seed {seed} --case {number}  # {finding}")
    return bool(findings)


def _until_interrupted(outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """What has come when somebody has seen enough."""
    with suppress(KeyboardInterrupt):
        yield from outcomes


if __name__ == "__main__":
    app()
