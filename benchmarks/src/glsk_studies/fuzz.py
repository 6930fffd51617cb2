"""Look for what breaks: degenerate clouds through all pipelines, damaged files through all readers.

Findings are crashes, hangs, memory, errors that are not of the package, warnings, vertices that are no numbers or lie
outside of the box of the points, indices out of range, and skeletons that depend on the order of the points.
"""

from __future__ import annotations

import resource
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, count
from typing import Annotated

import numpy as np
import typer

from .damaged import damaged_file, read
from .degenerate import degenerate_cloud, skeletonised
from .peers import silence
from .runs import Jobs, application, run
from .tables import present

LIMITS = {"arrays": 60, "files": 20}  # seconds of one case; those that are sound take a second at most
MOST_MEMORY = 2 << 30  # bytes that a case may take more than were taken before
CHUNK = 100  # cases between two looks at the clock
# loaded by the process of which that of each case is a copy
PRELOADED = ("glsk_studies.fuzz", "glsk_o3d.filters.refiner", "glsk_o3d.io.scans", "open3d", "laspy", "pye57")

app = application(__doc__)
Runs = Annotated[int, typer.Option("--runs", min=1, help="Cases.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Of all that is drawn.")]
Only = Annotated[int | None, typer.Option("--case", min=0, help="Run this one alone, in this process.")]


def drawn(what: str, seed: int, number: int) -> tuple[dict, tuple]:
    """The facts of a case, and what `judged` is given."""
    rng = np.random.default_rng([seed, number])
    kind, *case = damaged_file(rng) if what == "files" else degenerate_cloud(rng)
    return dict(number=number, kind=kind), (what, *case)


def judged(what: str, *case) -> dict:
    """What comes of a case; what is logged, and what libraries print past Python, is no finding."""
    before = memory()
    resource.setrlimit(resource.RLIMIT_DATA, (before + 3 * MOST_MEMORY,) * 2)
    with silence():
        result, findings = read(*case) if what == "files" else skeletonised(*case)
    if memory() > before + MOST_MEMORY:
        findings.append(f"it took more than {MOST_MEMORY >> 20} MiB")
    return dict(result=result, findings=findings)


def memory() -> int:
    """Bytes of memory at most so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def run_cases(what: str, seed: int, numbers: Iterable[int], jobs: int) -> list[dict]:
    """A row for each case, each in a process of its own."""
    work = [drawn(what, seed, number) for number in numbers]
    return run(judged, work, jobs, fresh=True, limit=LIMITS[what], preload=PRELOADED)


@app.command()
def arrays(runs: Runs = 1000, seed: Seed = 0, case: Only = None, jobs: Jobs = 2) -> None:
    """Degenerate clouds through the pipelines, each in two orders."""
    run_command("arrays", runs, seed, case, jobs)


@app.command()
def files(runs: Runs = 1000, seed: Seed = 0, case: Only = None, jobs: Jobs = 2) -> None:
    """Damaged files through the readers."""
    run_command("files", runs, seed, case, jobs)


@app.command()
def both(
    minutes: Annotated[float, typer.Option("--minutes", min=0, help="How long, about.")] = 1.0,
    seed: Seed = 0,
    jobs: Jobs = 2,
) -> None:
    """First files, then arrays, as long as there is time: half of it for each."""
    start, found = time.monotonic(), False
    for part, what in enumerate(("files", "arrays"), 1):
        found |= report(what, seed, rows_until(start + 60 * minutes * part / 2, what, seed, jobs))
    raise typer.Exit(found)


def rows_until(end: float, what: str, seed: int, jobs: int) -> Iterator[dict]:
    """The rows of one chunk of cases after another, until it is late."""
    for first in count(0, CHUNK):
        yield from run_cases(what, seed, range(first, first + CHUNK), jobs)
        if time.monotonic() > end:
            return


def run_command(what: str, runs: int, seed: int, case: int | None, jobs: int) -> None:
    """Run many cases, or one in this process, whose error is not caught."""
    if case is None:
        chunks = (range(first, min(first + CHUNK, runs)) for first in range(0, runs, CHUNK))
        raise typer.Exit(report(what, seed, chain.from_iterable(run_cases(what, seed, it, jobs) for it in chunks)))
    facts, arguments = drawn(what, seed, case)
    row = judged(*arguments)
    typer.echo("\n".join([f"{facts['kind']}: {row['result']}", *row["findings"]]))
    raise typer.Exit(bool(row["findings"]))


def report(what: str, seed: int, rows: Iterable[dict]) -> bool:
    """Print a table, and the findings with how to repeat them; gives whether there are any."""
    counts: Counter[tuple[str, str]] = Counter()
    findings = []
    with suppress(KeyboardInterrupt):  # what has come when somebody has seen enough
        for row in rows:
            found = [row["failure"]] if "failure" in row else row["findings"]
            for kind in (row["kind"], "all"):
                counts[kind, row.get("result", "failed")] += 1
                counts[kind, "findings"] += len(found)
            findings += [(row["number"], " ".join(each.split())[:200]) for each in found]
    results = sorted({result for _, result in counts} - {"findings"}) + ["findings"]
    kinds = [*sorted({kind for kind, _ in counts} - {"all"}), "all"]
    lines = [[kind, *(str(counts[kind, result]) for result in results)] for kind in kinds]
    present([(f"{what}, seed {seed}", [what, *results], lines)])
    for number, finding in findings:
        typer.echo(f"benchmarks/fuzz.py {what} --seed {seed} --case {number}  # {finding}")
    return bool(findings)
