"""What a batch has to do, and what is done already."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..driver import as_pipeline
from ..errors import FileFormatError, InvalidParameterError
from ..interop.packages import require_for
from ..io.clouds.selection import parsed
from ..io.skeletons import skeleton_ending
from ..pipeline import Filter, Pipeline
from ..recipes import to_recipe
from .inputs import find_inputs
from .ledger import DONE, STALE, Ledger, Row, file_hash
from .work import Job

UP_TO_DATE = "done"
RECIPE_FILE = "recipe.json"
NEW_INPUT, ASKED_FOR, FAILED_BEFORE, INTERRUPTED_BEFORE = "new", "asked for", "failed before", "interrupted before"
OTHER_PARAMETERS, OUTPUTS_GONE, INPUT_CHANGED = "other parameters", "outputs are gone", "input changed"


@dataclass(frozen=True)
class Task:
    """An input of a batch.

    Attributes
    ----------
    job : Job
    why : str
        ``"done"`` if it is to be skipped, else why not: ``"new"``, ``"failed before"``, ``"interrupted before"``,
        ``"other parameters"``, ``"outputs are gone"``, ``"input changed"`` or ``"asked for"``.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
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
        One per input, in the order of their names.
    ledger : Ledger
        As it is in the folder.
    left_out : dict of str to str
        Files in the folders and patterns that are not taken, with the reason.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
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


def plan_batch(
    inputs: str | os.PathLike | Iterable[str | os.PathLike],
    out_dir: str | os.PathLike,
    *,
    pipeline: Pipeline | Filter | str | os.PathLike = "default",
    formats: Sequence[str] = ("ply",),
    preview: bool = False,
    cut_loops: bool = False,
    recursive: bool = False,
    where: str | None = None,
    by: str | None = None,
    force: bool = False,
) -> Plan:
    """Find out what a batch would do. Nothing is written.

    Parameters
    ----------
    inputs : path-like, or several
        Folders, glob patterns, lists of files (``.txt``, one path a line, from the working folder) and clouds.
    out_dir : path-like
        Where results and ledger go; sub-folders as there are below each folder, pattern or list that is given.
    pipeline : Pipeline, name, or path of a recipe
        See `glsk_o3d.skeletonize`.
    formats : sequence of str
        Endings that `glsk_o3d.save_skeleton` knows; one file of each per cloud.
    preview : bool
        Also a picture of each.
    cut_loops : bool
        Cut loops open for formats that hold only trees.
    recursive : bool
        Take also the clouds in sub-folders.
    where : str, optional
        Take only points for which this holds; see `glsk_o3d.read_cloud`.
    by : str, optional
        One skeleton for each value of this attribute of the points, such as ``"treeID"``.
    force : bool
        Do everything anew.

    Returns
    -------
    Plan

    Raises
    ------
    FileNotFoundError
        A file is not there, or a folder or pattern has no cloud.
    InvalidParameterError
        The pipeline or a format is wrong, there is nothing to write, or a result would replace an input, the result of
        another input that is still there, or, in a folder without a ledger, a file that no batch has made.
    MissingPackageError
        A format, or the picture, is written by a package that is not installed.
    RecipeError
        No recipe can hold the pipeline: then it cannot be told whether two runs are the same.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> [task.why for task in plan.tasks], plan.skipped
    (['new'], 0)
    """
    recipe = to_recipe(as_pipeline(pipeline))
    try:
        endings = list(dict.fromkeys(skeleton_ending(Path(), ending) for ending in formats)) + [".png"] * preview
    except FileFormatError as error:
        raise InvalidParameterError(str(error)) from None
    if not endings:
        raise InvalidParameterError("there is nothing to write: give a format")
    for ending in endings:
        require_for(ending)
    if where is not None:
        parsed(where)
    given = [inputs] if isinstance(inputs, str | os.PathLike) else list(inputs)
    out = Path(os.path.abspath(out_dir))
    inputs_found = find_inputs(given, out, recursive=recursive, by=by, where=where)
    found = inputs_found.named
    sources = {text for source in found.values() for text in (str(source), str(source.path))}
    more = {**({"cut_loops": True} if cut_loops else {}), **({"where": where} if where else {})}
    told = {"recipe": recipe, **more} if more else recipe
    parameters = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
    ledger, tasks = Ledger(out), []
    results = {name + ending for name in found for ending in endings}
    names = {row["input"]: name for name, row in ledger.rows.items()}
    listed = {output for row in ledger.rows.values() for output in row.get("outputs", ())}
    for name, source in found.items():
        outputs = tuple(name + ending for ending in endings)
        for output in outputs:
            if str(out / output) in sources:
                raise InvalidParameterError(f"{out / output}: is an input: give the results another folder")
        row = ledger.rows.get(name, {})
        before = names.get(str(source), name)  # otherwise its old results would be nobody's
        stale = {each for each in row.get("outputs", ()) if _is_of(name, each)}
        stale |= {each for each in ledger.rows.get(before, {}).get("outputs", ()) if _is_of(before, each)} - results
        foreign = tuple(each for each in outputs if each not in listed and os.path.lexists(out / each))
        told = " and ".join(f"({part})" for part in (where, source.where) if part)
        paths = name, str(source.path), str(out), outputs
        job = Job(*paths, recipe, cut_loops, tuple(sorted(stale)), foreign, str(source), told)
        tasks.append(Task(job, ASKED_FOR if force else _why(job, row, parameters)))
    compared = _compared(tasks, ledger.rows)
    _check_results(out, ledger, compared, sources)
    return Plan(out, recipe, parameters, compared, ledger, inputs_found.left_out)


def _check_results(out: Path, ledger: Ledger, tasks: Sequence[Task], sources: set[str]) -> None:
    """Raise InvalidParameterError where a result would replace what no batch has made, or another input's result."""
    if not ledger.path.exists():
        strange = [each for task in tasks for each in task.job.foreign]
        strange += [each for each in (ledger.table.name, RECIPE_FILE) if os.path.lexists(out / each)]
        if strange:
            raise InvalidParameterError(
                f"{out / strange[0]}: is not the result of a batch, since there is no ledger here: give the results "
                "another folder, or remove it"
            )
    for task in tasks:
        row = ledger.rows.get(task.job.name, {})
        theirs = row.get("input", task.job.source)
        if task.why != UP_TO_DATE and row.get("outputs") and theirs not in sources and os.path.exists(theirs):
            raise InvalidParameterError(
                f"{task.job.source}: its results, {task.job.name}, would replace those of {theirs}: give another "
                "folder for them"
            )


def _why(job: Job, row: Row, parameters: str) -> str:
    """Why a cloud is to be done, as far as the cloud itself has no say."""
    if not row:
        return NEW_INPUT
    if row["status"] != DONE:
        return INTERRUPTED_BEFORE if row["status"] == STALE else FAILED_BEFORE
    if row.get("parameters") != parameters:
        return OTHER_PARAMETERS
    there = set(job.outputs) <= set(row.get("outputs", ())) and all(
        Path(job.out_dir, each).is_file() for each in job.outputs
    )
    return UP_TO_DATE if there else OUTPUTS_GONE


def _is_of(name: str, output: str) -> bool:
    """Whether a file is one of the results of this name: it will be removed, whatever has happened to the ledger."""
    return output.startswith(f"{name}.") and not set(output[len(name) :]) & {"/", os.sep}


def _compared(tasks: list[Task], rows: dict[str, Row]) -> tuple[Task, ...]:
    """The tasks, after a look at the inputs that seem done."""

    hashed = lru_cache(maxsize=None)(file_hash)  # of many clouds in one file

    def look(task: Task) -> Task:
        if task.why != UP_TO_DATE:
            return task
        try:
            same = hashed(task.job.path) == rows[task.job.name].get("input_hash")
        except OSError:  # gone, or not to be read: the worker will say so
            same = False
        return task if same else Task(task.job, INPUT_CHANGED)

    with ThreadPoolExecutor() as pool:
        return tuple(pool.map(look, tasks))
