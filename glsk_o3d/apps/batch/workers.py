"""The processes that do the work of a batch."""

import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

from ...errors import BatchError, PluginWarning, SkeletonWarning

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class Workers:
    """Processes of this machine with one BLAS thread each; where one dies, what all do is lost, and new ones begin."""

    def __init__(self, count: int):
        self.count = count
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand out one piece of work; BatchError where processes die before they begin."""
        with _inherited():
            if self._pool is not None:
                try:
                    return self._pool.submit(function, *arguments)
                except BrokenExecutor:
                    self._pool.shutdown()
            self._pool = ProcessPoolExecutor(self.count, multiprocessing.get_context("spawn"), _begin)
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
