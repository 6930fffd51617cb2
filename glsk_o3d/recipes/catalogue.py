"""Filters, stopping rules and pipelines by name, built in and of plugins."""

from collections.abc import Callable
from typing import Any

from ..data.contraction import Contraction
from ..errors import InvalidParameterError, did_you_mean
from ..interop.packages import FILTER_GROUP, PIPELINE_GROUP
from ..parameters import Parameters
from ..pipeline import Filter, Pipeline
from ..pipelines import BUILTIN, PIPELINES
from .plugins import plugins

__all__ = ["catalogue", "known_pipelines", "named_pipeline"]


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
