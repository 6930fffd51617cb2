"""Making a benchmark: the clouds and true axes of a version, as files that any program reads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glsk_o3d.apps.batch.workers import Workers
from glsk_o3d.errors import BatchError, InvalidParameterError, did_you_mean
from glsk_o3d.geometry.cores import cores

from . import versions
from .folders import BenchmarkFolder, begun, write_axis, write_points

Told = dict[str, Any]


def make(
    folder: str | os.PathLike,
    version: str = "v1",
    *,
    families: Iterable[str] | None = None,
    seeds: Iterable[int] | None = None,
    variants: Iterable[str] | None = None,
    jobs: int | None = None,
    on_shape: Callable[[str, int, int], object] | None = None,
) -> BenchmarkFolder:
    """Make a benchmark, or continue an interrupted one.

    Parameters
    ----------
    folder : path-like
        Created if missing. Existing clouds of the same version stay.
    version : str
    families : iterable of str, optional
        Of shapes; by default all of the version.
    seeds : iterable of int, optional
        Of the shapes of each family; by default those of the version. Use others for development.
    variants : iterable of str, optional
        Of the clouds; by default all of the version.
    jobs : int, optional
        Processes; by default one for each core.
    on_shape : callable, optional
        Called with the name of each finished shape, the number of finished ones, and that of all.

    Returns
    -------
    BenchmarkFolder

    Raises
    ------
    InvalidParameterError
        An unknown version, family or variant, a seed below 0, or a folder with another version.
    FileFormatError
        The folder's ``benchmark.json`` is damaged.
    BatchError
        A process died.
    OSError
        A file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     made = make(folder, families=["tubes"], seeds=[100], variants=["clean"], jobs=1)
    ...     made.clouds[0].path.name
    'tubes_100_clean.ply'
    """
    asked = versions.version(version)
    wanted = _known(families, asked.families, "family"), _known(variants, asked.variants, "variant")
    numbers = asked.seeds if seeds is None else tuple(dict.fromkeys(seeds))
    if not numbers or not all(isinstance(each, int | np.integer) and each >= 0 for each in numbers):
        raise InvalidParameterError(f"seeds must be whole numbers from 0, not {numbers!r}")
    made = begun(Path(folder), asked.name)
    todo = {}
    for family in wanted[0]:
        for seed in map(int, numbers):
            name = f"{family}_{seed}"
            missing = _missing(made, name, [each for each in wanted[1] if each in asked.variants_of(name)])
            if missing:
                todo[name] = partial(_make_shape, made.path, version, family, seed, missing)
    made = replace(made, complete=False) if todo else made
    for done, (name, told) in enumerate(_done(todo, cores() if jobs is None else jobs), 1):
        before = made.shapes.get(name, {"clouds": {}})
        made.shapes[name] = told | {
            part: before.get(part, {}) | told.get(part, {})
            for part in ("clouds", "not_made")
            if part in told or part in before
        }
        made.save()
        if on_shape is not None:
            on_shape(name, done, len(todo))
    made = replace(made, complete=True)
    made.save()
    return made


def _known(words: Iterable[str] | None, known: Sequence[str], what: str) -> list[str]:
    """The words, each once, or by default all that are known."""
    found = list(known if words is None else dict.fromkeys(words))
    for word in found:
        if word not in known:
            raise InvalidParameterError(did_you_mean(word, known, f"{what} of the benchmark"))
    if not found:
        raise InvalidParameterError(f"no {what} is given: there are {', '.join(known)}")
    return found


def _missing(made: BenchmarkFolder, name: str, variants: Sequence[str]) -> list[str]:
    """The variants of a shape of which there is no cloud, and that can be made; all where there is no truth."""
    told = made.shapes.get(name)
    if told is None or not (made.path / told["truth"]).is_file():
        made.shapes.pop(name, None)
        return list(variants)
    there = {variant for variant, each in told["clouds"].items() if (made.path / each["file"]).is_file()}
    return [variant for variant in variants if variant not in there | told.get("not_made", {}).keys()]


def _done(todo: Mapping[str, Callable[[], Told]], jobs: int) -> Iterator[tuple[str, Told]]:
    """What comes of each job, with its name; several are done at a time."""
    if jobs < 1:
        raise InvalidParameterError(f"jobs must be 1 or more, not {jobs}")
    if jobs == 1:
        yield from ((name, job()) for name, job in todo.items())
        return
    workers, waiting = Workers(min(jobs, max(len(todo), 1))), list(todo.items())
    running: dict[Future, str] = {}
    try:
        while waiting or running:
            while waiting and len(running) < workers.count:
                name, job = waiting.pop(0)
                running[workers.submit(job)] = name
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name, error = running.pop(future), future.exception()
                if isinstance(error, BrokenExecutor):
                    raise BatchError(f"{name}: the process died: out of memory?")
                yield name, future.result()
    finally:
        workers.close(at_once=False)  # what is in work takes seconds, and then leaves no temporary file


def _make_shape(folder: Path, name: str, family: str, seed: int, variants: Sequence[str]) -> Told:
    """Write a shape's true axis and clouds; gives what ``benchmark.json`` is to say of it."""
    from .clouds import cloud, coverage
    from .shapes import shape

    asked, known = versions.version(name), versions.fingerprints(name)
    drawn = shape(family, seed, steady=asked.steady)
    truth = f"truth/{drawn.name}.npz"
    write_axis(folder / truth, drawn)
    clouds, not_made = {}, {}
    for variant in variants:
        try:
            points = np.asarray(cloud(drawn, variant, n=asked.points, seed=asked.draw), np.float32)
        except InvalidParameterError as error:  # too little of the shape is seen
            not_made[variant] = str(error)
            continue
        share = 1.0 if variant in asked.whole else float(coverage(drawn, points))
        called = f"{drawn.name}_{variant}"
        file, expected = f"clouds/{called}.ply", known.get(called)
        write_points(folder / file, points)
        clouds[variant] = {
            **{"file": file, "scored": versions.is_scored(asked, called, share), "coverage": round(share, 4)},
            **{"fingerprint": versions.fingerprint(points)},
            "sameness": versions.sameness(points, expected) if expected else None,
        }
    told = {"family": family, "seed": seed, "truth": truth, "facts": _plain(drawn.facts), "clouds": clouds}
    return told | ({"not_made": not_made} if not_made else {})


def _plain(value: Any) -> Any:
    """What JSON holds, of facts with numbers and arrays of NumPy's."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value
