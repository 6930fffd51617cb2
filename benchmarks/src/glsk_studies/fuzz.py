"""Look for what breaks: degenerate clouds through all pipelines, damaged files through all readers.

Findings are crashes, hangs, memory, errors that are not of the package, warnings, vertices that are no numbers or lie
outside of the box of the points, indices out of range, and skeletons that depend on the order of the points.
"""

from __future__ import annotations

import os
import resource
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, NamedTuple

import numpy as np
import typer

from .damaged import file_case
from .degenerate import array_case
from .runs import application, cause_of_death
from .tables import present

LIMITS = {"arrays": 60, "files": 20}  # seconds of one case; those that are sound take a second at most
MOST_MEMORY = 2 << 30  # bytes that a case may take more than were taken before
MOST_CASES = 10**7  # more than there is time for

app = application(__doc__)
Runs = Annotated[int, typer.Option("--runs", min=1, help="Cases.")]
Minutes = Annotated[float, typer.Option("--minutes", min=0, help="How long, about.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Of all that is drawn.")]
Only = Annotated[int | None, typer.Option("--case", min=0, help="Run this one alone, in this process.")]


class Outcome(NamedTuple):
    """What came of a case."""

    number: int
    kind: str  # of the cloud or file; empty where its process died
    result: str  # skeleton, read, refused or failed
    findings: list[str]


def run_cases(what: str, seed: int, numbers: range) -> Iterator[Outcome]:
    """Run cases, one after another, in a process that is started anew where it ended."""
    context = get_context("spawn")
    first, last, limit = numbers.start, numbers.stop, LIMITS[what]
    while first < last:
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(sender, what, seed, range(first, last)), daemon=True)
        process.start()
        sender.close()  # so that the end of the process is the end of the pipe
        try:
            receiver.recv()  # after all that is imported, however long that takes
            while first < last:
                if not receiver.poll(limit):
                    first += 1
                    yield Outcome(first - 1, "", "failed", [f"not done after {limit} s"])
                    break
                yield receiver.recv()
                first += 1
        except EOFError:
            process.join()
            code = process.exitcode or 0
            if code == 0:
                continue  # it ended by itself, having taken too much memory
            first += 1
            yield Outcome(first - 1, "", "failed", [f"its process died: {cause_of_death(code)}"])
        finally:
            process.kill()
            process.join()
            receiver.close()


def one_case(what: str, seed: int, number: int, folder: Path) -> Outcome:
    """Run a case in this process; an error that is not one of the package's own is a finding."""
    rng = np.random.default_rng([seed, number])
    try:
        return Outcome(number, *(array_case(rng) if what == "arrays" else file_case(rng, folder)))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever it is; some is no Exception
        frames = traceback.extract_tb(error.__traceback__)
        ours = [frame for frame in frames if "glsk_o3d" in frame.filename] or frames
        place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
        return Outcome(number, "", "failed", [f"{type(error).__name__} at {place}: {str(error)[:200]}"])


def _work(sender, what: str, seed: int, numbers: range) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what is logged, and what libraries print past Python, is no finding
        os.dup2(nowhere, stream)
    with TemporaryDirectory() as folder:
        one_case("arrays", 0, 0, Path(folder))  # imports what is imported when first needed
        one_case("files", 0, 0, Path(folder))
        sender.send(None)
        most = _memory() + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_DATA, (most + 2 * MOST_MEMORY,) * 2)
        for number in numbers:
            outcome = one_case(what, seed, number, Path(folder))
            if _memory() > most:
                outcome.findings.append(f"it took more than {MOST_MEMORY >> 20} MiB")
            sender.send(outcome)
            if _memory() > most:
                return  # the most that was ever taken does not fall again


def _memory() -> int:
    """Bytes of memory at most so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


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
    start, found = time.monotonic(), False
    for part, what in enumerate(("files", "arrays"), 1):
        end = start + 60 * minutes * part / 2
        found |= report(what, seed, _until(end, run_cases(what, seed, range(MOST_CASES))))
    raise typer.Exit(found)


def _until(end: float, outcomes: Iterator[Outcome]) -> Iterator[Outcome]:
    """Those that come before it, and one."""
    for outcome in outcomes:
        yield outcome
        if time.monotonic() > end:
            return


def _run(what: str, runs: int, seed: int, case: int | None) -> None:
    if case is None:
        raise typer.Exit(report(what, seed, run_cases(what, seed, range(runs))))
    with TemporaryDirectory() as folder:
        outcome = one_case(what, seed, case, Path(folder))
    typer.echo("\n".join([f"{outcome.kind}: {outcome.result}", *outcome.findings]))
    raise typer.Exit(bool(outcome.findings))


def report(what: str, seed: int, outcomes: Iterable[Outcome]) -> bool:
    """Print a table, and the findings with how to repeat them; gives whether there are any."""
    counts: Counter[tuple[str, str]] = Counter()
    findings = []
    with suppress(KeyboardInterrupt):  # what has come when somebody has seen enough
        for outcome in outcomes:
            for kind in (outcome.kind or "not known", "all"):
                counts[kind, outcome.result] += 1
                counts[kind, "findings"] += len(outcome.findings)
            findings += [(outcome.number, finding) for finding in outcome.findings]
    results = sorted({result for _, result in counts} - {"findings"}) + ["findings"]
    kinds = [*sorted({kind for kind, _ in counts} - {"all"}), "all"]
    rows = [[kind, *(str(counts[kind, result]) for result in results)] for kind in kinds]
    present([(f"{what}, seed {seed}", [what, *results], rows)], markdown=False)
    for number, finding in findings:
        typer.echo(f"benchmarks/fuzz.py {what} --seed {seed} --case {number}  # {finding}")
    return bool(findings)
