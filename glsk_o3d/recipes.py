"""Recipes: pipelines as plain dicts, and as JSON and TOML files.

A recipe is ``{"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "RingBuilder", "k": 20}, ...]}``: a table per stage,
with its parameters; a reducer inside is a table with ``"filter"`` and a stopping rule one with ``"rule"``. Parameters
that are left out have their defaults. ``"none"`` stands for None, which TOML lacks. Instead of ``"pipeline"`` there can
be ``"extends"``, the name of a pipeline, and ``"set"``, changes to it by filter and parameter.
"""

from __future__ import annotations

import dataclasses
import json
import os
import warnings
from collections.abc import Callable, Iterator
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .catalogue import catalogue, changed_by, find, nearest, serves
from .errors import InvalidParameterError, RecipeError, SkeletonWarning
from .filter import Filter, Parameters, problem_with
from .pipeline import Pipeline
from .pipelines import named_pipeline
from .report import Report, outside

if TYPE_CHECKING:
    from .skeleton import Skeleton

VERSION = 1
ENDINGS = (".json", ".toml")
"""Files that hold recipes."""
NONE, UNWRITTEN = "none", "unwritten"


# ---------------------------------------------------------------------------------------------------------- writing


def to_recipe(pipeline: Pipeline) -> dict[str, Any]:
    """A pipeline as a recipe, with every parameter in it.

    Parameters
    ----------
    pipeline : Pipeline

    Returns
    -------
    dict
        Of dicts, lists, strings, numbers and bools.

    Raises
    ------
    InvalidParameterError
        A parameter is wrong.
    RecipeError
        A filter or rule is not in `glsk_o3d.catalogue.catalogue`, or a parameter is something that no file can hold.

    Examples
    --------
    >>> from glsk_o3d import LPRReducer
    >>> to_recipe(Pipeline(LPRReducer()))["pipeline"]
    [{'filter': 'LPRReducer', 'phi': 100000.0, 'conserve_mass': True, 'mend_rings': True, 'order': 'cheapest'}]
    """
    pipeline.check()
    recipe = joined({}, *map(written, pipeline.stages))
    _refuse_gaps(recipe)
    return recipe


def written(part: Parameters) -> dict[str, Any]:
    """A filter or rule as a table of a recipe; what cannot be written is told under the key ``"unwritten"``.

    Parameters
    ----------
    part : Parameters

    Returns
    -------
    dict
    """
    cls = type(part)
    if find(cls.__name__) is not cls:
        return {UNWRITTEN: f"{_name(cls)} is not among the filters and rules of 'glsk filters'"}
    values = {field.name: _plain(getattr(part, field.name)) for field in dataclasses.fields(part)}  # type: ignore[arg-type]
    return {"filter" if isinstance(part, Filter) else "rule": cls.__name__, **values}


def joined(recipe: dict[str, Any], *stages: dict[str, Any]) -> dict[str, Any]:
    """A recipe with more stages.

    Parameters
    ----------
    recipe : dict
        Empty for a new one.
    *stages : dict
        As `written` makes them.

    Returns
    -------
    dict
    """
    return {"glsk_o3d": {"version": VERSION}, "pipeline": [*recipe.get("pipeline", []), *stages]}


def _plain(value: Any) -> Any:
    if value is None:
        return NONE
    if isinstance(value, Parameters):
        return written(value)
    if isinstance(value, str):
        return str.__str__(value)
    if isinstance(value, bool):
        return value
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value)
    return {UNWRITTEN: f"{_name(value)} is no number, word, filter or rule"}


def _name(value: Any) -> str:
    named = value if hasattr(value, "__qualname__") else type(value)
    return f"{'' if named is value else 'a '}{named.__module__}.{named.__qualname__}"


def gaps(value: Any, path: str = "") -> Iterator[str]:
    """What a recipe says that it could not hold, each with its path.

    Parameters
    ----------
    value : dict, or part of one
    path : str

    Yields
    ------
    str
    """
    if isinstance(value, dict):
        if UNWRITTEN in value:
            yield f"{path}: a recipe cannot hold it: {value[UNWRITTEN]}"
        for key, item in value.items():
            yield from gaps(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from gaps(item, f"{path}[{i}]")


def _refuse_gaps(recipe: Any) -> None:
    for gap in gaps(recipe):
        raise RecipeError(gap)


def save_recipe(pipeline: Pipeline, path: str | os.PathLike) -> None:
    """Write a pipeline as a recipe, with every parameter in it, as JSON or TOML by the ending.

    Parameters
    ----------
    pipeline : Pipeline
    path : path-like
        It appears complete or not at all.

    Raises
    ------
    InvalidParameterError
        A parameter is wrong.
    RecipeError
        The ending is unknown, or the pipeline cannot be written; see `to_recipe`.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import pipelines
    >>> with TemporaryDirectory() as folder:
    ...     save_recipe(pipelines.default(), f"{folder}/usual.toml")
    ...     load_recipe(f"{folder}/usual.toml") == pipelines.default()
    True
    """
    from .interop.files import write_atomically

    toml = recipe_ending(path) == ".toml"
    recipe = to_recipe(pipeline)
    if toml:
        import tomlkit

        text = tomlkit.dumps(recipe)
    else:
        text = json.dumps(recipe, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(path, lambda temporary: temporary.write_bytes(text.encode()))


def recipe_ending(path: str | os.PathLike) -> str:
    """The ending of a recipe's file name.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    {".json", ".toml"}

    Raises
    ------
    RecipeError
        It is another one.
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise RecipeError(f"{os.fspath(path)}: unknown ending; recipes are {' or '.join(ENDINGS)} files")
    return ending


# ---------------------------------------------------------------------------------------------------------- reading


def load_recipe(path: str | os.PathLike) -> Pipeline:
    """Read a pipeline from a recipe.

    Parameters
    ----------
    path : path-like
        JSON or TOML, by the ending.

    Returns
    -------
    Pipeline

    Raises
    ------
    OSError
        The file cannot be read.
    RecipeError
        It is no recipe, or a wrong one; the message names the file and the place in it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "mine.json")
    ...     _ = path.write_text('{"glsk_o3d": {"version": 1}, "extends": "default", "set": {"RingBuilder": {"k": 12}}}')
    ...     load_recipe(path).stages[0].k
    12
    """
    ending = recipe_ending(path)
    data = Path(path).read_bytes()
    try:
        recipe = _READERS[ending](data.decode("utf-8-sig"))
    except Exception as error:  # whatever a parser raises on a hostile file
        raise RecipeError(f"{os.fspath(path)}: not valid {ending[1:].upper()}: {error}") from error
    try:
        return from_recipe(recipe)
    except (RecipeError, RecursionError) as error:
        raise RecipeError(f"{os.fspath(path)}: {error}") from None


def _read_json(text: str) -> Any:
    def table(pairs):
        keys = [key for key, _ in pairs]
        twice = [key for key in keys if keys.count(key) > 1]
        if twice:
            raise ValueError(f"the key {twice[0]!r} stands twice in one table")
        return dict(pairs)

    return json.loads(text, object_pairs_hook=table)


def _read_toml(text: str) -> Any:
    import tomlkit

    return tomlkit.parse(text).unwrap()


_READERS: dict[str, Callable[[str], Any]] = {".json": _read_json, ".toml": _read_toml}


def from_recipe(recipe: dict[str, Any]) -> Pipeline:
    """The pipeline that a recipe describes.

    Parameters
    ----------
    recipe : dict
        As `to_recipe` makes it, as `Report.recipe` has it, or as a file holds it.

    Returns
    -------
    Pipeline
        Checked.

    Raises
    ------
    RecipeError
        The recipe is of a newer version, malformed, or not complete; the message names the place in it.

    Examples
    --------
    >>> from_recipe({"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "Connector", "radius": "2%"}]})
    Connector(radius='2%', thickness=0.6, links='all', stray=0.1)
    >>> from_recipe({"glsk_o3d": {"version": 1}, "extends": "default", "set": {"RingBuilder": {"k": 20}}}).stages[0].k
    20
    """
    _check_head(recipe)
    _refuse_gaps(recipe)
    if "extends" in recipe:
        return _extended(recipe["extends"], recipe.get("set", {}))
    stages = recipe["pipeline"]
    if not isinstance(stages, list) or not stages:
        raise RecipeError(f"pipeline: must be a list of at least one stage, not {_short(stages)}")
    read: list[Any] = [_part(stage, f"pipeline[{i}]", "filter") for i, stage in enumerate(stages)]
    return _valid(lambda: Pipeline(*read), "pipeline")


def _check_head(recipe: Any) -> None:
    example = f'{{"glsk_o3d": {{"version": {VERSION}}}, "pipeline": [...]}}'
    if not isinstance(recipe, dict):
        raise RecipeError(f"a recipe is a table such as {example}, not {_short(recipe)}")
    head = recipe.get("glsk_o3d")
    if not isinstance(head, dict) or "version" not in head:
        raise RecipeError(f"glsk_o3d.version: is missing; a recipe is a table such as {example}")
    version = head["version"]
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise RecipeError(f"glsk_o3d.version: must be {VERSION}, not {_short(version)}")
    if version > VERSION:
        raise RecipeError(f"glsk_o3d.version: is {version} and this release reads {VERSION}: update glsk-o3d")
    for key in head:
        if key != "version":
            raise RecipeError(f"glsk_o3d.{key}: there is only 'version' in this table")
    for key in recipe:
        if key not in ("glsk_o3d", "pipeline", "extends", "set"):
            raise RecipeError(f"{key}: {nearest(str(key), ('pipeline', 'extends', 'set'), 'key of a recipe')}")
    if ("pipeline" in recipe) == ("extends" in recipe):
        both = "has both" if "pipeline" in recipe else "lacks both"
        raise RecipeError(f"a recipe has either 'pipeline' or 'extends', and this one {both}")
    if "set" in recipe and "extends" not in recipe:
        raise RecipeError("set: changes the pipeline that 'extends' names, and there is no 'extends'")


def _extended(name: Any, changes: Any) -> Pipeline:
    try:
        pipeline = named_pipeline(str(name))
    except InvalidParameterError as error:
        raise RecipeError(f"extends: {error}") from None
    if not isinstance(changes, dict):
        raise RecipeError(f"set: must be a table of filters, not {_short(changes)}")
    read = []
    for owner, values in changes.items():
        cls = find(owner)
        if cls is None:
            raise RecipeError(f"set.{owner}: {nearest(str(owner), catalogue(), 'filter or rule')}")
        read += [(cls, field, value, owner) for field, value in _values(cls, values, f"set.{owner}").items()]

    def absent(_, owner, there):
        return RecipeError(f"set.{owner}: it is not in the pipeline {name!r}, which has {there}")

    pipeline = changed_by(pipeline, read, absent)
    return _valid(lambda: pipeline, "set")


def _part(table: Any, path: str, role: str) -> Parameters:
    """A filter, reducer or rule from its table."""
    kind = "rule" if role == "stop" else "filter"
    if not isinstance(table, dict) or kind not in table:
        raise RecipeError(f'{path}: must be a table such as {{"{kind}": NAME, ...}}, not {_short(table)}')
    name = table[kind]
    cls = find(name) if isinstance(name, str) else None
    if cls is None or not serves(cls, role):
        fitting = [other for other, its in catalogue().items() if serves(its, role)]
        message = nearest(str(name), fitting, role.replace("stop", "stopping rule"))
        plugin = " (or install the plugin that it is from)" * (cls is None)
        raise RecipeError(f"{path}.{kind}: {message}{plugin}")
    values = _values(cls, {key: value for key, value in table.items() if key != kind}, path)
    return _valid(lambda: cls(**values), path)


def _values(cls: type[Parameters], table: Any, path: str) -> dict[str, Any]:
    """Parameters of a class, each checked."""
    if not isinstance(table, dict):
        raise RecipeError(f"{path}: must be a table of parameters, not {_short(table)}")
    fields = {field.name: field.metadata for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    values = {}
    for name, value in table.items():
        if name not in fields:
            raise RecipeError(f"{path}.{name}: {nearest(str(name), fields, f'parameter of {cls.__name__}')}")
        facts = fields[name]
        kind = facts["type"]
        if kind.endswith("?") and value == NONE and NONE not in facts["choices"]:
            value = None
        if kind.rstrip("?") in ("reducer", "stop") and value is not None:
            value = _part(value, f"{path}.{name}", kind.rstrip("?"))
        problem = problem_with(value, facts)
        if problem:
            raise RecipeError(f"{path}.{name}: {problem}, not {_short(value)}")
        values[name] = value
    return values


def _valid(make: Callable[[], Any], path: str) -> Any:
    """What is made, checked as a whole: stages that do not fit, and whatever else a filter demands."""
    try:
        made = make()
        made.check()
    except (ValueError, TypeError) as error:  # InvalidParameterError, or what a plugin raises
        raise RecipeError(f"{path}: {error}") from None
    return made


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


# ---------------------------------------------------------------------------------------------------------- repeating


def identical(skeleton: Skeleton, other: Skeleton) -> bool:
    """Whether two skeletons have the same vertices, edges and radii, to the last bit.

    Parameters
    ----------
    skeleton, other : Skeleton

    Returns
    -------
    bool
    """
    return all(
        np.array_equal(getattr(skeleton, name), getattr(other, name), equal_nan=name == "radii")
        for name in ("vertices", "edges", "radii")
    )


def rerun(skeleton: Skeleton, cloud: Any = None, **callbacks: Callable | None) -> Skeleton:
    """Make a skeleton again with the recipe in its report.

    Parameters
    ----------
    skeleton : Skeleton
        With its points, as it was computed or as a JSON or npz file holds it.
    cloud : cloud, optional
        Another cloud to run the recipe on; by default the skeleton's own points. They are what the first filter after
        those of clouds took, so that these do not run again.
    **callbacks : callable, optional
        Those that a Pipeline takes when it is called.

    Returns
    -------
    Skeleton

    Raises
    ------
    RecipeError
        There is no recipe, or not a complete one; the message says what is missing.

    Warns
    -----
    SkeletonWarning
        The result on the skeleton's own points differs from it: other releases computed it.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> skeleton = skeletonize(torus(1000).points)
    >>> bool((rerun(skeleton).vertices == skeleton.vertices).all())
    True
    """
    recipe = skeleton.report.recipe
    if not recipe:
        raise RecipeError(
            "it holds no recipe: .json and .npz results of glsk-o3d have one, but not those of old releases"
        )
    pipeline = from_recipe(recipe)
    try:
        pipeline.check_complete()
    except InvalidParameterError as error:
        raise RecipeError(f"pipeline: {error}") from None
    if cloud is not None:
        return pipeline(cloud, **callbacks)
    if not len(skeleton.points):
        raise RecipeError("it holds no points: give the scan")
    first = max((i for i, stage in enumerate(pipeline.stages) if stage.produces == "cloud"), default=-1) + 1
    again = Pipeline(*pipeline.stages[first:])(skeleton.points, **callbacks)
    if first:
        ahead = Report()
        for stage in pipeline.stages[:first]:
            ahead = ahead.with_stage(stage, 0.0)
        again = dataclasses.replace(again, report=again.report.after(ahead))
    if not identical(again, skeleton):
        then, now = skeleton.report.versions, again.report.versions
        others = [f"{name} {then.get(name)} instead of {now[name]}" for name in now if then.get(name) != now[name]]
        warnings.warn(
            f"the rerun differs from the result: that was made with {', '.join(others) or 'the same releases'}",
            SkeletonWarning,
            stacklevel=outside(),
        )
    return again
