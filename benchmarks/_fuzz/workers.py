"""Cases in another process, which may crash, hang or want all memory: then that is what was found."""

from __future__ import annotations

import os
import resource
import tempfile
import traceback
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from _common.runs import DEATHS

from .arrays import array_case
from .files import file_case

LIMIT_S = 60  # of one case; those that are sound take a second at most
MOST_MEMORY = 2 << 30  # bytes that a case may take more than were taken before


class Outcome(NamedTuple):
    """What came of a case.

    Attributes
    ----------
    number : int
    kind : str
        Of the cloud or file; empty if nobody lived to tell.
    told : str
        ``"skeleton"``, ``"read"``, ``"refused"`` or ``"failed"``.
    findings : list of str
    """

    number: int
    kind: str
    told: str
    findings: list[str]


def run_cases(what: str, seed: int, numbers: range) -> Iterator[Outcome]:
    """Run cases, one after another, in a process that is started anew where it ended.

    Parameters
    ----------
    what : {"arrays", "files"}
    seed : int
    numbers : range
        Of the cases: seed and number say all about one.
    """
    context = get_context("spawn")
    first, last = numbers.start, numbers.stop
    while first < last:
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(sender, what, seed, range(first, last)), daemon=True)
        process.start()
        sender.close()  # so that the end of the process is the end of the pipe
        try:
            receiver.recv()  # after all that is imported, however long that takes
            while first < last:
                if not receiver.poll(LIMIT_S):
                    first += 1
                    yield Outcome(first - 1, "", "failed", [f"not done after {LIMIT_S} s"])
                    break
                yield receiver.recv()
                first += 1
        except EOFError:
            process.join()
            code = process.exitcode or 0
            if code == 0:
                continue  # it ended by itself, having taken too much memory
            first += 1
            yield Outcome(first - 1, "", "failed", [f"its process died: {DEATHS.get(-code, f'exit code {code}')}"])
        finally:
            process.kill()
            process.join()
            receiver.close()


def one_case(what: str, seed: int, number: int, folder: Path) -> Outcome:
    """Run a case in this process; an error that is not one of the package's own is a finding."""
    rng = np.random.default_rng([seed, number])
    try:
        found = array_case(rng) if what == "arrays" else file_case(rng, folder)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever it is; some is no Exception
        frames = traceback.extract_tb(error.__traceback__)
        ours = [frame for frame in frames if "glsk_o3d" in frame.filename] or frames
        place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"
        return Outcome(number, "", "failed", [f"{type(error).__name__} at {place}: {str(error)[:200]}"])
    return Outcome(number, *found)


def _work(sender, what: str, seed: int, numbers: range) -> None:
    _be_quiet()
    with tempfile.TemporaryDirectory() as folder:
        one_case("arrays", 0, 0, Path(folder))  # imports what is imported when first needed
        one_case("files", 0, 0, Path(folder))
        sender.send(None)
        most = _taken() + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_DATA, (_data() + 2 * MOST_MEMORY,) * 2)
        for number in numbers:
            outcome = one_case(what, seed, number, Path(folder))
            if _taken() > most:
                outcome.findings.append(f"it took more than {MOST_MEMORY >> 20} MiB")
            sender.send(outcome)
            if _taken() > most:
                return  # the most that was ever taken does not fall again


def _be_quiet() -> None:
    """What is logged, and what libraries print past Python, is no finding."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)


def _taken() -> int:
    """Bytes of memory at most so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _data() -> int:
    """Bytes of data now."""
    lines = Path("/proc/self/status").read_text().splitlines() if Path("/proc/self/status").exists() else []
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData")), 4 << 30)
