"""What there is by name: the filters, the stopping rules, and the nearest name to a wrong one."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Iterator
from typing import Any

import glsk_o3d

from .filter import Filter, Parameters
from .pipeline import Pipeline
from .pipelines import PIPELINES


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


def catalogue() -> dict[str, type[Parameters]]:
    """The public filters and stopping rules by name: filters in the order in which they run, then the rules.

    Returns
    -------
    dict of str to class
    """
    public = [getattr(glsk_o3d, name) for name in glsk_o3d.__all__]
    kinds = [cls for cls in public if isinstance(cls, type) and issubclass(cls, Parameters)]
    known = [cls for cls in kinds if dataclasses.is_dataclass(cls)]
    order = [type(part) for part in parts(PIPELINES["default"]())]
    known.sort(key=lambda cls: (not issubclass(cls, Filter), order.index(cls) if cls in order else len(order)))
    return {cls.__name__: cls for cls in known}


def serves(cls: type[Parameters], kind: str) -> bool:
    """Whether a class can be what a parameter of the kind takes.

    Parameters
    ----------
    cls : subclass of Parameters
    kind : {"reducer", "stop"}

    Returns
    -------
    bool
    """
    if kind == "stop":
        return not issubclass(cls, Filter)
    return issubclass(cls, Filter) and cls.consumes == cls.produces == "Contraction"


def replaced(part: Any, cls: type[Parameters], name: str, value: Any) -> Any:
    """A filter or rule with a parameter replaced in every instance of a class, itself and those inside it.

    Parameters
    ----------
    part : Parameters
    cls : subclass of Parameters
    name : str
    value : object

    Returns
    -------
    Parameters
    """
    changes = {name: value} if type(part) is cls else {}
    for field in dataclasses.fields(part):
        inner = getattr(part, field.name)
        if isinstance(inner, Parameters) and field.name not in changes:
            changes[field.name] = replaced(inner, cls, name, value)
    return dataclasses.replace(part, **changes)


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
