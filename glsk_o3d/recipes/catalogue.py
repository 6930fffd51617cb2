"""Filters, stopping rules and pipelines by name, built in and of plugins."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from ..data.contraction import Contraction
from ..errors import InvalidParameterError, did_you_mean
from ..interop.packages import FILTER_GROUP, PIPELINE_GROUP
from ..parameters import NONE, Parameters
from ..pipeline import Filter, Pipeline
from ..pipelines import BUILTIN, PIPELINES
from .plugins import plugins

__all__ = ["catalogue", "known_pipelines", "named_pipeline"]


_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


def catalogue() -> dict[str, type[Parameters]]:
    """All filters and stopping rules by name, those of plugins after the built-in ones; first the filters.

    Returns
    -------
    dict of str to class
    """
    known = {**BUILTIN, **plugins(FILTER_GROUP)}
    return dict(sorted(known.items(), key=lambda item: not issubclass(item[1], Filter)))


def serves(cls: type[Parameters], kind: str) -> bool:
    """Whether an instance can be a parameter of the type ``"reducer"`` or ``"stop"``, or a stage: ``"filter"``."""
    if not issubclass(cls, Filter):
        return kind == "stop"
    return kind == "filter" or (kind == "reducer" and cls.consumes is cls.produces is Contraction)


def value_from_text(text: str, facts: Mapping[str, Any], owner: str = "") -> Any:
    """A value from its text, for a parameter of the filter `owner` with the facts that `parameter` makes.

    That is a number, a bool, None, or a reducer or rule from its name, which InvalidParameterError refuses if it is
    wrong; other text stays as it is, and is for the filter to check.
    """
    kind, word = facts["type"].rstrip("?"), text.lower()
    if word == NONE and facts["type"] != kind:
        return None
    if kind in ("reducer", "stop"):
        fitting = {name: cls for name, cls in catalogue().items() if name != owner and serves(cls, kind)}
        if text not in fitting:
            raise InvalidParameterError(did_you_mean(text, fitting, kind))
        return fitting[text]()
    if kind == "bool":
        return {**dict.fromkeys(_TRUE, True), **dict.fromkeys(_FALSE, False)}.get(word, text)
    for convert in {"int": (int, float), "float": (float,), "length": (float,)}.get(kind, ()):
        with suppress(ValueError):
            return convert(text)
    return text


def known_pipelines() -> dict[str, Callable[[], Pipeline[Any, Any]]]:
    """All pipelines by name, those of plugins after the built-in ones.

    Returns
    -------
    dict of str to callable
        Each makes a Pipeline.
    """
    return {**PIPELINES, **plugins(PIPELINE_GROUP)}


def named_pipeline(name: str) -> Pipeline[Any, Any]:
    """The pipeline of that name, built in or of a plugin; InvalidParameterError suggests one if there is none.

    Parameters
    ----------
    name : str

    Returns
    -------
    Pipeline
    """
    make = PIPELINES.get(name) or known_pipelines().get(name)
    if make is None:
        raise InvalidParameterError(did_you_mean(name, known_pipelines(), "pipeline"))
    return make()
