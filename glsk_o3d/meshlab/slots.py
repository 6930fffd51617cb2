"""The parameters of our filters as MeshLab's users and scripts meet them: names, types, values."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import did_you_mean
from ..parameters import Parameters, parameter, problem_with
from ..recipes.catalogue import catalogue, serves
from .script import FLOAT, LENGTH, Param

PARTS = ("reducer", "stop")
OF_FRAME = " of the frame"
"""What follows a percentage that is as everywhere else in this package, of the box that RingBuilder's `frame` names."""


@dataclass(frozen=True)
class Slot:
    """A parameter of a verb: one of a filter's or of what is inside it, or one of the verb's own.

    Attributes
    ----------
    name : str
    facts : mapping
        As `glsk_o3d.parameters.parameter` makes it.
    owner : subclass of Parameters, or None for the verb's own
    field : str
    default : object
        Of the verb's own; those of filters are as the pipeline has them.
    """

    name: str
    facts: Mapping[str, Any]
    owner: type[Parameters] | None = None
    field: str = ""
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
            words = [name for name, cls in catalogue().items() if cls is not self.owner and serves(cls, self.kind)]
        return (*words, *["none"] * self.facts["type"].endswith("?"))

    @property
    def types(self) -> tuple[str, ...]:
        """The types that it may have in a script; the first is written."""
        worded = {"choice": ("RichEnum",), **dict.fromkeys(("point", *PARTS), ())}
        if self.kind in worded:
            return ("RichString", *worded[self.kind])
        if self.name in ("layer", "mesh"):
            return ("RichMesh", "RichInt")
        plain = {"bool": ("RichBool",), "int": ("RichInt",), "float": FLOAT, "length": LENGTH}[self.kind]
        return (*plain, "RichString") if self.words or self.kind == "length" else plain

    def python_type(self) -> str:
        """Its type as MeshLab's listings print it."""
        name = {"length": "PercentageValue", **dict.fromkeys(("choice", "point", *PARTS), "str")}.get(
            self.kind, self.kind
        )
        return f"{name} or str" if self.words and name != "str" else name

    def checked(self, value: Any) -> Any:
        """The value as the filter takes it, reducers and rules made from their names; ValueError if it is wrong."""
        if isinstance(value, np.generic):
            value = value.item()
        if value == "none" and "none" in self.words:
            return None
        if self.kind == "length" and isinstance(value, str):
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
        param.check_type(self.types)
        value = param.value()
        self.checked(value)
        return value

    def written(self, value: Any) -> Param:
        """The inverse of `read`."""
        kind = self.types[0]
        if isinstance(value, Parameters | None):
            value, kind = "none" if value is None else type(value).__name__, "RichString"
        elif isinstance(value, str) and (self.kind == "int" or value.endswith(OF_FRAME)):
            kind = "RichString"
        text = str(value).lower() if isinstance(value, bool) else value if isinstance(value, str) else repr(value)
        return Param(self.name, kind, {"value": text})


def slots_of(cls: type[Parameters]) -> Iterator[Slot]:
    """A slot for each parameter of a filter, reducer or rule.

    Its name is that of the class in small letters, an underscore and that of the parameter.
    """
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        yield Slot(f"{cls.__name__.lower()}_{field.name}", field.metadata, cls, field.name)


def facts_of(doc: str, type: str, choices: tuple[str, ...] = (), low: float | None = None) -> Mapping[str, Any]:
    """The facts of a parameter that is no filter's, as `glsk_o3d.parameters.parameter` has them."""
    return parameter(None, doc, type=type, choices=choices, low=low).metadata
