"""Finding out what a batch has to do, and what is done already."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..errors import InvalidParameterError
from ..pipeline import Filter, Pipeline
from .inputs import Inputs, Source, find_inputs
from .ledger import DONE, STALE, Ledger, Row, file_hash
from .plan import (
    ASKED_FOR,
    FAILED_BEFORE,
    INPUT_CHANGED,
    INTERRUPTED_BEFORE,
    NEW_INPUT,
    OTHER_PARAMETERS,
    OUTPUTS_GONE,
    RECIPE_FILE,
    TILES_TO_DO,
    UP_TO_DATE,
    Plan,
    Task,
)
from .splitting import Splitter
from .wanted import Wanted
from .work import TILE_ENDING, Job


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
    tiles : float, optional
        Take scenes apart into tiles of at most this size, in the cloud's units, along every axis along which they are
        longer, and join the skeletons of these into one. For scenes that are too large to be taken at once.
    overlap : float, optional
        How far a tile looks beyond itself, in the cloud's units: at least 2.7 times the radius of the thickest part
        that crosses its faces, and at most a quarter of `tiles`. By default an eighth of it.
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
        another input that is still there, or, in a folder without a ledger, a file that no batch has made; `by` and
        `tiles` are given both, or tiles with a pipeline that makes one tree.
    MissingPackageError
        A format, or the picture, is written by a package that is not installed.
    RecipeError
        No recipe can hold the pipeline: then it cannot be told whether two runs are the same.
    BatchError
        Where the parts of a scene are to be, in the output folder, there is something else.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     Path(folder, "scan.ply").touch()
    ...     plan = plan_batch(folder, f"{folder}/skeletons")
    >>> [task.why for task in plan.tasks], plan.skipped
    (['new'], 0)

    Of tiles the skeletons come first, and then the whole:

    >>> import numpy as np
    >>> from glsk_o3d.samples import tube
    >>> with TemporaryDirectory() as folder:
    ...     np.savetxt(f"{folder}/pipe.xyz", tube(1000, radius=0.04).points)
    ...     plan = plan_batch(f"{folder}/pipe.xyz", f"{folder}/skeletons", tiles=0.6)
    >>> [output for task in plan.tasks for output in task.job.outputs]
    ['pipe.tiles/0-0-0.npz', 'pipe.tiles/1-0-0.npz', 'pipe.ply']
    """
    wanted = Wanted.of(
        pipeline=pipeline,
        formats=formats,
        preview=preview,
        cut_loops=cut_loops,
        recursive=recursive,
        where=where,
        by=by,
        tiles=tiles,
        overlap=overlap,
        force=force,
    )
    return planned(inputs, out_dir, wanted, write=False)


def planned(
    inputs: str | os.PathLike | Iterable[str | os.PathLike], out_dir: str | os.PathLike, wanted: Wanted, *, write: bool
) -> Plan:
    """The plan of `plan_batch`; `write` takes scenes apart at once, so that they are read but once."""
    given = [inputs] if isinstance(inputs, str | os.PathLike) else list(inputs)
    out = Path(os.path.abspath(out_dir))
    hashed = lru_cache(maxsize=None)(file_hash)  # of many clouds in one file
    splitter = None
    if wanted.cut is not None:  # what can be refused is refused before scenes are read
        splitter = Splitter(out, wanted.cut, hashed, write)
        _check_results(out, Ledger(out), (), set())
        if wanted.cut.tiles is not None:
            planned(given, out, replace(wanted, cut=None), write=False)
    found = find_inputs(given, out, recursive=wanted.recursive, splitter=splitter)
    ledger, parameters = Ledger(out), wanted.parameters
    tasks = [
        Task(job, ASKED_FOR if wanted.force else _why(job, ledger.rows.get(job.name, {}), parameters))
        for job in _jobs(found, out, wanted, ledger)
    ]
    compared = _compared(tasks, ledger.rows, hashed)
    _check_results(out, ledger, compared, _sources(found))
    if splitter is not None and write:
        _supply(splitter, found, compared)
    return Plan(out, wanted.recipe, parameters, compared, ledger, found.left_out)


def _sources(found: Inputs) -> set[str]:
    return {text for source in found.named.values() for text in (str(source), str(source.path))}


def _jobs(found: Inputs, out: Path, wanted: Wanted, ledger: Ledger) -> Iterator[Job]:
    sources, results = _sources(found), {name + each for name in found.named for each in wanted.endings}
    names = {row["input"]: name for name, row in ledger.rows.items()}
    listed = {output for row in ledger.rows.values() for output in row.get("outputs", ())}
    for name, source in found.named.items():
        tile = source.split is not None and source.split.grid is not None and not source.tiles
        outputs = (name + TILE_ENDING,) if tile else tuple(name + ending for ending in wanted.endings)
        for output in outputs:
            if str(out / output) in sources:
                raise InvalidParameterError(f"{out / output}: is an input: give the results another folder")
        row = ledger.rows.get(name, {})
        before = names.get(str(source), name)  # otherwise its old results would be nobody's
        stale = {each for each in row.get("outputs", ()) if _is_of(name, each)}
        stale |= {each for each in ledger.rows.get(before, {}).get("outputs", ()) if _is_of(before, each)} - results
        yield Job(
            name=name,
            path=str(source.file or source.path),
            out_dir=str(out),
            outputs=outputs,
            recipe=wanted.recipe,
            cut_loops=wanted.cut_loops,
            stale=tuple(sorted(stale)),
            foreign=tuple(each for each in outputs if each not in listed and os.path.lexists(out / each)),
            source=str(source),
            where=(wanted.where or "") if source.split is None else "",
            **_of_split(source),
        )


def _of_split(source: Source) -> dict[str, Any]:
    """What a job is to know of how its file was taken apart."""
    split = source.split
    if split is None:
        return {}
    return {
        "input_hash": split.input_hash,
        "origin": str(source.path) if source.file else "",
        "needs": source.tiles,
        "grid": split.grid,
        "points": split.points,
        "dropped": split.dropped,
    }


def _supply(splitter: Splitter, found: Inputs, tasks: Sequence[Task]) -> None:
    """Write the parts that are to be done and are not there; remove what is left of those that are done."""
    missing: dict[tuple[str, Path], set[str]] = {}
    for task in tasks:
        source = found.named[task.job.name]
        if source.file is not None:
            scene = source.file.parent.relative_to(splitter.folder).as_posix(), source.path
            if task.why == UP_TO_DATE:
                source.file.unlink(missing_ok=True)
            elif not source.file.exists():
                missing.setdefault(scene, set()).add(source.file.stem)
    for (name, path), labels in missing.items():
        splitter.supply(name, path, labels)


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


def _compared(tasks: list[Task], rows: dict[str, Row], hashed: Callable[[Path], str]) -> tuple[Task, ...]:
    """The tasks, after a look at the inputs that seem done."""

    def look(task: Task) -> Task:
        if task.why != UP_TO_DATE:
            return task
        try:
            now = task.job.input_hash or hashed(Path(task.job.path))
            same = now == rows[task.job.name].get("input_hash")
        except OSError:  # gone, or not to be read: the worker will say so
            same = False
        return task if same else Task(task.job, INPUT_CHANGED)

    with ThreadPoolExecutor() as pool:
        looked = list(pool.map(look, tasks))
    to_do = {task.job.name for task in looked if task.why != UP_TO_DATE}
    return tuple(
        Task(task.job, TILES_TO_DO) if task.why == UP_TO_DATE and to_do.intersection(task.job.needs) else task
        for task in looked
    )
