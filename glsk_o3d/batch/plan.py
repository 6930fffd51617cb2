"""What a batch has to do."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .ledger import Ledger
from .work import Job

UP_TO_DATE = "done"
RECIPE_FILE = "recipe.json"
NEW_INPUT, ASKED_FOR, FAILED_BEFORE, INTERRUPTED_BEFORE = "new", "asked for", "failed before", "interrupted before"
OTHER_PARAMETERS, OUTPUTS_GONE, INPUT_CHANGED = "other parameters", "outputs are gone", "input changed"
TILES_TO_DO = "tiles to do"


@dataclass(frozen=True)
class Task:
    """An input of a batch.

    Attributes
    ----------
    job : Job
    why : str
        ``"done"`` if it is to be skipped, else why not: ``"new"``, ``"failed before"``, ``"interrupted before"``,
        ``"other parameters"``, ``"outputs are gone"``, ``"input changed"``, ``"asked for"`` or, of what is joined from
        tiles, ``"tiles to do"``.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.batch import plan_batch
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> plan.tasks[0].why
    'new'
    """

    job: Job
    why: str


@dataclass(frozen=True)
class Plan:
    """What a batch has to do.

    Attributes
    ----------
    out_dir : Path
        Absolute.
    recipe : dict
        The pipeline.
    parameters : str
        The hash by which it is known.
    tasks : tuple of Task
        One per input, in the order of their names; after those of its tiles that of what is joined from them.
    ledger : Ledger
        As it is in the folder.
    left_out : dict of str to str
        Files in the folders and patterns that are not taken, with the reason.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.batch import plan_batch
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> len(plan.todo)
    1
    """

    out_dir: Path
    recipe: dict[str, Any]
    parameters: str
    tasks: tuple[Task, ...]
    ledger: Ledger
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def todo(self) -> list[Task]:
        """Those that are not done."""
        return [task for task in self.tasks if task.why != UP_TO_DATE]

    @property
    def skipped(self) -> int:
        """How many are done."""
        return len(self.tasks) - len(self.todo)
