"""``--set Filter.parameter=value``, or ``--set parameter=value``: a pipeline with some parameters changed."""

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from ..api import as_pipeline
from ..errors import InvalidParameterError, did_you_mean
from ..parameters import Parameters
from ..pipeline import Pipeline
from ..recipes.catalogue import catalogue, serves

_BOOLS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


def choose(
    pipeline: str, settings: Iterable[str] | None = (), drop_invalid: bool = False, sample: int | None = None
) -> Pipeline[Any, Any]:
    """The pipeline, from a cloud to a skeleton, that the options of a command ask for."""
    flags = ["drop_invalid=true"] * drop_invalid + [f"Sampler.sample={sample}"] * (sample is not None)
    return override(as_pipeline(pipeline), [*(settings or ()), *flags])


def override(pipeline: Pipeline[Any, Any], settings: Iterable[str]) -> Pipeline[Any, Any]:
    """A pipeline with parameters replaced, each wherever its filter occurs, also inside another filter; in their order.

    A setting is ``Filter.parameter=value``, or ``parameter=value`` where only one part of the pipeline has a parameter
    of that name. Values are written as in Python or as plain words: ``16``, ``1e4``, ``2%``, ``true``, ``none``,
    ``index``; reducers and rules by their names (``Contractor.stop=RingSizeRatio``). InvalidParameterError where a
    setting is malformed, or its filter, parameter or value is wrong.
    """
    for setting in settings:
        pipeline = pipeline.with_options(dict([_parse(setting, pipeline)]))
    return pipeline


def _parse(setting: str, pipeline: Pipeline[Any, Any]) -> tuple[str, Any]:
    """A setting as `Pipeline.with_options` takes it: ``"Filter.parameter"`` and the value."""
    key, _, text = (word.strip() for word in setting.partition("="))
    owner, dot, name = (word.strip() for word in key.rpartition("."))
    try:
        if not (name and text) or (dot and not owner):
            example = "for example Connector.radius=2%"
            raise InvalidParameterError(f"write it as Filter.parameter=value or parameter=value, {example}")
        cls, field = pipeline.class_of_option(f"{owner}{dot}{name}")
        return f"{cls.__name__}.{name}", _value(cls, field.metadata["type"], text)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"--set {setting}: {error}") from None


def _value(cls: type[Parameters], kind: str, text: str) -> Any:
    """Text as a value of the kind, or as it is where it is none: then the filter's own check says what is wrong."""
    if kind.endswith("?") and text.lower() == "none":
        return None
    kind = kind.rstrip("?")
    if kind in ("reducer", "stop"):
        fitting = {name: other for name, other in catalogue().items() if other is not cls and serves(other, kind)}
        if text not in fitting:
            raise InvalidParameterError(did_you_mean(text, fitting, kind))
        return fitting[text]()
    if kind == "bool":
        return _BOOLS.get(text.lower(), text)
    for convert in {"int": (int, float), "float": (float,), "length": (float,)}.get(kind, ()):
        with suppress(ValueError):
            return convert(text)
    return text
