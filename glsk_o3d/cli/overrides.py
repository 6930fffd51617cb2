"""``--set Filter.parameter=value``: a pipeline with some parameters changed."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

import glsk_o3d

from ..errors import InvalidParameterError
from ..filter import Filter, Parameters
from ..pipeline import Pipeline
from ..pipelines import PIPELINES

_BOOLS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


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


def override(pipeline: Pipeline, settings: Iterable[str], name: str = "") -> Pipeline:
    """A pipeline with parameters replaced, each wherever its filter occurs, also inside another filter.

    Parameters
    ----------
    pipeline : Pipeline
    settings : iterable of str
        Each ``Filter.parameter=value``. Values are written as in Python or as plain words: ``16``, ``1e4``, ``2%``,
        ``true``, ``none``, ``index``; reducers and rules by their names (``Contractor.stop=RingSizeRatio``). Those are
        put in first, so that the order does not matter.
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
    >>> override(pipelines.default(), ["RingBuilder.k=20", "Connector.radius=0.5"]).stages[0]
    RingBuilder(k=20, outlier_factor=2.5, denoise=4, frame='spread', drop_invalid=False)
    """
    changes = [(setting, *_parse(setting)) for setting in settings]
    changes.sort(key=lambda change: not isinstance(change[3], Parameters | None))
    for setting, cls, field, value in changes:
        present = list(dict.fromkeys(type(part).__name__ for part in parts(pipeline)))
        if cls.__name__ not in present:
            place = f"the pipeline {name!r}" if name else "the pipeline"
            raise InvalidParameterError(
                f"--set {setting}: {cls.__name__} is not in {place}, which has {', '.join(present)}{_how_to_add(cls)}"
            )
        pipeline = Pipeline(*(_replaced(stage, cls, field, value) for stage in pipeline.stages))
    pipeline.check()
    return pipeline


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
    close = difflib.get_close_matches(word.lower(), names, n=1)
    hint = f"did you mean {names[close[0]]!r}?" if close else f"there are {', '.join(names.values()) or 'none'}"
    return f"no {what} is called {word!r}: {hint}"


def _parse(setting: str) -> tuple[type[Parameters], str, Any]:
    key, equals, text = (word.strip() for word in setting.partition("="))
    owner, _, name = (word.strip() for word in key.partition("."))
    if not (equals and owner and name and text):
        raise InvalidParameterError(
            f"--set {setting}: write it as Filter.parameter=value, for example Connector.radius=2%"
        )
    known = catalogue()
    if owner not in known:
        raise InvalidParameterError(f"--set {setting}: {nearest(owner, known, 'filter')}")
    cls = known[owner]
    kinds = {field.name: field.metadata["type"] for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    if name not in kinds:
        raise InvalidParameterError(f"--set {setting}: {nearest(name, kinds, f'parameter of {owner}')}")
    kind = kinds[name]
    if kind.rstrip("?") not in ("reducer", "stop") or (kind.endswith("?") and text.lower() == "none"):
        return cls, name, _value(text, kind)
    fitting = [other for other, its in known.items() if its is not cls and _serves(its, kind.rstrip("?"))]
    if text not in fitting:
        raise InvalidParameterError(f"--set {setting}: {nearest(text, fitting, kind.rstrip('?'))}")
    return cls, name, known[text]()


def _value(text: str, kind: str) -> Any:
    """Text as a value of the kind, or as it is where it is none: then the filter's own check says what is wrong."""
    if kind.endswith("?") and text.lower() == "none":
        return None
    kind = kind.rstrip("?")
    if kind == "bool":
        return _BOOLS.get(text.lower(), text)
    for convert in {"int": (int, float), "float": (float,), "length": (float,)}.get(kind, ()):
        with suppress(ValueError):
            return convert(text)
    return text


def _serves(cls: type[Parameters], kind: str) -> bool:
    if kind == "stop":
        return not issubclass(cls, Filter)
    return issubclass(cls, Filter) and cls.consumes == cls.produces == "Contraction"


def _how_to_add(cls: type[Parameters]) -> str:
    for owner in catalogue().values():
        for field in dataclasses.fields(owner):  # type: ignore[arg-type]
            kind = field.metadata["type"].rstrip("?")
            if kind in ("reducer", "stop") and cls is not owner and _serves(cls, kind):
                return f"; to put it in: --set {owner.__name__}.{field.name}={cls.__name__}"
    return ""


def _replaced(part: Any, cls: type[Parameters], name: str, value: Any) -> Any:
    changes = {name: value} if type(part) is cls else {}
    for field in dataclasses.fields(part):
        inner = getattr(part, field.name)
        if isinstance(inner, Parameters) and field.name not in changes:
            changes[field.name] = _replaced(inner, cls, name, value)
    return dataclasses.replace(part, **changes)
