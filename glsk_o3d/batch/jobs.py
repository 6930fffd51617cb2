"""What a batch has to do, and has done, as plain records."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .grid import Grid
from .ledger import Ledger, Row

UP_TO_DATE = "done"
RECIPE_FILE = "recipe.json"
TILE_ENDING = ".npz"
"""Of the skeletons of tiles: what they keep, they keep to the last bit."""


@dataclass(frozen=True)
class Split:
    """A scene, taken apart: its parts by labels that can stand in names, with words for the points that they hold."""

    input_hash: str
    parts: dict[str, str]
    points: int
    dropped: int  # points that are in no part: without a label, or a place
    grid: Grid | None = None  # of the tiles


@dataclass(frozen=True)
class Job:
    """All that a worker needs to know of one cloud, or of a scene whose tiles it is to join."""

    name: str  # of the results, without ending
    path: str  # of the cloud
    source: str  # what the ledger calls the cloud: its path, and which of its points are meant if not all
    outputs: tuple[str, ...] = ()  # from out_dir; the ending chooses what is written, and .png is a preview
    out_dir: str = ""
    recipe: dict[str, Any] = field(default_factory=dict)
    cut_loops: bool = False
    where: str = ""  # the points to take; empty for all
    stale: tuple[str, ...] = ()  # outputs of an earlier batch, which are no longer true
    foreign: tuple[str, ...] = ()  # outputs that no ledger knows: replaced perhaps, never removed
    origin: str = ""  # the file of which `path` holds a part
    needs: tuple[str, ...] = ()  # names of the tiles from whose skeletons, their only outputs, this one is joined
    split: Split | None = None  # how the scene was taken apart, but for the list of its parts


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
    >>> len(plan.todo), plan.skipped
    (1, 0)
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
    >>> from glsk_o3d.batch import run_batch
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
