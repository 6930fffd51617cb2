"""``--set Filter.parameter=value``, or ``--set parameter=value``: a pipeline with some parameters changed."""

from collections.abc import Iterable
from typing import Any

from ..api import as_pipeline
from ..errors import InvalidParameterError
from ..pipeline import Pipeline
from ..recipes.catalogue import value_from_text


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
        return f"{cls.__name__}.{name}", value_from_text(text, field.metadata, cls.__name__)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"--set {setting}: {error}") from None
