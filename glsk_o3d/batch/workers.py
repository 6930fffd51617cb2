"""Where the work is done: processes of this machine, a Dask cluster, or any executor."""

from __future__ import annotations

import importlib
import logging
import multiprocessing
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from typing import Any, Protocol

from ..errors import BatchError, PluginWarning, SkeletonWarning
from ..interop.packages import import_open3d, require
from ..numerics.cores import cores

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_SCHEDULER_SECONDS = 10  # seconds until a scheduler must answer
_DASK_LOG = logging.getLogger("distributed.client")
_log = logging.getLogger(__name__)


class Workers(Protocol):
    """Who does the work."""

    def submit(self, function: Callable, *arguments: Any) -> Future:
        """Hand out one piece of work."""

    def capacity(self) -> int:
        """How many pieces to hand out at a time."""

    def close(self, *, at_once: bool) -> None:
        """Let the workers go; at once: without waiting for what they do."""


def died(error: BaseException | None) -> bool:
    """Whether an error says that the worker died with the work."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"  # the latter is Dask's


# ------------------------------------------------------------------------------------------------------ this machine


class LocalWorkers:
    """Processes of this machine with one BLAS thread each.

    Each is a pool by itself, so that one that dies takes no other work with it, and it is known what it was doing.

    Parameters
    ----------
    count : int
    load : bool
        Load what every skeleton needs, and takes its time, when they start.
    """

    def __init__(self, count: int, load: bool = True):
        self._seats = [_Seat(load) for _ in range(count)]
        self._free = list(self._seats)
        self._stillborn = 0

    def capacity(self) -> int:
        return len(self._seats)

    def submit(self, function: Callable, *arguments: Any) -> Future:
        seat, told = self._free.pop(), Future()
        seat.submit(function, *arguments).add_done_callback(partial(self._settle, seat, told))
        return told

    def _settle(self, seat: _Seat, told: Future, done: Future) -> None:
        """Free the seat, and only then pass on what came of the work."""
        if done.cancelled():
            told.cancel()
            return
        error = done.exception()
        if died(error):
            self._stillborn = 0 if seat.began() else self._stillborn + 1
            seat.close(wait=False)
            if self._stillborn > len(self._seats):
                error = BatchError(
                    "worker processes die before they begin; stderr may say why. In a script, call run_batch under "
                    'if __name__ == "__main__": every worker runs the rest of it too'
                )
        self._free.append(seat)
        if error is None:
            told.set_result(done.result())
        else:
            told.set_exception(error)

    def close(self, *, at_once: bool) -> None:
        for seat in self._seats:
            if at_once:
                seat.kill()
        for seat in self._seats:
            seat.close(wait=True)


class _Seat:
    """A pool of one process, started when there is work, and anew when it has died."""

    pool: ProcessPoolExecutor | None = None
    process: _Process | None = None

    def __init__(self, load: bool):
        self._load = load

    def submit(self, function, *arguments) -> Future:
        if self.pool is not None:
            with suppress(BrokenExecutor):  # died while it was idle
                return self.pool.submit(function, *arguments)
            self.close(wait=False)
        context = _Context()
        self.pool = ProcessPoolExecutor(1, context, _begin, (self._load,))
        self._first = self.pool.submit(os.getpid)
        self.process = context.process
        return self.pool.submit(function, *arguments)

    def began(self) -> bool:
        """Whether the process ever got as far as work."""
        return self._first.done() and self._first.exception() is None

    def kill(self) -> None:
        process = self.process
        if process is not None:
            process.kill()

    def close(self, *, wait: bool) -> None:
        pool, self.pool, self.process = self.pool, None, None
        if pool is not None:
            pool.shutdown(wait=wait, cancel_futures=True)


class _Process(SpawnProcess):
    """A worker that computes in one thread, and that leaves Ctrl-C to the process that started it."""

    def start(self):
        with _one_blas_thread(), _without_interrupts():  # the new process inherits both, before it imports anything
            super().start()


class _Context(SpawnContext):
    """Starts such workers, and remembers the last one."""

    process: _Process | None = None

    def Process(self, *args, **kwargs):  # type: ignore[override]
        self.process = _Process(*args, **kwargs)
        return self.process


@contextmanager
def _one_blas_thread() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _without_interrupts() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(load: bool) -> None:
    """Make a new process ready."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, daemon=True).start()
    for category in (SkeletonWarning, PluginWarning):  # the report has the one, the first process tells the other
        warnings.simplefilter("ignore", category)
    if not load:
        return
    with suppress(Exception):  # every job will say what is wrong
        import_open3d()
        importlib.import_module("glsk_o3d.recipes")


def _follow() -> None:
    """Die with the process that started this one, which may have been killed and tell nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


# -------------------------------------------------------------------------------------------------------------- Dask


class DaskWorkers:
    """A Dask cluster.

    Parameters
    ----------
    scheduler : str, path-like or distributed.Client
        The address of a scheduler such as ``tcp://host:8786``, or the file that it wrote.

    Raises
    ------
    BatchError
        No scheduler answers there.
    MissingPackageError
    """

    def __init__(self, scheduler: Any):
        distributed = require("distributed")
        self._own = not isinstance(scheduler, distributed.Client)
        self.name = str(getattr(getattr(scheduler, "scheduler", scheduler), "address", scheduler))
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
        self._client, self._level = scheduler, _DASK_LOG.level
        _DASK_LOG.setLevel(logging.CRITICAL)  # we say ourselves, in one line, that a scheduler has gone
        self._executor = scheduler.get_executor(pure=False)
        self._asked, self._threads = -1.0, 0

    def capacity(self) -> int:
        """Twice the threads of the cluster as it is now, so that none of them waits for us; one, while it has none."""
        if time.monotonic() - self._asked > 1:
            try:
                threads = sum(self._client.nthreads().values())
            except Exception as error:  # whatever a lost connection raises
                raise self._lost() from error
            if not threads and (self._threads or self._asked < 0):
                _log.warning("%s: this cluster has no workers: waiting for some", self.name)
            self._asked, self._threads = time.monotonic(), threads
        return max(1, 2 * self._threads)

    def submit(self, function: Callable, *arguments: Any) -> Future:
        try:
            return self._executor.submit(function, *arguments)
        except Exception as error:
            raise self._lost() from error

    def _lost(self) -> BatchError:
        return BatchError(f"{self.name}: the connection to the Dask scheduler is lost: run the same batch to go on")

    def close(self, *, at_once: bool) -> None:
        self._executor.shutdown(wait=not at_once)
        if self._own:
            self._client.close(timeout=5)
        _DASK_LOG.setLevel(self._level)


# ------------------------------------------------------------------------------------------------------ any executor


class GivenWorkers:
    """An executor that somebody else made and will shut down.

    Parameters
    ----------
    executor : concurrent.futures.Executor
    count : int, optional
        By default as many as it has workers.
    """

    def __init__(self, executor: Executor, count: int | None = None):
        self._executor = executor
        self._count = count or getattr(executor, "_max_workers", None) or cores()

    def capacity(self) -> int:
        return self._count

    def submit(self, function: Callable, *arguments: Any) -> Future:
        try:
            return self._executor.submit(function, *arguments)
        except RuntimeError as error:  # shut down, or broken
            raise BatchError(f"the executor takes no more work: {error}") from error

    def close(self, *, at_once: bool) -> None:
        pass
