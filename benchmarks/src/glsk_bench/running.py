"""Running a program over the clouds of a benchmark: our pipelines, or any command, with limits."""

from __future__ import annotations

import json
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from glsk_o3d.errors import LONGEST_QUOTED, FileFormatError, InvalidParameterError, brief
from glsk_o3d.interop.atomic import write_json
from glsk_o3d.io.skeletons import READABLE, read_skeleton
from glsk_o3d.recipes.catalogue import named_pipeline

from .folders import BenchmarkFolder, CloudFile, read_folder
from .scoring import TIMES_NAME, answer_files, read_times

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

CAN_LIMIT_MEMORY = hasattr(resource, "prlimit")
_PLACES = ("{cloud}", "{skeleton}")
TIME_LIMIT = 600.0  # fitted: seconds; the slowest of the programs that we know take a tenth of it
_PIPELINE_WORDS = (
    *(sys.executable, "-m", "glsk_o3d", "skeletonize", "{cloud}", "-o", "{skeleton}"),
    *("--quiet", "--pipeline"),
)
Told = dict[str, Any]


@dataclass(frozen=True)
class RunResult:
    """What came of a run."""

    done: int  # clouds with an answer, those of earlier runs too
    failed: int  # and without
    skipped: int  # of these, clouds that an earlier run had done
    failures: dict[str, str] = field(default_factory=dict)  # why there is no answer, by the name of the cloud


def run(
    folder: BenchmarkFolder | str | os.PathLike,
    answers: str | os.PathLike,
    *,
    pipeline: str | None = None,
    command: str | Sequence[str] | None = None,
    ending: str = ".ply",
    time_limit: float = TIME_LIMIT,
    memory_limit: float | None = None,
    jobs: int = 1,
    retry: bool = False,
    on_cloud: Callable[[str, Outcome, int, int], object] | None = None,
) -> RunResult:
    """Run a program over all scored clouds, or continue an interrupted run.

    Each cloud has a process of its own. Its file counts if the process succeeds and the file is readable. Answers have
    the name SHAPE_VARIANT and the ending; ``times.json`` has the seconds from the start of each process to its end, and
    the reasons for missing answers.

    Parameters
    ----------
    folder : BenchmarkFolder or path-like
    answers : path-like
        A folder, created if missing.
    pipeline : str, optional
        One of ours by name; "default" if there is no command.
    command : str or sequence of str, optional
        Any program, such as ``"mytool {cloud} {skeleton}"``, with places for the files that it reads and writes.
    ending : str
        Of the files that the command writes, one that `read_skeleton` reads.
    time_limit : float
        Seconds for each cloud.
    memory_limit : float, optional
        GB of address space for each process, on Linux.
    jobs : int
        Clouds at a time. More than one make the seconds inexact.
    retry : bool
        Repeat failed clouds.
    on_cloud : callable, optional
        Called with the name of each finished cloud, its `Outcome`, the number of finished ones, and that of all.

    Returns
    -------
    RunResult

    Raises
    ------
    InvalidParameterError
        The command has no place for a file, or there is no such program or pipeline; a limit is wrong; or the folder
        has answers of another program.
    FileFormatError
        The ending is not one of a skeleton, or a file in a folder is damaged.
    OSError

    Examples
    --------
    >>> from glsk_bench import make
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     made = make(f"{place}/bench", families=["tubes"], seeds=[100], variants=["clean"], jobs=1)
    ...     result = run(made, f"{place}/none", command=[sys.executable, "-c", "exit(3)", "{cloud}", "{skeleton}"])
    >>> result.failures
    {'tubes_100_clean': 'exit code 3'}
    """
    made = folder if isinstance(folder, BenchmarkFolder) else read_folder(folder)
    words, program = _program(pipeline, command, ending)
    if not 0 < time_limit < float("inf") or jobs < 1:
        raise InvalidParameterError(f"the time limit must be above 0 and jobs 1 or more, not {time_limit:g} and {jobs}")
    if memory_limit is not None and not memory_limit > 0:
        raise InvalidParameterError(f"the memory limit must be above 0, not {memory_limit:g}")
    if memory_limit is not None and not CAN_LIMIT_MEMORY:
        raise InvalidParameterError("this system cannot limit the memory of a process: leave the limit out")
    program |= {"time_limit": time_limit, "memory_limit": memory_limit}
    place = Path(answers)
    place.mkdir(parents=True, exist_ok=True)
    times = _times(place, made, program)
    done = {name for name, told in times.items() if not (retry and told.get("failure") is not None)}
    todo = [cloud for cloud in made.scored if cloud.name not in done]
    machine = {"system": platform.platform(), "cores": os.cpu_count(), "jobs": jobs}
    record = {"benchmark": made.version, "program": program, "machine": machine, "clouds": times}
    runner, pool = Runner(time_limit, memory_limit), ThreadPoolExecutor(jobs)
    with tempfile.TemporaryDirectory(prefix=".run_", dir=place, ignore_cleanup_errors=True) as work:
        try:
            begun = {pool.submit(_answer, runner, words, it, Path(work), place, ending): it for it in todo}
            for count, future in enumerate(as_completed(begun), 1):
                cloud, outcome = begun[future], future.result()
                told = {"seconds": round(outcome.seconds, 4), "failure": outcome.failure, "digits": made.digits(cloud)}
                times[cloud.name] = {part: value for part, value in told.items() if part != "digits" or value}
                write_json(place / TIMES_NAME, record)
                if on_cloud is not None:
                    on_cloud(cloud.name, outcome, count, len(todo))
        finally:  # ends all of them when something goes wrong
            runner.stop()
            pool.shutdown(wait=True, cancel_futures=True)
    known = {cloud.name: times[cloud.name].get("failure") for cloud in made.scored}
    failures = {name: failure for name, failure in known.items() if failure is not None}
    return RunResult(len(known) - len(failures), len(failures), len(known) - len(todo), failures)


def _program(pipeline: str | None, command: str | Sequence[str] | None, ending: str) -> tuple[list[str], Told]:
    """The words of the command to run, and what ``times.json`` says of it."""
    if ending not in READABLE:
        raise FileFormatError(f"{ending!r} is no ending of a skeleton: there are {', '.join(READABLE)}")
    if command is not None:
        if pipeline is not None:
            raise InvalidParameterError("a pipeline and a command are given: give one of them")
        return words_of(command), {"command": command if isinstance(command, str) else [*command], "ending": ending}
    named_pipeline(pipeline or "default").check_complete()
    return [*_PIPELINE_WORDS, pipeline or "default"], {"pipeline": pipeline or "default", "ending": ending}


def _times(place: Path, made: BenchmarkFolder, program: Told) -> dict[str, Told]:
    """What earlier runs of the same program tell of each cloud."""
    files, times, path = answer_files(place), read_times(place), place / TIMES_NAME
    before = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    same = (before.get("benchmark"), before.get("program")) == (made.version, json.loads(json.dumps(program)))
    if not same and (before or any(cloud.name in files for cloud in made.scored)):
        raise InvalidParameterError(
            f"{place}: has answers of another program, with other limits, or to other clouds: give another folder"
        )
    digits = {cloud.name: made.digits(cloud) for cloud in made.scored}
    there = [name for name, told in times.items() if told.get("failure") is not None or name in files]
    return {name: times[name] for name in there if times[name].get("digits") == digits.get(name)}


def _answer(runner: Runner, words: list[str], cloud: CloudFile, work: Path, place: Path, ending: str) -> Outcome:
    """Run the program on a cloud, and take its answer if it is one."""
    skeleton = work.resolve() / f"{cloud.name}{ending}"
    said = work / f"{cloud.name}.log"
    names = dict(zip(_PLACES, (str(cloud.path.resolve()), str(skeleton)), strict=True))
    filled = [re.sub("{cloud}|{skeleton}", lambda found: names[found[0]], word) for word in words]
    outcome = runner.run(filled, said)
    said.unlink(missing_ok=True)
    failure = outcome.failure or _fault(skeleton)
    if failure is None:
        os.replace(skeleton, place / skeleton.name)
    else:
        (place / skeleton.name).unlink(missing_ok=True)
        shutil.rmtree(skeleton) if skeleton.is_dir() else skeleton.unlink(missing_ok=True)
    return outcome._replace(failure=failure)


def _fault(skeleton: Path) -> str | None:
    """Why the file that a program wrote is no answer."""
    if not skeleton.is_file():
        return "it wrote no skeleton"
    try:
        found = read_skeleton(skeleton)
    except (FileFormatError, OSError, MemoryError) as error:
        return f"it wrote no skeleton: {brief(error).removeprefix(f'{skeleton}: ')}"
    return None if len(found.vertices) else "it wrote an empty skeleton"


class Outcome(NamedTuple):
    """What came of a command."""

    seconds: float
    failure: str | None


def words_of(command: str | Sequence[str]) -> list[str]:
    """The words of a command with the places for files, checked."""
    try:
        words = shlex.split(command, posix=os.name == "posix") if isinstance(command, str) else [*command]
    except ValueError as error:
        raise InvalidParameterError(f"the command {command!r} is malformed: {error}") from None
    for place in _PLACES:
        if not any(place in word for word in words):
            raise InvalidParameterError(
                f"the command has no {place} for the name of a file, as in 'mytool {' '.join(_PLACES)}'"
            )
    if shutil.which(words[0]) is None:
        raise InvalidParameterError(f"the command cannot be run: there is no program {words[0]!r}")
    return words


class Runner:
    """Runs commands, several at a time if it is called from threads, and can end them all."""

    def __init__(self, time_limit: float, memory_limit: float | None = None):
        self._time_limit, self._memory_limit = time_limit, memory_limit
        self._running: set[subprocess.Popen] = set()
        self._lock, self._stopped = threading.Lock(), False

    def run(self, words: Sequence[str], said: Path) -> Outcome:
        """Run a command to its end; what it prints goes into a file. Never raises for what the command does."""
        late = threading.Event()
        with said.open("wb") as stream:
            start = time.perf_counter()
            try:
                process = self._start(words, stream)
            except OSError as error:
                return Outcome(0.0, f"cannot be started: {error.strerror or error}")
            watch = threading.Timer(self._time_limit, self._end_late, (process, late))
            watch.daemon = True
            watch.start()
            code = process.wait()
            seconds = time.perf_counter() - start
            watch.cancel()
        with self._lock:
            self._running.discard(process)
        if late.is_set():
            return Outcome(seconds, f"not done after {self._time_limit:g} s")
        return Outcome(seconds, None if code == 0 else _cause(code, said))

    def _start(self, words: Sequence[str], stream: Any) -> subprocess.Popen:
        with self._lock:
            if self._stopped:
                raise InterruptedError("stopped")
            streams: dict[str, Any] = dict(stdin=subprocess.DEVNULL, stdout=stream, stderr=subprocess.STDOUT)
            process = subprocess.Popen(words, **streams, start_new_session=os.name == "posix")
            self._running.add(process)
        if self._memory_limit is not None and CAN_LIMIT_MEMORY:
            bytes_ = round(self._memory_limit * 1e9)
            with suppress(OSError):  # it has ended already
                resource.prlimit(process.pid, resource.RLIMIT_AS, (bytes_, bytes_))
        return process

    def _end_late(self, process: subprocess.Popen, late: threading.Event) -> None:
        if process.poll() is None:
            late.set()
            _kill(process)

    def stop(self) -> None:
        """Kill what runs, and start nothing any more."""
        with self._lock:
            self._stopped = True
            running = [*self._running]
        for process in running:
            if process.poll() is None:
                _kill(process)


def _kill(process: subprocess.Popen) -> None:
    """Kill a process with all that it started, as far as these have not left its group."""
    if os.name == "posix":
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    elif sys.platform == "win32":
        subprocess.run(["taskkill", "/F", "/T", "/PID", str(process.pid)], capture_output=True, check=False)


def _cause(code: int, said: Path) -> str:
    """How a command ended, and the last line of what it printed."""
    names = {each.value: each.name for each in signal.Signals}
    cause = f"exit code {code}" if code > 0 else f"killed by {names.get(-code, f'signal {-code}')}"
    with said.open("rb") as stream:
        stream.seek(0, os.SEEK_END)
        stream.seek(max(stream.tell() - 4 * LONGEST_QUOTED, 0))
        lines = stream.read().decode("utf-8", errors="replace").strip().splitlines()
    return f"{cause}: {lines[-1].strip()[:LONGEST_QUOTED]}" if lines else cause
