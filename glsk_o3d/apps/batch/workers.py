"""Where the work is done: processes of this machine, or a Dask cluster."""

import multiprocessing
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...errors import BatchError, PluginWarning, SkeletonWarning
from ...interop.packages import require

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_SCHEDULER_SECONDS = 10  # seconds until a scheduler must answer
CONNECTION_LOST = "the connection to the Dask scheduler is lost: run the same batch to go on"


def died(error: BaseException | None) -> bool:
    """Whether an error says that the worker died with the work."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"  # the latter is Dask's


class LocalWorkers:
    """Processes of this machine with one BLAS thread each; where one dies, what all do is lost, and new ones begin."""

    def __init__(self, count: int):
        self._count = count
        self._pool: ProcessPoolExecutor | None = None

    def capacity(self) -> int:
        """How many pieces of work to hand out at a time."""
        return self._count

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand out one piece of work; BatchError where processes die before they begin."""
        with _inherited():
            if self._pool is not None:
                try:
                    return self._pool.submit(function, *arguments)
                except BrokenExecutor:
                    self._pool.shutdown()
            self._pool = ProcessPoolExecutor(self._count, multiprocessing.get_context("spawn"), _begin)
            try:
                self._pool.submit(os.getpid).result()
            except BrokenExecutor as error:
                raise BatchError(
                    "worker processes die before they begin; stderr may say why. In a script, start them under "
                    'if __name__ == "__main__": every worker runs the rest of it too'
                ) from error
            return self._pool.submit(function, *arguments)

    def close(self, *, at_once: bool) -> None:
        """Let the workers go; at once: without waiting for what they do."""
        if self._pool is not None:
            processes = list((self._pool._processes or {}).values())  # before Python 3.14 no public name
            for process in processes if at_once else ():
                process.kill()
            self._pool.shutdown(cancel_futures=True)


@contextmanager
def _inherited() -> Iterator[None]:
    """What a new process is to have before it imports anything: one BLAS thread, and Ctrl-C left to its parent."""
    before = {name: os.environ[name] for name in _ONE_THREAD if name in os.environ}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    signals = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if os.name == "posix" else None
    try:
        yield
    finally:
        if signals is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, signals)
        for name in _ONE_THREAD:
            os.environ.pop(name, None)
        os.environ.update(before)


def _begin() -> None:
    """Make a new process ready."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, daemon=True).start()
    for category in (SkeletonWarning, PluginWarning):  # the report has the one, the first process tells the other
        warnings.simplefilter("ignore", category)


def _follow() -> None:
    """Die with the process that started this one, which may have been killed and tell nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class DaskWorkers:
    """A Dask cluster: the address of its scheduler, the file that this wrote, or a ``distributed.Client``.

    BatchError where no scheduler answers.
    """

    def __init__(self, scheduler: Any):
        distributed = require("distributed")
        self._own = not isinstance(scheduler, distributed.Client)
        if self._own:
            text = os.fspath(scheduler)
            try:
                if Path(text).is_file():
                    where = {"scheduler_file": text}
                else:
                    where = {"address": distributed.comm.resolve_address(text)}  # a client that cannot is slow to go
                scheduler = distributed.Client(**where, timeout=_SCHEDULER_SECONDS, set_as_default=False)
            except Exception as error:  # no answer, no address, no such protocol
                raise BatchError(f"{text}: no Dask scheduler answers there: {error}") from error
        self._client, self._executor = scheduler, scheduler.get_executor(pure=False)
        self._count, self._asked = 1, -1.0

    def capacity(self) -> int:
        """Twice the threads of the cluster as it is now, so that none of them waits for us; one, while it has none."""
        if time.monotonic() - self._asked > 1:  # not at once, since what is lost is cancelled first
            try:
                self._count = max(1, 2 * sum(self._client.nthreads().values()))
            except Exception as error:  # whatever a lost connection raises
                raise BatchError(CONNECTION_LOST) from error
            self._asked = time.monotonic()
        return self._count

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand out one piece of work; BatchError where the scheduler is gone."""
        try:
            future: Future[Any] = self._executor.submit(function, *arguments)
            return future
        except Exception as error:  # whatever a lost connection raises
            raise BatchError(CONNECTION_LOST) from error

    def close(self, *, at_once: bool) -> None:
        """Let the workers go; at once: without waiting for what they do."""
        self._executor.shutdown(wait=not at_once)
        if self._own:
            self._client.close(timeout=5)


Workers = LocalWorkers | DaskWorkers
