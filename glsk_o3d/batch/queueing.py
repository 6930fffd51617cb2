"""Which task is next, and what comes of each."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from .. import __version__
from .ledger import DONE, FAILED, LEDGER_COLUMNS, Row
from .plan import Plan, Task
from .work import clear, told
from .workers import died

WORKER_DIED = "the worker died with it, twice: out of memory, or a crash in native code"


class Queue:
    """The tasks of a plan: those that need others wait for these.

    Parameters
    ----------
    plan : Plan
    on_result : callable, optional
        Called with each row as it enters the ledger.

    Attributes
    ----------
    ready : deque of Task
        Those that can be handed out.
    """

    def __init__(self, plan: Plan, on_result: Callable[[Row], object] | None):
        self._plan, self._on_result = plan, on_result
        self.ready: deque[Task] = deque()
        self._waiting, self._open = plan.todo, {task.job.name for task in plan.todo}
        self._release()

    def enter(self, task: Task, row: Row) -> None:
        """Put what came of a task into the ledger."""
        row = {"parameters": self._plan.parameters} | row | {"name": task.job.name, "input": task.job.source}
        row = {name: row[name] for name in LEDGER_COLUMNS if name in row}
        self._plan.ledger.add(row)
        self._open.discard(task.job.name)
        if self._on_result is not None:
            self._on_result(row)
        self._release()

    def row(self, task: Task, future: Future, error: BaseException | None) -> Row:
        """What the ledger is to say of a task that has ended."""
        if error is None:
            row = future.result()
            missing = row["error"].startswith("no such file") or ": no such folder" in row["error"]
            if missing and Path(task.job.path).exists():
                row["error"] += (
                    f" (on {row['worker']}; there is one here: workers need the same files by the same paths)"
                )
            if row.get("kept") and row["outputs"]:  # what the line told of them stays, too
                before = self._plan.ledger.rows.get(task.job.name) or row
                return before | {name: row[name] for name in ("status", "error", "outputs")}
            return row
        return _failed(task, WORKER_DIED if died(error) else told(error))

    def _release(self) -> None:
        """Let those go on that wait for nothing any more."""
        waiting, self._waiting = self._waiting, []
        free = []
        for task in waiting:
            (free if self._open.isdisjoint(task.job.needs) else self._waiting).append(task)
        for task in free:
            failed = [name for name in task.job.needs if self._plan.ledger.rows[name]["status"] != DONE]
            if failed:
                self.enter(task, _without(task, failed, self._plan.ledger.rows[failed[0]]["error"]))
            else:
                self.ready.append(task)


def _without(task: Task, failed: Sequence[str], error: str) -> Row:
    """The row of what is not joined, since some of its tiles failed."""
    count = f"{len(failed)} of {len(task.job.needs)} tiles failed"
    return _failed(task, f"{count}, {failed[0]} since {error}: the same batch tries them again")


def _failed(task: Task, error: str) -> Row:
    clear(task.job)
    return {"status": FAILED, "error": error, "outputs": [], "version": __version__}
