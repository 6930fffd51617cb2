"""The batch itself: clouds to workers, rows to the ledger."""

from __future__ import annotations

import logging
import os
import shutil
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import BatchError, InvalidParameterError
from ..interop.atomic import write_json
from ..interop.interrupts import counted_interrupts
from ..numerics.cores import cores
from .inputs import TILES_FOLDER
from .ledger import DONE, FAILED, LOCK_FILE, STALE, Row, locked
from .plan import RECIPE_FILE, UP_TO_DATE, Plan, Task
from .planning import planned
from .queueing import Queue
from .splitting import PARTS_FOLDER
from .wanted import Wanted
from .work import Job, work
from .workers import DaskWorkers, GivenWorkers, LocalWorkers, Workers, died

if TYPE_CHECKING:
    import distributed

_POLL_SECONDS = 0.2  # seconds until Ctrl-C is noticed
CANCELLED = "the work was cancelled, or its scheduler has gone: run the same batch to go on"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class BatchResult:
    """What a batch did.

    Attributes
    ----------
    rows : dict of str to dict
        What the ledger says about the inputs, by name, those skipped included.
    done, skipped, failed : int
    seconds : float
        Wall time, from the first cloud handed out.
    ledger : Path

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder, ThreadPoolExecutor() as executor:
    ...     _ = Path(folder, "scan.xyz").write_text("not a point")
    ...     result = run_batch(folder, f"{folder}/skeletons", executor=executor)
    >>> result.done, result.failed
    (0, 1)
    """

    rows: dict[str, Row]
    done: int
    skipped: int
    failed: int
    seconds: float
    ledger: Path

    @property
    def rate(self) -> float:
        """Clouds done or failed per second."""
        return (self.done + self.failed) / self.seconds if self.seconds > 0 else 0.0


def run_batch(
    inputs: str | os.PathLike | Iterable[str | os.PathLike],
    out_dir: str | os.PathLike,
    *,
    workers: int | None = None,
    scheduler: str | os.PathLike | distributed.Client | None = None,
    executor: Executor | None = None,
    on_plan: Callable[[Plan], object] | None = None,
    on_result: Callable[[Row], object] | None = None,
    **options: Any,
) -> BatchResult:
    """Skeletonise many clouds, several at a time.

    One bad file does not stop the others. What is done is in the ledger, ``ledger.jsonl`` in `out_dir`; the same call
    again skips it, and tries again what failed. The first Ctrl-C hands out no more work and waits for what is in work;
    the second one does not wait. Both leave a ledger from which the next call goes on.

    Parameters
    ----------
    inputs : path-like, or several
        Folders, glob patterns, lists of files (``.txt``) and clouds.
    out_dir : path-like
        Made if it is not there.
    workers : int, optional
        Processes on this machine, by default one for each core that this process may use.
    scheduler : str, path-like or distributed.Client, optional
        Instead, a Dask cluster: the address of its scheduler, or the file that this wrote. Its workers read and write
        the same files, by the same paths.
    executor : concurrent.futures.Executor, optional
        Instead, any other executor; `workers` says how many clouds it gets at a time.
    on_plan : callable, optional
        Called with the `Plan` before the work begins.
    on_result : callable, optional
        Called with each row as it enters the ledger.
    **options
        As in `plan_batch`.

    Returns
    -------
    BatchResult

    Raises
    ------
    BatchError
        Another batch writes into `out_dir`, it has something else where the parts of a scene are to be, or the workers
        cannot be had any more.
    KeyboardInterrupt
        After the ledger has been put in order.
    FileNotFoundError, InvalidParameterError, RecipeError
        As in `plan_batch`.

    Notes
    -----
    A worker that dies, say for lack of memory, is replaced. What it was doing is done again in the end, by itself, and
    has failed if the worker dies again.

    Examples
    --------
    >>> from glsk_o3d.batch import run_batch
    >>> result = run_batch("scans", "skeletons", formats=["ply", "json"])  # doctest: +SKIP
    >>> [row["input"] for row in result.rows.values() if row["status"] == "failed"]  # doctest: +SKIP
    []
    """
    if scheduler is not None and (executor is not None or workers is not None):
        raise InvalidParameterError("scheduler: the cluster has its own workers: give neither workers nor an executor")
    if workers is not None and workers < 1:
        raise InvalidParameterError(f"workers = {workers}: must be at least 1")
    wanted, folder = Wanted.of(**options), Path(os.path.abspath(out_dir))
    new = not folder.is_dir()
    if new:
        planned(
            inputs, folder, replace(wanted, cut=None), write=False
        )  # what is wrong is said before there is a folder
        folder.mkdir(parents=True)
    with locked(folder):
        with _nothing_left_behind(folder) if new else nullcontext():
            plan = planned(inputs, folder, wanted, write=True)
        if on_plan is not None:
            on_plan(plan)
        crew, left = _hired(plan, workers, scheduler, executor), True
        start = time.perf_counter()
        try:
            _make_room(plan)
            try:
                _work_through(plan, crew, on_result)
            finally:
                plan.ledger.close()
            _sweep(plan)
            left = False
        finally:
            crew.close(at_once=left)
    rows = {task.job.name: plan.ledger.rows[task.job.name] for task in plan.tasks}
    failed = sum(row["status"] == FAILED for row in rows.values())
    done = len(plan.todo) - failed
    return BatchResult(rows, done, plan.skipped, failed, time.perf_counter() - start, plan.ledger.path)


@contextmanager
def _nothing_left_behind(folder: Path) -> Iterator[None]:
    """Remove a new folder where it turns out that the batch cannot be planned."""
    try:
        yield
    except BaseException:
        shutil.rmtree(folder / PARTS_FOLDER, ignore_errors=True)
        with suppress(OSError):  # on Windows nobody removes what is open
            (folder / LOCK_FILE).unlink()
            folder.rmdir()
        raise


def _hired(plan: Plan, workers, scheduler, executor) -> Workers:
    if scheduler is not None and plan.todo:
        return DaskWorkers(scheduler)
    if executor is not None:
        return GivenWorkers(executor, workers)
    return LocalWorkers(min(workers or cores(), len(plan.todo)))


def _make_room(plan: Plan) -> None:
    """Mark what is no longer true in the ledger, and make the folders: a worker's own would be where nobody looks."""
    rows = plan.ledger.rows
    for task in plan.tasks:
        name, source = task.job.name, task.job.source
        if task.why == UP_TO_DATE and rows[name]["input"] != source:  # the same bytes somewhere else
            rows[name] = rows.pop(name) | {"input": source}
        elif task.why != UP_TO_DATE and rows.get(name, {}).get("status") == DONE:
            rows[name]["status"] = STALE
    for task in plan.todo:
        if task.job.needs:
            _forget_tiles(plan, task.job)
    plan.ledger.rewrite()
    write_json(plan.out_dir / RECIPE_FILE, plan.recipe)
    for folder in {(plan.out_dir / task.job.name).parent for task in plan.todo}:
        folder.mkdir(parents=True, exist_ok=True)


def _forget_tiles(plan: Plan, job: Job) -> None:
    """Drop tiles of earlier batches that are none any more, since the size has changed, or the scene."""
    rows, first = plan.ledger.rows, job.name + TILES_FOLDER
    for name in [name for name in rows if name.startswith(first) and name not in job.needs]:
        for output in rows.pop(name).get("outputs", ()):
            if output.startswith(first):
                Path(plan.out_dir, output).unlink(missing_ok=True)


def _sweep(plan: Plan) -> None:
    """Remove the files of those parts of scenes that are done."""
    for task in plan.tasks:
        if task.job.origin and plan.ledger.rows[task.job.name]["status"] == DONE:
            Path(task.job.path).unlink(missing_ok=True)
            with suppress(OSError):  # others are to be done
                Path(task.job.path).parent.rmdir()


def _work_through(plan: Plan, workers: Workers, on_result: Callable[[Row], object] | None) -> None:
    queue, again = Queue(plan, on_result), deque[Task]()
    running: dict[Future, Task] = {}
    alone = warned = False

    def hand_out(task):
        running[workers.submit(work, task.job)] = task

    with counted_interrupts() as interrupts:  # no line of the ledger is torn
        while running or ((queue.ready or again) and not interrupts):
            while queue.ready and not interrupts and len(running) < workers.capacity():
                hand_out(queue.ready.popleft())
            if again and not running and not interrupts:
                alone = True
                hand_out(again.popleft())
            ready, _ = wait(running, _POLL_SECONDS, FIRST_COMPLETED)
            lost: BatchError | None = None
            for future in ready:
                task = running.pop(future)
                error = BatchError(CANCELLED) if future.cancelled() else future.exception()
                if isinstance(error, BatchError):
                    lost = error
                elif died(error) and not alone:
                    again.append(task)
                else:
                    queue.enter(task, queue.row(task, future, error))
            if lost is not None:
                raise lost
            if len(interrupts) > 1:
                raise KeyboardInterrupt
            if interrupts and not warned:
                warned = True
                _log.warning("finishing what is in work (%d), nothing else: Ctrl-C again stops at once", len(running))
            if not ready:
                workers.capacity()  # notices that a scheduler has gone
        if interrupts:
            raise KeyboardInterrupt
