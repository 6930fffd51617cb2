"""Programs that are run as commands: with limits, in a process group of their own, whatever they do."""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from glsk_o3d.errors import LONGEST_QUOTED, InvalidParameterError

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

CAN_LIMIT_MEMORY = hasattr(resource, "prlimit")
_PLACES = ("{cloud}", "{skeleton}")


class Outcome(NamedTuple):
    """What came of a command.

    Attributes
    ----------
    seconds : float
        From its start to its end.
    failure : str or None
        Why it failed.
    """

    seconds: float
    failure: str | None


def words_of(command: str | Sequence[str]) -> list[str]:
    """The words of a command with the places for files, checked.

    Parameters
    ----------
    command : str or sequence of str
        A text is split as a shell does; nothing else is done to it that shells do.

    Returns
    -------
    list of str

    Raises
    ------
    InvalidParameterError
        ``{cloud}`` or ``{skeleton}`` is missing, a quote is open, or there is no such program.

    Examples
    --------
    >>> words_of("sh -c 'cat < {cloud} > {skeleton}'")
    ['sh', '-c', 'cat < {cloud} > {skeleton}']
    """
    try:
        words = shlex.split(command, posix=os.name == "posix") if isinstance(command, str) else [*command]
    except ValueError as error:
        raise InvalidParameterError(f"the command {command!r} is malformed: {error}") from None
    for place in _PLACES:
        if not any(place in word for word in words):
            raise InvalidParameterError(
                f"the command must say where names of files go: it has no {place}, as in 'mytool {' '.join(_PLACES)}'"
            )
    if shutil.which(words[0]) is None:
        raise InvalidParameterError(f"the command cannot be run: there is no program {words[0]!r}")
    return words


def filled(words: Sequence[str], cloud: Path, skeleton: Path) -> list[str]:
    """The words with the names of files in their places.

    Examples
    --------
    >>> filled(["mytool", "--in={cloud}", "{skeleton}"], Path("a.ply"), Path("b.obj"))
    ['mytool', '--in=a.ply', 'b.obj']
    """
    names = [str(cloud), str(skeleton)]
    found = []
    for word in words:
        for place, name in zip(_PLACES, names, strict=True):
            word = word.replace(place, name)
        found.append(word)
    return found


class Runner:
    """Runs commands, several at a time if it is called from threads, and can end them all.

    Parameters
    ----------
    time_limit : float
        Seconds after which a command and all that it started are killed.
    memory_limit : float, optional
        GB of address space that it may have, and each process that it starts, where the system can tell them.
    """

    def __init__(self, time_limit: float, memory_limit: float | None = None):
        self._time_limit, self._memory_limit = time_limit, memory_limit
        self._running: set[subprocess.Popen] = set()
        self._lock, self._stopped = threading.Lock(), False

    def run(self, words: Sequence[str], said: Path) -> Outcome:
        """Run a command to its end. Never raises for what the command does.

        Parameters
        ----------
        words : sequence of str
        said : Path
            A file for what it prints.

        Returns
        -------
        Outcome
        """
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
        return Outcome(seconds, None if code == 0 else f"{_ended(code)}{_last_line(said)}")

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


def _ended(code: int) -> str:
    if code > 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"


def _last_line(said: Path) -> str:
    """The last line of what a command printed, after a colon."""
    with said.open("rb") as stream:
        stream.seek(0, os.SEEK_END)
        stream.seek(max(stream.tell() - 4 * LONGEST_QUOTED, 0))
        lines = stream.read().decode("utf-8", errors="replace").strip().splitlines()
    return f": {lines[-1].strip()[:LONGEST_QUOTED]}" if lines else ""
