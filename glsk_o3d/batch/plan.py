"""Finding out what a batch has to do, and what is done already."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..driver import as_pipeline
from ..errors import FileFormatError, InvalidCloudError, InvalidParameterError, did_you_mean
from ..interop.packages import require_for
from ..io.scan import parsed
from ..io.skeletons import skeleton_ending
from ..pipeline import Filter, Pipeline, parts
from ..recipes import to_recipe
from .grid import checked_sizes
from .inputs import find_inputs, one_name
from .ledger import DONE, STALE, Ledger, file_hash, refuse_ways_out
from .splitting import Cut, Splitter
from .tasks import TILE_ENDING, Task

UP_TO_DATE = "done"
RECIPE_FILE = "recipe.json"
TILES_FOLDER = ".tiles/"
"""What follows the name of a scene in those of its tiles."""


@dataclass(frozen=True)
class Plan:
    """The work of a batch.

    Attributes
    ----------
    out_dir : Path
        Absolute.
    recipe : dict
        The pipeline.
    parameters : str
        The hash by which it is known.
    tasks : tuple
        One per input, in the order of their names; a scene follows its tiles. Each has a ``name``, that of its results
        without ending; the ``source`` in the ledger; ``outputs``, files to write, relative to `out_dir`; and ``why``:
        ``"done"`` if it is to be skipped, else ``"new"``, ``"failed before"``, ``"interrupted before"``,
        ``"other parameters"``, ``"outputs are gone"``, ``"input changed"``, ``"asked for"`` or, for a scene,
        ``"tiles to do"``.
    ledger : Ledger
        The ledger in the folder.
    left_out : dict of str to str
        Skipped files in the folders and patterns, with the reason.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> plan.todo[0].why, plan.skipped
    ('new', 0)
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
    tiles: float | None = None,
    overlap: float | None = None,
    force: bool = False,
) -> Plan:
    """Plan a batch without writing anything.

    Parameters
    ----------
    inputs : path-like, or several
        Folders, glob patterns, lists of files (``.txt``, one path a line, from the working folder) and clouds.
    out_dir : path-like
        Folder of results and ledger, with the sub-folders below each given folder, pattern or list.
    pipeline : Pipeline, name, or path of a recipe
        See `glsk_o3d.skeletonize`.
    formats : sequence of str
        Endings that `glsk_o3d.save_skeleton` knows; one file of each per cloud.
    preview : bool
        Also make pictures.
    cut_loops : bool
        Cut loops open for formats that hold only trees.
    recursive : bool
        Take also the clouds in sub-folders.
    where : str, optional
        Take only points for which this holds; see `glsk_o3d.read_cloud`.
    by : str, optional
        One skeleton for each value of this attribute of the points, such as ``"treeID"``.
    tiles : float, optional
        Split scenes into tiles of at most this size, in the cloud's units, along every longer axis, and join their
        skeletons into one. For scenes that are too large for one run.
    overlap : float, optional
        Width around a tile from which it takes more points, in the cloud's units: at least 2.7 times the radius of the
        thickest part that crosses its faces, and at most a quarter of `tiles`. By default an eighth of `tiles`.
    force : bool
        Do everything anew.

    Returns
    -------
    Plan

    Raises
    ------
    FileNotFoundError
        A file is missing, or a folder or pattern has no cloud.
    InvalidParameterError
        The pipeline or a format is wrong, or nothing would be written. A result would replace an input, the result of
        another existing input, or, in a folder without a ledger, a file of somebody else. Both `by` and `tiles` are
        given, or `tiles` with a pipeline that makes one tree.
    MissingPackageError
        A format or the picture needs a package that is not installed.
    RecipeError
        No recipe can hold the pipeline, so runs cannot be compared.
    BatchError
        Something else is in the place of the parts of a scene in the output folder.

    Examples
    --------
    Of tiles the skeletons come first, and then the whole:

    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> from glsk_o3d.samples import tube
    >>> with TemporaryDirectory() as folder:
    ...     np.savetxt(f"{folder}/pipe.xyz", tube(1000, radius=0.04).points)
    ...     plan = plan_batch(f"{folder}/pipe.xyz", f"{folder}/skeletons", tiles=0.6)
    >>> [(task.why, *task.outputs) for task in plan.tasks]
    [('new', 'pipe.tiles/0-0-0.npz'), ('new', 'pipe.tiles/1-0-0.npz'), ('new', 'pipe.ply')]
    """
    wanted = Wanted(pipeline, formats, preview, cut_loops, recursive, where, by, tiles, overlap, force)
    return planned(inputs, out_dir, wanted, write=False)


@dataclass
class Wanted:
    """The options of `plan_batch`, checked before a batch looks at any cloud, and what follows from them."""

    pipeline: Pipeline | Filter | str | os.PathLike
    formats: Sequence[str]
    preview: bool
    cut_loops: bool
    recursive: bool
    where: str | None
    by: str | None
    tiles: float | None
    overlap: float | None
    force: bool

    @classmethod
    def of(cls, options: dict[str, Any]) -> Wanted:
        """Some options by name, and the defaults of the others; InvalidParameterError for a name that is none."""
        defaults = plan_batch.__kwdefaults__ or {}
        for name in options.keys() - defaults.keys():
            raise InvalidParameterError(did_you_mean(name, defaults, "option of a batch"))
        return cls(**{**defaults, **options})

    def __post_init__(self) -> None:
        chosen = as_pipeline(self.pipeline)
        self.recipe = to_recipe(chosen)
        try:
            endings = dict.fromkeys(skeleton_ending(Path(), ending) for ending in self.formats)
        except FileFormatError as error:
            raise InvalidParameterError(str(error)) from None
        self.endings = [*endings, *[".png"] * self.preview]
        if not self.endings:
            raise InvalidParameterError("there is nothing to write: give a format")
        for ending in self.endings:
            require_for(ending)
        if self.where is not None:
            parsed(self.where)
        self.cut = self._cut(chosen)
        more: dict[str, Any] = {"cut_loops": True} if self.cut_loops else {}
        more |= {"where": self.where} if self.where else {}
        more |= {"tiles": [self.cut.tiles, self.cut.overlap]} if self.cut and self.cut.tiles else {}
        hashed = json.dumps({"recipe": self.recipe, **more} if more else self.recipe, sort_keys=True)
        self.parameters = hashlib.sha256(hashed.encode()).hexdigest()

    def _cut(self, pipeline: Pipeline) -> Cut | None:
        """How scenes are to be taken apart, if they are."""
        if self.tiles is None:
            if self.overlap is not None:
                raise InvalidParameterError(f"overlap = {self.overlap!r}: needs tiles: give their size, too")
            return None if self.by is None else Cut(by=self.by, where=self.where)
        if self.by is not None:
            raise InvalidParameterError("by and tiles cannot be combined: give one of them")
        stages = list(parts(pipeline))
        if any(getattr(stage, "root", None) is not None for stage in stages):
            raise InvalidParameterError(
                "tiles: the pipeline makes one tree of all that is in a tile: give one without root"
            )
        tiles, overlap = checked_sizes(self.tiles, self.overlap)
        drop_invalid = any(getattr(stage, "drop_invalid", False) for stage in stages)
        return Cut(tiles=tiles, overlap=overlap, where=self.where, drop_invalid=drop_invalid)


def planned(inputs: Any, out_dir: str | os.PathLike, wanted: Wanted, *, write: bool) -> Plan:
    """The plan of `plan_batch`; `write` takes scenes apart at once, so that they are read but once."""
    given = [inputs] if isinstance(inputs, str | os.PathLike) else list(inputs)
    out = Path(os.path.abspath(out_dir))
    ledger, hashed = Ledger(out), lru_cache(maxsize=None)(file_hash)  # of many clouds in one file
    splitter = None
    if wanted.cut is not None:  # what can be refused is refused before scenes are read
        splitter = Splitter(out, wanted.cut, hashed, write)
        _refuse_strangers(out, ledger, ())
        if wanted.tiles is not None:
            planned(given, out, replace(wanted, tiles=None, overlap=None), write=False)
    named, left_out = find_inputs(given, out, recursive=wanted.recursive)
    tasks = [Task(name, str(path), str(path)) for name, path in named.items()]
    if splitter is not None:
        tasks = _apart(named, left_out, splitter)
    sources = {text for task in tasks for text in (task.source, task.origin or task.path)}
    tasks = _with_reasons(list(_filled(tasks, out, wanted, ledger, sources)), ledger, wanted, hashed)
    _refuse_strangers(out, ledger, tasks)
    refuse_ways_out(out, (RECIPE_FILE, *(path for task in tasks for path in (*task.outputs, *task.stale))))
    _refuse_to_replace(tasks, ledger, sources)
    plan = Plan(out, wanted.recipe, wanted.parameters, tuple(tasks), ledger, left_out)
    if splitter is not None and write:  # parts of which some are to be done were removed when they had been done
        missing = [task for task in plan.todo if task.origin and not os.path.exists(task.path)]
        for folder, origin in {Path(task.path).parent: task.origin for task in missing}.items():
            splitter.divide(folder.relative_to(splitter.folder).as_posix(), Path(origin))
    return plan


def _apart(named: dict[str, Path], left_out: dict[str, str], splitter: Splitter) -> list[Task]:
    """The tasks of files that are taken apart; what cannot be is left out."""
    tasks: dict[str, Task] = {}
    for name, path in named.items():
        try:
            new = _parts_of(name, path, splitter)
        except InvalidParameterError as error:
            left_out[str(path)] = str(error)
            continue
        for task in new:
            if task.name in tasks:
                raise one_name(tasks[task.name].source, task.source, task.name)
            tasks[task.name] = task
    if not tasks:
        path, reason = next(iter(left_out.items()))
        raise InvalidParameterError(f"{splitter.cut}: no input can be split; {path}: {reason}")
    return list(tasks.values())


def _parts_of(name: str, path: Path, splitter: Splitter) -> list[Task]:
    """A task for each part of a file, and after tiles one for the whole; one for the file if it cannot be read."""
    whole = Task(name, str(path), str(path))
    try:
        split = splitter.split(name, path)
    except (FileFormatError, InvalidCloudError, OSError):
        return [whole]  # the worker will say what is wrong
    between = "-" if split.grid is None else TILES_FOLDER
    known = replace(split, parts={})
    tasks = []
    for label, part in split.parts.items():
        file = str(splitter.file(name, label))
        tasks.append(Task(f"{name}{between}{label}", f"{path} {part}", file, origin=str(path), split=known))
    if split.grid is not None:
        tasks.append(replace(whole, needs=tuple(task.name for task in tasks), split=known))
    return tasks


def _filled(tasks: list[Task], out: Path, wanted: Wanted, ledger: Ledger, sources: set[str]) -> Iterator[Task]:
    """The tasks with what they are to write, and what is there of earlier batches."""
    results = {task.name + each for task in tasks for each in wanted.endings}
    names = {row["input"]: name for name, row in ledger.rows.items()}
    listed = {output for row in ledger.rows.values() for output in row["outputs"]}
    for task in tasks:
        is_tile = task.origin and task.split is not None and task.split.grid is not None
        outputs = tuple(task.name + ending for ending in ([TILE_ENDING] if is_tile else wanted.endings))
        for output in outputs:
            if str(out / output) in sources:
                raise InvalidParameterError(f"{out / output}: is an input: give the results another folder")
        before = names.get(task.source, task.name)  # otherwise its old results would be nobody's
        stale = _listed_results(ledger, task.name) | (_listed_results(ledger, before) - results)
        yield replace(
            task,
            out_dir=str(out),
            outputs=outputs,
            recipe=wanted.recipe,
            cut_loops=wanted.cut_loops,
            where=(wanted.where or "") if task.split is None else "",
            stale=tuple(sorted(stale)),
            foreign=tuple(each for each in outputs if each not in listed and os.path.lexists(out / each)),
        )


def _listed_results(ledger: Ledger, name: str) -> set[str]:
    """What the ledger lists for a name, if it is called so: it will be removed, whatever has happened to the ledger."""
    outputs = ledger.rows[name]["outputs"] if name in ledger.rows else ()
    return {each for each in outputs if each.startswith(f"{name}.") and not set(each[len(name) :]) & {"/", os.sep}}


def _with_reasons(tasks: list[Task], ledger: Ledger, wanted: Wanted, hashed: Callable[[Path], str]) -> list[Task]:
    """The tasks, each with why it is to be done, if it is."""

    def why(task: Task) -> str:
        row = ledger.rows.get(task.name)
        if wanted.force:
            return "asked for"
        if row is None:
            return "new"
        if row["status"] != DONE:
            return "interrupted before" if row["status"] == STALE else "failed before"
        if row.get("parameters") != wanted.parameters:
            return "other parameters"
        written = row["outputs"]
        if not all(each in written and Path(task.out_dir, each).is_file() for each in task.outputs):
            return "outputs are gone"
        try:
            now = hashed(Path(task.path)) if task.split is None else task.split.input_hash
        except OSError:  # gone, or not to be read: the worker will say so
            return "input changed"
        return UP_TO_DATE if now == row.get("input_hash") else "input changed"

    with ThreadPoolExecutor() as pool:  # a hash takes as long as reading the file
        reasons = dict(zip((task.name for task in tasks), pool.map(why, tasks), strict=True))
    to_do = {name for name, reason in reasons.items() if reason != UP_TO_DATE}
    reasons |= {task.name: "tiles to do" for task in tasks if task.name not in to_do and to_do.intersection(task.needs)}
    return [replace(task, why=reasons[task.name]) for task in tasks]


def _refuse_strangers(out: Path, ledger: Ledger, tasks: Iterable[Task]) -> None:
    """Raise InvalidParameterError where a batch would replace what no batch has made, since there is no ledger."""
    if ledger.path.exists():
        return
    strange = [each for task in tasks for each in task.foreign]
    strange += [each for each in (ledger.table.name, RECIPE_FILE) if os.path.lexists(out / each)]
    if strange:
        raise InvalidParameterError(
            f"{out / strange[0]}: is not the result of a batch, since there is no ledger here: give the results "
            "another folder, or remove it"
        )


def _refuse_to_replace(tasks: Iterable[Task], ledger: Ledger, sources: set[str]) -> None:
    """Raise InvalidParameterError where a result would replace that of another input which is still there."""
    for task in tasks:
        row = ledger.rows.get(task.name, {})
        theirs = row.get("input", task.source)
        if task.why != UP_TO_DATE and row.get("outputs") and theirs not in sources and os.path.exists(theirs):
            raise InvalidParameterError(
                f"{task.source}: its results, {task.name}, would replace those of {theirs}: give another folder"
            )
