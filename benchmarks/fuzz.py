"""Look for what breaks: degenerate clouds through all pipelines, damaged files through all readers, unsound skeletons.

Findings are crashes, hangs, memory, clouds that take much longer than others of their size, errors that are not of the
package, warnings, vertices that are no numbers or lie outside of the box of the points, indices out of range, and
skeletons that depend on the order of the points.
"""

from __future__ import annotations

import os
import re
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

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before NumPy: the same on any machine

import numpy as np
import typer
from _fuzz_arrays import array_case
from _fuzz_files import file_case
from _fuzz_lies import bomb_case, lie_case, named_case
from _fuzz_times import KINDS, MOST_RATIO, SIZES, time_case
from _fuzz_times import LIMIT_S as TIMES_LIMIT_S
from _runs import application, cause_of_death
from _tables import present
from _unsound import unsound_case

LIMIT_S = 60  # of one case; those that are sound take a second at most
FILE_LIMIT_S = 20  # of one file
LARGE = 1 << 20  # bytes of files of which it is said how much more memory they take
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
    kind: str  # of the cloud or file; empty if nobody lived to tell
    told: str  # skeleton, read, refused or failed
    findings: list[str]
    size: int = 0  # of the file
    memory: int = 0  # bytes that it took at most, where the system tells
    seconds: float = 0.0


def run_cases(what: str, seed: int, numbers: range) -> Iterator[Outcome]:
    """Run cases, one after another, in a process that is started anew where it ended."""
    context = get_context("spawn")
    limits = {"arrays": LIMIT_S, "times": TIMES_LIMIT_S}
    first, last, limit = numbers.start, numbers.stop, limits.get(what, min(LIMIT_S, FILE_LIMIT_S))
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
    cases = {"files": file_case, "lies": lie_case, "bombs": bomb_case, "named": named_case, "skeletons": unsound_case}
    before, start = _measured("VmRSS"), time.monotonic()
    try:
        if what == "times":
            kind, told, seconds = time_case(seed, number)
            return Outcome(number, kind, told, [], seconds=seconds)
        found = array_case(rng) if what == "arrays" else cases[what](rng, folder)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever it is; some is no Exception
        frames = traceback.extract_tb(error.__traceback__)
        ours = [frame for frame in frames if "glsk_o3d" in frame.filename] or frames
        place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
        return Outcome(number, "", "failed", [f"{type(error).__name__} at {place}: {str(error)[:200]}"])
    taken = {"memory": max(_measured("VmHWM") - before, 0), "seconds": time.monotonic() - start}
    return Outcome(number, *found)._replace(**taken)


def _measured(what: str) -> int:
    """Bytes of memory that this process has now, from where on the most is measured; or had at most since then."""
    try:
        if what == "VmRSS":
            Path("/proc/self/clear_refs").write_text("5")
        return 1024 * int(re.search(rf"{what}:\s*(\d+)", Path("/proc/self/status").read_text())[1])
    except OSError:  # no Linux
        return 0


def _work(sender, what: str, seed: int, numbers: range) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what is logged, and what libraries print past Python, is no finding
        os.dup2(nowhere, stream)
    with TemporaryDirectory() as folder:
        one_case("arrays", 0, 0, Path(folder))  # imports what is imported when first needed
        one_case("files", 0, 0, Path(folder))
        one_case("lies", 0, 0, Path(folder))
        sender.send(None)
        most = _taken() + MOST_MEMORY
        status = Path("/proc/self/status").read_text() if Path("/proc/self/status").exists() else "VmData: 4194304"
        data = 1024 * int(re.search(r"VmData:\s*(\d+)", status)[1])  # bytes of it now
        resource.setrlimit(
            resource.RLIMIT_DATA, (data + MOST_MEMORY * (1 if what in ("lies", "bombs", "named") else 2),) * 2
        )
        for number in numbers:
            outcome = one_case(what, seed, number, Path(folder))
            if _taken() > most:
                outcome.findings.append(f"it took more than {MOST_MEMORY >> 20} MiB")
            sender.send(outcome)
            if _taken() > most:
                return  # the most that was ever taken does not fall again


def _taken() -> int:
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
def skeletons(runs: Runs = 1000, seed: Seed = 0, case: Only = None) -> None:
    """Files of skeletons with one field unsound, and all that can be done with those that are read."""
    _run("skeletons", runs, seed, case)


@app.command()
def lies(runs: Runs = 1000, seed: Seed = 0, case: Only = None) -> None:
    """Files that promise more or less than they hold, with checksums that are right."""
    _run("lies", runs, seed, case)


@app.command()
def bombs(runs: Runs = 100, seed: Seed = 0, case: Only = None) -> None:
    """Small files that unfold to more than memory."""
    _run("bombs", runs, seed, case)


@app.command()
def named(runs: Runs = 100, seed: Seed = 0, case: Only = None) -> None:
    """Files that name pipes, devices, folders, loops of links, and what is not there."""
    _run("named", runs, seed, case)


@app.command()
def times(
    seed: Seed = 0,
    case: Only = None,
    sizes: Annotated[str, typer.Option("--sizes", help="Sizes, with commas.")] = ",".join(map(str, SIZES)),
) -> None:
    """Degenerate clouds of every kind and size: none takes more than five times the median CPU time of its size."""
    if case is not None:
        _run("times", 1, seed, case)
    rows, findings, taken = {kind: [kind] for kind in KINDS}, [], dict[int, float]()
    for size in map(int, sizes.split(",")):
        first = SIZES.index(size) * len(KINDS)
        numbers = range(first, first + len(KINDS))
        taken |= {each.number: each.seconds if each.kind else np.inf for each in run_cases("times", seed, numbers)}
        limit = MOST_RATIO * np.median([taken[number] for number in numbers])
        for number in numbers:
            if taken[number] > limit:  # once more: something else may have been in the caches
                again = [each.seconds for each in run_cases("times", seed, range(number, number + 1)) if each.kind]
                taken[number] = min([taken[number], *again])
        median = np.median([taken[number] for number in numbers])
        for number, row in zip(numbers, rows.values(), strict=True):
            ratio = taken[number] / median
            row += [f"{taken[number]:.2f}", f"{ratio:.1f}"]
            if ratio > MOST_RATIO:
                findings.append((number, f"{row[0]} of {size} points: {ratio:.1f} times the median"))
    header = ["kind", *(name for size in sizes.split(",") for name in (f"{size}: CPU s", "ratio"))]
    present([(f"times, seed {seed}", header, [*rows.values()])], markdown=False)
    for number, finding in findings:
        typer.echo(f"benchmarks/fuzz.py times --seed {seed} --case {number}  # {finding}")
    raise typer.Exit(bool(findings))


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
    most: dict[str, Outcome] = {}
    with suppress(KeyboardInterrupt):  # what has come when somebody has seen enough
        for outcome in outcomes:
            kind = outcome.kind or "not known"
            counts[kind, outcome.told] += 1
            old = most.get(kind, outcome)
            ratio = max((each for each in (old, outcome) if each.size > LARGE), key=_ratio, default=old)
            most[kind] = ratio._replace(seconds=max(old.seconds, outcome.seconds))
            counts[kind, "findings"] += len(outcome.findings)
            findings += [(outcome.number, finding) for finding in outcome.findings]
    told = sorted({word for _, word in counts} - {"findings"}) + ["findings"]
    rows = [[kind, *(str(counts[kind, word]) for word in told)] for kind in sorted({kind for kind, _ in counts})]
    rows.append(["all", *(str(sum(counts[kind, word] for kind in {kind for kind, _ in counts})) for word in told)])
    if what != "arrays":
        told[-1:-1] = ["seconds at most", "memory over size"]
        for row in rows[:-1]:
            share = f"{_ratio(most[row[0]]):.0f}" if most[row[0]].size > LARGE else "-"
            row[-1:-1] = [f"{most[row[0]].seconds:.1f}", share]
        rows[-1][-1:-1] = [f"{max((each.seconds for each in most.values()), default=0):.1f}", "-"]
    present([(f"{what}, seed {seed}", [what, *told], rows)], markdown=False)
    for number, finding in findings:
        typer.echo(f"benchmarks/fuzz.py {what} --seed {seed} --case {number}  # {finding}")
    return bool(findings)


def _ratio(outcome: Outcome) -> float:
    return outcome.memory / max(outcome.size, 1)


if __name__ == "__main__":
    app()
