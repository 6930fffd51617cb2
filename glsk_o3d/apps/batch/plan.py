"""Finding out what a batch has to do, and what is done already."""

import hashlib
import json
import os
from collections.abc import Container, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ...api import as_pipeline
from ...data.verdict import Verdict, as_verdict
from ...errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ...interop.packages import require_for
from ...io.paths import unknown_ending
from ...io.scan import parsed
from ...io.skeletons import FORMATS
from ...parameters import check_number
from ...pipeline import Filter, Pipeline, parts
from ...recipes import to_recipe
from .inputs import find_inputs
from .ledger import DONE, STARTED, Ledger, file_hash, refuse_ways_out
from .tasks import TILE_ENDING, Task
from .tiles import PARTS_FILE, PARTS_FOLDER, Cut, checked_sizes, divide, known_split

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
    left_out : dict of str to str
        Skipped files in the folders, with the reason.
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
    inputs: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out_dir: str | os.PathLike[str],
    *,
    pipeline: Pipeline[Any, Any] | Filter[Any, Any] | str | os.PathLike[str] = "default",
    formats: Sequence[str] = ("ply",),
    preview: bool = False,
    cut_loops: bool = False,
    accept: Verdict | str | None = None,
    recursive: bool = False,
    shard: tuple[int, int] | None = None,
    where: str | None = None,
    tiles: float | None = None,
    overlap: float | None = None,
    force: bool = False,
    split: bool = False,
) -> Plan:
    """Plan a batch without running it.

    Parameters
    ----------
    inputs : path-like, or several
        Folders, lists of files (``.txt``, one path a line, from the working folder) and clouds.
    out_dir : path-like
        Folder of results and ledger, with the sub-folders below each given folder or list.
    pipeline : Pipeline, name, or path of a recipe
        See `glsk_o3d.skeletonize`.
    formats : sequence of str
        Endings that `glsk_o3d.save_skeleton` knows; one file of each per cloud.
    preview : bool
        Also make pictures.
    cut_loops : bool
        Cut loops open for formats that hold only trees.
    accept : Verdict or str, optional
        The worst verdict, ``"good"`` or ``"doubtful"``, of skeletons that are written; others have failed.
    recursive : bool
        Take also the clouds in sub-folders.
    shard : (int, int), optional
        ``(i, n)`` takes every n-th cloud from the i-th on, by name: for n machines, each with an `out_dir` of its own.
    where : str, optional
        Take only points for which this holds; see `glsk_o3d.read_cloud`.
    tiles : float, optional
        Split scenes into tiles of at most this size, in the cloud's units, along every longer axis, and join their
        skeletons into one. For scenes that are too large for one run.
    overlap : float, optional
        Width around a tile from which it takes more points, in the cloud's units: at least 2.7 times the radius of the
        thickest part that crosses its faces, and at most a quarter of `tiles`. By default an eighth of `tiles`.
    force : bool
        Do everything anew.
    split : bool
        Split scenes into files in the output folder, as a batch does. Otherwise nothing is written, and scenes that are
        not split yet are in the plan as a whole.

    Returns
    -------
    Plan

    Raises
    ------
    FileNotFoundError
        A file is missing, or a folder has no cloud.
    InvalidParameterError
        An option is wrong, or a result would replace an input, the result of another existing input, or, in a folder
        without a ledger, a file of somebody else.
    MissingPackageError
        A format or the picture needs a package that is not installed.
    RecipeError
        No recipe can hold the pipeline, so runs cannot be compared.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> plan.todo[0].why, plan.todo[0].outputs, plan.skipped
    ('new', ('scan.ply',), 0)
    """
    chosen = as_pipeline(pipeline)
    recipe, endings, cut = to_recipe(chosen), _endings(formats, preview), _cut(chosen, where, tiles, overlap)
    if where is not None:
        parsed(where)
    settings: dict[str, Any] = {"recipe": recipe, "cut_loops": cut_loops, "where": where, "cut": cut and asdict(cut)}
    least = as_verdict(accept)
    settings |= {"accept": least} if least else {}
    parameters = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
    out = Path(os.path.abspath(out_dir))
    ledger = Ledger(out)
    given = [inputs] if isinstance(inputs, str | os.PathLike) else inputs
    sources, left_out = find_inputs(given, out, recursive=recursive)
    if shard is not None:
        sources = dict(list(sources.items())[_slice_of(*shard)])
    common: dict[str, Any] = dict(out_dir=str(out), recipe=recipe, cut_loops=cut_loops, where=where, accept=least)
    tasks = [
        Task(name, str(path), str(path), tuple(name + ending for ending in endings), **common)
        for path, name in sources.items()
    ]
    _refuse_to_replace(tasks, ledger, sources)  # before scenes are read
    if cut is not None:
        tasks = [part for task in tasks for part in _tiles_of(task, cut, split)]
        _refuse_to_replace(tasks, ledger, sources)
    with ThreadPoolExecutor() as pool:  # a hash takes as long as reading the file
        whys = pool.map(lambda task: "asked for" if force else _why(task, ledger, parameters), tasks)
        reasons = dict(zip((task.name for task in tasks), whys, strict=True))
    for task in tasks:
        if reasons[task.name] == UP_TO_DATE and any(reasons[tile] != UP_TO_DATE for tile in task.needs):
            reasons[task.name] = "tiles to do"
    tasks = [replace(task, why=reasons[task.name]) for task in tasks]
    return Plan(out, recipe, parameters, tuple(tasks), ledger, left_out)


def _slice_of(index: int, count: int) -> slice:
    """Where the inputs of a shard are among all; InvalidParameterError if there is no such shard."""
    check_number("shards", count, "int", low=1)
    check_number("shard", index, "int", low=1, high=count)
    return slice(index - 1, None, count)


def _endings(formats: Sequence[str], preview: bool) -> list[str]:
    """What is written of each skeleton."""
    endings = list(dict.fromkeys(f".{name.lower().lstrip('.')}" for name in formats))
    if strange := [ending for ending in endings if ending not in FORMATS]:
        raise InvalidParameterError(str(unknown_ending(f"format {strange[0]!r}", FORMATS)))
    endings += [".png"] * preview
    if not endings:
        raise InvalidParameterError("there is nothing to write: give a format")
    for ending in endings:
        require_for(ending)
    return endings


def _cut(pipeline: Pipeline[Any, Any], where: str | None, tiles: Any, overlap: Any) -> Cut | None:
    """How scenes are to be split, if they are."""
    if tiles is None and overlap is not None:
        raise InvalidParameterError(f"overlap = {overlap!r}: needs tiles: give their size, too")
    if tiles is None:
        return None
    stages = list(parts(pipeline))
    if any(getattr(stage, "root", None) is not None for stage in stages):
        raise InvalidParameterError("tiles: the pipeline makes one tree of all in a tile: give one without root")
    drop_invalid = any(getattr(stage, "drop_invalid", False) for stage in stages)
    return Cut(*checked_sizes(tiles, overlap), where, drop_invalid)


def _tiles_of(whole: Task, cut: Cut, split: bool) -> list[Task]:
    """A task for each tile of a file, and after them one for the whole; one for a file that cannot be split."""
    path, folder = Path(whole.path), Path(whole.out_dir, PARTS_FOLDER, whole.name)
    refuse_ways_out(Path(whole.out_dir), [f"{PARTS_FOLDER}/{whole.name}"])
    try:
        of = [str(path), file_hash(path), asdict(cut)]
    except OSError:  # the worker will say what is wrong, as of what is no cloud
        return [whole]
    try:
        scene = known_split(folder, of) or (divide(path, folder, cut, of) if split else None)
    except (FileFormatError, InvalidCloudError):
        scene = None
    except InvalidParameterError as error:
        raise InvalidParameterError(f"{path}: {error}") from None
    if scene is None:
        return [whole]
    tasks = []
    for label in scene.labels:
        name, source = f"{whole.name}{TILES_FOLDER}{label}", f"{path} tile {label}"
        facts: dict[str, Any] = dict(path=str(folder / f"{label}.ply"), outputs=(name + TILE_ENDING,), where=None)
        tasks.append(replace(whole, name=name, source=source, is_tile=True, **facts))
    return [*tasks, replace(whole, path=str(folder / PARTS_FILE), needs=tuple(task.name for task in tasks))]


def _refuse_to_replace(tasks: Sequence[Task], ledger: Ledger, inputs: Container[Path]) -> None:
    """Raise InvalidParameterError where a batch would replace what is not its own, or write elsewhere."""
    out = ledger.path.parent
    outputs = [RECIPE_FILE, *(output for task in tasks for output in task.outputs)]
    refuse_ways_out(out, outputs)
    for path in (out / output for output in outputs):
        if path in inputs:
            raise InvalidParameterError(f"{path}: is an input: give the results another folder")
        if not ledger.path.exists() and os.path.lexists(path):
            foreign = "is not the result of a batch, since there is no ledger here"
            raise InvalidParameterError(f"{path}: {foreign}: give the results another folder, or remove it")
    others = [row for row in ledger.rows.values() if row["outputs"] and Path(row["input"]) not in inputs]
    owners = {row["name"]: row["input"] for row in others if os.path.exists(row["input"])}
    for task in tasks:
        owner = owners.setdefault(task.name, task.source)
        if owner != task.source:
            both = f"the results of {owner} and {task.source} would both be called {task.name}"
            raise InvalidParameterError(f"{both}: give the folder above them, a list, or each an output folder")


def _why(task: Task, ledger: Ledger, parameters: str) -> str:
    """Why a task is to be done, if it is."""
    row = ledger.rows.get(task.name)
    if row is None:
        return "new"
    if row["status"] != DONE:
        return "interrupted before" if row["status"] == STARTED else "failed before"
    if row.get("parameters") != parameters:
        return "other parameters"
    if not all(name in row["outputs"] and Path(task.out_dir, name).is_file() for name in task.outputs):
        return "outputs are gone"
    try:
        current_hash = file_hash(task.path)
    except OSError:  # gone, or not to be read: the worker will say so
        return "input changed"
    return UP_TO_DATE if current_hash == row.get("input_hash") else "input changed"
