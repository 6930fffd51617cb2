"""``--set Filter.parameter=value``, or ``--set parameter=value``: a pipeline with some parameters changed."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import InvalidParameterError, did_you_mean
from ..parameters import Parameters
from ..pipeline import Pipeline, parts
from ..recipes import load_recipe
from ..recipes.catalogue import catalogue, find, named_pipeline, serves
from .reporting import WrongUsage

_BOOLS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


def choose(pipeline: str, recipe: Path | None, settings: Iterable[str], drop_invalid: bool) -> Pipeline:
    """The pipeline, from a cloud to a skeleton, that the options of a command ask for.

    WrongUsage for a recipe and the name of a pipeline; InvalidParameterError and RecipeError as they come.
    """
    if recipe is not None and pipeline != "default":
        raise WrongUsage(f"--recipe {recipe} and --pipeline {pipeline}: give one of them")
    base = named_pipeline(pipeline) if recipe is None else load_recipe(recipe)
    drop = ["drop_invalid=true"] if drop_invalid else []
    chosen = override(base, [*settings, *drop], name=pipeline if recipe is None else str(recipe))
    chosen.check_complete()
    return chosen


def override(pipeline: Pipeline, settings: Iterable[str], name: str = "") -> Pipeline:
    """A pipeline with parameters replaced, each wherever its filter occurs, also inside another filter.

    Parameters
    ----------
    pipeline : Pipeline
    settings : iterable of str
        Each ``Filter.parameter=value``, or ``parameter=value`` where only one part of the pipeline has a parameter of
        that name. Values are written as in Python or as plain words: ``16``, ``1e4``, ``2%``, ``true``, ``none``,
        ``index``; reducers and rules by their names (``Contractor.stop=RingSizeRatio``). Those are put in first, so
        that the order does not matter.
    name : str
        What the user called the pipeline, for messages.

    Returns
    -------
    Pipeline
        Checked.

    Raises
    ------
    InvalidParameterError
        A setting is malformed, its filter or parameter is unknown or not in the pipeline, or the value is wrong.

    Examples
    --------
    >>> from glsk_o3d import Connector, RingBuilder, pipelines
    >>> override(pipelines.default(), ["k=20", "Connector.links=nearest"]).stages[2]
    Connector(radius='1%', thickness=0.6, links='nearest', min_support=0.1)
    """
    place = f"the pipeline {name!r}" if name else "the pipeline"
    settings, ready = list(settings), pipeline
    for setting in settings:
        with suppress(InvalidParameterError):  # whatever is wrong is said below
            option, value = _parse(setting, ready, place)
            if isinstance(value, Parameters):
                ready = ready.with_options({option: value})
    return pipeline.with_options(dict(_parse(setting, ready, place) for setting in settings))


def _parse(setting: str, pipeline: Pipeline, place: str) -> tuple[str, Any]:
    """A setting as `Pipeline.with_options` takes it: ``"Filter.parameter"`` and the value."""
    key, equals, text = (word.strip() for word in setting.partition("="))
    owner, dot, name = (word.strip() for word in key.rpartition("."))
    if not (equals and (owner or not dot) and name and text):
        raise InvalidParameterError(
            f"--set {setting}: write it as Filter.parameter=value or parameter=value, for example Connector.radius=2%"
        )
    try:
        owner = owner or pipeline.class_of_option(name)[0].__name__
    except InvalidParameterError as error:
        raise InvalidParameterError(f"--set {setting}: {error}") from None
    cls = find(owner)
    if cls is None:
        raise InvalidParameterError(f"--set {setting}: {did_you_mean(owner, catalogue(), 'filter')}")
    kinds = {field.name: field.metadata["type"] for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    if name not in kinds:
        raise InvalidParameterError(f"--set {setting}: {did_you_mean(name, kinds, f'parameter of {owner}')}")
    value = _value(setting, cls, text, kinds[name])
    present = dict.fromkeys(type(part).__name__ for part in parts(pipeline))
    if owner not in present:
        raise InvalidParameterError(
            f"--set {setting}: {owner} is not in {place}, which has {', '.join(present)}{_how_to_add(cls)}"
        )
    return f"{owner}.{name}", value


def _value(setting: str, cls: type[Parameters], text: str, kind: str) -> Any:
    """Text as a value of the kind, or as it is where it is none: then the filter's own check says what is wrong."""
    if kind.endswith("?") and text.lower() == "none":
        return None
    kind = kind.rstrip("?")
    if kind in ("reducer", "stop"):
        known = catalogue()
        fitting = [other for other, its in known.items() if its is not cls and serves(its, kind)]
        if text not in fitting:
            raise InvalidParameterError(f"--set {setting}: {did_you_mean(text, fitting, kind)}")
        return known[text]()
    if kind == "bool":
        return _BOOLS.get(text.lower(), text)
    for convert in {"int": (int, float), "float": (float,), "length": (float,)}.get(kind, ()):
        with suppress(ValueError):
            return convert(text)
    return text


def _how_to_add(cls: type[Parameters]) -> str:
    for owner in catalogue().values():
        for field in dataclasses.fields(owner):  # type: ignore[arg-type]
            kind = field.metadata["type"].rstrip("?")
            if kind in ("reducer", "stop") and cls is not owner and serves(cls, kind):
                return f"; to put it in: --set {owner.__name__}.{field.name}={cls.__name__}"
    return ""
