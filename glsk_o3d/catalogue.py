"""What there is by name: the filters, the stopping rules, and the nearest name to a wrong one."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from .connector import Connector
from .contractor import Contractor
from .filter import Filter, Parameters
from .lpr_reducer import LPRReducer
from .pipeline import Pipeline
from .refiner import Refiner
from .ring_builder import RingBuilder
from .stopping import ExplainedScore, RingSizeRatio

BUILTIN: dict[str, type[Parameters]] = {
    cls.__name__: cls
    for cls in (RingBuilder, Contractor, LPRReducer, Connector, Refiner, ExplainedScore, RingSizeRatio)
}
"""The filters and stopping rules of this package, in the order in which they run."""


def parts(item: Pipeline | Parameters) -> Iterator[Parameters]:
    """Everything with parameters in a pipeline: its filters, and after each the reducer and the rule inside.

    Parameters
    ----------
    item : Pipeline or Parameters

    Yields
    ------
    Parameters
    """
    if isinstance(item, Pipeline):
        inner: Iterable[Any] = item.stages
    else:
        yield item
        inner = (getattr(item, field.name) for field in dataclasses.fields(item))  # type: ignore[arg-type]
    for part in inner:
        if isinstance(part, Parameters):
            yield from parts(part)


def changed(item: Any, cls: type[Parameters], name: str, value: Any) -> Any:
    """A pipeline, or a part of one, with a parameter replaced wherever its filter occurs, also inside another.

    Parameters
    ----------
    item : Pipeline or Parameters
    cls : class
    name : str
    value : object

    Returns
    -------
    Pipeline or Parameters
    """
    if isinstance(item, Pipeline):
        return Pipeline(*(changed(stage, cls, name, value) for stage in item.stages))
    changes = {name: value} if type(item) is cls else {}
    for field in dataclasses.fields(item):
        inner = getattr(item, field.name)
        if isinstance(inner, Parameters) and field.name not in changes:
            changes[field.name] = changed(inner, cls, name, value)
    return dataclasses.replace(item, **changes)


def changed_by(
    pipeline: Pipeline,
    changes: Iterable[tuple[type[Parameters], str, Any, str]],
    absent: Callable[[str, str, str], Exception],
) -> Pipeline:
    """A pipeline with many changes, reducers and rules first: what is put in has parameters that others may change.

    Parameters
    ----------
    pipeline : Pipeline
    changes : iterable of (class, str, object, str)
        As for `changed`, and what the user calls the change.
    absent : callable
        Makes the error for a change of what is not in the pipeline, from the change's name, the filter's, and the names
        of those that are there.

    Returns
    -------
    Pipeline
        Not checked.
    """
    for cls, name, value, told in sorted(changes, key=lambda change: not isinstance(change[2], Parameters | None)):
        present = list(dict.fromkeys(type(part).__name__ for part in parts(pipeline)))
        if cls.__name__ not in present:
            raise absent(told, cls.__name__, ", ".join(present))
        pipeline = changed(pipeline, cls, name, value)
    return pipeline


def catalogue() -> dict[str, type[Parameters]]:
    """All filters and stopping rules by name, those of plugins after the built-in ones; first the filters.

    Returns
    -------
    dict of str to class
    """
    from .plugins import plugin_filters

    known = {**BUILTIN, **plugin_filters()}
    return dict(sorted(known.items(), key=lambda item: not issubclass(item[1], Filter)))


def find(name: str) -> type[Parameters] | None:
    """The filter or stopping rule of that name, if there is one; plugins are only loaded for names of their own.

    Parameters
    ----------
    name : str

    Returns
    -------
    class or None
    """
    return BUILTIN.get(name) or catalogue().get(name)


def serves(cls: type[Parameters], kind: str) -> bool:
    """Whether an instance can be a parameter of the type ``"reducer"`` or ``"stop"``, or a stage: ``"filter"``.

    Parameters
    ----------
    cls : class
    kind : {"filter", "reducer", "stop"}

    Returns
    -------
    bool
    """
    if kind == "stop" or not issubclass(cls, Filter):
        return kind == "stop" and not issubclass(cls, Filter)
    return kind == "filter" or cls.consumes == cls.produces == "Contraction"


def nearest(word: str, known: Iterable[str], what: str) -> str:
    """The message for an unknown word: what was meant, or what there is.

    Parameters
    ----------
    word : str
    known : iterable of str
    what : str
        What `word` should have been, such as ``"filter"``.

    Returns
    -------
    str

    Examples
    --------
    >>> nearest("radios", ["radius", "links"], "parameter of Connector")
    "no parameter of Connector is called 'radios': did you mean 'radius'?"
    """
    names = {name.lower(): name for name in known}
    # a long list helps nobody: then the nearest name is said however far it is
    close = difflib.get_close_matches(word.lower(), names, n=1, cutoff=0.6 if len(names) <= 20 else 0.0)
    hint = f"did you mean {names[close[0]]!r}?" if close else f"there are {', '.join(names.values()) or 'none'}"
    return f"no {what} is called {word!r}: {hint}"
