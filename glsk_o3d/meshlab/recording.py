"""What a session did, as a script that does the same again."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import ScriptError
from . import builtin
from .script import VECTORS, write_script
from .steps import Step, change_of_layer

_NO_VALUES = ("name", "type", "tooltip", "description")  # attributes that tell of a parameter


class Recording:
    """The current script of a `MeshSet`, whose steps name the layers on which a replay finds what the session found.

    A replay begins with the layers that the first filter found, numbered from 0, of which the last is the current one;
    then every filter numbers what it makes. MeshLab's own scripts do not tell when another layer was made the current
    one. Here our filters name the layer where it is not the one that the filter before left, and for MeshLab's there is
    a step of its own.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Make it empty; what is there when the next filter runs will be there for a replay."""
        self.load(())

    def load(self, steps: Iterable[Step]) -> None:
        """Take the steps of a script, which have not been run."""
        self.steps = list(steps)
        self._numbers: dict[int, int] | None = None
        self._made = 0
        self._left: int | None = None
        self._lost: tuple[str, int] | None = None

    def rerun(self) -> None:
        """Take what is there as what the whole script is going to be run on."""
        self._numbers, self._lost = None, None

    def forget_layers(self) -> None:
        """All layers are gone, and those to come are numbered from 0."""
        if self._numbers is not None:
            self._numbers, self._left = {}, -1

    @contextmanager
    def following(self, layers: Callable[[], tuple[list[int], int]]) -> Iterator[int | None]:
        """See what a filter that runs meanwhile makes, unless it fails.

        Parameters
        ----------
        layers : callable
            Gives the numbers of all layers in ascending order, and that of the current one, -1 if there is none.

        Yields
        ------
        int or None
            The current layer if it is another than it would be in a replay.
        """
        before = self._numbers, self._made, self._left
        found, current = layers()
        if self._numbers is None:
            self._numbers, self._made = {layer: number for number, layer in enumerate(found)}, len(found)
            self._left = found[-1] if found and not self.steps else None
        try:
            yield None if current == -1 or self._left in (None, current) else current
        except BaseException:
            self._numbers, self._made, self._left = before
            raise
        after, self._left = layers()
        for layer in after:
            if layer not in found:
                self._numbers[layer], self._made = self._made, self._made + 1

    def add(self, step: Step, on: int | None = None) -> None:
        """Add a filter that has run, after a change to the layer `on` if there is one."""
        steps = [step] if on is None else [change_of_layer(on), step]
        self.steps += [_renumbered(each, lambda layer: self._number(layer, step.call.name)) for each in steps]

    def _number(self, layer: int, name: str) -> int:
        assert self._numbers is not None
        if layer not in self._numbers:
            self._lost = self._lost or (name, layer)
        return self._numbers.get(layer, layer)

    def __str__(self) -> str:
        told = [f"Filter Script Size : {len(self.steps)}\n"]
        for i, each in enumerate(self.steps):
            told.append(f"{i}: {each.name}")
            for param in each.call.params:
                values = [value for key, value in param.attributes.items() if key not in _NO_VALUES]
                shown = param.attributes.get("value", ", ".join(values))
                told.append(f"\t{param.name} : {param.type} = {shown}")
        return "\n".join(told)

    def save(self, path: str | os.PathLike) -> None:
        """Write the script; ScriptError if it needs a layer that was not there at first and that no filter made."""
        if self._lost is not None:
            name, layer = self._lost
            raise ScriptError(
                f"{path}: filter {name!r} needs layer {layer}, which was added between the filters, and a script "
                "cannot add it: add all layers first, or begin a new script with clear_filter_script"
            )
        write_script(path, [step.call for step in self.steps])


def _renumbered(step: Step, number: Callable[[int], int]) -> Step:
    """A step with other numbers for the layers that it names; -1, the current one, stays."""
    values, params = dict(step.values), []
    for key, value in values.items():
        if key in ("layer", "mesh") if not step.needs_pymeshlab else builtin.is_layer(key, value):
            values[key] = number(value) if value >= 0 else value
    for param in step.call.params:
        if param.type == "RichMesh" and (value := int(param.attributes["value"])) >= 0:
            param = replace(param, attributes={**param.attributes, "value": str(number(value))})
        params.append(param)
    return replace(step, values=values, call=replace(step.call, params=tuple(params)))


def exact_digits(step: Step, values: Mapping[str, Any]) -> Step:
    """A step of MeshLab's with the numbers that it was run with, where MeshLab itself writes six digits of them.

    Parameters
    ----------
    step : Step
    values : mapping of str to object
        By pymeshlab's names. MeshLab's numbers and vectors are float32, its matrices float64. What differs by more than
        the digits lost stays as MeshLab wrote it.

    Returns
    -------
    Step
    """

    def exact(param):
        value = values.get(builtin.keyword(param.name, values) or "")
        names = VECTORS.get(param.type, ("value",))
        if not isinstance(value, float | np.ndarray) or np.size(value) != len(names):
            return param
        numbers = dict(zip(names, map(float, np.ravel(value)), strict=True))
        if not all(math.isclose(float(param.attributes[key]), number, rel_tol=1e-5) for key, number in numbers.items()):
            return param
        return replace(param, attributes={**param.attributes, **{key: _digits(n) for key, n in numbers.items()}})

    return replace(step, call=replace(step.call, params=tuple(map(exact, step.call.params))))


def _digits(number: float) -> str:
    """The shortest text that is exactly the number, for float32 in float32."""
    short = np.float32(number)
    return str(short) if float(short) == number else repr(number)
