"""Filters, stopping rules and pipelines of other distributions, by their entry points."""

import dataclasses
import sys
import warnings
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint
from typing import Any

from ..data.report import outside
from ..errors import PluginWarning
from ..interop.clouds import Cloud
from ..interop.packages import FILTER_GROUP, entry_points
from ..parameters import RESERVED_WORDS, Parameters
from ..pipeline import FLOWS, Filter, Pipeline
from ..pipelines import BUILTIN, PIPELINES

__all__ = ["forget_plugins"]


class _Unfit(Exception):
    """A plugin is not what it should be."""


_LOADED: dict[str, dict[str, Any]] = {}


def plugins(group: str) -> dict[str, Any]:
    """What the entry points of `FILTER_GROUP` or `PIPELINE_GROUP` name: classes, or callables that make a Pipeline.

    A PluginWarning says once what is wrong with each broken plugin. Broken plugins are skipped, the others stay.
    """
    if group not in _LOADED:
        loaded = _LOADED[group] = {}  # plugins may themselves ask for plugins
        problems: list[str] = []
        for entry in entry_points(group, problems):
            try:
                loaded[entry.name] = _load(entry, group, loaded)
            except KeyboardInterrupt:
                del _LOADED[group]  # next time from the start
                raise
            except BaseException as error:  # whatever code of others raises; some is no Exception
                cause = str(error) if isinstance(error, _Unfit) else f"{type(error).__name__}: {error}"
                package = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"
                problems.append(f"plugin {entry.name!r} ({entry.value}) of {package} left out: {cause}")
        for problem in problems:
            warnings.warn(problem, PluginWarning, stacklevel=outside())
    return _LOADED[group]


def forget_plugins() -> None:
    """Search for plugins again at the next use, after one was installed into a running process."""
    _LOADED.clear()


def _load(entry: EntryPoint, group: str, loaded: dict[str, Any]) -> Any:
    """What an entry point names; _Unfit, or whatever its code raises, if it cannot be used."""
    builtin: Any = BUILTIN if group == FILTER_GROUP else PIPELINES
    if entry.name in builtin or entry.name in loaded:
        owner = "the built-in one" if entry.name in builtin else "one of another plugin"
        raise _Unfit(f"the name is that of {owner}")
    with redirect_stdout(sys.stderr):  # where there are results of commands, nothing else may be
        plugin = entry.load()
        (_check_filter if group == FILTER_GROUP else _check_pipeline)(entry.name, plugin)
    return plugin


def _check_filter(name: str, cls: Any) -> None:
    frozen = getattr(getattr(cls, "__dataclass_params__", None), "frozen", False)
    if not (isinstance(cls, type) and issubclass(cls, Parameters) and frozen):
        raise _Unfit("it is no frozen dataclass derived from glsk_o3d.Filter")
    if cls.__name__ != name:
        raise _Unfit(f"the entry point must have the name of the class, {cls.__name__!r}")
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if "type" not in field.metadata or field.name in RESERVED_WORDS:
            raise _Unfit(f"its field {field.name!r} is not made by glsk_o3d.parameters.parameter, or recipes use it")
    if not issubclass(cls, Filter):
        if not callable(cls()):
            raise _Unfit("a stopping rule must be callable")
    elif cls.consumes not in FLOWS or cls.produces not in FLOWS or (cls.produces is Cloud is not cls.consumes):
        raise _Unfit(f"there is no filter from {cls.consumes} to {cls.produces}")
    elif cls.run is Filter.run:
        raise _Unfit("it has no method run")
    cls().check()


def _check_pipeline(name: str, make: Any) -> None:
    pipeline = make() if callable(make) else make
    if not callable(make) or not isinstance(pipeline, Pipeline):
        raise _Unfit(f"it must be a callable that returns a Pipeline, and gives a {type(pipeline).__name__}")
