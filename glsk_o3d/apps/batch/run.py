"""The batch itself: clouds to workers, rows to the ledger."""

from __future__ import annotations

import os
import shutil
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...geometry.cores import cores
from ...interop.atomic import remove_unfinished, write_json
from ...parameters import check_number
from .ledger import DONE, FAILED, LOCK_FILE, STARTED, Row, locked, refuse_ways_out
from .plan import RECIPE_FILE, TILES_FOLDER, UP_TO_DATE, Plan, plan_batch
from .tasks import Task, failure, in_one_line, work
from .workers import Workers

_POLL_SECONDS = 0.2  # seconds until Ctrl-C is noticed on Windows
WORKER_DIED = "the worker died with it, also alone: out of memory, or a crash in native code"


@dataclass(frozen=True)
class BatchResult:
    """The result of a batch.

    Attributes
    ----------
    rows : dict of str to dict
        The ledger's rows of the inputs by name, also of skipped ones.
    done, skipped, failed : int
    seconds : float
        Wall time from the first cloud.
    ledger : Path

    Examples
    --------
    >>> BatchResult({}, done=3, skipped=0, failed=1, seconds=2.0, ledger=Path("ledger.jsonl")).rate
    2.0
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
    inputs: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out_dir: str | os.PathLike[str],
    *,
    workers: int | None = None,
    on_plan: Callable[[Plan], object] | None = None,
    on_result: Callable[[Row], object] | None = None,
    **options: Any,
) -> BatchResult:
    """Skeletonise many clouds, several at a time.

    A failed file does not stop the others. Finished clouds are in the ledger, ``ledger.jsonl`` in `out_dir`. The same
    call again skips them and retries failures, also after Ctrl-C, which stops at once. A cloud whose worker dies, for
    example for lack of memory, is tried again at the end, alone.

    Parameters
    ----------
    inputs, out_dir, **options
        As in `plan_batch`; the folder is made.
    workers : int, optional
        Processes on this machine, by default one for each core that this process may use.
    on_plan : callable, optional
        Called with the `Plan` before the work begins.
    on_result : callable, optional
        Called with each row as it enters the ledger.

    Returns
    -------
    BatchResult

    Raises
    ------
    BatchError
        Another batch writes into `out_dir`, or worker processes die before they begin.
    KeyboardInterrupt
        After the ledger is complete.
    FileNotFoundError, InvalidParameterError, RecipeError
        As in `plan_batch`.

    Examples
    --------
    >>> from glsk_o3d.apps.batch import run_batch
    >>> result = run_batch("scans", "skeletons", formats=["ply", "json"])  # doctest: +SKIP
    >>> [row["input"] for row in result.rows.values() if row["status"] == "failed"]  # doctest: +SKIP
    []
    """
    check_number("workers", workers, "int?", low=1)
    folder = Path(os.path.abspath(out_dir))
    new = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    refuse_ways_out(folder, [LOCK_FILE])
    with locked(folder):
        try:
            plan = plan_batch(inputs, folder, split=True, **options)
        except BaseException:
            for uppermost in new[-1:]:
                shutil.rmtree(uppermost, ignore_errors=True)
            raise
        if on_plan is not None:
            on_plan(plan)
        crew = Workers(min(workers or cores(), len(plan.todo)))
        start, complete = time.perf_counter(), False
        try:
            try:
                _Run(plan, crew, on_result).work_through()
            finally:
                plan.ledger.rewrite()
            complete = True
        finally:
            crew.close(at_once=not complete)
            remove_unfinished(plan.out_dir)
    rows = {task.name: plan.ledger.rows[task.name] for task in plan.tasks}
    failed = sum(row["status"] == FAILED for row in rows.values())
    seconds = time.perf_counter() - start
    return BatchResult(rows, len(plan.todo) - failed, plan.skipped, failed, seconds, plan.ledger.path)


class _Run:
    """A batch at work. Scenes are joined when all tiles are done."""

    def __init__(self, plan: Plan, workers: Workers, on_result: Callable[[Row], object] | None):
        self._plan, self._workers, self._on_result = plan, workers, on_result
        self._rows = plan.ledger.rows

    def work_through(self) -> None:
        """Hand out all tasks, those that need others last."""
        plan = self._plan
        for task in plan.tasks:
            if task.why == UP_TO_DATE:
                self._rows[task.name]["input"] = task.source  # the same bytes may be somewhere else
        plan.ledger.rewrite()
        write_json(plan.out_dir / RECIPE_FILE, plan.recipe)
        for folder in {(plan.out_dir / task.name).parent for task in plan.todo}:
            folder.mkdir(parents=True, exist_ok=True)  # a worker's own would be where nobody looks
        self._do([task for task in plan.todo if not task.needs])
        self._do([task for task in plan.todo if task.needs and self._has_all_tiles(task)])

    def _do(self, tasks: list[Task]) -> None:
        """Have tasks done, and those whose workers died once more, each by itself."""
        for task in self._lost_of(tasks):
            for lost in self._lost_of([task]):
                self._enter(lost, failure(WORKER_DIED))

    def _lost_of(self, tasks: list[Task]) -> list[Task]:
        """Have tasks done, side by side; gives those whose workers died."""
        ready, running, lost = deque(tasks), dict[Future[Any], Task](), []
        while running or ready:
            while len(running) < self._workers.count and ready:
                task = ready.popleft()
                self._begin(task)
                running[self._workers.submit(work, task)] = task
            for future in wait(running, _POLL_SECONDS, FIRST_COMPLETED).done:
                task, error = running.pop(future), future.exception()
                if isinstance(error, BrokenExecutor):
                    lost.append(task)
                else:
                    self._enter(task, future.result() if error is None else failure(in_one_line(error)))
        return lost

    def _begin(self, task: Task) -> None:
        """Remove what is there of earlier batches, and say so; but of a cloud on a disk that is not mounted, say."""
        if not os.path.exists(task.path):
            return
        tiles = f"{task.name}{TILES_FOLDER}"  # those of another size, or of another cut of the scene
        old = [name for name in self._rows if task.needs and name.startswith(tiles) and name not in task.needs]
        rows = [self._rows[name] for name in (task.name, *old) if name in self._rows]
        for output in {*task.outputs, *(output for row in rows for output in row["outputs"])}:
            if not os.path.isdir(path := Path(task.out_dir, output)):  # else the worker will say what is wrong
                path.unlink(missing_ok=True)
        for row in rows:
            del self._rows[row["name"]]
        self._add(task, {"status": STARTED, "outputs": list(task.outputs)})

    def _enter(self, task: Task, row: Row) -> None:
        """Put into the ledger what came of a task."""
        before = self._rows.get(task.name)
        if row["status"] == FAILED and before and before["status"] != STARTED:  # the cloud is away, its results stay
            row = before | {"status": FAILED, "error": row["error"]}
        else:
            done = row["status"] == DONE
            row["outputs"] = [name for name in task.outputs if done or Path(task.out_dir, name).is_file()]
        row = self._add(task, row)
        if self._on_result is not None:
            self._on_result(row)

    def _add(self, task: Task, row: Row) -> Row:
        row = {"parameters": self._plan.parameters, **row, "name": task.name, "input": task.source}
        self._plan.ledger.add(row)
        return row

    def _has_all_tiles(self, task: Task) -> bool:
        """Whether all that a task needs is done; where tiles failed, it has failed, too."""
        undone = [self._rows[name] for name in task.needs if self._rows[name]["status"] != DONE]
        if undone:
            why = f"{len(undone)} of {len(task.needs)} tiles failed, {undone[0]['name']} since {undone[0]['error']}"
            self._begin(task)
            self._enter(task, failure(f"{why}: the same batch tries them again"))
        return not undone
