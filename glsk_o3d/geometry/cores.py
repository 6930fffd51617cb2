"""Cores and threads at hand."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Threads to compute with: one for each core, or as many as ``OMP_NUM_THREADS`` says."""
    wanted = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return int(wanted) if wanted.isdecimal() and int(wanted) > 0 else cores()


def in_threads(function: Callable[[Item], Result], items: Iterable[Item], most: int | None = None) -> Iterator[Result]:
    """Results of a function for each item, in their order, computed on `threads()` threads, or `most` if fewer.

    No more items than there are threads are taken ahead of the result that is given. It gains where most time is
    NumPy's, which lets other threads go on. Where no thread can be started a function may be called twice of one item.
    """
    n = min(threads(), most or threads())
    if n == 1:
        yield from map(function, items)
        return
    pool, results = ThreadPoolExecutor(n), deque[Callable[[], Result]]()
    try:
        for item in items:
            try:
                results.append(pool.submit(function, item).result)
            except RuntimeError:  # an interpreter that ends starts no threads, nor does a system that has too many
                results.append(partial(function, item))
            if len(results) > n:
                yield results.popleft()()
        while results:
            yield results.popleft()()
    finally:
        pool.shutdown(cancel_futures=True)
