"""Work in parallel processes, a row for each job."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

from rich.console import Console
from rich.progress import track

from glsk_o3d import pipelines, samples

DEATHS = {it.value: it.name for it in signal.Signals} | {signal.SIGKILL.value: "killed, perhaps for want of memory"}


def run(
    work: Callable[..., dict],
    jobs: Sequence[tuple[dict, tuple]],
    processes: int,
    fresh: bool = False,
    limit: float | None = None,
    preload: Sequence[str] = (),
) -> list[dict]:
    """Work through jobs in parallel.

    Parameters
    ----------
    work : callable
        A function of a module; gives what it measured.
    jobs : sequence of (facts, arguments)
    processes : int
        At once; 0 for none but this one.
    fresh : bool
        Each job in a process of its own, in which nothing but the warm-up has run, and whose death is a failure of that
        job alone.
    limit : float, optional
        How long such a process may take, everything included [s]; one that takes longer is ended, and has failed.
    preload : sequence of str
        Modules that are loaded once for all such processes, which are then copies of one that has done nothing else;
        there is no warm-up.

    Returns
    -------
    list of dict
        One row per job: its facts and what `work` measured, or a `failure` in words.
    """
    if processes == 0:
        with warnings.catch_warnings():
            _warm_up()
            return [_row(work, job) for job in jobs]
    # CPU seconds are those of one thread: NumPy reads this when it is imported, which is in the processes yet to start
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    pool = ThreadPoolExecutor(processes) if fresh else ProcessPoolExecutor(processes, get_context("spawn"), _warm_up)
    with pool:
        rows = pool.map(partial(_alone, preload, limit, work) if fresh else partial(_row, work), jobs)
        return list(track(rows, "", len(jobs), console=Console(stderr=True), transient=True))


def _warm_up() -> None:
    warnings.simplefilter("ignore")  # what a skeleton warns of shows in its measures
    pipelines.default()(samples.tube(256).points)  # loads what is imported when first needed, so that it is not timed


def _alone(preload, limit, work, job):
    context = get_context("forkserver" if preload else "spawn")
    if preload:
        context.set_forkserver_preload([*preload])
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, work, job, not preload), daemon=True)
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    try:
        if not receiver.poll(limit):
            return job[0] | {"failure": f"not done after {limit:g} s"}
        row = receiver.recv()
        process.join(10)  # let it tidy up
        return row
    except EOFError:
        process.join()
        code = process.exitcode
        return job[0] | {"failure": f"its process died: {DEATHS.get(-code, f'exit code {code}')}"}
    finally:
        process.kill()
        process.join()


def _send(sender, work, job, warm_up):
    if warm_up:
        _warm_up()
    sender.send(_row(work, job))


def _row(work, job):
    facts, arguments = job
    try:
        return facts | work(*arguments)
    except Exception as error:  # whatever it is, the other shapes are to be measured
        return facts | {"failure": f"{type(error).__name__}: {error}"}
