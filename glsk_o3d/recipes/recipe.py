"""Pipelines as recipes, and these as JSON files: read and written."""

import dataclasses
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import RecipeError, did_you_mean
from ..interop.atomic import existing_file, write_json
from ..parameters import FROM, NONE, UNWRITTEN, Parameters, problem_with, shown
from ..pipeline import RECIPE_VERSION, Pipeline, recipe_of
from ..pipelines import BUILTIN
from .catalogue import catalogue, serves

RECIPE_ENDING = ".json"
"""Of files that hold recipes."""


def to_recipe(pipeline: Pipeline[Any, Any]) -> dict[str, Any]:
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
        A filter or rule is not in `glsk_o3d.recipes.catalogue.catalogue`, or a file cannot hold a parameter.

    Examples
    --------
    >>> from glsk_o3d import Thinner
    >>> to_recipe(Pipeline(Thinner()))["pipeline"]
    [{'filter': 'Thinner', 'around': 20.0, 'thin_to': 'auto'}]
    """
    recipe = recipe_of(*(stage.table() for stage in pipeline.stages))
    from_recipe(recipe)  # refuses what it could not make again
    return recipe


def save_recipe(pipeline: Pipeline[Any, Any], path: str | os.PathLike[str]) -> None:
    """Write a pipeline as a recipe, with every parameter in it, as JSON.

    Parameters
    ----------
    pipeline : Pipeline
    path : path-like
        Ends in ``.json``. It appears complete or not at all.

    Raises
    ------
    InvalidParameterError, RecipeError, OSError
        See `to_recipe`; or the ending is another, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import load_recipe, pipelines
    >>> with TemporaryDirectory() as folder:
    ...     save_recipe(pipelines.default(), f"{folder}/usual.json")
    ...     load_recipe(f"{folder}/usual.json") == pipelines.default()
    True
    """
    _check_ending(path)
    write_json(path, to_recipe(pipeline))


def _check_ending(path: str | os.PathLike[str]) -> None:
    if Path(path).suffix.lower() != RECIPE_ENDING:
        raise RecipeError(f"{os.fspath(path)}: unknown ending; recipes are {RECIPE_ENDING} files")


def load_recipe(path: str | os.PathLike[str]) -> Pipeline[Any, Any]:
    """Read a pipeline from a recipe.

    Parameters
    ----------
    path : path-like
        JSON of a recipe, or of a result, which holds the recipe that made it.

    Returns
    -------
    Pipeline

    Raises
    ------
    RecipeError, FileFormatError, OSError
        The file is no valid recipe; is a folder, empty or a pipe; or cannot be read. The message names the file and the
        place in it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "mine.json")
    ...     _ = path.write_text('{"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "Sampler"}]}')
    ...     load_recipe(path).stages[0].frame
    'spread'
    """
    _check_ending(path)
    data = existing_file(path).read_bytes()
    try:
        recipe = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise RecipeError(f"{os.fspath(path)}: not valid JSON: {error}") from error
    if isinstance(recipe, dict) and isinstance(recipe.get("report"), dict):
        recipe = recipe["report"].get("recipe")
    try:
        return from_recipe(recipe)
    except (RecipeError, RecursionError) as error:
        raise RecipeError(f"{os.fspath(path)}: {error}") from None


def from_recipe(recipe: dict[str, Any]) -> Pipeline[Any, Any]:
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
    Connector(radius='2%', thickness=0.6, links='all', shut=0.01)
    """
    _check_head(recipe)
    stages = recipe["pipeline"]
    if not isinstance(stages, list) or not stages:
        raise RecipeError(f"pipeline: must be a list of at least one stage, not {shown(stages)}")
    read: list[Any] = [_part(stage, f"pipeline[{i}]", "filter") for i, stage in enumerate(stages)]
    pipeline: Pipeline[Any, Any] = _valid(lambda: Pipeline(*read), "pipeline")
    return pipeline


def _check_head(recipe: Any) -> None:
    """Raise RecipeError unless a recipe is a table of the right version with the right keys."""
    example = f'{{"glsk_o3d": {{"version": {RECIPE_VERSION}}}, "pipeline": [...]}}'
    if not isinstance(recipe, dict):
        raise RecipeError(f"a recipe is a table such as {example}, not {shown(recipe)}")
    version = recipe["glsk_o3d"].get("version") if isinstance(recipe.get("glsk_o3d"), dict) else None
    if version is None:
        raise RecipeError(f"glsk_o3d.version: is missing; a recipe is a table such as {example}")
    if version != RECIPE_VERSION:
        raise RecipeError(
            f"glsk_o3d.version: is {shown(version)}; this release reads {RECIPE_VERSION}: update glsk-o3d"
        )
    keys = ("glsk_o3d", "pipeline")
    for key in recipe:
        if key not in keys:
            raise RecipeError(f"{key}: {did_you_mean(str(key), keys, 'key of this table')}")
    if "pipeline" not in recipe:
        raise RecipeError(f"pipeline: is missing; a recipe is a table such as {example}")


def _part(table: Any, path: str, role: str) -> Parameters:
    """A filter, reducer or rule from its table."""
    kind = "rule" if role == "stop" else "filter"
    _check_written(table, path)
    if not isinstance(table, dict) or kind not in table:
        raise RecipeError(f'{path}: must be a table such as {{"{kind}": NAME, ...}}, not {shown(table)}')
    name = table[kind]
    # plugins are only loaded for names of their own
    cls = BUILTIN.get(name) or catalogue().get(name) if isinstance(name, str) else None
    origin = table.get(FROM)
    if cls is None or not serves(cls, role):
        fitting = [other for other, its in catalogue().items() if serves(its, role)]
        message = did_you_mean(str(name), fitting, role.replace("stop", "stopping rule"))
        plugin = f" (or install {'the plugin that it is from' if origin is None else origin})" * (cls is None)
        raise RecipeError(f"{path}.{kind}: {message}{plugin}")
    if origin not in (None, cls.__module__):
        raise RecipeError(f"{path}.{FROM}: {name!r} of {origin} is not among the filters and rules of 'glsk filters'")
    values = _values(cls, {key: value for key, value in table.items() if key not in (kind, FROM)}, path)
    part: Parameters = _valid(lambda: cls(**values), path)
    return part


def _check_written(value: Any, path: str) -> None:
    if isinstance(value, dict) and UNWRITTEN in value:
        raise RecipeError(f"{path}: a recipe cannot hold it: {value[UNWRITTEN]}")


def _values(cls: type[Parameters], table: dict[str, Any], path: str) -> dict[str, Any]:
    """Parameters of a class, each checked."""
    fields = {field.name: field.metadata for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    values = {}
    for name, value in table.items():
        if name not in fields:
            hint = did_you_mean(str(name), fields, f"parameter of {cls.__name__}")
            raise RecipeError(f"{path}.{name}: {hint}")
        _check_written(value, f"{path}.{name}")
        facts = fields[name]
        kind = facts["type"]
        if kind.endswith("?") and value == NONE and NONE not in facts["choices"]:
            value = None
        if kind.rstrip("?") in ("reducer", "stop") and value is not None:
            value = _part(value, f"{path}.{name}", kind.rstrip("?"))
        problem = problem_with(value, facts)
        if problem:
            raise RecipeError(f"{path}.{name}: {problem}, not {shown(value)}")
        values[name] = value
    return values


def _valid(make: Callable[[], Any], path: str) -> Any:
    """What is made, checked as a whole: stages that do not fit, and whatever else a filter demands."""
    try:
        return make()
    except (ValueError, TypeError) as error:  # InvalidParameterError, or what a plugin raises
        raise RecipeError(f"{path}: {error}") from None
