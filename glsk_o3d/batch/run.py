"""The batch itself: clouds to workers, rows to the ledger."""

from __future__ import annotations

import logging
import os
import shutil
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..errors import BatchError, InvalidParameterError
from ..interop.atomic import write_json
from ..interop.interrupts import counted_interrupts
from ..numerics.cores import cores
from .jobs import RECIPE_FILE, UP_TO_DATE, BatchResult, Plan, Task
from .ledger import DONE, FAILED, LEDGER_COLUMNS, LOCK_FILE, STALE, Row, locked
from .plan import Wanted, planned
from .splitting import PARTS_FOLDER, TILES_FOLDER
from .work import clear, told, work
from .workers import DaskWorkers, GivenWorkers, LocalWorkers, Workers, died

if TYPE_CHECKING:
    import distributed

_POLL_SECONDS = 0.2  # seconds until Ctrl-C is noticed
CANCELLED = "the work was cancelled, or its scheduler has gone: run the same batch to go on"
WORKER_DIED = "the worker died with it, twice: out of memory, or a crash in native code"
_log = logging.getLogger(__name__)


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
    wanted, folder = Wanted(**options), Path(os.path.abspath(out_dir))
    new = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        try:
            plan = planned(inputs, folder, wanted, write=True)
        except BaseException:
            _remove_new(new)
            raise
        if on_plan is not None:
            on_plan(plan)
        crew, complete = _hired(plan, workers, scheduler, executor), False
        start = time.perf_counter()
        try:
            _make_room(plan)
            try:
                _Run(plan, crew, on_result).work_through()
            finally:
                plan.ledger.close()
            _sweep(plan)
            complete = True
        finally:
            crew.close(at_once=not complete)
    rows = {task.job.name: plan.ledger.rows[task.job.name] for task in plan.tasks}
    failed = sum(row["status"] == FAILED for row in rows.values())
    done = len(plan.todo) - failed
    return BatchResult(rows, done, plan.skipped, failed, time.perf_counter() - start, plan.ledger.path)


def _remove_new(folders: Sequence[Path]) -> None:
    """Remove the output folder, and those above it that are new, where it turns out that nothing can be planned."""
    if folders:
        shutil.rmtree(folders[0] / PARTS_FOLDER, ignore_errors=True)
        with suppress(OSError):  # on Windows nobody removes what is open
            (folders[0] / LOCK_FILE).unlink()
            for folder in folders:
                folder.rmdir()


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
    _forget_tiles(plan)
    plan.ledger.rewrite()
    write_json(plan.out_dir / RECIPE_FILE, plan.recipe)
    for folder in {(plan.out_dir / task.job.name).parent for task in plan.todo}:
        folder.mkdir(parents=True, exist_ok=True)


def _forget_tiles(plan: Plan) -> None:
    """Drop tiles of earlier batches that are none any more, since the size has changed, or the scene."""
    rows = plan.ledger.rows
    for job in (task.job for task in plan.todo if task.job.needs):
        first = job.name + TILES_FOLDER
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


class _Run:
    """A batch at work: tasks that can be handed out, that wait for their tiles, that are in work, or to be retried."""

    def __init__(self, plan: Plan, workers: Workers, on_result: Callable[[Row], object] | None):
        self._plan, self._workers, self._on_result = plan, workers, on_result
        self._ready: deque[Task] = deque()
        self._waiting = plan.todo
        self._open = {task.job.name for task in plan.todo}
        self._running: dict[Future, Task] = {}
        self._again: deque[Task] = deque()  # their workers died; done alone in the end
        self._retried: set[str] = set()
        self._release()

    def work_through(self) -> None:
        """Hand out all tasks. Ctrl-C hands out no more and waits for what is in work; the second one does not wait."""
        warned = False
        with counted_interrupts() as interrupts:  # no line of the ledger is torn
            while self._running or ((self._ready or self._again) and not interrupts):
                if not interrupts:
                    self._hand_out()
                ended, _ = wait(self._running, _POLL_SECONDS, FIRST_COMPLETED)
                self._collect(ended)
                if len(interrupts) > 1:
                    break
                if interrupts and not warned:
                    warned = True
                    in_work = len(self._running)
                    _log.warning("finishing what is in work (%d), nothing else: Ctrl-C again stops at once", in_work)
                if not ended:
                    self._workers.capacity()  # notices that a scheduler has gone
            if interrupts:
                raise KeyboardInterrupt

    def _hand_out(self) -> None:
        if self._again and not self._ready and not self._running:
            self._ready.append(self._again.popleft())
            self._retried.add(self._ready[0].job.name)
        while self._ready and len(self._running) < self._workers.capacity():
            task = self._ready.popleft()
            self._running[self._workers.submit(work, task.job)] = task

    def _collect(self, ended: Iterable[Future]) -> None:
        """Put what came of tasks into the ledger; BatchError, in the end, where there is nobody to work any more."""
        lost: BatchError | None = None
        for future in ended:
            task = self._running.pop(future)
            error = BatchError(CANCELLED) if future.cancelled() else future.exception()
            if isinstance(error, BatchError):
                lost = error
            elif error is None:
                self._enter(task, self._completed(task, future.result()))
            elif not died(error):
                self._enter(task, _failed(task, told(error)))
            elif task.job.name in self._retried:
                self._enter(task, _failed(task, WORKER_DIED))
            else:
                self._again.append(task)
        if lost is not None:
            raise lost

    def _completed(self, task: Task, row: Row) -> Row:
        """A worker's row, with what only this process knows."""
        missing = row["error"].startswith("no such file") or ": no such folder" in row["error"]
        if missing and Path(task.job.path).exists():
            row["error"] += f" (on {row['worker']}; there is one here: workers need the same files by the same paths)"
        if row.get("kept") and row["outputs"]:  # what the line told of them stays, too
            before = self._plan.ledger.rows.get(task.job.name) or row
            return before | {name: row[name] for name in ("status", "error", "outputs")}
        return row

    def _enter(self, task: Task, row: Row) -> None:
        """Put a row into the ledger, and let those go on that waited for it."""
        row = {"parameters": self._plan.parameters} | row | {"name": task.job.name, "input": task.job.source}
        row = {name: row[name] for name in LEDGER_COLUMNS if name in row}
        self._plan.ledger.add(row)
        self._open.discard(task.job.name)
        if self._on_result is not None:
            self._on_result(row)
        self._release()

    def _release(self) -> None:
        """Let those go on that wait for nothing any more; a scene of which tiles failed has failed, too."""
        free = [task for task in self._waiting if self._open.isdisjoint(task.job.needs)]
        self._waiting = [task for task in self._waiting if not self._open.isdisjoint(task.job.needs)]
        for task in free:
            rows = [self._plan.ledger.rows[name] for name in task.job.needs]
            failed = [row for row in rows if row["status"] != DONE]
            if failed:
                why = f"{len(failed)} of {len(rows)} tiles failed, {failed[0]['name']} since {failed[0]['error']}"
                self._enter(task, _failed(task, f"{why}: the same batch tries them again"))
            else:
                self._ready.append(task)


def _failed(task: Task, error: str) -> Row:
    clear(task.job)
    return {"status": FAILED, "error": error, "outputs": [], "version": __version__}
