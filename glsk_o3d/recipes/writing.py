"""Pipelines as recipes, and these as JSON and TOML files."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tomli_w

from ..errors import RecipeError
from ..interop.atomic import write_atomically
from ..parameters import UNWRITTEN, Parameters
from ..pipeline import Pipeline, recipe_of
from .catalogue import find

RECIPE_ENDINGS = (".json", ".toml")
"""Files that hold recipes."""


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
        A filter or rule is not in `glsk_o3d.recipes.catalogue.catalogue`, or a parameter is something that no file can
        hold.

    Examples
    --------
    >>> from glsk_o3d import LPRReducer
    >>> to_recipe(Pipeline(LPRReducer()))["pipeline"]
    [{'filter': 'LPRReducer', 'phi': 100000.0, 'conserve_mass': True, 'order': 'cheapest'}]
    """
    pipeline.check()
    recipe = recipe_of(*(stage.table() for stage in pipeline.stages))
    for i, stage in enumerate(pipeline.stages):
        _refuse_unknown(stage, f"pipeline[{i}]")
    refuse_gaps(recipe)
    return recipe


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


def refuse_gaps(recipe: Any) -> None:
    """Raise RecipeError if a recipe lacks what it could not hold; see `gaps`."""
    for gap in gaps(recipe):
        raise RecipeError(gap)


def _refuse_unknown(part: Parameters, path: str) -> None:
    """Raise RecipeError if a filter or rule, or one inside it, is none that a recipe could name."""
    cls = type(part)
    if find(cls.__name__) is not cls:
        name = f"{cls.__module__}.{cls.__qualname__}"
        raise RecipeError(
            f"{path}: a recipe cannot hold it: {name} is not among the filters and rules of 'glsk filters'"
        )
    for field in dataclasses.fields(part):  # type: ignore[arg-type]
        value = getattr(part, field.name)
        if isinstance(value, Parameters):
            _refuse_unknown(value, f"{path}.{field.name}")


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
    >>> from glsk_o3d import load_recipe, pipelines
    >>> with TemporaryDirectory() as folder:
    ...     save_recipe(pipelines.default(), f"{folder}/usual.toml")
    ...     load_recipe(f"{folder}/usual.toml") == pipelines.default()
    True
    """
    toml = recipe_ending(path) == ".toml"
    recipe = to_recipe(pipeline)
    text = tomli_w.dumps(recipe) if toml else json.dumps(recipe, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(path, lambda temporary: temporary.write_bytes(text.encode()))


def recipe_ending(path: str | os.PathLike) -> str:
    """The ending of a recipe's file name; RecipeError for another one."""
    ending = Path(path).suffix.lower()
    if ending not in RECIPE_ENDINGS:
        raise RecipeError(f"{os.fspath(path)}: unknown ending; recipes are {' or '.join(RECIPE_ENDINGS)} files")
    return ending
