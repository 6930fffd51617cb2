"""What all our filters for MeshLab have in common: a name, parameters, and a new layer for a result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidParameterError, did_you_mean
from ..parameters import Parameters, parameter, problem_with
from ..recipes.catalogue import catalogue, serves
from .layers import Layer
from .script import BOOL, FLOAT, LENGTH, Param

PARTS = ("reducer", "stop")
OF_FRAME = " of the frame"
"""What follows a percentage that is as everywhere else in this package, of the box that RingBuilder's `frame` names."""
_SLOT_TYPES = {
    "bool": ("bool", BOOL),
    "int": ("int", ("RichInt",)),
    "float": ("float", FLOAT),
    "length": ("PercentageValue", LENGTH),
    "choice": ("str", ("RichString", "RichEnum")),
}
"""What listings call the types of parameters, and those of scripts, of which the first is written; others are words."""


@dataclass(frozen=True)
class Slot:
    """A parameter of a verb, with the facts that `glsk_o3d.parameters.parameter` makes.

    One of a filter, or of what is inside it, has its name in `Pipeline.with_options` as `option`, and its default from
    the pipeline; the verb's own have a default here.
    """

    name: str
    facts: Mapping[str, Any]
    option: str = ""
    default: Any = None

    @property
    def kind(self) -> str:
        """The type of the parameter, without the mark that it may be None."""
        return self.facts["type"].rstrip("?")

    @property
    def words(self) -> tuple[str, ...]:
        """What it may be in words."""
        words = self.facts["choices"]
        if self.kind in PARTS:
            serving = [name for name, cls in catalogue().items() if serves(cls, self.kind)]
            words = [name for name in serving if name != self.option.partition(".")[0]]
        return (*words, *["none"] * self.facts["type"].endswith("?"))

    @property
    def types(self) -> tuple[str, ...]:
        """The types that it may have in a script; the first is written."""
        if self.name == "layer":
            return ("RichMesh", "RichInt")
        _, types = _SLOT_TYPES.get(self.kind, ("str", ("RichString",)))
        worded = self.kind == "length" or self.words
        return (*types, "RichString") if worded and "RichString" not in types else types

    def python_type(self) -> str:
        """Its type as MeshLab's listings print it."""
        name, _ = _SLOT_TYPES.get(self.kind, ("str", ()))
        return f"{name} or str" if self.words and name != "str" else name

    def checked(self, value: Any) -> Any:
        """The value as the filter takes it, reducers and rules made from their names; ValueError if it is wrong."""
        if isinstance(value, np.generic):
            value = value.item()
        if value == "none" and "none" in self.words:
            return None
        if self.kind == "length" and self.option and isinstance(value, str):  # filters alone know the frame
            value = value.removesuffix(OF_FRAME)
        if self.kind == "choice" and type(value) is int:
            if not 0 <= value < len(self.words):
                raise ValueError(f"must be one of {', '.join(map(repr, self.words))}, or its number from 0")
            value = self.words[value]
        if self.kind in PARTS and isinstance(value, str):
            if value not in self.words:
                raise ValueError(did_you_mean(value, self.words, self.kind))
            return catalogue()[value]()
        wrong = problem_with(value, self.facts)
        if wrong:
            raise ValueError(wrong)
        return value

    def is_of_box(self, value: Any) -> bool:
        """Whether a value is a percentage as MeshLab's are: of the bounding box of the layer."""
        return self.kind == "length" and isinstance(value, str) and value.rstrip().endswith("%")

    def read(self, param: Param) -> Any:
        """The value of a parameter in a script, checked but not resolved; ValueError if it is wrong."""
        value = param.value(self.types)
        self.checked(value)
        return value

    def written(self, value: Any) -> Param:
        """The inverse of `read`."""
        if isinstance(value, Parameters | None):
            value = "none" if value is None else type(value).__name__
        text = str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else repr(value)
        worded = isinstance(value, str) and not self.is_of_box(value)
        return Param(self.name, "RichString" if worded else self.types[0], {"value": text})


def facts_of(doc: str, type: str, choices: tuple[str, ...] = (), low: float | None = None) -> Mapping[str, Any]:
    """The facts of a parameter that is no filter's."""
    return parameter(None, doc, type=type, choices=choices, low=low).metadata


@dataclass(frozen=True)
class Verb:
    """One of our filters for MeshLab, by its name in Python and its title in scripts."""

    name: str
    title: str
    doc: str
    slots: dict[str, Slot]

    @property
    def makes(self) -> str:
        """What the result may be, as `check_ending` has it."""
        return "skeleton"

    def checked(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The given parameters as they are taken; InvalidParameterError for a name or a value that is wrong."""
        made = {}
        for name, value in values.items():
            if name not in self.slots:
                raise InvalidParameterError(did_you_mean(name, self.slots, f"parameter of {self.name}"))
            try:
                made[name] = self.slots[name].checked(value)
            except ValueError as error:
                raise InvalidParameterError(f"{name} = {value!r}: {error}") from None
        return made

    def values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """All parameters that matter, the given ones and the defaults of the others."""
        made = self.checked(given)
        return {name: made.get(name, slot.default) for name, slot in self.slots.items()}

    def plan(self, values: Mapping[str, Any]) -> Any:
        """What the verb does with such parameters, all checked; two of the same are equal."""
        raise NotImplementedError

    def run(self, layer: Layer, given: Mapping[str, Any], on_iteration: Callable[..., Any] | None = None) -> Layer:
        """The new layer; percentages are of the diagonal of the given layer's bounding box."""
        raise NotImplementedError

    def shown(self, result: Any, source: Layer) -> Layer:
        """The layer that shows a result."""
        return Layer.of(result, f"{self.title.partition(' (')[0].partition(' ')[2]} of {source.label}", source)

    def listing(self) -> Iterator[str]:
        """Lines on each parameter, as MeshLab prints them, with limits and meaning."""
        values = self.values({})
        for slot in self.slots.values():
            limits = {"above" if slot.facts["open_low"] else "min": slot.facts["low"], "max": slot.facts["high"]}
            limits = {key: limit for key, limit in limits.items() if limit is not None}
            said = f" [{'; '.join(f'{key}: {limit:g}' for key, limit in limits.items())}]" if limits else ""
            said += f" ({', '.join(slot.words)})" if slot.words else ""
            default = values.get(slot.name, "as the pipeline has it")
            yield f"\t{slot.name} : {slot.python_type()} = {default}{said}\n\t\t{slot.facts['doc']}"


def called(stem: str) -> tuple[str, str]:
    """Name and title of a verb."""
    return f"{stem}_glsk", f"{stem.replace('_', ' ').title()} (GLSkeleton)"
