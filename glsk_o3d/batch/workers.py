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
from pathlib import Path
from typing import Any

from ..errors import BatchError, PluginWarning, SkeletonWarning
from ..interop.packages import import_open3d, require
from ..numerics.cores import cores

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_SCHEDULER_SECONDS = 10  # seconds until a scheduler must answer
_DASK_LOG = logging.getLogger("distributed.client")
_log = logging.getLogger(__name__)


def died(error: BaseException | None) -> bool:
    """Whether an error says that the worker died with the work."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"  # the latter is Dask's


class LocalWorkers:
    """Processes of this machine with one BLAS thread each; `load` has them load at once what every skeleton needs.

    Each is a pool by itself, so that one that dies takes no other work with it, and it is known what it was doing.
    """

    def __init__(self, count: int, load: bool = True):
        self._seats = [_Seat(load) for _ in range(count)]
        self._stillborn = 0  # how many in a row died before they began

    def capacity(self) -> int:
        """How many pieces of work to hand out at a time."""
        return len(self._seats)

    def submit(self, function: Callable, *arguments: Any) -> Future:
        """Hand out one piece of work."""
        seat = next(seat for seat in self._seats if seat.work.done())
        seat.work = Future()
        seat.submit(function, *arguments).add_done_callback(partial(self._settle, seat, seat.work))
        return seat.work

    def _settle(self, seat: _Seat, work: Future, done: Future) -> None:
        """Pass on what came of work; BatchError where more workers in a row died before they began than there are."""
        if done.cancelled():
            work.cancel()
            return
        error = done.exception()
        if died(error):
            self._stillborn = 0 if seat.first.exception() is None else self._stillborn + 1
            if self._stillborn > len(self._seats):
                error = BatchError(
                    "worker processes die before they begin; stderr may say why. In a script, call run_batch under "
                    'if __name__ == "__main__": every worker runs the rest of it too'
                )
        if error is None:
            work.set_result(done.result())
        else:
            work.set_exception(error)

    def close(self, *, at_once: bool) -> None:
        """Let the workers go; at once: without waiting for what they do."""
        pools = [seat.pool for seat in self._seats if seat.pool is not None]
        for pool in pools:
            for process in (
                list((pool._processes or {}).values()) if at_once else ()
            ):  # before Python 3.14 no public name
                process.kill()
        for pool in pools:
            pool.shutdown(cancel_futures=True)


class _Seat:
    """A pool of one process, started when there is work, and anew when it has died."""

    def __init__(self, load: bool):
        self._load = load
        self.pool: ProcessPoolExecutor | None = None
        self.work: Future = Future()
        self.work.set_result(None)

    def submit(self, function, *arguments) -> Future:
        if self.pool is not None:
            try:
                return self.pool.submit(function, *arguments)
            except BrokenExecutor:  # it died, perhaps while it was idle
                self.pool.shutdown(wait=False)
        self.pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _begin, (self._load,))
        with _inherited():
            self.first = self.pool.submit(os.getpid)  # fails if the process does not get as far as work
        return self.pool.submit(function, *arguments)


@contextmanager
def _inherited() -> Iterator[None]:
    """What a new process is to have before it imports anything: one BLAS thread, and Ctrl-C left to its parent."""
    environment = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    signals = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if os.name == "posix" else None
    try:
        yield
    finally:
        if signals is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, signals)
        for name, value in environment.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _begin(load: bool) -> None:
    """Make a new process ready."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, daemon=True).start()
    for category in (SkeletonWarning, PluginWarning):  # the report has the one, the first process tells the other
        warnings.simplefilter("ignore", category)
    if load:
        with suppress(Exception):  # every task will say what is wrong
            import_open3d()
            importlib.import_module("glsk_o3d.recipes")


def _follow() -> None:
    """Die with the process that started this one, which may have been killed and tell nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class GivenWorkers:
    """An executor that somebody else made and will shut down; by default it gets as much as it has workers."""

    def __init__(self, executor: Executor, count: int | None = None):
        self._executor, self._gone = executor, "the executor takes no more work"
        self._count = count or getattr(executor, "_max_workers", None) or cores()

    def capacity(self) -> int:
        return self._count

    def submit(self, function: Callable, *arguments: Any) -> Future:
        try:
            return self._executor.submit(function, *arguments)
        except Exception as error:  # shut down, broken, or whatever a lost connection raises
            raise BatchError(f"{self._gone}: {error}") from error

    def close(self, *, at_once: bool) -> None:
        pass


class DaskWorkers(GivenWorkers):
    """A Dask cluster: the address of its scheduler, the file that this wrote, or a ``distributed.Client``.

    BatchError where no scheduler answers.
    """

    def __init__(self, scheduler: Any):
        distributed = require("distributed")
        self._own = not isinstance(scheduler, distributed.Client)
        self._name = str(getattr(getattr(scheduler, "scheduler", scheduler), "address", scheduler))
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
        super().__init__(scheduler.get_executor(pure=False), 1)
        self._gone = f"{self._name}: the connection to the Dask scheduler is lost: run the same batch to go on"
        self._asked, self._threads = -1.0, 0

    def capacity(self) -> int:
        """Twice the threads of the cluster as it is now, so that none of them waits for us; one, while it has none."""
        if time.monotonic() - self._asked > 1:
            try:
                threads = sum(self._client.nthreads().values())
            except Exception as error:  # whatever a lost connection raises
                raise BatchError(self._gone) from error
            if not threads and (self._threads or self._asked < 0):
                _log.warning("%s: this cluster has no workers: waiting for some", self._name)
            self._asked, self._threads = time.monotonic(), threads
        return max(1, 2 * self._threads)

    def close(self, *, at_once: bool) -> None:
        self._executor.shutdown(wait=not at_once)
        if self._own:
            self._client.close(timeout=5)
        _DASK_LOG.setLevel(self._level)


Workers = LocalWorkers | GivenWorkers
